"""The one explicit driver: central differences with lumped masses, in two parallel sweeps a step.

Sweep 1 evaluates contacts and shells, each storing its own result; sweep 2 lets every partition of the nodes collect
what acts on it in a fixed order, adds its beams and integrates. The number of partitions is fixed, so the bits do not
depend on the number of threads.
"""

import numpy as np
from numba import njit, prange

from knittest.kernels import beam_blocks, contact_blocks
from knittest.kernels.beam_blocks import advance_beams, advance_free
from knittest.kernels.contact_blocks import contact_forces, scatter_contacts
from knittest.kernels.motion import impose_motions
from knittest.kernels.options import KERNEL, PARALLEL, PARTITIONS


#: work space of one partition, in floats
SCRATCH = max(beam_blocks.SCRATCH, contact_blocks.SCRATCH)


@njit(**KERNEL)
def _clear(start, stop, nodes):
    for k in range(3):
        for i in range(start, stop):
            nodes.force[k, i] = 0.0


@njit(**KERNEL)
def _contact_partition(p, count, dt, nodes, contacts, alive, law, tally, scratch):
    first, last = count * p // PARTITIONS, count * (p + 1) // PARTITIONS
    tally.energy[p, 1] += contact_forces(first, last, nodes, contacts, alive, law, 1.0 / dt, scratch[p])


@njit(**KERNEL)
def _advance_partition(p, time, dt, keep, nodes, parts, beams, contacts, motions, tally, scratch):
    _clear(parts.node[p], parts.node[p + 1], nodes)
    scatter_contacts(p, nodes, contacts)
    for k in range(parts.span_start[p], parts.span_start[p + 1]):
        start, stop, section = parts.span[k, 0], parts.span[k, 1], parts.span[k, 2]
        if section >= 0:
            tally.energy[p, 2] += advance_beams(start, stop, section, time, dt, keep, nodes, beams, scratch[p])
        else:
            advance_free(start, stop, dt, keep, nodes, scratch[p])
    impose_motions(p, time + 0.5 * dt, dt, nodes, motions, tally)


@njit(**PARALLEL)
def advance(steps, time, dt, keep, nodes, parts, beams, contacts, count, law, motions, tally, scratch):
    """Advance ``steps`` time steps of ``dt`` [ms] from ``time``.

    ``keep`` share of velocity that mass-proportional damping leaves in a step; ``count`` contacts in use; ``scratch``
    (PARTITIONS, n) work space. State is updated in place.
    """
    for step in range(steps):
        now = time + step * dt
        for p in prange(PARTITIONS):
            _contact_partition(np.int64(p), count, dt, nodes, contacts, beams.alive, law, tally, scratch)
        for p in prange(PARTITIONS):
            _advance_partition(np.int64(p), now, dt, keep, nodes, parts, beams, contacts, motions, tally, scratch)
