"""Natural state of yarns: curvature that is not set in them, elliptic sections that flatten, contacts where yarns bend
round ellipses.

A beam's curvature is the rotation from one end node to the other, so a yarn that was straight before it was bent starts
with nodes turned along its bend; a yarn fully set in its shape starts with none turned.
"""

import numpy as np

from knittest.base.arrays import Array, Index
from knittest.base.errors import InputError
from knittest.kernels.contact import FIRST_ALONG, SECOND_ALONG, SIDE_BY_SIDE
from knittest.kernels.flattening import DRAG, EXPONENT, FREE, HIGH, LENGTH, PRODUCT, ROWS, STIFF
from knittest.kernels.state import Beams, Contacts
from knittest.models.contact_tracker import ContactTracker


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
        between = direction[:, :-1] + direction[:, 1:]  # at the nodes, halfway between the elements
        between /= np.linalg.norm(between, axis=2, keepdims=True)
        at_nodes = np.concatenate([direction[:, :1], between, direction[:, -1:]], axis=1)
        turned = _turns(at_nodes, 1.0 - degree_of_set[node[:, :-1]])
        mean = turned[:, :-1] + turned[:, 1:]
        mean /= np.linalg.norm(mean, axis=2, keepdims=True)
        rotation[node], tangent[node[:, :-1]] = turned, _rotate_back(mean, direction)
    return rotation, tangent


def natural_normal(rotation: Array, normal: Array) -> Array:
    """``normal`` (n, 3) of elements as it was before nodes turned by ``rotation`` (n, 4); x where it is not finite."""
    mean = rotation[:-1] + rotation[1:]
    mean = np.vstack([mean, rotation[-1:]])
    size = np.linalg.norm(mean, axis=1, keepdims=True)
    known = np.isfinite(normal).all(axis=1, keepdims=True)
    back = _rotate_back(mean / np.where(size > 0.0, size, 1.0), np.where(known, normal, 0.0))
    return np.where(known, back, [1.0, 0.0, 0.0])


def _turns(direction: Array, share: Array) -> Array:
    """Quaternions (m, k + 1, 4) that turn from node to node by ``share`` (m, k) of the shortest rotation."""
    axis = np.cross(direction[:, :-1], direction[:, 1:])
    sine = np.linalg.norm(axis, axis=2)
    half = 0.5 * share * np.arctan2(sine, np.sum(direction[:, :-1] * direction[:, 1:], axis=2))
    step = np.concatenate([np.cos(half)[..., None], axis * (np.sin(half) / np.maximum(sine, 1e-30))[..., None]], axis=2)
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (*direction.shape[:2], 1))
    for k in range(step.shape[1]):
        turned[:, k + 1] = quaternion_product(step[:, k], turned[:, k])
    return turned


def quaternion_product(p: Array, q: Array) -> Array:
    """Quaternion products (m, 4)."""
    scalar = p[:, :1] * q[:, :1] - np.sum(p[:, 1:] * q[:, 1:], axis=1, keepdims=True)
    vector = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    return np.concatenate([scalar, vector], axis=1)


def _rotate_back(q: Array, vector: Array) -> Array:
    """``vector`` (..., 3) turned by the inverse of the unit quaternions ``q`` (..., 4)."""
    across = 2.0 * np.cross(vector, q[..., 1:])
    return vector + q[..., :1] * across + np.cross(across, q[..., 1:])


def rotate_quaternions(rotation: Array, vector: Array) -> Array:
    """Quaternions (n, 4) turned further by the rotation vectors ``vector`` (n, 3) [rad]."""
    angle = np.linalg.norm(vector, axis=1, keepdims=True)
    turn = np.hstack([np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi) * vector])
    return quaternion_product(turn, rotation)


def with_equal_signs(rotation: Array) -> Array:
    """Quaternions (n, 4) of the same rotations, each of the sign that lies nearer to the one before: the mean rotation
    of two neighbours is that of their sum.
    """
    along = np.einsum("ij,ij->i", rotation[1:], rotation[:-1])
    sign = np.cumprod(np.append(1.0, np.where(along < 0.0, -1.0, 1.0)))
    return sign[:, None] * rotation


def rotate_about_x(rotation: Array, angle: Array) -> Array:
    """Quaternions (4, n) turned further about x by ``angle`` (n,) [rad]."""
    w, x, y, z = rotation
    c, s = np.cos(0.5 * angle), np.sin(0.5 * angle)
    return np.array([c * w - s * x, c * x + s * w, c * y - s * z, c * z + s * y])


#: share of the way to balance that a half height goes in a step, at most, and stiffnesses of contacts that it feels
RATE, PRESSED = 0.5, 1.5
#: tangent of the law, over that of a section at rest whose exponent is 1, for which drag is made
STEEPEST = 4.0


def shapes_at_rest(high: Array, wide: Array, stiff: Array, exponent: Array, length: Array, contact: float) -> Array:
    """Rows of :mod:`knittest.kernels.flattening` of nodes of half height ``high`` and half width ``wide`` [mm],
    (ROWS, n).

    ``stiff`` lateral modulus [MPa], 0 where a section is rigid, ``exponent`` of its law, ``length`` [mm] of the yarn at
    each node, all (n,); ``contact`` [N/mm] the stiffest that presses a node. Empty where all are rigid.
    """
    if not (stiff > 0.0).any():
        return np.zeros((ROWS, 0))
    shape = np.zeros((ROWS, high.size))
    shape[HIGH] = shape[FREE] = high
    shape[PRODUCT], shape[STIFF] = high * wide, 4.0 * high * wide * stiff
    shape[LENGTH], shape[EXPONENT] = length, exponent
    within = shape[STIFF] * (STEEPEST * length / high**2 + 4.0 / np.maximum(length, 1e-12))
    widest = np.maximum(wide / high, 1.0)  # a contact at the side moves by more than the half height
    shape[DRAG] = (PRESSED * contact * widest**2 + within) / RATE
    return shape


def shape_energy(shape: Array, beams: Beams, alive: Array, owned: Array | None) -> float:
    """Energy [mJ] of the sections in ``shape`` (ROWS, n); only nodes ``owned`` (n,) count, all if None."""
    if not shape.size:
        return 0.0
    y = shape[HIGH] / shape[FREE]
    z = np.minimum(y, 1.0 / y)
    cubic = -np.log(z) - 3.0 * (1.0 - z) + 1.5 * (1.0 - z**2) - (1.0 - z**3) / 3.0
    stored = np.where(shape[EXPONENT] == 1.0, z - 1.0 - np.log(z), cubic)
    bent = np.zeros(y.size)
    n = y.size - 1
    between = alive[:n] * beams.inv_length[:n] * np.diff(shape[HIGH]) ** 2
    bent[:-1] = 0.5 * between
    counts = np.ones(y.size) if owned is None else owned
    return float(np.sum(counts * shape[STIFF] * (shape[LENGTH] * stored + bent)))


# Contacts of elliptic sections at yarns that bend as the ellipse does: there one nearest place becomes two.
#
# Yarns that are pressed piece by piece touch in both; what is left are those that bend along the section of such a
# yarn.

#: curvature of a yarn times the distance to the centre of the ellipse's curvature, at which the nearest place turns
#: into two, beside it
CONFORMS = 1.0
#: curvature times distance of the ratio that is advised
ADVISED = 0.8
#: kind of contact that holds the first yarn, and the second
HOLDS = (FIRST_ALONG, SECOND_ALONG)
#: share of the sum of contact forces that such contacts may carry
MOST = 0.05


def conformity(tracker: ContactTracker, position: Array) -> Array:
    """Curvature of the yarns times their distance [-] of the tracked contacts, (count,): the larger of both yarns, of
    those whose place on them is free.

    ``position`` (3, n_nodes) [mm]. The distance is that to the circle that osculates the section of the other.
    """
    contacts, n = tracker.contacts, tracker.count
    found = np.zeros((2, n))
    for side, sign in ((0, -1.0), (1, 1.0)):
        i, s = contacts.piece[side, :n], contacts.parameter[side, :n]
        bend = position[:, i - 1] - 2.0 * position[:, i] + position[:, i + 1]
        tangent = position[:, i] - position[:, i - 1] + s * bend
        along = sign * np.sum(_to_curvature(contacts, side, n) * bend, axis=0) / np.sum(tangent * tangent, axis=0)
        found[side] = np.where(contacts.line[:n] != HOLDS[side], along, 0.0)
    return found.max(axis=0)


def _to_curvature(contacts: Contacts, side: int, n: int) -> Array:
    """Offset (3, n) [mm] of the centre-line on one ``side`` and the centre of curvature of the other's section."""
    offset: Array = contacts.offset[:, :n]
    return offset + (contacts.shift if side == 0 else contacts.other)[:, :n] if contacts.touch.size else offset


def check_conformity(tracker: ContactTracker, position: Array) -> None:
    """Raise :class:`InputError` for the reason that :func:`conformity_fault` gives."""
    if reason := conformity_fault(tracker, position):
        raise InputError(reason)


def conformity_fault(tracker: ContactTracker, position: Array) -> str:
    """Sections that yarns bend around so closely that they touch twice, with a ratio that helps; empty if none."""
    contacts, n = tracker.contacts, tracker.count
    if not contacts.touch.size or not n:
        return ""
    force = np.linalg.norm(contacts.force[:, :n], axis=0)
    elliptic = (contacts.touch[:n] > 0.0) & (contacts.line[:n] != SIDE_BY_SIDE)
    along = np.where(elliptic & (force > 0.0), conformity(tracker, position), 0.0)
    if force[along > CONFORMS].sum() <= MOST * force.sum():
        return ""
    worst = int(np.argmax(np.where(along > CONFORMS, force, 0.0)))
    first, second = (int(i) for i in contacts.piece[:, worst])
    ratio, most = _smaller_ratio(contacts, worst, first, second, float(along[worst]))
    less = f"at most about {most:.2f}" if most >= 1.0 else "1, and a higher packing"
    return (
        f"fabric.reinforcing.section.width_to_height: {tracker.name_of(first)} and {tracker.name_of(second)} bend "
        f"around a section {ratio:.3g} times as wide as high and would touch in two places; the contact model follows "
        f"one place only; expected {less}"
    )


def _smaller_ratio(contacts: Contacts, c: int, first: int, second: int, along: float) -> tuple[float, float]:
    """Width over height [-] of the flatter section of contact ``c``, and the one that conforms by less.

    Lying flat an ellipse has the radius of curvature sqrt(area / pi) ratio^(3/2).
    """
    touch, arm = float(contacts.touch[c]), float(contacts.arm[c])
    flat = [float(contacts.square[i] / (contacts.square[i] + contacts.excess[i])) ** 0.5 for i in (first, second)]
    side = int(flat[1] > flat[0])
    radius = touch * (arm if side == 0 else 1.0 - arm)
    away = float(np.linalg.norm(_to_curvature(contacts, 1 - side, c + 1)[:, c]))
    less = radius - away * (1.0 - ADVISED / along)
    return flat[side], flat[side] * (max(less, 0.0) / radius) ** (2.0 / 3.0)
