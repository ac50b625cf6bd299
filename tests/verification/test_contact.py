"""Contact of yarns against closed forms, each with its source in ``cases/yarn_contact.py``; sticking; breaks."""

import numpy as np
import pytest
from cases import yarn_contact
from yarn_cases import Driver, card, clamp, yarns

LINE = np.arange(-5.0, 5.01, 0.45)


def crossing(run, gap=0.0, angle=90.0):
    """A fixed yarn along y and one across it, ``gap`` above touching."""
    a, zero = np.deg2rad(angle), np.zeros_like(LINE)
    lower = np.column_stack([zero, LINE, zero])
    upper = np.column_stack([LINE * np.sin(a), LINE * np.cos(a), zero + 0.75 + gap])
    return yarns(run, lower, upper)


@pytest.mark.parametrize(("friction", "angle"), [(0.3, 90.0), (0.1, 60.0)])
def test_crossing_yarns_drag_with_coulomb_friction(friction, angle):
    """The pressure swings by its critical damping of 10 %: a mean over five elements is good to 0.5 %."""
    assert abs(yarn_contact.crossing(friction, angle).error) < 5e-3


def test_capstan():
    """mu pi d^2 / 12 (1 + mu^2) = 0.1 % at d = pi / 24, and 0.06 % by damping, which bends the order."""
    (row,) = yarn_contact.capstan()
    assert abs(row.error) < 2e-3
    assert row.order == pytest.approx(2.0, abs=0.5)


@pytest.mark.parametrize(
    "case", [{"friction": 0.2}, {"friction": 0.3}, {"friction": 0.3, "first": False}, {"friction": 0.3, "rise": 0.1}]
)
def test_capstan_of_a_yarn_on_a_yarn(case):
    """One contact would run along the wrap, let the rest sink in, and end in no number."""
    assert abs(yarn_contact.wrapped(**case).error) < 1e-2


@pytest.mark.parametrize(
    ("friction", "coarse", "fine"), [(0.1, -0.0011, 0.0116), (0.3, -0.0133, 0.0225), (0.5, 0.0289, 0.0338)]
)
def test_capstan_of_yarns_of_one_radius_is_off_by_what_limits_say(friction, coarse, fine):
    """T2 / T1 over half a turn exceeds its closed form by ``coarse`` on pieces of 15 and ``fine`` on pieces of 7.5 deg.

    A limit, not a tolerance: an error that grows is a fault, and one that falls makes docs/limits.md out of date. The
    tension swings by 1 % while an element passes, so the mean is good to 0.3 %. The error of coarse pieces depends on
    when the search finds that a piece lies along another yarn.
    """
    for n, error in ((12, coarse), (24, fine)):
        row = yarn_contact.wrapped(friction, n, drum=0.1)
        assert row.error == pytest.approx(error, abs=3e-3)


def test_exponent_of_the_capstan_solves_the_equations_of_a_limp_yarn():
    """Pressure, shear and tension in proportion to exp(a theta), by differences of a fine grid."""
    mu, drum, size = 0.5, 0.1, 0.1
    theta = np.linspace(0.0, 1.0, 2001)
    pressure = np.exp(yarn_contact.capstan_exponent(mu, drum, size) * theta)
    shear = mu * pressure * size
    tension = pressure * (drum + size) + np.gradient(shear, theta)
    assert np.gradient(tension, theta)[2:-2] == pytest.approx(mu * pressure[2:-2] * drum, rel=1e-5)


def test_a_body_on_an_incline_slips_at_the_static_coefficient_and_slides_at_the_kinetic_one():
    """Slip is seen 0.1 degrees late; the acceleration is exact but for the swing of the pressure."""
    angle, acceleration = yarn_contact.incline()
    assert 0.0 <= angle.error < 0.006
    assert abs(acceleration.error) < 1e-6


def test_an_elastic_impact_keeps_momentum_and_energy():
    """Velocities to 1e-3 (vibration), momentum to rounding, energy to a few (omega dt)^2 of the contact, 1e-6."""
    light, heavy, momentum, energy, rubbed = yarn_contact.impact()
    assert abs(light.error) < 1e-3
    assert abs(heavy.error) < 1e-3
    assert momentum.error < 1e-13
    assert abs(energy.error) < 5e-6
    assert energy.order > 1.0
    assert "22 % lost" in rubbed.case
    # a contact that slides along its yarns gains no depth by it: that is not booked, and falls with the step
    assert abs(rubbed.error) < 3e-5


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
