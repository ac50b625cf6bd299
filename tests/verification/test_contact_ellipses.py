"""Ellipses in contact by hand-posed yarns: one rocks on its flank as a rigid body does, and no energy is made of it."""

from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from knittest.models.yarn_model import YarnModel
from knittest.pose import ALL, Body, Chain, YarnContact, constant, ramp, section

WIDE, HIGH, ROUND, WEIGHT, LEAN = 0.5, 0.3, 0.25, 2.0, 0.1
#: yarns so stiff that they turn as one
STIFF = section(1e4, 200.0, ROUND, 1e-3, torsion=200.0)
FLAT = replace(STIFF, radius=HIGH, half_width=WIDE)
X = np.arange(-2.0, 2.01, 0.5)


def leaning() -> Body:
    """An ellipse that leans on a held yarn across it, under a weight; it may roll, or rise."""
    zero = np.zeros(len(X))
    height = np.hypot(HIGH * np.cos(LEAN), WIDE * np.sin(LEAN)) + ROUND
    lower = Chain(np.column_stack([X, zero, zero]), STIFF)
    upper = Chain(np.column_stack([zero, X, zero + height]), FLAT, normal=np.array([np.sin(LEAN), 0.0, np.cos(LEAN)]))
    body = Body.of_chains([lower, upper], YarnContact(500.0, 250.0, 1.0))
    held, top = np.arange(len(X)), np.arange(len(X), 2 * len(X))
    body.boundary.move(held, ALL)
    body.boundary.move(top, ["y", "rx", "rz"])
    body.boundary.load(top, "z", np.full(len(top), -WEIGHT / len(top)), constant(1.0))
    return body


def test_a_leaning_ellipse_rocks_on_its_flank():
    """h = b + (a^2 - b^2) / 2b p^2 about the flat: omega^2 = N (a^2 - b^2) / b over I + m b^2, about the
    place of touch.
    """
    body = leaning()
    rows = []
    body.advance(3.0, lambda b: rows.append((b.time, b.position[len(X), 0], b.energies()["kinetic"])))
    time, way, kinetic = np.array(rows).T
    top = slice(len(X), 2 * len(X))
    turning = float(body.model.inertia[top].sum() + body.model.mass[top].sum() * HIGH**2)
    expected = 2.0 * np.pi / np.sqrt(WEIGHT * (WIDE**2 - HIGH**2) / HIGH / turning)
    crossed = np.flatnonzero(np.diff(np.sign(way - way.mean())) > 0)
    period = np.diff(time[crossed]).mean()
    assert len(crossed) > 15
    assert period == pytest.approx(expected, rel=0.03)
    energies = body.energies()
    assert abs(energies["balance"]) < 0.01 * kinetic.max()
    assert energies["friction"] < 0.01 * kinetic.max()


def test_a_weight_flattens_crossed_ellipses_and_the_balance_has_what_they_store_and_lose():
    """Both give way by N / (8 a modulus) at the crossing: that of a length of two half heights; the area stays."""
    along, modulus = np.arange(-1.25, 1.26, 0.0625), 150.0
    zero, soft = np.zeros(len(along)), replace(FLAT, lateral=(modulus, 1))
    up = np.array([0.0, 0.0, 1.0])
    lower = Chain(np.column_stack([along, zero, zero]), soft, normal=up)
    upper = Chain(np.column_stack([zero, along, zero + 2.0 * HIGH]), soft, normal=up)
    body = Body.of_chains([lower, upper], YarnContact(500.0, 250.0, 0.3), damping=2.0)
    n = len(along)
    body.boundary.move(np.arange(n), ALL)
    body.boundary.move(np.arange(n, 2 * n), ["x", "y", "rx", "ry", "rz"])
    body.boundary.load(np.arange(n, 2 * n), "z", np.full(n, -WEIGHT / n), ramp(1.0, 1.0))
    body.advance(3.0)
    group = cast(YarnModel, body.model).group
    middle = n // 2
    wide, high = np.sqrt(group.square), np.sqrt(group.square + group.excess)
    assert wide * high == pytest.approx(WIDE * HIGH)
    give = WEIGHT / (8.0 * WIDE * modulus)
    # the spline spreads the force over an element
    assert HIGH - high[[middle, n + middle]] == pytest.approx(give, rel=0.08)
    assert HIGH - high[[0, -1]] == pytest.approx(0.0, abs=0.05 * give)
    depth = WEIGHT / 500.0
    assert body.position[n + middle, 2] == pytest.approx(2.0 * HIGH - 2.0 * give - depth, abs=0.2 * give)
    energies = body.energies()
    assert energies["contact"] == pytest.approx(0.5 * WEIGHT * depth + WEIGHT * give, rel=0.08)
    assert abs(energies["balance"]) < 0.01 * energies["external"]
