"""Guess the unit a user had in mind when a number is implausible in the unit of its field."""

#: field unit -> other units it is often given in, each with its factor to the field unit; the commonest first
ALTERNATIVES: dict[str, tuple[tuple[str, float], ...]] = {
    "GPa": (("MPa", 1e-3), ("Pa", 1e-9)),
    "mm": (("m", 1e3), ("cm", 10.0), ("um", 1e-3)),
    "mm2": (("um2", 1e-6), ("cm2", 100.0), ("m2", 1e6)),
    "%": (("a fraction", 100.0),),
    "tex": (("dtex", 0.1), ("kg/m", 1e6), ("g/m", 1e3)),
    "g/m2": (("kg/m2", 1e3), ("g/cm2", 1e4)),
    "yarn/100 mm": (("yarns/cm", 10.0), ("yarns/mm", 100.0), ("yarns/m", 0.1)),
    "N mm": (("N m", 1e3), ("N cm", 10.0), ("mN cm", 1e-2)),
    "N mm2": (("N m2", 1e6), ("N cm2", 100.0), ("mN cm2", 0.1)),
    "N/mm": (("N/m", 1e-3), ("kN/mm", 1e3)),
    "m/s": (("mm/s", 1e-3), ("mm/min", 1e-3 / 60.0)),
    "ms": (("us", 1e-3), ("s", 1e3)),
    "us": (("s", 1e6), ("ns", 1e-3)),
}


def likely_unit(number: float, unit: str, band: tuple[float, float]) -> str:
    """Name the unit in which ``number`` would fall into ``band`` (given in ``unit``), or say nothing ("")."""
    low, high = band
    guesses = [
        f"{name}: {number * factor:.6g} {unit}"
        for name, factor in ALTERNATIVES.get(unit, ())
        if low <= number * factor <= high
    ]
    return f" (it looks like {' or '.join(guesses[:2])})" if guesses else ""
