"""Bounds of the squared frequency that the fibres' bending in the plane adds: at rest, and in any state.

Nodes without mass are held.

The energy of a stencil and a fibre is c (k - k0)^2 / 2 with k = x'' . m (:mod:`knittest.kernels.in_plane`), so its
stiffness is c (dk dk + (k - k0) d2k). m turns about a by at most (|db| + |a . b| |da| / a . a) / |p| and towards a by
|da| / |a|: a member with the weights u of the second derivative and v of both turns has |dk| <= u + v x'', each turn
with the part of x'' that it meets, along the normal and along a, and two members have |d2k| <= u v' + v u' + 3 |x''|
v v'. At rest in a plane k - k0 and the part along the normal vanish.
"""

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.in_plane import CLOSED
from knittest.kernels.in_plane_state import BLOCK, WEIGHTS, Bends

Array = NDArray[np.float64]


def bend_bound(bends: Bends, mass: Array) -> float:
    """Bound at rest in a plane [1/ms^2], nodal masses ``mass`` [g]: row sums over mass.

    A stencil's curvature is across its fibre, those of warp and weft may lie in one line where shear has closed them.
    """
    second = np.abs(_weights(bends)[:, 2:])
    rows = np.zeros(bends.member.shape)
    for family, stiffness in enumerate(_stiffness(bends)):
        u = second[:, family]
        rows += u * _spread(bends, _sums(bends, u) * stiffness)
    return float(_per_mass(bends, rows, mass).max(initial=0.0))


def bend_bound_now(bends: Bends, position: Array, mass: Array) -> tuple[float, int]:
    """Bound [1/ms^2] in the state of ``position`` (3, n) [mm], and the node where it is."""
    weight = _weights(bends)
    place = np.moveaxis(position[:, bends.member], 0, 1)  # rows, coordinates, lanes
    warp, weft, *second = (_sums(bends, weight[:, f, None] * place) for f in range(WEIGHTS))
    rows = np.zeros(bends.member.shape)
    for family, (a, b) in enumerate(((warp, weft), (weft, warp))):
        own, other = np.abs(weight[:, family]), np.abs(weight[:, 1 - family])
        share, inv, bent, off = _turning(a, b, second[family], bends.natural[family].reshape(-1, BLOCK))
        about = (other + _spread(bends, share) * own) * _spread(bends, inv[1])
        towards = own * _spread(bends, inv[0])
        u, v = np.abs(weight[:, 2 + family]), about + towards
        gradient = u + about * _spread(bends, bent[1]) + towards * _spread(bends, bent[0])
        size = np.sqrt(_dot(second[family], second[family]))
        change = u * _spread(bends, _sums(bends, v)) + v * _spread(
            bends, _sums(bends, u) + 3.0 * size * _sums(bends, v)
        )
        alive = _stiffness(bends)[family] * bends.alive.reshape(-1, BLOCK)
        rows += _spread(bends, alive) * (
            gradient * _spread(bends, _sums(bends, gradient)) + _spread(bends, off) * change
        )
    found = _per_mass(bends, rows, mass)
    return float(found.max(initial=0.0)), int(found.argmax())


def _turning(
    a: Array, b: Array, second: Array, natural: Array
) -> tuple[Array, tuple[Array, Array], tuple[Array, Array], Array]:
    """Size of a . b / a . a; 1 / |a| and 1 / |p|; sizes of the second derivative along a and the normal; |k - k0|."""
    long, share = _dot(a, a), _dot(a, b) / _dot(a, a)
    part = b - share[:, None] * a
    inv = 1.0 / np.sqrt(long), 1.0 / np.sqrt(np.maximum(_dot(part, part), CLOSED))
    k, along = _dot(second, part) * inv[1], _dot(second, a) * inv[0]
    out = np.sqrt(np.maximum(_dot(second, second) - k**2 - along**2, 0.0))
    return np.abs(share), inv, (np.abs(along), out), np.abs(k - natural)


def _dot(a: Array, b: Array) -> Array:
    """Scalar products of (n, 3, lanes), (n, lanes)."""
    return np.sum(a * b, axis=1)


def _weights(bends: Bends) -> Array:
    return bends.weight.reshape(-1, WEIGHTS, BLOCK)


def _stiffness(bends: Bends) -> Array:
    return bends.stiffness.reshape(2, -1, BLOCK)


def _sums(bends: Bends, rows: Array) -> Array:
    """Sums of ``rows`` of members over each block."""
    return np.asarray(np.add.reduceat(rows, bends.first[:-1], axis=0))


def _spread(bends: Bends, blocks: Array) -> Array:
    """Each block's row for all of its members."""
    return np.repeat(blocks, np.diff(bends.first), axis=0)


def _per_mass(bends: Bends, rows: Array, mass: Array) -> Array:
    """Row sums of each node over its mass, (n_nodes,)."""
    total = np.bincount(bends.member.ravel(), rows.ravel(), len(mass))
    return np.divide(total, mass, out=np.zeros(len(mass)), where=mass > 0.0)
