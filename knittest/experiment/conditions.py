"""The conditions of a laboratory test: which test and direction, and the sizes that its forces belong to."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, get_args

from knittest.config.base import BoundsError, check_bounds, field_meta
from knittest.config.fabric import Direction
from knittest.config.rigs import FrictionRig, PictureFrameRig, TensileRig
from knittest.errors import InputError

#: fields whose bounds a size must keep, and the option that states it
SIZES: dict[str, tuple[Any, str, str]] = {
    "strip_width_mm": (TensileRig, "width", "--width"),
    "gauge_length_mm": (TensileRig, "gauge_length", "--gauge-length"),
    "frame_side_mm": (PictureFrameRig, "frame_side", "--frame-side"),
    "fabric_side_mm": (PictureFrameRig, "side", "--fabric-side"),
    "normal_force_n": (FrictionRig, "normal_force", "--normal-force"),
}
CHOICES: dict[str, tuple[str, ...]] = {
    "test": ("tensile", "picture-frame", "cantilever", "friction"),
    "direction": get_args(Direction),
}
#: difference [-] of two lengths that are meant to be the same
SAME = 0.005
#: difference [-] of two lengths below which forces are not scaled: that of rounding
EXACT = 1e-6


@dataclass(frozen=True)
class Conditions:
    """What a file or a user states of a test; empty or ``None`` where nothing is stated."""

    test: str = ""
    direction: str = ""
    strip_width_mm: float | None = None
    gauge_length_mm: float | None = None
    frame_side_mm: float | None = None
    fabric_side_mm: float | None = None
    normal_force_n: float | None = None


UNKNOWN = Conditions()


def conditions_of(texts: Mapping[str, tuple[str, str]]) -> Conditions:
    """Conditions among ``texts``: name to (value, where it stands), names as in :class:`Conditions`.

    Raises :class:`InputError` for another test or direction than there is, and for what is no plausible size.
    """
    found: dict[str, Any] = {}
    for name, known in CHOICES.items():
        if name in texts:
            value, where = texts[name]
            if value not in known:
                raise InputError(f"{where}: {name}: {value}; expected one of {', '.join(known)}")
            found[name] = value
    for name in SIZES:
        if name in texts:
            found[name] = _size(name, *texts[name])
    return checked(Conditions(**found), next((where for _, where in texts.values()), ""))


def plausible(name: str, value: float, said: str) -> float:
    """The size ``value``; raises :class:`InputError`, with the likely unit, outside the bounds of its field."""
    model, field, _ = SIZES[name]
    try:
        check_bounds(value, field_meta(model, field))
    except BoundsError as error:
        raise InputError(f"{said} {value:g}: {error.expected}") from None
    return value


def unit_of(name: str) -> str:
    """Unit of the size ``name``."""
    model, field, _ = SIZES[name]
    return str(field_meta(model, field)["unit"])


def checked(conditions: Conditions, where: str) -> Conditions:
    """``conditions``; raises :class:`InputError` for a fabric that reaches beyond its frame."""
    frame, fabric = conditions.frame_side_mm, conditions.fabric_side_mm
    if frame is not None and fabric is not None and fabric > frame * (1.0 + SAME):
        raise InputError(
            f"{where}: fabric_side_mm: {fabric:g} is larger than frame_side_mm: {frame:g}; the frame holds the fabric: "
            "expected the side between the hinges, and the side of the sheared square"
        )
    return conditions


def agreed(stated: Conditions, given: Conditions, where: str) -> Conditions:
    """What the file ``where`` has ``stated``, and what a user has ``given`` besides by options.

    Raises :class:`InputError` where they contradict each other.
    """
    found = {}
    for field in fields(Conditions):
        one, other = getattr(stated, field.name), getattr(given, field.name)
        option = SIZES[field.name][2] if field.name in SIZES else f"--{field.name}"
        if other in (None, ""):
            continue
        if field.name in SIZES:
            plausible(field.name, other, option)
        if one not in (None, "") and not same(one, other):
            raise InputError(f"{where}: its header says {field.name}: {one}, {option} says {other}")
        found[field.name] = other if one in (None, "") else one
    return checked(replace(stated, **found), where)


def same(one: Any, other: Any) -> bool:
    """Whether two texts are equal, or two sizes meant to be the same."""
    return bool(one == other if isinstance(one, str) else abs(one - other) <= SAME * one)


def _size(name: str, text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"{where}: {name}: {text!r}; expected a number [{unit_of(name)}]") from None
    return plausible(name, value, f"{where}: {name}:")
