"""The conditions of a laboratory test: which test and direction, and the sizes that its forces belong to."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, get_args

from knittest.base.errors import InputError
from knittest.base.kinds import names
from knittest.config.fabric import Direction
from knittest.experiment.lab_conditions import (
    CLAMPED_EDGES,
    CROSSING_DENSITY,
    CYCLE_ANGLE,
    CYCLES,
    EMBEDDED,
    FABRIC_SIDE,
    FRAME_SIDE,
    GAUGE,
    NORMAL_FORCE,
    RATIO,
    SAME,
    SLID_PITCHES,
    WIDTH,
    Condition,
)

#: sizes that curves and tables state, by their keys
SIZES: dict[str, Condition] = {
    size.key: size
    for size in (
        WIDTH, GAUGE, FRAME_SIDE, FABRIC_SIDE, NORMAL_FORCE, RATIO, EMBEDDED, CROSSING_DENSITY, CLAMPED_EDGES,
        SLID_PITCHES, CYCLES, CYCLE_ANGLE,
    )
}  # fmt: skip
#: difference [-] of two lengths below which forces are not scaled: that of rounding
EXACT = 1e-6


@dataclass(frozen=True)
class Conditions:
    """Statements of a file or a user on a test; empty or ``None`` where nothing is stated."""

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
    """Conditions among ``texts``: name to (value, where it stands), names as in :class:`Conditions`.

    Raises :class:`InputError` for another test or direction than there is, and for what is no plausible size.
    """
    found: dict[str, Any] = {}
    for name, known in {"test": names("laboratory"), "direction": get_args(Direction)}.items():
        if name in texts:
            value, where = texts[name]
            if value not in known:
                raise InputError(f"{where}: {name}: {value}; expected one of {', '.join(known)}")
            found[name] = value
    for name in SIZES:
        if name in texts:
            found[name] = _size(name, *texts[name])
    return checked(Conditions(**found), next((where for _, where in texts.values()), ""))


def checked(conditions: Conditions, where: str) -> Conditions:
    """``conditions``; raises :class:`InputError` for a fabric that reaches beyond its frame."""
    frame, fabric = conditions.frame_side_mm, conditions.fabric_side_mm
    if frame is not None and fabric is not None and fabric > frame * (1.0 + SAME):
        raise InputError(
            f"{where}: fabric_side_mm: {fabric:g} is larger than frame_side_mm: {frame:g}; state the distance of the "
            "hinges as the frame side, and the side of the sheared square as the fabric side"
        )
    return conditions


def agreed(stated: Conditions, given: Conditions, where: str) -> Conditions:
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
            SIZES[field.name].plausible(other, option)
        if one not in (None, "") and not same(one, other):
            raise InputError(
                f"{where}: the header states {field.name}: {one}, but {option} is {other}; correct one of them"
            )
        found[field.name] = other if one in (None, "") else one
    return checked(replace(stated, **found), where)


def same(one: Any, other: Any) -> bool:
    """Tell whether two texts are equal, or two sizes are meant to be the same."""
    return bool(one == other if isinstance(one, str) else abs(one - other) <= SAME * one)


def _size(name: str, text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"{where}: {name}: {text!r}; expected a number [{SIZES[name].unit}]") from None
    return SIZES[name].plausible(value, f"{where}: {name}:")
