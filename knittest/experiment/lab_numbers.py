"""Numbers of laboratory files, with either decimal mark."""

import re
from collections.abc import Sequence

import numpy as np

from knittest.base.errors import InputError
from knittest.config.yaml_loader import shown

#: digits and marks, whatever they mean; looks ahead for a digit, so that a long cell takes no quadratic time
NUMBER = re.compile(r"[+-]?(?=[.,]*\d)[\d.,]+(e[+-]?\d+)?$", re.I)
#: cells that say that there is no number
EMPTY = {
    "", "nan", "na", "n/a", "n.a.", "#n/a", "#nv", "#num!", "#value!", "#wert!", "#div/0!", "null", "none", "-", "--",
    "---",
}  # fmt: skip
#: decimal mark -> the number: thousands in groups of three or not at all
_GROUPED = {
    mark: re.compile(rf"[+-]?(\d{{1,3}}(\{other}\d{{3}})+|\d*)(\{mark}\d*)?(e[+-]?\d+)?", re.I)
    for mark, other in ((",", "."), (".", ","))
}


def decimal_mark(path: object, cells: Sequence[str]) -> str:
    """The decimal mark of an export; refuses to guess when every number could be in thousands."""
    numbers = [c for c in cells if ("." in c or "," in c) and NUMBER.match(c)]
    for mark, other in ((",", "."), (".", ",")):
        if any(other in c and mark in c and c.rindex(mark) > c.rindex(other) for c in numbers):
            return mark
    thousands = {m: re.compile(rf"[+-]?[1-9]\d{{0,2}}(\{m}\d{{3}})+") for m in ".,"}
    sure = {m for m in ".," if any(m in c and not thousands[m].fullmatch(c) for c in numbers)}
    if len(sure) == 2:
        raise InputError(f"{path}: both '.' and ',' appear as decimal marks; say which with --decimal")
    if numbers and not sure:
        raise InputError(
            f"{path}: {shown(numbers[0])} could be a thousand or a decimal; say which with --decimal . or --decimal ,"
        )
    return sure.pop() if sure else "."


def read_number(path: object, line: int, cell: str, mark: str) -> float:
    """The number in ``cell`` of line ``line``; raises :class:`InputError`."""
    value = number(cell, mark)
    if np.isnan(value):
        raise InputError(f"{path}:{line}: {shown(cell)} is not a number with decimal mark {mark!r}")
    if np.isinf(value):
        raise InputError(f"{path}:{line}: {shown(cell)} is not a finite number")
    return value


def number(cell: str, mark: str) -> float:
    """The number in ``cell``, nan for what is none with decimal mark ``mark``."""
    if not NUMBER.match(cell) or not _GROUPED[mark].fullmatch(cell):
        return float("nan")
    return float(cell.replace("." if mark == "," else ",", "").replace(mark, "."))


def plain(value: float) -> float:
    """``value`` to six digits, as files state it."""
    return float(f"{value:.6g}")
