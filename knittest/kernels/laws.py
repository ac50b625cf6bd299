"""Tabulated laws as sums of hinges: exactly piecewise linear, without a table search."""

import numpy as np
from numba import njit

from knittest.base.arrays import Array
from knittest.kernels.vec import INLINE


def hinge_table(strain: Array, force: Array) -> tuple[Array, Array]:
    """Knees [-] and slopes of the hinges whose sum joins the points ``strain``, ``force`` (n,), the first (0, 0).

    Both results are (n - 1,); beyond the last point the last tangent goes on.
    """
    return strain[:-1].copy(), np.diff(np.diff(force) / np.diff(strain), prepend=0.0)


def hinge_tables(tables: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Knees and slopes of several tables, (n_tables, n_hinges) each, filled up with hinges of no slope."""
    knees, slopes = np.zeros((2, len(tables), max(len(knee) for knee, _ in tables)))
    for i, (knee, slope) in enumerate(tables):
        knees[i, : len(knee)], slopes[i, : len(slope)] = knee, slope
    return knees, slopes


@njit(**INLINE)
def hinge_force(strain, knee, slope):
    """One hinge, slope max(strain - knee, 0), in the unit of ``slope`` (N for beams, N/mm or MPa for shells)."""
    return slope * max(strain - knee, 0.0)


@njit(**INLINE)
def hinge_energy(strain, knee, slope):
    """Integral of :func:`hinge_force` over strain."""
    over = max(strain - knee, 0.0)
    return 0.5 * slope * over * over


@njit(**INLINE)
def odd_hinge_force(strain, knee, slope):
    """A hinge at ``knee`` >= 0 and its mirror image, so that the law is odd; a knee of 0 gives slope * strain."""
    return slope * (max(strain - knee, 0.0) + min(strain + knee, 0.0))


@njit(**INLINE)
def slider_force(stretch, stiffness, limit):
    """Force of a spring of ``stiffness`` behind a Coulomb slider that gives way at ``limit`` >= 0 (Prandtl, 1928)."""
    return min(max(stiffness * stretch, -limit), limit)


@njit(**INLINE)
def odd_hinge_energy(strain, knee, slope):
    """Integral of :func:`odd_hinge_force` over strain."""
    return hinge_energy(abs(strain), knee, slope)
