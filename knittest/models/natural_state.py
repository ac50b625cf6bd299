"""Bent yarns that are not set in their shape: the rotations and element tangents that carry their curvature.

A beam's curvature is the rotation from one end node to the other, so a yarn that was straight before it was bent starts
with nodes turned along its bend; a yarn fully set in its shape starts with none turned.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def natural_state(start: Index, chord: Array, degree_of_set: Array) -> tuple[Array, Array]:
    """Nodal rotations (n, 4) as quaternions (w, x, y, z) and unit tangents (n, 3) of the elements before they turn.

    ``start`` (n_chains + 1,) first node of each chain, ``chord`` (n, 3) from each node to the next [mm], and
    ``degree_of_set`` (n,) the share of its elements' curvature that is free of moment. The nodes turn from one to the
    next by the rest, without twist; chords keep their directions, so that no axial or shear strain arises.
    """
    n = len(chord)
    rotation, tangent = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)), np.tile([1.0, 0.0, 0.0], (n, 1))
    counts = np.diff(start)
    for count in np.unique(counts[counts > 1]):
        node = start[:-1][counts == count][:, None] + np.arange(count)
        direction = chord[node[:, :-1]]
        direction = direction / np.linalg.norm(direction, axis=2, keepdims=True)
        turned = _turns(_at_nodes(direction), 1.0 - degree_of_set[node[:, :-1]])
        mean = turned[:, :-1] + turned[:, 1:]
        mean /= np.linalg.norm(mean, axis=2, keepdims=True)
        rotation[node], tangent[node[:, :-1]] = turned, _turned_back(mean, direction)
    return rotation, tangent


def natural_normal(rotation: Array, normal: Array) -> Array:
    """``normal`` (n, 3) of elements as it was before nodes turned by ``rotation`` (n, 4); x where it is not finite."""
    mean = rotation[:-1] + rotation[1:]
    mean = np.vstack([mean, rotation[-1:]])
    size = np.linalg.norm(mean, axis=1, keepdims=True)
    known = np.isfinite(normal).all(axis=1, keepdims=True)
    back = _turned_back(mean / np.where(size > 0.0, size, 1.0), np.where(known, normal, 0.0))
    return np.where(known, back, [1.0, 0.0, 0.0])


def _at_nodes(direction: Array) -> Array:
    """Unit directions at the nodes of chains, (m, k + 1, 3), halfway between those of the elements (m, k, 3)."""
    between = direction[:, :-1] + direction[:, 1:]
    between /= np.linalg.norm(between, axis=2, keepdims=True)
    return np.concatenate([direction[:, :1], between, direction[:, -1:]], axis=1)


def _turns(direction: Array, share: Array) -> Array:
    """Quaternions (m, k + 1, 4) that turn from node to node by ``share`` (m, k) of the shortest rotation."""
    axis = np.cross(direction[:, :-1], direction[:, 1:])
    sine = np.linalg.norm(axis, axis=2)
    half = 0.5 * share * np.arctan2(sine, np.sum(direction[:, :-1] * direction[:, 1:], axis=2))
    step = np.concatenate([np.cos(half)[..., None], axis * (np.sin(half) / np.maximum(sine, 1e-30))[..., None]], axis=2)
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (*direction.shape[:2], 1))
    for k in range(step.shape[1]):
        turned[:, k + 1] = _product(step[:, k], turned[:, k])
    return turned


def _product(p: Array, q: Array) -> Array:
    """Quaternion products (m, 4)."""
    scalar = p[:, :1] * q[:, :1] - np.sum(p[:, 1:] * q[:, 1:], axis=1, keepdims=True)
    vector = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    return np.concatenate([scalar, vector], axis=1)


def _turned_back(q: Array, vector: Array) -> Array:
    """``vector`` (..., 3) turned by the inverse of the unit quaternions ``q`` (..., 4)."""
    across = 2.0 * np.cross(vector, q[..., 1:])
    back: Array = vector + q[..., :1] * across + np.cross(across, q[..., 1:])
    return back


def turned_further(rotation: Array, vector: Array) -> Array:
    """Quaternions (n, 4) turned further by the rotation vectors ``vector`` (n, 3) [rad]."""
    angle = np.linalg.norm(vector, axis=1, keepdims=True)
    turn = np.hstack([np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi) * vector])
    return _product(turn, rotation)


def of_one_sign(rotation: Array) -> Array:
    """Quaternions (n, 4) of the same rotations, each of the sign that lies nearer to the one before: the mean rotation
    of two neighbours is that of their sum.
    """
    along = np.einsum("ij,ij->i", rotation[1:], rotation[:-1])
    sign = np.cumprod(np.append(1.0, np.where(along < 0.0, -1.0, 1.0)))
    return sign[:, None] * rotation


def turned_about_x(rotation: Array, angle: Array) -> Array:
    """Quaternions (4, n) turned further about x by ``angle`` (n,) [rad]."""
    w, x, y, z = rotation
    c, s = np.cos(0.5 * angle), np.sin(0.5 * angle)
    return np.array([c * w - s * x, c * x + s * w, c * y - s * z, c * z + s * y])
