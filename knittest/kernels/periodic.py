"""A periodic cell: images follow their nodes, and the lattice moves or is free under what the cell pulls it with.

Image (i, j) of a node at x lies at R x + t, where t = i a + j b with the lattice vectors a and b of the fabric laid
flat. Where the fabric is bent to the curvature k along the unit vector d, with the normal n and the axis e = d x n, the
way s = t . d becomes an arc of the turn k s: R turns from d towards n by that, and t has (sin(k s) / k - s) d +
(1 - cos(k s)) / k n more. All these maps commute, so that the fabric is a cylinder whose parts are alike.

Contacts and beams count by shares of the cell: a beam where its first node lies in it, a contact by halves where either
of its pieces does. With f and m the forces and moments of these on images, the elastic energy E of the cell changes by
dE/dq = - sum f . dx/dq + m . e d(k s)/dq with each number q of the lattice (virial theorem; Allen & Tildesley, Computer
Simulation of Liquids, for pairs). Its power is the work of the mean deformation.
"""

from math import cos, sin

from numba import njit

from knittest.kernels.beam import axial_strain, flat_moment, mean_frame, section_force, section_moment
from knittest.kernels.contact import spline_weights
from knittest.kernels.laws import hinge_force
from knittest.kernels.state import ARC, COSINE, CURVATURE, LATTICE, SHIFT, SHIFT_RATE, SINE, TURN, TURN_RATE
from knittest.kernels.vec import KERNEL, PART, add, at3, combine, cross, dot, rows3, rows4, scale, sub

#: turn [rad] below which series stand for quotients
SMALL = 1e-2


@njit(**PART)
def _arc(turn):
    """Quotients of a turn t: sin t / t - 1, (1 - cos t) / t, and their derivatives by t (with t' = s k')."""
    if abs(turn) < SMALL:
        t2 = turn * turn
        return -t2 / 6.0 + t2 * t2 / 120.0, turn * (0.5 - t2 / 24.0), -turn / 3.0 + turn * t2 / 30.0, 0.5 - t2 / 8.0
    s, c = sin(turn), cos(turn)
    return s / turn - 1.0, (1.0 - c) / turn, (c - s / turn) / turn, (s - (1.0 - c) / turn) / turn


@njit(**PART)
def place_images(dt, images):
    """Bring the maps of all images to the present lattice, with their rates over the last ``dt`` [ms]."""
    a, curvature = images.lattice, images.lattice[CURVATURE]
    along, normal = images.axes[0], images.axes[1]
    for k in range(images.times.shape[0]):
        i, j = images.times[k, 0], images.times[k, 1]
        arc = 0.0
        for d in range(3):
            arc += (i * a[d] + j * a[d + 3]) * along[d]
        turn = curvature * arc
        short, high, _, _ = _arc(turn)
        row = images.map[k]
        for d in range(3):
            shift = i * a[d] + j * a[d + 3] + arc * (short * along[d] + high * normal[d])
            row[SHIFT_RATE + d] = (shift - row[SHIFT + d]) / dt
            row[SHIFT + d] = shift
        row[TURN_RATE] = (turn - row[TURN]) / dt
        row[TURN], row[SINE], row[COSINE], row[ARC] = turn, sin(turn), cos(turn), arc


@njit(**PART)
def _rotate_about(axis, sine, cosine, v):
    """Vector ``v`` turned about the unit vector ``axis``."""
    return add(add(scale(cosine, v), scale(sine, cross(axis, v))), scale((1.0 - cosine) * dot(axis, v), axis))


@njit(**PART)
def _product(p, q):
    """Product of two quaternions (w, x, y, z)."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] + p[2] * q[0] + p[3] * q[1] - p[1] * q[3],
        p[0] * q[3] + p[3] * q[0] + p[1] * q[2] - p[2] * q[1],
    )


@njit(**KERNEL)
def move_images(dt, nodes, images):
    """Put every image where the lattice and its node have it, at their speeds over the last step."""
    place_images(dt, images)
    x, v, spin, q = rows3(nodes.position), rows3(nodes.velocity), rows3(nodes.spin), rows4(nodes.rotation)
    axis = (images.axes[2, 0], images.axes[2, 1], images.axes[2, 2])
    for k in range(images.ghost.size):
        g, m = images.ghost[k], images.master[k]
        row = images.map[images.of[g]]
        here, speed, turning = at3(x, m), at3(v, m), at3(spin, m)
        rotation = (q[0][m], q[1][m], q[2][m], q[3][m])
        if row[TURN] != 0.0 or row[TURN_RATE] != 0.0:
            sine, cosine, rate = row[SINE], row[COSINE], row[TURN_RATE]
            # over the whole step: what was turned by less before it
            before = row[TURN] - dt * rate
            old = _rotate_about(axis, sin(before), cos(before), sub(here, scale(dt, speed)))
            here = _rotate_about(axis, sine, cosine, here)
            speed = scale(1.0 / dt, sub(here, old))
            turning = add(_rotate_about(axis, sine, cosine, turning), scale(rate, axis))
            half = 0.5 * row[TURN]
            rotation = _product((cos(half), sin(half) * axis[0], sin(half) * axis[1], sin(half) * axis[2]), rotation)
        rotation = _product(rotation, (images.gauge[0, k], images.gauge[1, k], images.gauge[2, k], images.gauge[3, k]))
        for d in range(3):
            x[d][g], v[d][g] = here[d] + row[SHIFT + d], speed[d] + row[SHIFT_RATE + d]
            spin[d][g] = turning[d]
        for d in range(4):
            q[d][g] = rotation[d]


@njit(**PART)
def _book(node, force, moment, position, images):
    """Add to ``images.pull`` what ``force`` [N] and ``moment`` [N mm] on ``node`` mean, if it is an image."""
    k = images.of[node]
    if k == 0:
        return
    row, along, normal, axis = images.map[k], images.axes[0], images.axes[1], images.axes[2]
    turned, curvature = 0.0, images.lattice[CURVATURE]
    if images.group[CURVATURE] >= 0 or curvature != 0.0:
        _, _, short_by, high_by = _arc(row[TURN])
        e = (axis[0], axis[1], axis[2])
        lever = cross(e, sub(at3(rows3(position), node), (row[SHIFT], row[SHIFT + 1], row[SHIFT + 2])))
        couple = dot(force, lever) + dot(moment, e)
        down, up = dot(force, (along[0], along[1], along[2])), dot(force, (normal[0], normal[1], normal[2]))
        turned = curvature * couple + (row[COSINE] - 1.0) * down + row[SINE] * up
        arc = row[ARC]
        images.pull[CURVATURE] -= arc * (couple + arc * (short_by * down + high_by * up))
    for d in range(3):
        moved = force[d] + along[d] * turned
        images.pull[d] -= images.times[k, 0] * moved
        images.pull[3 + d] -= images.times[k, 1] * moved


@njit(**PART)
def _beam_end(i, section, nodes, beams):
    """Force [N] and moment [N mm] of beam ``i`` on its second node."""
    x, q, tangent = rows3(nodes.position), rows4(nodes.rotation), rows3(beams.tangent)
    j = i + 1
    dx, dy, dz = at3(tangent, i)
    ax, ay, az, cx, cy, cz, inv = mean_frame(
        q[0][i], q[1][i], q[2][i], q[3][i], q[0][j], q[1][j], q[2][j], q[3][j], dx, dy, dz
    )
    r = sub(at3(x, j), at3(x, i))
    inv_length, stiffness = beams.inv_length[i], beams.stiffness[section]
    strain = axial_strain(ax, ay, az, r[0], r[1], r[2], inv_length)
    axial = stiffness[0] * min(strain, 0.0)
    for h in range(beams.hinge_strain.shape[1]):
        axial += hinge_force(strain - beams.slack[i], beams.hinge_strain[section, h], beams.hinge_slope[section, h])
    n = section_force(axial, strain, stiffness[1], ax, ay, az, r[0], r[1], r[2], inv_length)
    t = cross(r, n)
    m = section_moment(stiffness[2], stiffness[3], inv, inv_length, ax, ay, az, cx, cy, cz, t[0], t[1], t[2])
    if beams.excess[section] != 0.0:
        nx, ny, nz = at3(rows3(beams.normal), i)
        nx, ny, nz, _, _, _, _ = mean_frame(
            q[0][i], q[1][i], q[2][i], q[3][i], q[0][j], q[1][j], q[2][j], q[3][j], nx, ny, nz
        )
        m = add(m, flat_moment(beams.excess[section], inv, inv_length, nx, ny, nz, cx, cy, cz))
    alive = beams.alive[i]
    return scale(-alive, n), scale(-alive, sub(m, scale(0.5, t)))


@njit(**PART)
def _book_contact(c, contacts, position, images):
    """Add what the forces of contact ``c`` on images mean, by its share."""
    share, f = contacts.share[c], at3(rows3(contacts.force), c)
    if share == 0.0 or (f[0] == 0.0 and f[1] == 0.0 and f[2] == 0.0):
        return
    offset = at3(rows3(contacts.offset), c)
    couple, spin = cross(f, offset), scale(contacts.couple[c], offset)
    for side in range(2):
        i = contacts.piece[side, c]
        weights = spline_weights(contacts.parameter[side, c])
        sign, arm = (1.0, contacts.arm[c]) if side == 0 else (-1.0, 1.0 - contacts.arm[c])
        for k in range(3):
            part = share * weights[k]
            moment = combine(arm * part, couple, -sign * part, spin)
            if contacts.excess.size > 0:
                shift = at3(rows3(contacts.shift if side == 0 else contacts.other), c)
                moment = combine(1.0, moment, part, cross(f, shift))
            _book(i - 1 + k, scale(sign * part, f), moment, position, images)


@njit(**PART)
def _book_pairs(pairs, position, images):
    """Add what the forces of pairs of soft yarns on images mean, by their shares."""
    force, none = rows3(pairs.force), (0.0, 0.0, 0.0)
    for c in range(pairs.weight.size):
        f = at3(force, c)
        if f[0] != 0.0 or f[1] != 0.0 or f[2] != 0.0:
            share = pairs.share[c]
            _book(pairs.node[0, c], scale(share, f), none, position, images)
            _book(pairs.node[1, c], scale(-share, f), none, position, images)


@njit(**KERNEL)
def pull_lattice(count, dt, nodes, beams, contacts, pairs, images, tables, tally):
    """Find what the cell pulls the lattice with, book its work, and move the lattice on by ``dt`` [ms].

    To be called when the forces of the ``count`` contacts, and of the ``pairs`` of soft yarns (None: there are none),
    are known and no node has moved yet.
    """
    for q in range(LATTICE):
        images.pull[q] = 0.0
    for k in range(images.cut.shape[0]):
        i = images.cut[k, 0]
        force, moment = _beam_end(i, images.cut[k, 1], nodes, beams)
        _book(i + 1, force, moment, nodes.position, images)
    for c in range(count):
        _book_contact(c, contacts, nodes.position, images)
    if pairs is not None:
        _book_pairs(pairs, nodes.position, images)
    kept = nodes.damping_factor[0]
    for q in range(LATTICE):
        before, force = images.rate[q], images.pull[q]
        if images.inv_mass[q] > 0.0:
            images.rate[q] = kept * before - dt * images.inv_mass[q] * force
        else:
            images.rate[q] = tables.now[1, images.table[q]]
            before = tables.now[0, images.table[q]]
        images.lattice[q] += dt * images.rate[q]
        tally.energy[0, 0] += force * 0.5 * (before + images.rate[q]) * dt
        if images.group[q] >= 0:
            tally.reaction[0, images.group[q]] += force
            tally.support[0, images.group[q]] += force
