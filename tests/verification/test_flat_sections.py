"""Chains with two bending stiffnesses: lateral-torsional buckling of strips, bending about each axis, what is refused.

Gradient, balance and objectivity are judged in ``tests/unit/test_plain_beam.py``.
"""

from math import sqrt

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.pose import ALL, Body, Chain, round_section, section, strip_section

STRIP = strip_section(modulus=1000.0, width=5.0, thickness=0.25, density=1e-3)
LENGTH, UP = 60.0, np.array([0.0, 0.0, 1.0])
#: the strip stands on its edge: bends about y with the EI of its width, about z with that of its thickness
NORMAL = np.array([0.0, 1.0, 0.0])
LATERAL = sqrt(STRIP.bending * STRIP.torsion)  # [N mm2]


def strip(n: int, **options: float) -> Body:
    points = np.column_stack([np.linspace(0.0, LENGTH, n + 1), np.zeros(n + 1), np.zeros(n + 1)])
    return Body.of_chains([Chain(points, STRIP, normal=NORMAL)], **options)


def test_section_of_a_strip():
    """EI of both axes; GJ = G w t^3 k with k = 0.1406 for a square and 0.3123 for 10 : 1 (Timoshenko & Goodier)."""
    assert STRIP.across / STRIP.bending == pytest.approx(400.0)
    assert STRIP.bending == pytest.approx(1000.0 * 5.0 * 0.25**3 / 12.0)
    for ratio, factor in ((1.0, 0.1406), (2.0, 0.2287), (10.0, 0.3123)):
        card = strip_section(2600.0, ratio, 1.0, 1e-3)
        assert card.torsion == pytest.approx(1000.0 * ratio * factor, rel=5e-4)


def test_strip_on_two_forks_buckles_under_end_moments():
    """M = pi sqrt(EI GJ) / L (Timoshenko & Gere 1961, 6.3), from the sags under a sine of side load with half of M^2
    and without: w = w0 / (1 - (M / Mcr)^2). Bending in the plane adds EI / EI' = 0.3 %, elements (pi / n)^2 / 6.
    """
    n, critical, sag = 16, np.pi * LATERAL / LENGTH, []
    for moment in (0.0, sqrt(0.5) * critical):
        body = strip(n)
        body.boundary.move([0], ("x", "y", "z", "rx"))
        body.boundary.move([n], ("y", "z", "rx"))
        body.boundary.load([0], "ry", moment)
        body.boundary.load([n], "ry", -moment)
        body.boundary.load(np.arange(1, n), "y", 1e-4 / n * np.sin(np.pi * np.arange(1, n) / n))
        body.relax(tolerance=1e-6)
        sag.append(body.position[n // 2, 1])
    assert sqrt(0.5) * critical / sqrt(1.0 - sag[0] / sag[1]) == pytest.approx(critical, rel=0.01)


def test_cantilever_strip_buckles_under_its_tip_load():
    """P = 4.013 sqrt(EI GJ) / L^2 (Prandtl 1899; Timoshenko & Gere 1961, 6.3), from the turns of the tip under a small
    side load at 0.8 and 0.9 of it: P / turn falls with P^2 to 0. Errors as under end moments.
    """
    n, critical, soft = 16, 4.013 * LATERAL / LENGTH**2, []
    loads = np.array([0.8, 0.9]) * critical
    for load in loads:
        body = strip(n)
        body.boundary.move([0], ALL)
        body.boundary.load([n], "z", -load)
        body.boundary.load([n], "y", 1e-3 * load)
        body.relax(tolerance=1e-7)
        soft.append(load**2 / (2.0 * body.rotation[n, 1]))  # side load in proportion to P
    root = loads[1] ** 2 + soft[1] * (loads[1] ** 2 - loads[0] ** 2) / (soft[0] - soft[1])
    assert sqrt(root) == pytest.approx(critical, rel=0.01)


@pytest.mark.parametrize(("dof", "axis", "stiffness"), [("y", 1, STRIP.bending), ("z", 2, STRIP.across)])
def test_strip_bends_about_each_axis(dof, axis, stiffness):
    """F L^3 / (3 EI) with shear, F L / GA; its moment is that about the normal or across it."""
    body = strip(16)
    body.boundary.move([0], ALL)
    force = 1e-3 * stiffness / LENGTH**2
    body.boundary.load([16], dof, force)
    body.relax(tolerance=1e-6)
    exact = force * LENGTH**3 / (3.0 * stiffness) + force * LENGTH / STRIP.shear
    assert body.position[16, axis] == pytest.approx(exact, rel=3e-3)
    fields, middle = body.fields(), LENGTH * (np.arange(16) + 0.5) / 16
    bent = np.abs(fields["bending_normal"])
    assert fields["bending"] == pytest.approx(force * (LENGTH - middle), rel=2e-3)
    assert bent == pytest.approx(fields["bending"] if dof == "z" else 0.0, abs=1e-3 * force * LENGTH)


@pytest.mark.parametrize("degree_of_set", [0.0, 0.4])
@pytest.mark.parametrize("lean", [0.0, 0.5, 0.5 * np.pi])
def test_arc_of_a_strip_stores_what_is_not_set(lean, degree_of_set):
    """U = (EI' cos^2 + EI sin^2) ((1 - set) / R)^2 L / 2 with the normal leaning by an angle from the axis of the arc;
    half a curvature is missing at each end.
    """
    n, radius, length = 200, 20.0, 30.0
    turn = np.linspace(0.0, length / radius, n + 1)
    points = radius * np.column_stack([np.sin(turn), 1.0 - np.cos(turn), np.zeros(n + 1)])
    chord = np.diff(points, axis=0)
    inward = np.cross(UP, chord / np.linalg.norm(chord, axis=1, keepdims=True))
    normal = np.cos(lean) * UP + np.sin(lean) * inward
    body = Body.of_chains([Chain(points, STRIP, normal=normal, degree_of_set=degree_of_set)])
    stiffness = STRIP.across * np.cos(lean) ** 2 + STRIP.bending * np.sin(lean) ** 2
    exact = 0.5 * stiffness * ((1.0 - degree_of_set) / radius) ** 2 * length
    assert body.model.stored_energies().internal.sum() == pytest.approx(exact, rel=2.0 / n)


def test_the_step_holds_for_a_strip_on_edge():
    """The width's EI decides the rotary inertia: a strip shaken by each node's own spin does not gain
    by orders; sums at full and half steps differ where all modes move at the limit.
    """
    body = strip(30)
    body.spin[:] = np.random.default_rng(1).normal(0.0, 1.0, (31, 3))
    shaken = 0.5 * float((body.model.inertia[:, None] * body.spin**2).sum())
    body.step(4000)
    energies = body.energies()
    assert energies["kinetic"] + energies["internal"] < 3.0 * shaken


def test_round_sections_keep_their_bits():
    """A section with the same EI twice is round: every bit of its motion is that of the one with one EI."""
    card = round_section(modulus=600.0, diameter=0.75, density=2.5e-3)
    twice = section(
        card.axial, card.bending, card.radius, card.linear_density, torsion=card.torsion, across=card.bending
    )
    points = np.column_stack([np.linspace(0.0, 10.0, 13), np.zeros(13), np.zeros(13)])
    found = []
    for chain in (Chain(points, card), Chain(points, twice, normal=UP)):
        body = Body.of_chains([chain])
        body.velocity[:] = np.random.default_rng(2).normal(0.0, 1.0, (13, 3))
        body.step(500)
        found.append(body.position.tobytes() + body.rotation.tobytes())
    assert found[0] == found[1]


LINE = np.column_stack([np.linspace(0.0, 1.0, 4), np.zeros(4), np.zeros(4)])
REFUSED = {
    "no torsion": (lambda: section(1.0, 1.0, 0.1, 1e-3, across=2.0), "needs torsion"),
    "no stiffness": (lambda: section(1.0, 1.0, 0.1, 1e-3, torsion=1.0, across=0.0), "across must be above 0"),
    "upright": (lambda: strip_section(1.0, 1.0, 2.0, 1e-3), "thickness above 0 up to the width 1 mm, got 2"),
    "no normal": (lambda: Body.of_chains([Chain(LINE, STRIP)]), "chain 0: a section with two bending stiffnesses"),
    "along": (lambda: Body.of_chains([Chain(LINE, STRIP, normal=[2.0, 0.0, 0.0])]), "along the chain at element 0"),
    "shape": (lambda: Body.of_chains([Chain(LINE, STRIP, normal=np.ones((4, 3)))]), r"expected the shape \(3\) or"),
    "nan": (lambda: Body.of_chains([Chain(LINE, STRIP, normal=[0.0, np.nan, 1.0])]), "normal of chain 0: not finite"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_no_strip_can_be_made_of_is_refused(name):
    make, message = REFUSED[name]
    with pytest.raises(InputError, match=message):
        make()
