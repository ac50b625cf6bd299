"""Table of all units, for fields, files and kernels; numbers rounded down.

Kernel units are mm, ms, g, N, MPa (1 N = 1 g*mm/ms^2; energy N*mm = mJ). Multiply a user value by its factor.
"""

import math
from decimal import Decimal
from math import floor, log10

#: quantity -> unit -> factor to kernel units
UNITS: dict[str, dict[str, float]] = {
    "number": {"1": 1.0, "%": 1e-2, "a fraction": 1.0, "mm/mm": 1.0, "um/m": 1e-6},
    "length": {"mm": 1.0, "cm": 10.0, "m": 1e3, "um": 1e-3, "inch": 25.4},
    "area": {"mm2": 1.0, "um2": 1e-6, "cm2": 100.0, "m2": 1e6},
    "angle": {"deg": math.pi / 180.0, "rad": 1.0},
    "mass": {"g": 1.0, "kg": 1e3, "t": 1e6},
    "mass per length": {"tex": 1e-6, "dtex": 1e-7, "kg/m": 1.0, "g/m": 1e-3},  # 1 tex = 1 g/km
    "mass per area": {"g/m2": 1e-6, "kg/m2": 1e-3, "g/cm2": 1e-2, "oz/yd2": 33.90575e-6},
    "mass per volume": {"g/cm3": 1e-3},
    "time": {"ms": 1.0, "us": 1e-3, "ns": 1e-6, "s": 1e3, "min": 6e4, "h": 3.6e6},
    "speed": {"m/s": 1.0, "mm/s": 1e-3, "mm/min": 1.0 / 6e4, "cm/s": 1e-2, "m/min": 1.0 / 60.0, "km/h": 1.0 / 3.6},
    "acceleration": {"m/s2": 1e-3},
    "rate": {"1/ms": 1.0},
    "force": {"N": 1.0, "kN": 1e3, "daN": 10.0, "cN": 1e-2, "mN": 1e-3, "kgf": 9.80665, "lbf": 4.4482216152605},
    "force per length": {"N/mm": 1.0, "N/m": 1e-3, "kN/mm": 1e3},
    "stress": {
        "MPa": 1.0, "GPa": 1e3, "kPa": 1e-3, "Pa": 1e-6, "bar": 0.1, "mbar": 1e-4, "hPa": 1e-4,
        "psi": 6.89475729316836e-3, "ksi": 6.89475729316836, "N/mm2": 1.0, "N/cm2": 1e-2,
        "kgf/cm2": 0.0980665, "gf/cm2": 9.80665e-5,
    },
    "stress per length": {"N/mm3": 1.0, "MPa/mm": 1.0},
    "moment": {"N mm": 1.0, "N m": 1e3, "N cm": 10.0, "mN cm": 1e-2},
    "bending stiffness": {"N mm2": 1.0, "N m2": 1e6, "N cm2": 100.0, "mN cm2": 0.1},
    "threads per length": {
        "yarn/100 mm": 1e-2, "yarns/cm": 0.1, "yarns/mm": 1.0, "yarns/m": 1e-3, "yarns/dm": 1e-2,
    },
}  # fmt: skip
#: unit -> its factor to kernel units
FACTOR = {unit: factor for units in UNITS.values() for unit, factor in units.items()}
_QUANTITY = {unit: quantity for quantity, units in UNITS.items() for unit in units}
#: characters of units that have a plain spelling; both micro signs are in use
_PLAIN = str.maketrans({"µ": "u", "μ": "u", "²": "2", "³": "3"})
#: quantity -> end of the names of numbers in kernel units
SUFFIX = {
    "number": "fraction", "length": "mm", "area": "mm2", "angle": "rad", "mass": "g", "mass per length": "g_per_mm",
    "mass per area": "g_per_mm2", "mass per volume": "g_per_mm3", "time": "ms", "speed": "mm_per_ms",
    "acceleration": "mm_per_ms2", "rate": "per_ms", "force": "n", "force per length": "n_per_mm", "stress": "mpa",
    "stress per length": "n_per_mm3", "moment": "n_mm", "bending stiffness": "n_mm2", "threads per length": "per_mm",
}  # fmt: skip


def to_kernel(value: float, unit: str) -> float:
    """Convert ``value`` in user ``unit`` to kernel units; raise ``KeyError`` for an unknown unit.

    >>> to_kernel(2.0, "GPa")  # MPa
    2000.0
    """
    return value * FACTOR[unit]


def suffix(unit: str) -> str:
    """Return how the name of a number ends that was given in ``unit`` and is in kernel units.

    >>> suffix("GPa"), suffix("tex")
    ('mpa', 'g_per_mm')
    """
    return SUFFIX[_QUANTITY[unit]]


def ratio(unit: str, other: str) -> float:
    """Number of ``other`` that one ``unit`` is; raise ``KeyError`` for an unknown unit or one of another quantity.

    >>> ratio("kN", "N"), ratio("inch", "mm")
    (1000.0, 25.4)
    """
    return float(Decimal(repr(UNITS[_QUANTITY[other]][unit])) / Decimal(repr(FACTOR[other])))  # 1e-3 / 1e-6 is 1000


def ratios(other: str, *units: str) -> dict[str, float]:
    """:func:`ratio` of each of ``units`` to ``other``, which comes first itself.

    >>> ratios("mm", "cm")
    {'mm': 1.0, 'cm': 10.0}
    """
    return {unit: ratio(unit, other) for unit in (other, *units)}


def to_plain_letters(text: str) -> str:
    """``text`` with plain letters for micro signs and powers.

    >>> to_plain_letters("µm/mm²")
    'um/mm2'
    """
    return text.translate(_PLAIN)


def round_down(value: float) -> float:
    """``value`` above 0 with two digits, never more than it is."""
    place = 10.0 ** (floor(log10(value)) - 1)
    return float(f"{floor(value / place * (1.0 + 1e-12)) * place:.3g}")
