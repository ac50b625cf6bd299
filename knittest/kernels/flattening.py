"""Elliptic sections that flatten where contacts press them, of conserved area, by a law of lateral compaction.

Each node has a half height b of its own, its half width a b0 a0 / b. The pressure over the width 2 a is modulus x^m, x
the share by which the height is less than free; x of the width where a yarn is pressed from its sides. The energy a
length is C (u + (db/ds)^2 / 2), C = 4 a b modulus, u = integral of (1 - y)^m / y from z to 1, z the smaller of b / b0
and b0 / b: work of both faces, and a gradient that lets a squeeze at a point spread over about the height. Contacts
pull with pressure dh/db. Heights follow without inertia, against a drag that loses energy.
"""

from math import sqrt

from numba import njit

from knittest.kernels.contact import spline_weights
from knittest.kernels.section_blocks import section_at, turn_sections
from knittest.kernels.vec import INLINE, ONE, PART, dot, rows3

#: rows of the shapes of nodes: half height [mm], its last change, pull of the contacts on it [N], force that drove it;
#: free half height, a b [mm^2], C [N], length [mm], drag over the step [N/mm], exponent m
HIGH, MOVED, PULL, DROVE, FREE, PRODUCT, STIFF, LENGTH, DRAG, EXPONENT = range(10)
ROWS = 10
#: no length [mm]
TINY = 1e-12


@njit(**INLINE)
def slope(high, free, exponent):
    """Derivative [1/mm] of u by the half height ``high`` [mm]."""
    y = high / free
    z = min(y, 1.0 / y)
    share = (1.0 - z) if exponent == 1.0 else (1.0 - z) * (1.0 - z) * (1.0 - z)
    return (share * z if y > 1.0 else -share / z) / free


@njit(**INLINE)
def _growth(i, weight, x, h, contacts):
    """Derivative of the half extent ``h`` [mm] of a piece by the half height of its node ``i``, which has ``weight``;
    ``x`` is the component of the normal along the height.
    """
    high = max(contacts.shape[HIGH][i], TINY)
    wide = contacts.shape[PRODUCT][i] / high
    return weight * (high * x * x - wide * wide * (1.0 - x * x) / high) / h


@njit(**INLINE)
def _extent_along(section, offset):
    """Component along the height of the normal along ``offset``, and the half extent [mm] of ``section`` along that."""
    axis, square, excess = section
    x = dot(axis, offset) / max(sqrt(dot(offset, offset)), TINY)
    return x, sqrt(square + excess * x * x)


@njit(**INLINE)
def _swelling(i, parameter, section, offset, contacts):
    moved, weights = contacts.shape[MOVED], spline_weights(parameter)
    x, h = _extent_along(section, offset)
    return (
        _growth(i - ONE, weights[0], x, h, contacts) * moved[i - ONE]
        + _growth(i, weights[1], x, h, contacts) * moved[i]
        + _growth(i + ONE, weights[2], x, h, contacts) * moved[i + ONE]
    )


@njit(**INLINE)
def swelling(i, j, s, t, first, second, offset, contacts):
    """Change of the half extents [mm] along ``offset`` of pieces ``i`` and ``j`` by that of their shapes in the last
    step; ``first`` and ``second`` are their sections at ``s`` and ``t``.
    """
    if contacts.shape.shape[1] == 0:
        return 0.0
    return _swelling(i, s, first, offset, contacts) + _swelling(j, t, second, offset, contacts)


@njit(**PART)
def squeeze(i, parameter, force, offset, contacts):
    """Add what ``force`` [N] of a contact on piece ``i`` pulls the half heights of its nodes with."""
    pull, weights = contacts.shape[PULL], spline_weights(parameter)
    section = section_at(i, parameter, rows3(contacts.turned), contacts.square, contacts.excess)
    x, h = _extent_along(section, offset)
    pressure = max(dot(force, offset) / max(sqrt(dot(offset, offset)), TINY), 0.0)
    pull[i - ONE] += pressure * _growth(i - ONE, weights[0], x, h, contacts)
    pull[i] += pressure * _growth(i, weights[1], x, h, contacts)
    pull[i + ONE] += pressure * _growth(i + ONE, weights[2], x, h, contacts)


@njit(**PART)
def _drive(i, alive, inv_length, shape):
    """Force [N] on the half height of node ``i``: of contacts, of its law, of its neighbours."""
    high, stiff = shape[HIGH], shape[STIFF][i]
    force = -shape[PULL][i] - stiff * shape[LENGTH][i] * slope(high[i], shape[FREE][i], shape[EXPONENT][i])
    if alive[i] > 0.0:
        force += stiff * inv_length[i] * (high[i + 1] - high[i])
    if i > 0 and alive[i - 1] > 0.0:
        force += stiff * inv_length[i - 1] * (high[i - 1] - high[i])
    return force


@njit(**PART)
def reshape(first, stop, contacts):
    """Bring the squares of nodes first..stop that flatten to their half heights."""
    for i in range(first, stop):
        if contacts.shape[STIFF][i] > 0.0:
            high = contacts.shape[HIGH][i]
            wide = contacts.shape[PRODUCT][i] / high
            contacts.square[i] = wide * wide
            excess = high * high - wide * wide
            contacts.excess[i] = excess if excess != 0.0 else -TINY  # a circle that may flatten is an ellipse


@njit(**PART)
def flatten(first, stop, beams, contacts):
    """Move the half heights of nodes first..stop by one step; returns what dragged on them took in the last [mJ]."""
    shape, lost = contacts.shape, 0.0
    for i in range(first, stop):
        if shape[STIFF][i] > 0.0:
            force = _drive(i, beams.alive, beams.inv_length, shape)
            lost += 0.5 * (force + shape[DROVE][i]) * shape[MOVED][i]
            shape[DROVE][i] = force
        shape[PULL][i] = 0.0
    for i in range(first, stop):
        if shape[STIFF][i] > 0.0:
            shape[MOVED][i] = shape[DROVE][i] / shape[DRAG][i]
            shape[HIGH][i] += shape[MOVED][i]
    reshape(first, stop, contacts)
    return lost


@njit(**PART)
def follow_sections(nodes, images, contacts):
    """Give images the shapes of their nodes, and turn the heights of all."""
    shape = contacts.shape
    for k in range(images.ghost.size if shape.shape[1] > 0 else 0):
        g, m = images.ghost[k], images.master[k]
        shape[HIGH][g], shape[MOVED][g] = shape[HIGH][m], shape[MOVED][m]
        contacts.square[g], contacts.excess[g] = contacts.square[m], contacts.excess[m]
    turn_sections(0, contacts.excess.size, nodes, contacts)
