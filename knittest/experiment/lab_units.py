"""Units of force and travel in laboratory files: read from the name of a column or the row below it, or refused."""

import re

from knittest.base.errors import InputError
from knittest.base.units import plainly, ratios

#: factors to N
FORCE = ratios("N", "kN", "daN", "cN", "mN", "kgf", "lbf")
#: factors to mm
LENGTH = ratios("mm", "cm", "m", "um", "inch")
#: factors to deg
ANGLE = ratios("deg", "rad")
#: factors to g/m2
AREA_MASS = ratios("g/m2", "kg/m2", "g/cm2", "oz/yd2")
#: factors to %
STRAIN = ratios("%", "mm/mm")
#: other names
_NAMED = {"in": "inch", '"': "inch", "pct": "%", "°": "deg", "grad": "deg"}
_STRAIN_NAME = re.compile(r"strain|dehnung", re.I)
#: after these marks stands a unit; after an underscore, blank or comma only if it is a known one
_BRACKETS = re.compile(r"\[([^\[\]]*)\]|\(([^()]*)\)")
_PER_LENGTH = re.compile(
    r"(?<![a-z])(per|pro)[ _]{0,2}[\d.,]{0,9}[ _]{0,2}(mm|cm|m|width|breite)(?![a-z])|"
    r"(line(ar)?[ _-]?|linien|strecken)(load|last|kraft)|breitenbezogen",
    re.I,
)
_UNIT_WITHIN = 100  # last characters of a name, so that a long one takes no quadratic time
_MARKED = re.compile(r"(?:/|\bin\b)\s*(\S+)$")
_LAST_WORD = re.compile(r"[_\s,]\s*([^_\s,]+)$")


def force_unit(name: str, below: str, where: str) -> str:
    """Unit of the force column ``name``; ``below`` is its cell in the row of units; none stated means N.

    Raises :class:`InputError` for a force per width, which is no force of a strip.
    """
    if _PER_LENGTH.search(name):
        raise InputError(f"{where}: column {name!r}: a force per width: expected the force of the whole strip [N]")
    return stated(name, below, FORCE, where) or "N"


def likely_force(newton: float, unit: str, band: tuple[float, float]) -> str:
    """Name the units in which the number that ``unit`` made ``newton`` would fall into ``band`` [N], or say nothing.

    A column of N under a head that says kN looks like N, whatever other unit would fit as well.
    """
    low, high = band
    number = newton / FORCE[unit]
    found = [f"{u}: {number * f:.6g} N" for u, f in FORCE.items() if u != unit and low <= number * f <= high]
    return f" (it looks like {' or '.join(found[:2])})" if found else ""


def travel_unit(name: str, below: str, where: str) -> str:
    """Unit of the travel column ``name``: a key of LENGTH or STRAIN; none stated means mm, for a strain it is refused.

    Raises :class:`InputError`, as :func:`force_unit` does, for any unit that is not known.
    """
    unit = stated(name, below, LENGTH | STRAIN, where)
    if not unit and _STRAIN_NAME.search(name):
        raise InputError(f"{where}: column {name!r}: a strain without a unit: write '{name} [%]' or '{name} [mm/mm]'")
    return unit or "mm"


def known(text: str, units: dict[str, float]) -> str:
    """The unit of ``units`` that ``text`` spells, in any case; ``""`` for none and for MN, which is not mN."""
    text = plainly(text.strip("[]() "))
    text = _NAMED.get(text.lower(), text)
    return next((u for u in units if u == text or (u.lower() == text.lower() and text != "MN")), "")


def stated(name: str, below: str, units: dict[str, float], where: str) -> str:
    """Unit in the name of a column or in the cell ``below`` it; ``""`` for none; :class:`InputError` if not known."""
    in_name = _in_name(name, units)
    for text in (below.strip("[]() "), in_name):
        if text and not known(text, units):
            raise InputError(f"{where}: column {name!r}: unit {text!r}: expected one of {', '.join(units)}")
    above, beneath = known(in_name, units), known(below, units)
    if above and beneath and above != beneath:
        raise InputError(f"{where}: column {name!r}: the row below says {below!r}: which unit is it?")
    return beneath or above


def _in_name(name: str, units: dict[str, float]) -> str:
    """Text in the place of a unit in a column's name: a known unit, else what can be nothing else."""
    bracketed = [(square or round_).strip() for square, round_ in _BRACKETS.findall(name)]
    bare = _BRACKETS.sub("", name).strip()[-_UNIT_WITHIN:]
    marked = _MARKED.findall(bare)
    places = [*bracketed, *marked, *_LAST_WORD.findall(bare)]
    return next((p for p in places if known(p, units)), next(iter([*bracketed, *marked]), ""))
