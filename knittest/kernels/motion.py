"""Prescribed velocities: smooth-step tables, applied after the free step, with reaction and work."""

from numba import njit

from knittest.kernels.options import INLINE, KERNEL


@njit(**INLINE)
def smooth_step(u):
    """Quintic 10 u^3 - 15 u^4 + 6 u^5 on [0, 1]: velocity without jumps in acceleration or its rate."""
    u = min(max(u, 0.0), 1.0)
    return u * u * u * (10.0 - u * (15.0 - 6.0 * u))


@njit(**KERNEL)
def table_velocity(motions, m, time):
    """Velocity [mm/ms] of motion ``m`` at ``time`` [ms]; constant outside its table."""
    knots = motions.time[m]
    values = motions.velocity[m]
    for k in range(knots.size - 1):
        if time < knots[k + 1]:
            share = smooth_step((time - knots[k]) / (knots[k + 1] - knots[k]))
            return values[k] + (values[k + 1] - values[k]) * share
    return values[knots.size - 1]


@njit(**KERNEL)
def impose_motions(partition, time, dt, nodes, motions, tally):
    """Replace free velocities by the prescribed ones at mid-step ``time``; tally reactions [N] and work [mJ]."""
    for k in range(motions.start[partition], motions.start[partition + 1]):
        i, axis, m = motions.node[k], motions.dof[k], motions.motion[k]
        target = table_velocity(motions, m, time)
        before = table_velocity(motions, m, time - dt)
        correction = target - nodes.velocity[axis, i]
        nodes.velocity[axis, i] = target
        nodes.position[axis, i] += dt * correction
        inv_mass = nodes.inv_mass[i]
        reaction = correction / (inv_mass * dt) if inv_mass > 0.0 else -nodes.force[axis, i]
        tally.reaction[partition, m] += reaction
        tally.energy[partition, 0] += reaction * 0.5 * (target + before) * dt
