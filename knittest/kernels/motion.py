"""Prescribed velocities: applied after the free step, with reaction and work."""

from numba import njit

from knittest.kernels.beam import quaternion_step
from knittest.kernels.drive_state import ABOUT, ALONG
from knittest.kernels.options import PART
from knittest.kernels.rows import rows3, rows4


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
