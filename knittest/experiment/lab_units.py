"""Recognise names in machine files, in eight languages (``lab_names.yaml``), and read units and numbers."""

import re
import unicodedata
from collections.abc import Mapping, Sequence
from functools import lru_cache
from math import isfinite, isinf, nan
from pathlib import Path
from typing import Any

import yaml

from knittest.base import units as base_units
from knittest.base.errors import InputError
from knittest.base.units import ratios
from knittest.config.yaml_loader import value_excerpt

#: quantity -> unit -> factor to its first unit; columns have one of the first six quantities, conditions any
QUANTITIES = {
    "force": ratios("N", "kN", "daN", "cN", "mN", "kgf", "lbf"), "length": ratios("mm", "cm", "m", "um", "inch"),
    "angle": ratios("deg", "rad"), "strain": ratios("%", "mm/mm", "um/m"),
    "pressure": ratios("kPa", "MPa", "Pa", "bar", "mbar", "hPa", "psi", "ksi", "N/mm2", "N/cm2", "kgf/cm2", "gf/cm2"),
    "number": ratios("1", "%"), "area": ratios("mm2", "cm2", "m2"),
    "mass per area": ratios("g/m2", "kg/m2", "g/cm2", "oz/yd2"),
    "yarns per length": {"yarn/100 mm": 1.0, "yarn/cm": 10.0, "yarn/inch": 100.0 / 25.4},
}  # fmt: skip
#: a unit follows these marks; after an underscore, blank or comma only a known unit counts
_BRACKETS = re.compile(r"\[([^\[\]]*)\]|\(([^()]*)\)")
_MARKED, _LAST_WORD = re.compile(r"(?:/|\bin\b)\s*(\S+)$"), re.compile(r"[_\s,]\s*([^_\s,]+)$")
#: sets of characters, which remain unchanged, and accented letters
_ACCENTED = re.compile(r"\[[^\]]*\]|[à-öø-żÀ-ÖØ-Ż]")
#: characters of a name that are searched, so that a long one takes no quadratic time
LONGEST = 200
#: digits and marks of any meaning; looks ahead for a digit, so that a long cell takes no quadratic time
NUMBER = re.compile(r"[+-]?(?=[.,]*\d)[\d.,]+(e[+-]?\d+)?$", re.I)
#: decimal mark -> the number: thousands in groups of three or not at all
_GROUPED = {
    mark: re.compile(rf"[+-]?(\d{{1,3}}(\{other}\d{{3}})+|\d*)(\{mark}\d*)?(e[+-]?\d+)?", re.I)
    for mark, other in ((",", "."), (".", ","))
}


@lru_cache(1)
def name_table() -> dict[str, Any]:
    """Return the table of names in machine files, ``lab_names.yaml``."""
    found: dict[str, Any] = yaml.safe_load(Path(__file__).with_name("lab_names.yaml").read_text(encoding="utf-8"))
    return found


@lru_cache(512)
def pattern(*path: str | int) -> re.Pattern[str]:
    """Return the pattern at ``path`` in the table for all languages together; without one it never matches."""
    found: Any = name_table()
    for key in path:
        found = found.get(key, {}) if isinstance(found, dict) else found[key]
    text = "|".join(found.values()) if isinstance(found, dict) else found
    return re.compile(_ACCENTED.sub(lambda letter: _accent_pattern(letter[0]), text or "(?!)"), re.I)


def _accent_pattern(letter: str) -> str:
    """Return a pattern of an accented letter that also matches plain text such as 'Epaisseur' and 'Pruefzeit'."""
    plain = {"ł": "l", "ß": "ss"}.get(letter, unicodedata.normalize("NFD", letter)[0])
    if letter.startswith("[") or plain == letter:
        return letter
    return f"(?:{letter}|{plain}{'e?' if letter in 'äöü' else ''})"


def matches(name: str, *path: str | int) -> bool:
    """Return whether ``name`` contains the pattern at ``path`` in the table."""
    return bool(pattern(*path).search(clean_name(name)))


def clean_name(name: str) -> str:
    """Replace underscores by blanks and limit the length."""
    return name[:LONGEST].replace("_", " ")


def is_statistic(cell: str) -> bool:
    """Return whether ``cell`` labels a row of statistics, such as a mean."""
    label = rf"\W*({pattern('statistics').pattern})\W*([\s(\[%].*)?"
    return len(cell) < LONGEST and bool(re.fullmatch(label, cell, re.I))


@lru_cache(4096)
def find_role(name: str, below: str = "") -> tuple[str, str]:
    """Return the first role that fits ``name`` and the unit ``below``; else none, and a role with another unit."""
    refused = ""
    for key in name_table()["columns"]:
        if matches(name, "columns", key, "any"):
            if unit_fits_role(key, name, below):
                return key, ""
            refused = refused or key
    return "", refused


def unit_fits_role(key: str, name: str, below: str) -> bool:
    """Return whether the unit of a column, if stated, is one of the role ``key``."""
    own = [QUANTITIES[quantity] for quantity in name_table()["columns"][key].get("quantity", ())]
    texts = [text for text in (_strip_brackets(below), *_texts_in_brackets(name)) if text not in ("", "MN", "ft")]
    return not own or all(any(find_unit(text, units) for units in own) or not is_unit(text) for text in texts)


def identifies_test(test: str, rows: list[list[str]]) -> bool:
    """Return whether the ``rows`` at the head of a file identify the knittest ``test``."""
    entry = name_table()["own_tests"].get(test, {})
    for row in rows:
        roles = {find_role(cell)[0] for cell in row} if "roles" in entry else set()
        if any(roles.issuperset(some) for some in entry.get("roles", ())) or any(
            matches(cell, "own_tests", test, "text") or any(is_label(key, cell) for key in entry.get("conditions", ()))
            for cell in row
        ):
            return True
    return False


def is_label(condition: str, cell: str, tier: int = 0) -> bool:
    """Return whether ``cell`` names a ``condition`` by a label of rank ``tier``."""
    path = ("conditions", condition)
    return matches(cell, *path, "tiers", tier) and not matches(cell, *path, "none")


def find_foreign_test(texts: list[str], own: tuple[str, ...]) -> tuple[str, str] | None:
    """Return the kind of test named in ``texts`` that is not one of ``own``, and the text that names it."""
    for text in (text for text in texts if not matches(text, "no_test")):
        allowed = (*own, *(("compression",) if matches(text, "pull") else ()))
        for kind in name_table()["tests"]:
            if kind not in allowed and matches(text, "tests", kind):
                return kind, text
    return None


def count_known(text: str) -> int:
    """Count the letters beyond ASCII in known names of columns and conditions, in the first lines of ``text``."""
    lines = [line[:1000].replace("_", " ") for line in text[:20_000].splitlines()[:200] if not line.isascii()]
    known = [pattern("columns", key, "any") for key in name_table()["columns"]]
    for key, entry in name_table()["conditions"].items():
        known += [pattern("conditions", key, "tiers", tier) for tier in range(len(entry["tiers"]))]
    known += [pattern("statistics"), pattern("kinds", "symbol")]
    found = (match[0] for line in lines for words in known for match in words.finditer(line))
    return sum(not letter.isascii() for word in found for letter in word)


@lru_cache(256)
def _is_known_to_pint(unit: str) -> bool:
    if not re.fullmatch(r"[A-Za-z°%/*^.·\d\s]{1,12}", unit) or unit[:1].isdigit():
        return False
    import pint  # heavy, and of no use to a command that reads no file

    try:
        pint.get_application_registry().Unit(re.sub(r"(?<=[a-z])([23])(?!\d)", r"^\1", unit).replace("°C", "degC"))
    except Exception:  # pint raises whatever its parser meets
        return False
    return True


def _strip_brackets(text: str) -> str:
    return text.strip("[]() ")


def _texts_in_brackets(name: str) -> list[str]:
    return [text for square, round_ in _BRACKETS.findall(name[-LONGEST:]) if (text := (square or round_).strip())]


def find_unit(text: str, units: Mapping[str, float]) -> str:
    """Return the one of ``units`` that ``text`` spells, in any case; ``""`` for none, and for MN (not mN)."""
    text = base_units.to_plain_letters(_strip_brackets(text))
    text = name_table()["units"].get(text.lower(), text)
    if text == "1" and "mm/mm" in units:
        return "mm/mm"
    return next((u for u in units if u == text or (u.lower() == text.lower() and text != "MN")), "")


def is_unit(text: str) -> bool:
    """Return whether a cell is a unit of any quantity, or empty."""
    text = _strip_brackets(text)
    return (
        not text
        or any(find_unit(text, q) for q in QUANTITIES.values())
        or _is_known_to_pint(name_table()["units"].get(text, text))
    )


def find_stated_unit(name: str, below: str, units: Mapping[str, float], where: str) -> str:
    """Return the unit in the name of a column or in the cell ``below``; ``""`` for none; InputError if unknown."""
    bare = _BRACKETS.sub("", name[-LONGEST:]).strip()
    marked = [*_texts_in_brackets(name), *_MARKED.findall(bare)]
    places = [*marked, *(word for word in _LAST_WORD.findall(bare) if word != "1")]
    in_name = next((p for p in places if find_unit(p, units)), next(filter(None, marked), ""))
    if find_unit(below, units) and not is_unit(in_name):  # a channel, such as that of 'Tensile strain (Strain 1)'
        in_name = ""
    for text in (_strip_brackets(below), in_name):
        if text and not find_unit(text, units):
            raise InputError(f"{where}: column {name!r} has the unit {text!r}; expected one of {', '.join(units)}")
    above, beneath = find_unit(in_name, units), find_unit(below, units)
    if above and beneath and above != beneath:
        raise InputError(f"{where}: column {name!r}: the row below states another unit, {below!r}; keep the right one")
    return beneath or above


def decimal_mark(path: object, cells: Sequence[str]) -> str:
    """Find the decimal mark; raises :class:`InputError` if every mark may separate thousands."""
    numbers = [c for c in cells if ("." in c or "," in c) and any(mark.fullmatch(c) for mark in _GROUPED.values())]
    for mark, other in ((",", "."), (".", ",")):
        if any(other in c and mark in c and c.rindex(mark) > c.rindex(other) for c in numbers):
            return mark
    thousands = {m: re.compile(rf"[+-]?[1-9]\d{{0,2}}(\{m}\d{{3}})+") for m in ".,"}
    sure = {m for m in ".," if any(m in c and not thousands[m].fullmatch(c) for c in numbers)}
    if len(sure) == 2:
        raise InputError(f"{path}: '.' and ',' both occur as decimal marks; state the right one with --decimal")
    if numbers and not sure:
        raise InputError(
            f"{path}: {value_excerpt(numbers[0])} may contain a thousands separator or a decimal mark; state "
            f"the decimal mark "
            "with --decimal . or --decimal ,"
        )
    return sure.pop() if sure else "."


def has_number(cell: str) -> bool:
    """Return whether a cell of a column of numbers is neither empty nor marked as empty."""
    return bool(NUMBER.match(cell)) or cell.lower() not in name_table()["empty"]


def read_number(path: object, line: int, cell: str, mark: str) -> float:
    """Return the number in ``cell``; raises :class:`InputError` with the line for anything else."""
    value = number(cell, mark)
    if not isfinite(value):
        expected = "a finite number" if isinf(value) else f"a number with decimal mark {mark!r}"
        raise InputError(f"{path}:{line}: {value_excerpt(cell)} is not {expected}")
    return value


def number(cell: str, mark: str) -> float:
    """Return the number in ``cell``; nan for what is no number with decimal mark ``mark``."""
    if not NUMBER.match(cell) or not _GROUPED[mark].fullmatch(cell):
        return nan
    return float(cell.replace("." if mark == "," else ",", "").replace(mark, "."))


def round_number(value: float) -> float:
    """Round ``value`` to six digits, as in files."""
    return float(f"{value:.6g}")
