"""A body keeps to its own number of threads, whatever the process has."""

import numba
import pytest

from knittest.kernels.threading import limit_threads
from knittest.pose import ALL, Body, Chain, PeriodicBody, PeriodicChain, round_section
from knittest.solve.pace import TRIES

YARN = round_section(modulus=60e3, diameter=0.75, density=2.5e-3)
MOST = int(numba.config.NUMBA_NUM_THREADS)


@pytest.mark.skipif(MOST < 2, reason="one core")
@pytest.mark.parametrize("asked", [None, 1])
def test_a_small_body_never_tries_more_threads(monkeypatch, asked):
    points = [(float(k), 0.0, 0.0) for k in range(21)]
    body = Body.of_chains([Chain(points, YARN)], threads=asked)
    for dof in ALL:
        body.boundary.move([0], dof)
    seen: list[int] = []
    monkeypatch.setattr(body.model, "step", lambda *arguments: seen.append(numba.get_num_threads()))
    with limit_threads(MOST):
        for _ in range(3 * TRIES):
            body.step(20)
        assert numba.get_num_threads() == MOST
    assert set(seen) == {1}


@pytest.mark.skipif(MOST < 2, reason="one core")
def test_a_cell_that_settles_keeps_to_its_own_and_leaves_those_of_the_process(monkeypatch):
    chain = PeriodicChain([(0.5 * k, 0.0, 0.0) for k in range(8)], YARN, along=0)
    body = PeriodicBody.of_cell([chain], [(4.0, 0.0, 0.0), (0.0, 4.0, 0.0)])
    seen: list[int] = []
    monkeypatch.setattr(body.model, "step", lambda *arguments: seen.append(numba.get_num_threads()))
    with limit_threads(MOST):
        body.settle(most_steps=500)
        assert numba.get_num_threads() == MOST
    assert set(seen) == {1}
