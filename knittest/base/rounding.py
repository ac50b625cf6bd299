"""Numbers rounded to the safe side."""

from math import floor, log10


def rounded_down(value: float) -> float:
    """``value`` above 0 with two digits, never more than it is."""
    place = 10.0 ** (floor(log10(value)) - 1)
    return float(f"{floor(value / place * (1.0 + 1e-12)) * place:.3g}")
