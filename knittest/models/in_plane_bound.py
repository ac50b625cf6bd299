"""Bounds of the squared frequency that the fibres' bending in the plane adds: at rest, and in any state.

Nodes without mass are held. The bound of a stencil is that of :mod:`knittest.kernels.in_plane_bound`. At rest in a
plane the difference to the natural curvature vanishes, and so does the second derivative along the normal.
"""

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.in_plane_bound import add_bounds
from knittest.kernels.in_plane_state import BLOCK, WEIGHTS, Bends

Array = NDArray[np.float64]


def bend_bound(bends: Bends, mass: Array) -> float:
    """Bound at rest in a plane [1/ms^2], nodal masses ``mass`` [g]: row sums over mass.

    A stencil's curvature is across its fibre, those of warp and weft may lie in one line where shear has closed them.
    """
    second = np.abs(bends.weight.reshape(-1, WEIGHTS, BLOCK)[:, 2:])
    rows, size = np.zeros(bends.member.shape), np.diff(bends.first)
    for family, stiffness in enumerate(bends.stiffness.reshape(2, -1, BLOCK)):
        u = second[:, family]
        sums = np.add.reduceat(u, bends.first[:-1], axis=0)  # over each block
        rows += u * np.repeat(sums * stiffness, size, axis=0)
    total = np.bincount(bends.member.ravel(), rows.ravel(), len(mass)).astype(float)
    return float(_per_mass(total, mass).max(initial=0.0))


def bend_bound_now(bends: Bends, position: Array, mass: Array) -> tuple[float, int]:
    """Bound [1/ms^2] in the state of ``position`` (3, n) [mm], and the node where it is."""
    rows = np.zeros(len(mass))
    add_bounds(position, bends, rows)
    found = _per_mass(rows, mass)
    return float(found.max(initial=0.0)), int(found.argmax())


def _per_mass(rows: Array, mass: Array) -> Array:
    """Row sums of each node over its mass, (n_nodes,)."""
    return np.divide(rows, mass, out=np.zeros(len(mass)), where=mass > 0.0)
