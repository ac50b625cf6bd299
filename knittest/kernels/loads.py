"""Forces and moments that keep their direction (gravity, point loads, follower-free moments)."""

from numba import njit

from knittest.kernels.options import INLINE, KERNEL, PART, U


@njit(**PART)
def load_now(value, table, tables):
    """``value`` times a table at the instant of the forces, between the middles of two steps."""
    return value * 0.5 * (tables.now[0, table] + tables.now[1, table])


@njit(**INLINE)
def _work(first, count, factor, value, rate):
    """Sum of ``factor`` times the entries of ``value`` (count,) times the rates of the nodes from ``first`` on."""
    work = 0.0
    for k in range(U(count)):
        work += factor * value[k] * rate[U(first) + k]
    return work


@njit(**INLINE)
def _guided_work(first, count, factor, value, nodes, dof):
    """:func:`_work` of the damping towards a guide, times the step."""
    work, rate = 0.0, nodes.velocity[dof]
    for k in range(U(count)):
        i = U(first) + k
        work += factor * value[k] * (1.0 - nodes.damping_factor[i]) * rate[i]
    return work


@njit(**PART)
def _gain(dt, table, tables):
    """Rise of a guide's velocity over the step [1/ms], at a table in units of the velocity."""
    return (tables.now[1, table] - tables.now[0, table]) / dt


@njit(**KERNEL)
def apply_loads(partition, dt, nodes, loads, tables, tally):
    """Add the loads of one partition before its nodes are integrated; books the first half of their work [mJ].

    Moments act on the spin at once, divided by the damping that follows, so that they balance exactly at rest. Damping
    v -> f v towards a guide's velocity u is v -> f v + (1 - f) u: a force m (1 - f) u / dt. The guide accelerates the
    nodes too, by m du/dt.
    """
    work, guided = 0.0, 0.0
    for run in range(loads.start[partition], loads.start[partition + 1]):
        first, count, dof = loads.node[run], loads.length[run], loads.dof[run]
        factor, value = load_now(1.0, loads.table[run], tables), loads.value[loads.at[run] :]
        if loads.guides[run] == 1:
            force, gain = nodes.force[dof], _gain(dt, loads.table[run], tables)
            for k in range(U(count)):
                i = U(first) + k
                force[i] += value[k] * (factor * (1.0 - nodes.damping_factor[i]) / dt + gain)
            guided += _guided_work(first, count, factor, value, nodes, dof)
            work += _work(first, count, gain, value, nodes.velocity[dof])
        elif dof < 3:
            force = nodes.force[dof]
            for k in range(U(count)):
                force[U(first) + k] += factor * value[k]
            work += _work(first, count, factor, value, nodes.velocity[dof])
        else:
            spin = nodes.spin[dof - 3]
            work += _work(first, count, factor, value, spin)
            for k in range(U(count)):
                i = U(first) + k
                spin[i] += factor * value[k] * nodes.inv_inertia[i] * dt / nodes.damping_factor[i]
    tally.energy[partition, 0] += 0.5 * dt * work
    tally.energy[partition, 8] += 0.5 * guided


@njit(**KERNEL)
def book_loads(partition, dt, nodes, loads, tables, tally):
    """Second half of the work, with the velocities after the step."""
    work, guided = 0.0, 0.0
    for run in range(loads.start[partition], loads.start[partition + 1]):
        first, count, dof = loads.node[run], loads.length[run], loads.dof[run]
        factor, value = load_now(1.0, loads.table[run], tables), loads.value[loads.at[run] :]
        if loads.guides[run] == 1:
            guided += _guided_work(first, count, factor, value, nodes, dof)
            gain = _gain(dt, loads.table[run], tables)
            work += _work(first, count, gain, value, nodes.velocity[dof])
        else:
            work += _work(first, count, factor, value, nodes.velocity[dof] if dof < 3 else nodes.spin[dof - 3])
    tally.energy[partition, 0] += 0.5 * dt * work
    tally.energy[partition, 8] += 0.5 * guided
