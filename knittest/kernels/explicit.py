"""The one explicit driver: central differences with lumped masses, in two parallel sweeps a step.

Sweep 1 evaluates contacts or shells, each storing its own result; sweep 2 lets every partition of the nodes collect
what acts on it in a fixed order and integrates. The number of partitions is fixed, so the bits do not depend on the
number of threads. A run compiles only what it uses: yarns and shells, one thread and several have an entry each; what
resists ``spin`` at crossings, ``oval`` sections, ``pairs`` of soft yarns, the ``images`` of a periodic cell and
``tools`` are None where there are none, and their branches are cut before they are compiled.
"""

import numpy as np
from numba import njit, prange

from knittest.kernels import beam, contact, in_plane_blocks, loads, shell_state, tool_contact
from knittest.kernels.beam import advance_beams, advance_free
from knittest.kernels.contact_blocks import contact_forces, scatter_contacts
from knittest.kernels.flattening import flatten, follow_sections
from knittest.kernels.in_plane_blocks import bend_forces, gather_bends
from knittest.kernels.loads import apply_loads, book_loads, impose_motions
from knittest.kernels.periodic import move_images, pull_lattice
from knittest.kernels.section_blocks import turn_sections
from knittest.kernels.sheet_contact import scatter_sheet, sheet_forces
from knittest.kernels.shell_blocks import gather_shells, shell_forces
from knittest.kernels.shell_state import BLOCK
from knittest.kernels.soft_contact import gather_pairs, press_pairs
from knittest.kernels.threading import claim, next_partition
from knittest.kernels.tool_contact import forget_rooms, move_tools, touch_tools
from knittest.kernels.vec import KERNEL, PARALLEL, PART, PARTITIONS, U, read_tables, rows3

#: work space of one thread, in floats
SCRATCH = max(m.SCRATCH for m in (beam, contact, shell_state, in_plane_blocks, tool_contact, loads))


@njit(**KERNEL)
def _clear(start, stop, rows):
    for row in rows3(rows):
        for k in range(U(stop - start)):
            row[U(start) + k] = 0.0


@njit(**KERNEL)
def contact_share(p, count, dt, nodes, contacts, alive, law, spin, oval, tally, w):
    """Evaluate the yarn contacts of share ``p`` and book what they lose."""
    share = count * p // PARTITIONS, count * (p + 1) // PARTITIONS
    rubbed, spun, damped = contact_forces(share, dt, nodes, contacts, alive, law, spin, oval, w)
    tally.energy[p, 1] += rubbed
    tally.energy[p, 3] += damped
    tally.energy[p, 4] += spun


@njit(**PART)
def sheet_share(p, dt, nodes, shells, sheet, count, law, contacts, tally):
    """Evaluate the contacts of shells of share ``p`` and book what they lose."""
    first, last = count * p // PARTITIONS, count * (p + 1) // PARTITIONS
    rubbed, damped = sheet_forces(first, last, dt, nodes, shells, sheet, law, contacts)
    tally.energy[p, 1] += rubbed
    tally.energy[p, 3] += damped


@njit(**KERNEL)
def shell_share(p, time, nodes, shells, laminate, bends, tally, w):
    """Evaluate the shells of share ``p`` and the bending of their fibres, and book what they lose."""
    blocks = shells.conn.shape[0] // BLOCK
    first, last = blocks * p // PARTITIONS, blocks * (p + 1) // PARTITIONS
    lost, rubbed = shell_forces(first, last, time, nodes, shells, laminate, w)
    blocks = bends.first.size - 1
    first, last = blocks * p // PARTITIONS, blocks * (p + 1) // PARTITIONS
    bends.broken[p] += lost  # whether another partition sees it now or in the next step, it cuts in the next
    lost += bend_forces(first, last, time, nodes, shells.fail_time, bends, w)
    tally.energy[p, 1] += rubbed
    tally.energy[p, 2] += lost
    tally.energy[p, 6] += rubbed


@njit(**KERNEL)
def apply_outside_forces(p, dt, nodes, parts, tables, loads, tools, touch, tally, w):
    """Forces of tools and loads on the nodes of one partition."""
    if tools is not None:
        touch_tools(p, parts.node[p], parts.node[p + 1], dt, nodes, tools, touch, tally, w)
    apply_loads(p, dt, nodes, loads, tables, tally, w)


@njit(**PART)
def _yarn_share(
    p, time, dt, nodes, parts, beams, contacts, pairs, oval, tables, motions, loads, tools, touch, tally, w
):  # fmt: skip
    _clear(parts.node[p], parts.node[p + 1], nodes.force)
    _clear(parts.node[p], parts.node[p + 1], nodes.moment)
    scatter_contacts(p, nodes, contacts)
    if pairs is not None:
        gather_pairs(parts.node[p], parts.node[p + 1], nodes, pairs)
    apply_outside_forces(p, dt, nodes, parts, tables, loads, tools, touch, tally, w)
    for k in range(parts.span_start[p], parts.span_start[p + 1]):
        start, stop, section = parts.span[k, 0], parts.span[k, 1], parts.span[k, 2]
        tally.energy[p, 2] += advance_beams(start, stop, section, time, dt, nodes, beams, w)
    impose_motions(p, dt, nodes, motions, tables, tally)
    book_loads(p, dt, nodes, loads, tables, tally, w)
    if oval is not None:
        turn_sections(parts.node[p], parts.node[p + 1], nodes, contacts)
        if contacts.shape.shape[1] > 0:
            tally.energy[p, 3] += flatten(parts.node[p], parts.node[p + 1], beams, contacts)


@njit(**PART)
def _fabric_share(p, dt, nodes, parts, shells, bends, count, contacts, tables, motions, loads, tools, touch, tally, w):
    start, stop = parts.node[p], parts.node[p + 1]
    _clear(start, stop, nodes.force)
    _clear(start, stop, nodes.moment)
    gather_shells(start, stop, nodes, shells)
    if bends.alive.size > 0:
        gather_bends(start, stop, nodes, bends)
    scatter_sheet(p, start, stop, count, nodes, shells, contacts)
    apply_outside_forces(p, dt, nodes, parts, tables, loads, tools, touch, tally, w)
    advance_free(start, stop, dt, nodes, w)
    impose_motions(p, dt, nodes, motions, tables, tally)
    book_loads(p, dt, nodes, loads, tables, tally, w)


@njit(**KERNEL)
def advance_yarns_alone(
    steps, time, dt, nodes, parts, beams, contacts, count, law, pairs, soft, spin, oval, images, tables, motions, loads,
    tools, touch, tally, scratch,
):  # fmt: skip
    """:func:`advance_yarns` on one thread, without parallel loops and claims."""
    if tools is not None:
        forget_rooms(touch)
    w = scratch[0]
    for step in range(steps):
        now = time + step * dt
        read_tables(tables, now - 0.5 * dt, now + 0.5 * dt)
        if count > 0:
            for p in range(PARTITIONS):
                contact_share(p, count, dt, nodes, contacts, beams.alive, law, spin, oval, tally, w)
        if pairs is not None:
            for p in range(PARTITIONS):
                press_pairs(p, dt, nodes, pairs, soft, tally)
        if images is not None:
            pull_lattice(count, dt, nodes, beams, contacts, pairs, images, tables, tally)
        for p in range(PARTITIONS):
            if parts.node[p] < parts.node[p + 1]:
                _yarn_share(
                    p, now, dt, nodes, parts, beams, contacts, pairs, oval, tables, motions, loads, tools, touch,
                    tally, w,
                )  # fmt: skip
        if images is not None:
            move_images(dt, nodes, images)
            if oval is not None:
                follow_sections(nodes, images, contacts)
        if tools is not None:
            move_tools(dt, tools, tables, tally)


@njit(**PARALLEL)
def advance_yarns(
    threads, steps, time, dt, nodes, parts, beams, contacts, count, law, pairs, soft, spin, oval, images, tables,
    motions, loads, tools, touch, tally, scratch,
):  # fmt: skip
    """Advance a model of beam chains by ``steps`` time steps of ``dt`` [ms] from ``time`` [ms].

    ``threads`` is the number of threads, more than one, ``count`` that of contacts in use. ``pairs`` of soft yarns
    touch by the law ``soft``, both None where there are none. ``tables`` to ``touch`` are the fields of :class:`Drive`
    (parallel loops take no nested tuples); ``scratch`` is (PARTITIONS, SCRATCH). State is updated in place.
    """
    if tools is not None:
        forget_rooms(touch)
    threads, claimed = min(threads, PARTITIONS), np.zeros(PARTITIONS, np.int64)
    for step in range(steps):
        now = time + step * dt
        read_tables(tables, now - 0.5 * dt, now + 0.5 * dt)
        for thread in prange(threads):
            for k in range(PARTITIONS):
                p = next_partition(k, thread, threads)
                if claim(claimed, p, 2 * step + 1):
                    contact_share(p, count, dt, nodes, contacts, beams.alive, law, spin, oval, tally, scratch[thread])
                    if pairs is not None:
                        press_pairs(p, dt, nodes, pairs, soft, tally)
        if images is not None:
            pull_lattice(count, dt, nodes, beams, contacts, pairs, images, tables, tally)
        for thread in prange(threads):
            for k in range(PARTITIONS):
                p = next_partition(k, thread, threads)
                if claim(claimed, p, 2 * step + 2):
                    _yarn_share(
                        p, now, dt, nodes, parts, beams, contacts, pairs, oval, tables, motions, loads, tools, touch,
                        tally, scratch[thread],
                    )  # fmt: skip
        if images is not None:
            move_images(dt, nodes, images)
            if oval is not None:
                follow_sections(nodes, images, contacts)
        if tools is not None:
            move_tools(dt, tools, tables, tally)


@njit(**KERNEL)
def advance_fabric_alone(
    steps, time, dt, nodes, parts, shells, laminate, bends, sheet, contacts, count, law, tables, motions, loads, tools,
    touch, tally, scratch,
):  # fmt: skip
    """:func:`advance_fabric` on one thread; as :func:`advance_yarns_alone`."""
    if tools is not None:
        forget_rooms(touch)
    w = scratch[0]
    for step in range(steps):
        now = time + step * dt
        read_tables(tables, now - 0.5 * dt, now + 0.5 * dt)
        if count > 0:
            for p in range(PARTITIONS):
                sheet_share(p, dt, nodes, shells, sheet, count, law, contacts, tally)
        for p in range(PARTITIONS):
            shell_share(p, now, nodes, shells, laminate, bends, tally, w)
        for p in range(PARTITIONS):
            if parts.node[p] < parts.node[p + 1]:
                _fabric_share(
                    p, dt, nodes, parts, shells, bends, count, contacts, tables, motions, loads, tools, touch, tally, w
                )
        if tools is not None:
            move_tools(dt, tools, tables, tally)


@njit(**PARALLEL)
def advance_fabric(
    threads, steps, time, dt, nodes, parts, shells, laminate, bends, sheet, contacts, count, law, tables, motions,
    loads, tools, touch, tally, scratch,
):  # fmt: skip
    """Advance a model of shells; arguments as in :func:`advance_yarns`.

    ``count`` of the ``contacts`` of ``sheet`` with itself are in use, by ``law``
    (:mod:`knittest.kernels.sheet_surface`).
    """
    if tools is not None:
        forget_rooms(touch)
    threads, claimed = min(threads, PARTITIONS), np.zeros(PARTITIONS, np.int64)
    for step in range(steps):
        now = time + step * dt
        read_tables(tables, now - 0.5 * dt, now + 0.5 * dt)
        if count > 0:  # before any shell is deleted in this step
            for thread in prange(threads):
                for k in range(PARTITIONS):
                    p = next_partition(k, thread, threads)
                    if claim(claimed, p, 3 * step + 1):
                        sheet_share(p, dt, nodes, shells, sheet, count, law, contacts, tally)
        for thread in prange(threads):
            for k in range(PARTITIONS):
                p = next_partition(k, thread, threads)
                if claim(claimed, p, 3 * step + 2):
                    shell_share(p, now, nodes, shells, laminate, bends, tally, scratch[thread])
        for thread in prange(threads):
            for k in range(PARTITIONS):
                p = next_partition(k, thread, threads)
                if claim(claimed, p, 3 * step + 3):
                    _fabric_share(
                        p, dt, nodes, parts, shells, bends, count, contacts, tables, motions, loads, tools, touch,
                        tally, scratch[thread],
                    )  # fmt: skip
        if tools is not None:
            move_tools(dt, tools, tables, tally)
