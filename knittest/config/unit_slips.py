"""Units often given instead of that of a field: guessed from an implausible number, or written behind it."""

#: field unit -> other units it is often given in, each with its factor to the field unit; the commonest first
ALTERNATIVES: dict[str, tuple[tuple[str, float], ...]] = {
    "GPa": (("MPa", 1e-3), ("Pa", 1e-9)),
    "mm": (("m", 1e3), ("cm", 10.0), ("um", 1e-3)),
    "mm2": (("um2", 1e-6), ("cm2", 100.0), ("m2", 1e6)),
    "%": (("a fraction", 100.0),),
    "tex": (("dtex", 0.1), ("kg/m", 1e6), ("g/m", 1e3)),
    "g/m2": (("kg/m2", 1e3), ("g/cm2", 1e4)),
    "yarn/100 mm": (("yarns/cm", 10.0), ("yarns/mm", 100.0), ("yarns/m", 0.1), ("yarns/dm", 1.0)),
    "N mm": (("N m", 1e3), ("N cm", 10.0), ("mN cm", 1e-2)),
    "N mm2": (("N m2", 1e6), ("N cm2", 100.0), ("mN cm2", 0.1)),
    "N/mm": (("N/m", 1e-3), ("kN/mm", 1e3)),
    "m/s": (("mm/s", 1e-3), ("mm/min", 1e-3 / 60.0), ("cm/s", 1e-2), ("m/min", 1.0 / 60.0), ("km/h", 1.0 / 3.6)),
    "N": (("kN", 1e3), ("daN", 10.0), ("cN", 1e-2), ("mN", 1e-3)),
    "ms": (("us", 1e-3), ("s", 1e3)),
    "us": (("s", 1e6), ("ns", 1e-3)),
    "1": (("%", 0.01),),
    "kg": (("g", 1e-3), ("t", 1e3)),
    "s": (("ms", 1e-3), ("min", 60.0), ("h", 3600.0)),
}
_SPELT = str.maketrans({" ": None, "µ": "u", "μ": "u", "²": "2", "³": "3"})


def likely_unit(number: float, unit: str, band: tuple[float, float]) -> str:
    """Name the unit in which ``number`` would fall into ``band`` (given in ``unit``), or say nothing ("")."""
    low, high = band
    guesses = [
        f"{name}: {number * factor:.6g} {unit}"
        for name, factor in ALTERNATIVES.get(unit, ())
        if low <= number * factor <= high
    ]
    return f" (it looks like {' or '.join(guesses[:2])})" if guesses else ""


def in_field_unit(number: float, written: str, unit: str) -> str | None:
    """``number``, given in the unit ``written``, in the ``unit`` of its field; ``None`` for a unit not known there."""
    factors = {_plain(name): factor for name, factor in ALTERNATIVES.get(unit, ())} | {_plain(unit): 1.0}
    factor = factors.get(_plain(written))
    return None if factor is None else f"{number * factor:.6g}"


def _plain(unit: str) -> str:
    """A unit without blanks, with plain letters and the yarn in the singular."""
    return unit.translate(_SPELT).replace("yarns/", "yarn/")
