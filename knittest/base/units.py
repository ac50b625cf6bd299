"""User units to kernel units, the only place that converts.

Kernel units are mm, ms, g, N, MPa (1 N = 1 g*mm/ms^2; energy N*mm = mJ). Multiply a user value by its factor.
"""

FACTOR = {
    "1": 1.0,
    "mm": 1.0,
    "deg": 0.017453292519943295,
    "%": 1.0e-2,
    "kg": 1.0e3,  # g
    "tex": 1.0e-6,  # g/mm (1 tex = 1 g/km)
    "g/cm3": 1.0e-3,  # g/mm^3
    "g/m2": 1.0e-6,  # g/mm^2
    "GPa": 1.0e3,  # MPa
    "MPa": 1.0,
    "N": 1.0,
    "N/mm": 1.0,
    "N mm": 1.0,
    "N mm2": 1.0,
    "mm2": 1.0,
    "yarn/100 mm": 1.0e-2,  # 1/mm
    "m/s": 1.0,  # mm/ms
    "m/s2": 1.0e-3,  # mm/ms^2
    "ms": 1.0,
    "us": 1.0e-3,  # ms
    "s": 1.0e3,  # ms
    "1/ms": 1.0,
}


def to_kernel(value: float, unit: str) -> float:
    """Convert ``value`` in user ``unit`` to kernel units; raise ``KeyError`` for an unknown unit."""
    return value * FACTOR[unit]


def from_kernel(value: float, unit: str) -> float:
    """Convert a kernel value back to the user ``unit``; raise ``KeyError`` for an unknown unit."""
    return value / FACTOR[unit]
