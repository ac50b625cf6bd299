"""Loads that keep their direction (gravity, point loads, moments), and prescribed velocities with reaction and work."""

from numba import njit

from knittest.kernels.beam import quaternion_step
from knittest.kernels.state import ABOUT, ALONG
from knittest.kernels.vec import INLINE, KERNEL, LANE_SUMS, PART, U, clear_sums, rows3, rows4, total_of_sums

#: work space, in floats
SCRATCH = 2 * LANE_SUMS


@njit(**PART)
def present_load(value, table, tables):
    """``value`` times a table at the instant of the forces, between the middles of two steps."""
    return value * 0.5 * (tables.now[0, table] + tables.now[1, table])


@njit(**INLINE)
def _work(first, count, value, rate, w):
    """Sum of the entries of ``value`` (count,) times the rates of the nodes from ``first`` on; ``w`` is work space."""
    clear_sums(w, U(0))
    for block in range(0, count, LANE_SUMS):
        for k in range(U(min(LANE_SUMS, count - block))):
            w[k] += value[U(block) + k] * rate[U(first + block) + k]
    return total_of_sums(w, U(0))


@njit(**INLINE)
def _guide_nodes(first, count, value, nodes, dof, force, push, gain, w):
    """Power of a guide, ``value`` times the rates, and the part of it that damping takes.

    Where ``force`` is not None it receives the force of the guide: ``value`` times the sum of ``gain`` and ``push``
    times the share that damping takes.
    """
    rate, damping = nodes.velocity[dof], nodes.damping_factor
    clear_sums(w, U(0))
    clear_sums(w, U(LANE_SUMS))
    for block in range(0, count, LANE_SUMS):
        for k in range(U(min(LANE_SUMS, count - block))):
            i = U(first + block) + k
            damped_share = 1.0 - damping[i]
            if force is not None:
                force[i] += value[U(block) + k] * (push * damped_share + gain)
            work = value[U(block) + k] * rate[i]
            w[k] += work
            w[U(LANE_SUMS) + k] += work * damped_share
    return total_of_sums(w, U(0)), total_of_sums(w, U(LANE_SUMS))


@njit(**PART)
def _gain(dt, table, tables):
    """Rise of a guide's velocity over the step [1/ms], at a table in units of the velocity."""
    return (tables.now[1, table] - tables.now[0, table]) / dt


@njit(**KERNEL)
def apply_loads(partition, dt, nodes, loads, tables, tally, w):
    """Add the loads of one partition before its nodes are integrated; books the first half of their work [mJ].

    Moments act on the spin at once, divided by the damping that follows, so that they balance exactly at rest. Damping
    v -> f v towards a guide's velocity u is v -> f v + (1 - f) u: a force m (1 - f) u / dt. The guide accelerates the
    nodes too, by m du/dt. ``w`` is work space of ``SCRATCH`` numbers.
    """
    work, guided = 0.0, 0.0
    for run in range(loads.start[partition], loads.start[partition + 1]):
        first, count, dof = loads.node[run], loads.length[run], loads.dof[run]
        factor, value = present_load(1.0, loads.table[run], tables), loads.value[loads.at[run] :]
        if loads.guides[run] == 1:
            gain = _gain(dt, loads.table[run], tables)
            moved, damped = _guide_nodes(first, count, value, nodes, dof, nodes.force[dof], factor / dt, gain, w)
            work, guided = work + gain * moved, guided + factor * damped
        elif dof < 3:
            force = nodes.force[dof]
            for k in range(U(count)):
                force[U(first) + k] += factor * value[k]
            work += factor * _work(first, count, value, nodes.velocity[dof], w)
        else:
            spin = nodes.spin[dof - 3]
            work += factor * _work(first, count, value, spin, w)
            for k in range(U(count)):
                i = U(first) + k
                spin[i] += factor * value[k] * nodes.inv_inertia[i] * dt / nodes.damping_factor[i]
    tally.energy[partition, 0] += 0.5 * dt * work
    tally.energy[partition, 8] += 0.5 * guided


@njit(**KERNEL)
def book_loads(partition, dt, nodes, loads, tables, tally, w):
    """Second half of the work, with the velocities after the step."""
    work, guided = 0.0, 0.0
    for run in range(loads.start[partition], loads.start[partition + 1]):
        first, count, dof = loads.node[run], loads.length[run], loads.dof[run]
        factor, value = present_load(1.0, loads.table[run], tables), loads.value[loads.at[run] :]
        if loads.guides[run] == 1:
            moved, damped = _guide_nodes(first, count, value, nodes, dof, None, 0.0, 0.0, w)
            work += _gain(dt, loads.table[run], tables) * moved
            guided += factor * damped
        else:
            work += factor * _work(first, count, value, nodes.velocity[dof] if dof < 3 else nodes.spin[dof - 3], w)
    tally.energy[partition, 0] += 0.5 * dt * work
    tally.energy[partition, 8] += 0.5 * guided


@njit(**PART)
def impose_motions(partition, dt, nodes, motions, tables, tally):
    """Replace free velocities by the prescribed ones of this step; tally reactions [N, N mm] and work [mJ].

    ``nodes.force`` is made to hold the reaction too, so that it stays the force that changes the velocity.
    """
    for k in range(motions.start[partition], motions.start[partition + 1]):
        i, dof = motions.node[k], motions.dof[k]
        target = motions.scale[k] * tables.now[1, motions.table[k]]
        before = motions.scale[k] * tables.now[0, motions.table[k]]
        if dof < 3:
            correction = target - nodes.velocity[dof, i]
            inv_mass = nodes.inv_mass[i]
            reaction = correction / (inv_mass * dt) if inv_mass > 0.0 else -nodes.force[dof, i]
            nodes.velocity[dof, i] = target
            nodes.position[dof, i] += dt * correction
            nodes.force[dof, i] += reaction
        elif dof == ALONG:
            reaction = _guide(nodes, i, dt, target, motions.axis[k])
        elif dof == ABOUT:
            reaction = _swivel(nodes, i, dt, target, motions.axis[k])
        else:
            correction = target - nodes.spin[dof - 3, i]
            inv_inertia = nodes.inv_inertia[i]
            reaction = correction / (inv_inertia * dt) if inv_inertia > 0.0 else -nodes.moment[dof - 3, i]
            _turn(nodes, i, -0.5 * dt)
            nodes.spin[dof - 3, i] = target
            _turn(nodes, i, 0.5 * dt)
        # work-conjugate to the table, whatever the scale
        tally.reaction[partition, motions.group[k]] += motions.scale[k] * reaction
        tally.support[partition, motions.group[k]] += reaction
        tally.energy[partition, 0] += reaction * 0.5 * (target + before) * dt


@njit(**PART)
def _guide(nodes, i, dt, target, axis):
    """Move node ``i`` along the unit vector ``axis`` (3,) with ``target`` [mm/ms]; returns the reaction [N]."""
    v, x, f = nodes.velocity, nodes.position, nodes.force
    correction = target - (v[0, i] * axis[0] + v[1, i] * axis[1] + v[2, i] * axis[2])
    inv_mass = nodes.inv_mass[i]
    along = f[0, i] * axis[0] + f[1, i] * axis[1] + f[2, i] * axis[2]
    reaction = correction / (inv_mass * dt) if inv_mass > 0.0 else -along
    for d in range(3):
        v[d, i] += correction * axis[d]
        x[d, i] += dt * correction * axis[d]
        f[d, i] += reaction * axis[d]
    return reaction


@njit(**PART)
def _swivel(nodes, i, dt, target, axis):
    """Turn node ``i`` about the unit vector ``axis`` (3,) with ``target`` [rad/ms]; returns the reaction [N mm]."""
    w, m = nodes.spin, nodes.moment
    correction = target - (w[0, i] * axis[0] + w[1, i] * axis[1] + w[2, i] * axis[2])
    inv_inertia = nodes.inv_inertia[i]
    about = m[0, i] * axis[0] + m[1, i] * axis[1] + m[2, i] * axis[2]
    reaction = correction / (inv_inertia * dt) if inv_inertia > 0.0 else -about
    _turn(nodes, i, -0.5 * dt)
    for d in range(3):
        w[d, i] += correction * axis[d]
    _turn(nodes, i, 0.5 * dt)
    return reaction


@njit(**PART)
def _turn(nodes, i, half):
    """Turn node ``i`` by its spin for the time 2 ``half``; back and forth again leaves it as it was.

    Rotations about different axes do not commute: corrections axis by axis would let a held node creep.
    """
    qw, qx, qy, qz = rows4(nodes.rotation)
    wx, wy, wz = rows3(nodes.spin)
    ax, ay, az = half * wx[i], half * wy[i], half * wz[i]
    qw[i], qx[i], qy[i], qz[i] = quaternion_step(qw[i], qx[i], qy[i], qz[i], ax, ay, az)
