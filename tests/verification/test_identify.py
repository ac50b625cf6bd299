"""Pull-out and compaction of straight yarns against closed forms: Coulomb friction at crossings, contacts in series."""

import numpy as np
import pytest

from knittest.base.history import History
from knittest.config.loading import resolve
from knittest.laboratory.compaction.test import REST as PRESSED_FROM
from knittest.laboratory.compaction.test import CompactionTest
from knittest.laboratory.pull_out.sliding import evaluate_sliding
from knittest.laboratory.pull_out.test import REST, PullOutTest, add_tail_travel
from knittest.laboratory.restart import history_from_time
from knittest.models.boundary import TOOL_STIFFNESS, Boundary
from knittest.models.chains import Chain, build_chains
from knittest.models.sections import round_section
from knittest.models.tool import Table
from knittest.models.yarn_contact import YarnContact
from knittest.solve.simulation import simulate

RADIUS, MU, SQUEEZE, PITCH = 0.4, 0.3, 0.5, 4.0
CARD = round_section(modulus=1000.0, diameter=2.0 * RADIUS, density=2.5e-3)
#: soft: pressed in by 0.01 mm, beside which what sways across the inlay is small
CONTACT = YarnContact(50.0, 10.0, MU)
STIFF = YarnContact(1000.0, 100.0, MU)


def straight(start: tuple[float, float, float], end: tuple[float, float, float], n: int) -> Chain:
    """Straight yarn of ``n`` beams."""
    return Chain(np.linspace(start, end, n + 1), CARD)


class Squeezed(PullOutTest):
    """A pull-out in which the yarns above the inlay come down onto it by twice the depth of :data:`SQUEEZE`."""

    above: np.ndarray

    def constrain(self, boundary: Boundary) -> None:
        super().constrain(boundary)
        boundary.grip(self.above, "z", Table((0.0, 1.0, 2.0), (0.0, -2.0 * SQUEEZE / CONTACT.normal, 0.0)))


def drawn() -> tuple[History, float]:
    """History of an inlay that is drawn through four crossings a pitch apart."""
    sets = ("rig.travel=9", "rig.length=16", "solver.speed=0.5", "solver.ramp=2", "solver.damping=0.5")
    run = resolve(variant="1", preset="quick", test="pull-out", direction="weft", sets=sets)
    places = PITCH * (0.5 + np.arange(4))
    chains = [straight((0.0, 0.0, 0.0), (16.0, 0.0, 0.0), 32)]
    for z in (-2.0 * RADIUS, 2.0 * RADIUS):
        chains += [straight((x, -0.9, z), (x, 0.9, z), 3) for x in places]
    model = build_chains(chains, ("warp", "weft", "knit"), CONTACT)
    below, above = np.arange(33, 49), np.arange(49, 65)
    rig = Squeezed(run, 0, np.array([32]), below, 16.0)
    rig.above = above
    history, _ = simulate(model, rig, run.solver, run.output)
    return add_tail_travel(history_from_time(history, REST), {"tail_node": 0.0, "embedded_mm": 16.0}, 0), PITCH


def test_the_pull_is_mu_times_all_normal_forces_and_falls_as_crossings_let_go():
    """F = mu (N above + N below) of each crossing that is left: 4 x 2 x 0.3 x 0.5 N = 1.2 N, then 0.9, 0.6; the yarns
    below, which are the piece here, take half of it.
    """
    history, pitch = drawn()
    curve = history.curve
    tail, force = curve["tail_travel_mm"], curve["pull_force_n"]
    for low, high, left in ((0.3, 1.2, 4), (2.8, 5.2, 3), (6.8, 8.6, 2)):
        there = (tail > low) & (tail < high)
        assert curve["clamp_force_n"][there].mean() == pytest.approx(left * MU * SQUEEZE, rel=0.02), left
        assert force[there].mean() == pytest.approx(left * 2.0 * MU * SQUEEZE, rel=0.04), left
    found = evaluate_sliding(curve, pitch)
    assert found.force_at_rest == pytest.approx(1.2, rel=0.03)
    assert found.per_crossing == pytest.approx(2.0 * MU * SQUEEZE, rel=0.05)


def test_two_crossed_yarns_between_plates_are_springs_in_series():
    """Each plate holds the five nodes of one short stiff yarn, the crossing the two yarns on each other."""
    sets = ("rig.max_pressure=2000", "solver.speed=0.12", "solver.ramp=1", "solver.damping=1")
    run = resolve(variant="1", preset="quick", test="compaction", sets=sets)
    stiff = round_section(modulus=6e4, diameter=2.0 * RADIUS, density=2.5e-3)
    chains = [
        Chain(np.linspace((-0.8, 0.0, RADIUS), (0.8, 0.0, RADIUS), 5), stiff),
        Chain(np.linspace((0.0, -0.8, -RADIUS), (0.0, 0.8, -RADIUS), 5), stiff),
    ]
    model = build_chains(chains, ("warp", "weft", "knit"), STIFF)
    faces, area = (-2.0 * RADIUS, 2.0 * RADIUS), 20.0
    ends = np.array([0, 4, 5, 9])
    rig = CompactionTest(run, faces, np.array([4.0, 5.0]), np.full(10, RADIUS), ends)
    plates = rig.stiffness * TOOL_STIFFNESS * model.mass[:5].sum() / (run.solver.safety * model.critical_step) ** 2
    history, _ = simulate(model, rig, run.solver, run.output)
    curve = history_from_time(history, PRESSED_FROM).curve
    pressed = curve["pressure_kpa"] > 200.0
    slope = np.polyfit(curve["thickness_mm"][pressed], 1e-3 * area * curve["pressure_kpa"][pressed], 1)[0]
    assert -1.0 / slope == pytest.approx(1.0 / STIFF.normal + 2.0 / plates, rel=0.03)
    free = curve["thickness_mm"][pressed] + 1e-3 * area * curve["pressure_kpa"][pressed] / -slope
    assert free.mean() == pytest.approx(4.0 * RADIUS, abs=0.002)  # what two yarns are thick without pressure
