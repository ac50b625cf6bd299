"""Tabulated laws as sums of hinges: exactly piecewise linear, without a table search."""

from numba import njit

from knittest.kernels.options import INLINE


@njit(**INLINE)
def hinge_force(strain, knee, slope):
    """One hinge, slope max(strain - knee, 0), in the unit of ``slope`` (N for beams, N/mm or MPa for shells)."""
    return slope * max(strain - knee, 0.0)


@njit(**INLINE)
def hinge_energy(strain, knee, slope):
    """Integral of :func:`hinge_force` over strain."""
    over = max(strain - knee, 0.0)
    return 0.5 * slope * over * over
