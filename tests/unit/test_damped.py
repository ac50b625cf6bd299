"""Chunks of a relaxation: what is out of balance in them, how far they drift, and what they leave to the model."""

import numpy as np
import pytest

from knittest.pose import Body, Chain, round_section
from knittest.solve.damped_model import CHUNK, Chunk, DampedModel
from knittest.solve.relaxation import AT_THE_END, Relaxation

SPIN = 0.02


@pytest.fixture
def rod() -> tuple[DampedModel, np.ndarray]:
    """A straight rod along x, damped, that turns about its axis as a whole; its spin before the first chunk."""
    points = np.column_stack([np.arange(5.0), np.zeros(5), np.zeros(5)])
    body = Body.of_chains([Chain(points, round_section(modulus=2e3, diameter=0.5, density=1.5e-3))])
    going = body.start()
    body.model.nodes.damping_factor[:] = 0.75
    damped = DampedModel(body.model, going.drive, going.tally, body.dt, AT_THE_END)
    body.model.nodes.spin[0, :5] = SPIN
    return damped, body.model.nodes.spin


def test_a_spin_that_only_damping_slows_is_in_balance(rod):
    damped, spin = rod
    before = float(np.abs(damped.model.inertia).sum() * SPIN / damped.dt)
    chunk = damped.advance()
    assert chunk.steps == CHUNK
    assert 0.0 < spin[0, 2] < SPIN * np.exp(-2.0 * 0.05 * (CHUNK - 1))
    assert chunk.force < 1e-9 * before


def test_the_only_system_of_a_body_gives_its_yarns_one_name(rod):
    assert rod[0].model.name_of(2) == "yarn 1"


def test_it_is_left_at_rest_with_its_own_damping(rod):
    damped, spin = rod
    damped.advance()
    damped.release()
    assert (spin == 0.0).all() and (damped.model.nodes.damping_factor == 0.75).all()


def test_a_chunk_is_judged_by_what_acts_and_drifts_for_a_period():
    found, chunk = Relaxation(), Chunk(steps=40, force=2.0, moved=0.1, frequency=0.04)
    found.add(chunk, 8.0)
    found.add(Chunk(30, 1.0, 0.05, 0.04), 8.0)
    assert (found.steps, found.last_chunk, found.residual) == (70, 30, 0.125)
    assert found.history == [(40, 0.25, 0.1, 0.04), (70, 0.125, 0.05, 0.04)]
    assert chunk.drift == pytest.approx(0.1 * 2.0 * np.pi / 0.04 / 40)
