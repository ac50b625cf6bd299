"""Forces and moments that keep their direction (gravity, point loads, follower-free moments)."""

from numba import njit

from knittest.kernels.options import KERNEL


@njit(**KERNEL)
def load_now(value, table, tables):
    """``value`` times a table at the instant of the forces, between the middles of two steps."""
    return value * 0.5 * (tables.now[0, table] + tables.now[1, table])


@njit(**KERNEL)
def apply_loads(partition, dt, nodes, loads, tables, tally):
    """Add the loads of one partition before its nodes are integrated; books the first half of their work [mJ].

    Moments act on the spin at once, divided by the damping that follows, so that they balance exactly at rest.
    """
    work = 0.0
    for k in range(loads.start[partition], loads.start[partition + 1]):
        i, dof = loads.node[k], loads.dof[k]
        value = load_now(loads.value[k], loads.table[k], tables)
        if dof < 3:
            nodes.force[dof, i] += value
            work += value * nodes.velocity[dof, i]
        else:
            work += value * nodes.spin[dof - 3, i]
            nodes.spin[dof - 3, i] += value * nodes.inv_inertia[i] * dt / nodes.keep[i]
    tally.energy[partition, 0] += 0.5 * dt * work


@njit(**KERNEL)
def book_loads(partition, dt, nodes, loads, tables, tally):
    """Second half of the work, with the velocities after the step."""
    work = 0.0
    for k in range(loads.start[partition], loads.start[partition + 1]):
        i, dof = loads.node[k], loads.dof[k]
        value = load_now(loads.value[k], loads.table[k], tables)
        rate = nodes.velocity[dof, i] if dof < 3 else nodes.spin[dof - 3, i]
        work += value * rate
    tally.energy[partition, 0] += 0.5 * dt * work
