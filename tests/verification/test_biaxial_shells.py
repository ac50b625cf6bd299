"""Biaxial test of shells: each system carries what it would alone, or more by the coupling of both."""

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.laboratory.base import fabric_laminate, tension_curve
from knittest.laboratory.biaxial.test import Biaxial, cross_direction, rows_before_break
from knittest.solve.state import SILENT

TEST = Biaxial()


def pulled(direction: str, ratio: float, *sets: str):
    given = (f"rig.ratio={ratio:g}", "rig.side=60", *sets)
    run = resolve(variant="1", scale="macro", preset="quick", test="biaxial", direction=direction, sets=given)
    prepared = TEST.prepare(run)
    history, cost = TEST.solve(prepared, run, SILENT)
    return run, prepared, history, TEST.assess(run, prepared, history, cost)


@pytest.mark.parametrize(("direction", "ratio"), [("warp", 0.5), ("warp", 2.0), ("weft", 2.0), ("warp", 0.0)])
def test_uncoupled_systems_carry_what_they_would_alone(direction, ratio):
    """Forces per width are those of the tension curves at the strain of each, up to the failure of the first."""
    run, prepared, history, quality = pulled(direction, ratio)
    assert not quality.failures
    curve, other = history.curve, cross_direction(run.rig.direction)
    before = curve["strain_pct"] < 0.9 * max(
        run.fabric.macro.fracture_strain.of(direction).value / max(1.0, ratio), 0.1
    )
    for name, of in (("", run.rig.direction), ("cross_", other)):
        fed = tension_curve(run.fabric, of)
        expected = np.interp(curve[f"{name}strain_pct"][before], fed.x, fed.mean)
        assert curve[f"{name}force_n_per_mm"][before] == pytest.approx(expected, abs=0.01 * fed.mean.max())
    assert curve["force_n"] == pytest.approx(60.0 * curve["force_n_per_mm"])
    found = TEST.results(run, prepared, history)
    assert history.first_failure is not None
    for name, of in (("biaxial_", run.rig.direction), ("cross_", other)):  # not what waves of the failure pull
        fed = tension_curve(run.fabric, of)
        expected = np.interp(found[f"{name}strain_pct"], fed.x, fed.mean)
        assert found[f"{name}force_n_per_mm"] == pytest.approx(expected, abs=0.01 * fed.mean.max())
    first = "cross_" if ratio > 1.0 else "biaxial_"
    peak = tension_curve(run.fabric, other if ratio > 1.0 else run.rig.direction).peak[1]
    assert found[f"{first}force_n_per_mm"] == pytest.approx(peak, rel=0.01)


def test_rows_before_shells_break():
    """Counted at every other row: the row in which both forces still rise is whole, the wave after it is not."""
    forces = {"force_n_per_mm": [1.0, 2.0, 3.0, 4.0, 0.5, 9.0], "cross_force_n_per_mm": [1.0, 2.0, 3.0, 4.0, 8.0, 9.0]}
    curve = {name: np.array(values) for name, values in forces.items()}
    assert rows_before_break(curve | {"failed_fabric": np.array([0.0, 0.0, 0.0, 5.0, 5.0, 5.0])}) == 4
    assert rows_before_break(curve | {"failed_fabric": np.array([0.0, 0.0, 0.0, 0.0, 5.0, 5.0])}) == 4
    assert rows_before_break(curve | {"failed_fabric": np.zeros(6)}) is None


def test_a_test_that_ends_before_failure_is_judged_to_its_end():
    run, prepared, history, quality = pulled("warp", 1.0, "rig.max_strain=0.8")
    assert history.first_failure is None and not quality.failures
    assert TEST.results(run, prepared, history)["biaxial_strain_pct"] == pytest.approx(0.8, rel=0.03)


def test_coupled_systems_carry_more_by_the_strain_across():
    """N_a = N_a(e_a) + (C_a nu nu' e_a + C_b nu e_b) / (1 - nu nu'), with nu' = nu C_b / C_a and C in compression."""
    sets = ("rig.max_strain=0.8", "output.samples=20")
    (run, _, alone, _), (_, _, both, _) = (
        pulled("warp", 1.0, *sets, f"fabric.macro.poisson={nu}") for nu in (0.0, 0.3)
    )
    card = fabric_laminate(run)
    warp, weft = card.compression + 2.0 * card.outer
    back = 0.3 * weft / warp
    strain = 0.01 * both.curve["strain_pct"]
    before = np.interp(strain, 0.01 * alone.curve["strain_pct"], alone.curve["force_n_per_mm"])
    more = (0.3 * back * warp + 0.3 * weft) / (1.0 - 0.3 * back) * strain
    late = strain > 0.004
    assert (both.curve["force_n_per_mm"] - before)[late] == pytest.approx(more[late], rel=0.08)
