"""Conditions of a laboratory test: test, direction and the sizes of specimens and apparatus."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, get_args

from knittest.base.errors import InputError
from knittest.base.kinds import test_names
from knittest.config.fabric import Direction
from knittest.experiment import lab_conditions as lab

#: sizes that curves and tables state, by their keys
SIZES: dict[str, lab.Condition] = {
    size.key: size
    for size in (
        lab.WIDTH, lab.GAUGE, lab.FRAME_SIDE, lab.FABRIC_SIDE, lab.NORMAL_FORCE, lab.RATIO, lab.EMBEDDED,
        lab.CROSSING_DENSITY, lab.CLAMPED_EDGES, lab.SLID_PITCHES, lab.CYCLES, lab.CYCLE_ANGLE,
    )
}  # fmt: skip
#: difference [-] of two lengths below which forces are not scaled: that of rounding
EXACT = 1e-6


@dataclass(frozen=True)
class Conditions:
    """Conditions that a file or a user states; empty or ``None`` if not stated."""

    test: str = ""
    direction: str = ""
    strip_width_mm: float | None = None
    gauge_length_mm: float | None = None
    frame_side_mm: float | None = None
    fabric_side_mm: float | None = None
    normal_force_n: float | None = None
    strain_ratio: float | None = None
    embedded_length_mm: float | None = None
    crossing_density_per_100_mm: float | None = None
    clamped_edges: float | None = None
    slid_pitches: float | None = None
    cycles: float | None = None
    cycle_angle_deg: float | None = None


UNKNOWN = Conditions()


def conditions_of(texts: Mapping[str, tuple[str, str]]) -> Conditions:
    """Read the conditions in ``texts``: name, as in :class:`Conditions`, to value and place.

    Raises :class:`InputError` for an unknown test or direction, and for an implausible size.
    """
    found: dict[str, Any] = {}
    for name, known in {"test": test_names("laboratory"), "direction": get_args(Direction)}.items():
        if name in texts:
            value, where = texts[name]
            if value not in known:
                raise InputError(f"{where}: {name}: {value}; expected one of {', '.join(known)}")
            found[name] = value
    for name in (name for name in SIZES if name in texts):
        text, where = texts[name]
        try:
            size = float(text)
        except ValueError:
            raise InputError(f"{where}: {name}: {text!r}; expected a number [{SIZES[name].unit}]") from None
        found[name] = SIZES[name].check_plausible(size, f"{where}: {name}:")
    return check_sides(Conditions(**found), next((where for _, where in texts.values()), ""))


def check_sides(conditions: Conditions, where: str) -> Conditions:
    """Return ``conditions``; raises :class:`InputError` for a fabric larger than its frame."""
    frame, fabric = conditions.frame_side_mm, conditions.fabric_side_mm
    if frame is not None and fabric is not None and fabric > frame * (1.0 + lab.SAME):
        raise InputError(
            f"{where}: fabric_side_mm: {fabric:g} is larger than frame_side_mm: {frame:g}; state the distance of the "
            "hinges as the frame side, and the side of the sheared square as the fabric side"
        )
    return conditions


def merge_conditions(stated: Conditions, given: Conditions, where: str) -> Conditions:
    """Conditions that the file ``where`` has ``stated``, with those that a user has ``given`` by options.

    Raises :class:`InputError` where they contradict each other.
    """
    found = {}
    for field in fields(Conditions):
        one, other = getattr(stated, field.name), getattr(given, field.name)
        option = SIZES[field.name].option if field.name in SIZES else f"--{field.name}"
        if other in (None, ""):
            continue
        if field.name in SIZES:
            SIZES[field.name].check_plausible(other, option)
        if one not in (None, "") and not values_agree(one, other):
            raise InputError(f"{where}: the header states {field.name}: {one}, but {option} is {other}; correct one")
        found[field.name] = other if one in (None, "") else one
    return check_sides(replace(stated, **found), where)


def values_agree(one: Any, other: Any) -> bool:
    """Return whether two texts are equal, or two sizes agree within :data:`lab.SAME`."""
    return bool(one == other if isinstance(one, str) else abs(one - other) <= lab.SAME * one)
