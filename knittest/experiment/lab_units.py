"""Numbers and units of machine files: with either decimal mark; from the name of a column or the row below it."""

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from math import isinf, isnan, nan
from pathlib import Path
from typing import Any

import yaml

from knittest.base.errors import InputError
from knittest.base.units import plainly, ratios
from knittest.config.yaml_loader import shown

FORCE = ratios("N", "kN", "daN", "cN", "mN", "kgf", "lbf")
LENGTH = ratios("mm", "cm", "m", "um", "inch")
ANGLE, AREA, PLAIN = ratios("deg", "rad"), ratios("mm2", "cm2", "m2"), ratios("1", "%")
AREA_MASS, STRAIN = ratios("g/m2", "kg/m2", "g/cm2", "oz/yd2"), ratios("%", "mm/mm", "um/m")
PRESSURE = ratios(
    "kPa", "MPa", "Pa", "bar", "mbar", "hPa", "psi", "ksi", "N/mm2", "N/cm2", "kgf/cm2", "gf/cm2"
)  # fmt: skip
DENSITY = {"yarn/100 mm": 1.0, "yarn/cm": 10.0, "yarn/inch": 100.0 / 25.4}
QUANTITIES = {
    "force": FORCE, "length": LENGTH, "angle": ANGLE, "strain": STRAIN, "pressure": PRESSURE, "number": PLAIN,
}  # fmt: skip
#: after these marks stands a unit; after an underscore, blank or comma only if it is a known one
_BRACKETS = re.compile(r"\[([^\[\]]*)\]|\(([^()]*)\)")
_MARKED, _LAST_WORD = re.compile(r"(?:/|\bin\b)\s*(\S+)$"), re.compile(r"[_\s,]\s*([^_\s,]+)$")
_WITHIN = 200  # characters of a name, so that a long one takes no quadratic time
#: digits and marks, whatever they mean; looks ahead for a digit, so that a long cell takes no quadratic time
NUMBER = re.compile(r"[+-]?(?=[.,]*\d)[\d.,]+(e[+-]?\d+)?$", re.I)
#: decimal mark -> the number: thousands in groups of three or not at all
_GROUPED = {
    mark: re.compile(rf"[+-]?(\d{{1,3}}(\{other}\d{{3}})+|\d*)(\{mark}\d*)?(e[+-]?\d+)?", re.I)
    for mark, other in ((",", "."), (".", ","))
}


@lru_cache(1)
def table() -> dict[str, Any]:
    """The table of what machine files call things, ``lab_names.yaml``."""
    found: dict[str, Any] = yaml.safe_load(Path(__file__).with_name("lab_names.yaml").read_text(encoding="utf-8"))
    return found


@lru_cache(1)
def _registry() -> Any:
    import pint  # heavy, and of no use to a command that reads no file

    return pint.UnitRegistry()


@lru_cache(256)
def _is_parsed(unit: str) -> bool:
    """Tell whether pint understands ``unit``."""
    if not re.fullmatch(r"[A-Za-z°%/*^.·\d\s]{1,12}", unit) or unit[:1].isdigit():
        return False
    try:
        _registry().Unit(re.sub(r"(?<=[a-z])([23])(?!\d)", r"^\1", unit).replace("°C", "degC"))
    except Exception:  # pint raises whatever its parser meets
        return False
    return True


def likely_force(newton: float, unit: str, band: tuple[float, float]) -> str:
    """Name the units in which the number that ``unit`` made ``newton`` would fall into ``band`` [N], or say nothing."""
    low, high = band
    number = newton / FORCE[unit]
    found = [f"{u}: {number * f:.6g} N" for u, f in FORCE.items() if u != unit and low <= number * f <= high]
    return f" (it looks like {' or '.join(found[:2])})" if found else ""


def known(text: str, units: Mapping[str, float]) -> str:
    """The unit of ``units`` that ``text`` spells, in any case; ``""`` for none and for MN, which is not mN."""
    text = plainly(text.strip("[]() "))
    text = table()["units"].get(text.lower(), text)
    if text == "1" and "mm/mm" in units:
        return "mm/mm"
    return next((u for u in units if u == text or (u.lower() == text.lower() and text != "MN")), "")


def stated(name: str, below: str, units: Mapping[str, float], where: str) -> str:
    """Unit in the name of a column or in the cell ``below`` it; ``""`` for none; :class:`InputError` if not known."""
    bracketed = _bracketed(name)
    bare = _BRACKETS.sub("", name[-_WITHIN:]).strip()
    marked = _MARKED.findall(bare)
    places = [*bracketed, *marked, *(word for word in _LAST_WORD.findall(bare) if word != "1")]
    in_name = next((p for p in places if known(p, units)), next(filter(None, [*bracketed, *marked]), ""))
    if known(below, units) and not is_unit(in_name):  # a channel, such as that of 'Tensile strain (Strain 1)'
        in_name = ""
    for text in (below.strip("[]() "), in_name):
        if text and not known(text, units):
            raise InputError(f"{where}: column {name!r}: unit {text!r}: expected one of {', '.join(units)}")
    above, beneath = known(in_name, units), known(below, units)
    if above and beneath and above != beneath:
        raise InputError(f"{where}: column {name!r}: the row below says {below!r}: which unit is it?")
    return beneath or above


def is_of_another(name: str, below: str, quantities: tuple[str, ...]) -> bool:
    """Tell whether the unit of a column is one of another quantity than ``quantities``, if there are any."""
    texts = [text for text in (below.strip("[]() "), *_bracketed(name)) if text and text not in ("MN", "ft")]
    own = [any(known(text, QUANTITIES[quantity]) for quantity in quantities) for text in texts]
    return bool(quantities) and any(is_unit(text) for text, is_own in zip(texts, own, strict=True) if not is_own)


def is_unit(text: str) -> bool:
    """Tell whether a cell is a unit, of whatever quantity, or empty."""
    text = text.strip("[]() ")
    return not text or any(known(text, q) for q in QUANTITIES.values()) or _is_parsed(table()["units"].get(text, text))


def _bracketed(name: str) -> list[str]:
    """Texts in brackets, which can be nothing but units."""
    return [text for square, round_ in _BRACKETS.findall(name[-_WITHIN:]) if (text := (square or round_).strip())]


def decimal_mark(path: object, cells: Sequence[str]) -> str:
    """The decimal mark of an export; refuses to guess when every number could be in thousands."""
    numbers = [c for c in cells if ("." in c or "," in c) and any(mark.fullmatch(c) for mark in _GROUPED.values())]
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


def has_number(cell: str) -> bool:
    """Tell whether a cell of a column of numbers is not empty, nor marked so."""
    return bool(NUMBER.match(cell)) or cell.lower() not in table()["empty"]


def read_number(path: object, line: int, cell: str, mark: str) -> float:
    """The number in ``cell`` of line ``line``; raises :class:`InputError`."""
    value = number(cell, mark)
    if isnan(value):
        raise InputError(f"{path}:{line}: {shown(cell)} is not a number with decimal mark {mark!r}")
    if isinf(value):
        raise InputError(f"{path}:{line}: {shown(cell)} is not a finite number")
    return value


def number(cell: str, mark: str) -> float:
    """The number in ``cell``, nan for what is none with decimal mark ``mark``."""
    if not NUMBER.match(cell) or not _GROUPED[mark].fullmatch(cell):
        return nan
    return float(cell.replace("." if mark == "," else ",", "").replace(mark, "."))


def plain(value: float) -> float:
    """``value`` to six digits, as files state it."""
    return float(f"{value:.6g}")
