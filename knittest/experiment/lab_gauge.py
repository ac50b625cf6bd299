"""The gauge length of a laboratory file: what its head states, and whether it agrees with what the user says."""

import re
from collections.abc import Sequence
from pathlib import Path

from knittest.config.base import BoundsError, check_bounds, field_meta
from knittest.config.run import TensileRig
from knittest.errors import InputError
from knittest.experiment import lab_units
from knittest.experiment.lab_numbers import read_number

#: what machines call the distance of the clamps; an extensometer's gauge ("Messlänge") is another length
_NAME = re.compile(
    r"einspannl|klemml|anfangsl|ausgangsl|gau?ge[ _-]?length|grip sep|clamp(ing)? (dist|len)|\bL0\b", re.I
)
_VALUE = re.compile(r"([+-]?\d[\d.,]*)\s*(.*)", re.S)
#: difference [-] of two lengths that are meant to be the same
_SAME = 0.005


def stated_gauge(path: Path, head: Sequence[tuple[int, list[str]]], mark: str) -> tuple[float, str] | None:
    """Gauge length [mm] in the rows above the table, and ``file:line``; ``None`` when no row names one.

    ``mark`` is the decimal mark of the table. Raises :class:`InputError` for an unknown unit or an implausible length.
    """
    for line, cells in head:
        name = next((k for k, cell in enumerate(cells) if _NAME.search(cell)), None)
        if name is None:
            continue
        label, _, rest = cells[name].partition(":")
        found = _VALUE.match(" ".join([rest, *cells[name + 1 :]]).strip())
        if found is None:
            continue
        value = read_number(path, line, found[1], _mark(found[1], mark))
        unit = lab_units.stated(label, found[2].strip(), lab_units.LENGTH, f"{path}:{line}") or "mm"
        return plausible_gauge(value * lab_units.LENGTH[unit], f"{path}:{line}: {label}"), f"{path}:{line}"
    return None


def agreed_gauge(given: float | None, stated: tuple[float, str] | None) -> float | None:
    """The gauge length [mm] of the option or of the file; raises :class:`InputError` if they contradict each other."""
    if given is not None:
        plausible_gauge(given, "--gauge-length")
    if stated is None or given is None:
        return given if stated is None else stated[0]
    length, where = stated
    if abs(given - length) > _SAME * length:
        raise InputError(f"{where}: the file states a gauge length of {length:g} mm, --gauge-length says {given:g} mm")
    return given


def plausible_gauge(length: float, said: str) -> float:
    """``length`` [mm]; raises :class:`InputError` outside the bounds of ``rig.gauge_length``, with the likely unit."""
    try:
        check_bounds(length, field_meta(TensileRig, "gauge_length"))
    except BoundsError as error:
        raise InputError(f"{said} {length:g}: {error.expected}") from None
    return length


def _mark(text: str, table: str) -> str:
    """Decimal mark of one number: that of the table, unless its only mark cannot stand for thousands."""
    own = re.fullmatch(r"\d+([.,])(\d*)", text)
    return own[1] if own and len(own[2]) != 3 else table
