"""The loops of a step as compiled: no counting of references to arrays, no scattered stores."""

import re

import numpy as np
import pytest
from llvmlite.binding import get_host_cpu_features
from numba import njit, typeof
from test_plain_beam import Chain
from test_plain_contact import SMOOTH, Crossing
from test_tool_room import Fall

from knittest import pose
from knittest.kernels import beam, contact, contact_blocks, explicit, periodic, shell_blocks, tool_contact
from knittest.kernels.vec import ALLOCATING, KERNEL

COUNTS, SCATTER = re.compile("NRT_|atomicrmw"), "masked.scatter"
W = np.zeros(explicit.SCRATCH)
#: first-level cache of x86 cores since 2011, at the least
SETS, WAYS, LINE = 64, 8, 64
LATTICE = np.array([[3.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
PLACE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])


def _beams():
    chain = Chain()
    return beam.advance_beams, (0, 4, 0, 0.0, 1e-3, chain.nodes, chain.beams, W)


def _contacts():
    crossing = Crossing(SMOOTH)
    arguments = ((0, 1), 1e-3, crossing.nodes, crossing.contacts, np.ones(7), SMOOTH, None, None, W)
    return contact_blocks.contact_forces, arguments


def _spins():
    kernel, (*arguments, _, _, w) = _contacts()
    return kernel, (*arguments, True, True, w)


def _scatter():
    crossing = Crossing(SMOOTH)
    return contact_blocks.scatter_contacts, (0, crossing.nodes, crossing.contacts)


def _tools():
    fall = Fall()
    return tool_contact.touch_tools, (0, 0, 5, 1e-3, fall.nodes, fall.tools, fall.touch, fall.tally, W)


def _clear():
    return explicit._clear, (0, 5, Fall().nodes.force)


def _shells():
    nodes, shells, laminate = _square()
    return shell_blocks.shell_forces, (0, 1, 0.0, nodes, shells, laminate, W)


def _gather():
    nodes, shells, _ = _square()
    return shell_blocks.gather_shells, (0, 4, nodes, shells)


def _square():
    laminate = pose.linear_laminate((100.0, 100.0), (1.0, 1.0), 1.0, 1.0)
    model = pose.Body.of_shells(PLACE, np.array([[0, 1, 2, 3]]), laminate, 1e-3, 1.0).model
    return model.nodes, model.shells, model.laminate


def _cell():
    s = np.arange(4)[:, None] / 4
    yarns = [
        pose.PeriodicChain(s * side, pose.round_section(1e3, 0.5, 1e-3), along=k) for k, side in enumerate(LATTICE)
    ]
    return pose.PeriodicBody.of_cell(yarns, LATTICE).cell


def _images():
    cell = _cell()
    return periodic.move_images, (1e-3, cell.nodes, cell.images)


def _lattice():
    cell = _cell()
    going = pose.PeriodicBody(cell).start()
    last = (cell.tracker.contacts, None, cell.images, going.drive.tables, going.tally)
    return periodic.pull_lattice, (0, 1e-3, cell.nodes, cell.beams, *last)


CASES = (_beams, _contacts, _spins, _scatter, _tools, _clear, _shells, _gather, _images, _lattice)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__[1:])
def test_a_sweep_counts_no_references_and_scatters_no_stores(case):
    """Counts are atomic and shared between threads, one a reading of an array; a scatter stores lane by lane."""
    code = _compiled(*case(), KERNEL)
    assert not COUNTS.search(code)
    assert SCATTER not in code


@pytest.mark.parametrize("scratch", [beam, contact, tool_contact], ids=lambda m: m.__name__)
def test_rows_of_a_scratch_spread_over_the_sets_of_the_first_level_cache(scratch):
    """Of 64 sets of 8 lines: a column of the scratch must not put more lines into one than others leave room for."""
    stride = int(scratch.STRIDE)
    column = np.arange(scratch.SCRATCH // stride) * stride * W.itemsize // LINE % SETS
    assert np.bincount(column).max() <= 2
    assert scratch.SCRATCH * W.itemsize < 0.75 * SETS * WAYS * LINE


def test_the_search_finds_what_it_searches():
    """A kernel that may make arrays counts; a row read in a loop with a signed index is scattered to.

    The latter where the processor can: AVX2 cannot, and passes the tests above for nothing.
    """
    assert COUNTS.search(_compiled(*_scatter(), ALLOCATING))
    if not get_host_cpu_features().get("avx512f"):
        return
    assert SCATTER in _compiled(njit(_signed), (0, 5, np.zeros((3, 9))), KERNEL)


def _signed(start, stop, rows):
    for k in range(3):
        for i in range(start, stop):
            rows[k, i] = 0.0


def _compiled(kernel, arguments, options):
    fresh = njit(**{**options, "cache": False})(kernel.py_func)
    signature = tuple(typeof(a) for a in arguments)
    fresh.compile(signature)
    return fresh.inspect_llvm(signature)
