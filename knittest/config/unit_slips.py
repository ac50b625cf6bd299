"""Units often given instead of that of a field: guessed from an implausible number, or written behind it."""

from knittest.base.units import plainly, ratio

#: field unit -> other units it is often given in; the commonest first
ALTERNATIVES: dict[str, tuple[str, ...]] = {
    "GPa": ("MPa", "Pa"),
    "mm": ("m", "cm", "um"),
    "mm2": ("um2", "cm2", "m2"),
    "%": ("a fraction",),
    "tex": ("dtex", "kg/m", "g/m"),
    "g/m2": ("kg/m2", "g/cm2"),
    "yarn/100 mm": ("yarns/cm", "yarns/mm", "yarns/m", "yarns/dm"),
    "N mm": ("N m", "N cm", "mN cm"),
    "N mm2": ("N m2", "N cm2", "mN cm2"),
    "N/mm": ("N/m", "kN/mm"),
    "m/s": ("mm/s", "mm/min", "cm/s", "m/min", "km/h"),
    "N": ("kN", "daN", "cN", "mN"),
    "ms": ("us", "s"),
    "us": ("s", "ns"),
    "1": ("%",),
    "kg": ("g", "t"),
    "s": ("ms", "min", "h"),
}


def likely_unit(number: float, unit: str, band: tuple[float, float]) -> str:
    """Name the unit in which ``number`` would fall into ``band`` (given in ``unit``), or say nothing ("")."""
    low, high = band
    read = [(name, number * ratio(name, unit)) for name in ALTERNATIVES.get(unit, ())]
    guesses = [f"{name}: {value:.6g} {unit}" for name, value in read if low <= value <= high]
    return f" (it looks like {' or '.join(guesses[:2])})" if guesses else ""


def in_field_unit(number: float, written: str, unit: str) -> str | None:
    """``number``, given in the unit ``written``, in the ``unit`` of its field; ``None`` for a unit not known there."""
    names = {_plain(name): name for name in (*ALTERNATIVES.get(unit, ()), unit)}
    name = names.get(_plain(written))
    if name is None:
        return None
    return f"{number if name == unit else number * ratio(name, unit):.6g}"


def _plain(unit: str) -> str:
    """A unit without blanks, with plain letters and the yarn in the singular."""
    return plainly(unit).replace(" ", "").replace("yarns/", "yarn/")
