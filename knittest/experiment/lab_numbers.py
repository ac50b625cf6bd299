"""Numbers of laboratory files, with either decimal mark."""

import re
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.config.yaml_loader import shown

#: digits and marks, whatever they mean; looks ahead for a digit, so that a long cell takes no quadratic time
NUMBER = re.compile(r"[+-]?(?=[.,]*\d)[\d.,]+(e[+-]?\d+)?$", re.I)
#: decimal mark -> the number: thousands in groups of three or not at all
_GROUPED = {
    mark: re.compile(rf"[+-]?(\d{{1,3}}(\{other}\d{{3}})+|\d*)(\{mark}\d*)?(e[+-]?\d+)?", re.I)
    for mark, other in ((",", "."), (".", ","))
}


def decimal_mark(path: Path, cells: list[str]) -> str:
    """The decimal mark of an export; refuses to guess when every number could be in thousands."""
    numbers = [c for c in cells if c and NUMBER.match(c) and re.search(r"[.,]", c)]
    for mark, other in ((",", "."), (".", ",")):
        if any(other in c and mark in c and c.rindex(mark) > c.rindex(other) for c in numbers):
            return mark
    marks = {m for c in numbers for m in ".," if m in c}
    if len(marks) == 2:
        raise InputError(f"{path}: both '.' and ',' appear as decimal marks; say which with --decimal")
    if not marks:
        return "."
    mark = marks.pop()
    if all(re.fullmatch(rf"[+-]?[1-9]\d{{0,2}}(\{mark}\d{{3}})+", c) for c in numbers):
        raise InputError(
            f"{path}: {shown(numbers[0])} could be a thousand or a decimal; say which with --decimal . or --decimal ,"
        )
    return mark


def read_number(path: Path, line: int, cell: str, mark: str) -> float:
    """The number in ``cell`` of line ``line``; raises :class:`InputError`."""
    if not NUMBER.match(cell) or not _GROUPED[mark].fullmatch(cell):
        raise InputError(f"{path}:{line}: {shown(cell)} is not a number with decimal mark {mark!r}")
    plain = cell.replace("." if mark == "," else ",", "").replace(mark, ".")
    try:
        value = float(plain)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f"{path}:{line}: {shown(cell)} is not a finite number")
    return value


def plain(value: float) -> float:
    """``value`` to six digits, as files state it."""
    return float(f"{value:.6g}")
