"""Yarn contact: Coulomb friction of crossing yarns, energy through an impact, breaks, determinism."""

import numba
import numpy as np
import pytest
from yarn_cases import Driver, card, clamp, yarns

LINE = np.arange(-5.0, 5.01, 0.45)


def crossing(run, gap=0.0, angle=90.0):
    """A fixed yarn along y and one across it, ``gap`` above touching."""
    a, zero = np.deg2rad(angle), np.zeros_like(LINE)
    lower = np.column_stack([zero, LINE, zero])
    upper = np.column_stack([LINE * np.sin(a), LINE * np.cos(a), zero + 0.75 + gap])
    return yarns(run, lower, upper)


def sliding_force(friction, angle, speed=2.0):
    """Mean drag over normal force [-] while a held, pressed yarn is drawn along y over the lower one."""
    model = crossing(card(f"fabric.contact.friction_coefficient={friction}"), gap=-0.02, angle=angle)
    drive = Driver(model)
    n = len(LINE)
    for node in range(2 * n):
        clamp(model, node)
    model.tracker.contacts.reach[:] = 0.75  # press: 0.02 mm of overlap is wanted here
    model.nodes.velocity[1, n : 2 * n] = speed
    drive.step(int(0.2 / speed / drive.dt))
    drags = []
    for _ in range(60):
        drive.step(200)
        force = model.tracker.contacts.force[:, : model.tracker.count].sum(axis=1)
        drags.append(abs(force[1]) / abs(force[2]))
    return np.mean(drags), np.std(drags)


@pytest.mark.parametrize(("friction", "angle"), [(0.3, 90.0), (0.1, 60.0)])
def test_sliding_yarns_drag_with_coulomb_friction(friction, angle):
    """The lower yarn is straight: drag along it is mu N, also while the contact walks from piece to piece."""
    mean, scatter = sliding_force(friction, angle)
    assert mean == pytest.approx(friction, rel=0.01)
    assert scatter < 0.01 * friction


def test_sticking_yarns_do_not_slide():
    """Below mu N the tangential spring holds: the drag stays under friction times normal force and grows linearly."""
    model = crossing(card("fabric.contact.friction_coefficient=0.5"), gap=-0.02)
    drive = Driver(model)
    n = len(LINE)
    for node in range(2 * n):
        clamp(model, node)
    model.tracker.contacts.reach[:] = 0.75
    model.nodes.velocity[1, n : 2 * n] = 0.01
    drive.step(round(0.005 / 0.01 / drive.dt))
    law = model.law
    force = model.tracker.contacts.force[:, : model.tracker.count].sum(axis=1)
    assert force[2] == pytest.approx(-law.normal * 0.02, rel=0.01)
    assert abs(force[1]) == pytest.approx(law.tangential * 0.005, rel=0.01)


def test_energy_through_an_impact_with_friction():
    model = crossing(card(), gap=0.05)
    n = len(LINE)
    model.nodes.velocity[2, n : 2 * n], model.nodes.velocity[1, n : 2 * n] = -20.0, 40.0
    drive = Driver(model)
    before = drive.energy()
    drive.step(1500)
    assert drive.tally.energy[:, 1].sum() > 0.05 * before  # friction did work
    assert drive.energy() == pytest.approx(before, rel=0.002)


def test_a_broken_piece_does_not_touch():
    model = crossing(card(), gap=-0.02)
    drive = Driver(model)
    model.tracker.contacts.reach[:] = 0.75
    drive.step(1)
    assert np.abs(model.tracker.contacts.force[2, : model.tracker.count]).max() > 1.0
    piece = int(model.tracker.contacts.piece[0, 0])
    model.beams.alive[piece] = 0.0
    drive.step(1)
    assert np.abs(model.tracker.contacts.force[:, : model.tracker.count]).max() == 0.0


def test_same_bits_at_one_and_two_threads():
    if numba.config.NUMBA_NUM_THREADS < 2:
        pytest.skip("one core")
    states = []
    for threads in (1, 2):
        numba.set_num_threads(threads)
        model = crossing(card(), gap=0.02)
        n = len(LINE)
        model.nodes.velocity[2, n : 2 * n], model.nodes.velocity[1, n : 2 * n] = -20.0, 40.0
        drive = Driver(model)
        drive.step(2000)
        states.append([a.tobytes() for a in (*model.nodes, *model.tracker.contacts)])
    assert states[0] == states[1]
