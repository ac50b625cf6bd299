"""The cell test as it runs: columns agree with each other, quality checks pass, and a path that tears is refused."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.laboratory.cell.test import Cell, checked_span, secant
from knittest.solve.state import SILENT


def solved(*sets: str):
    """Run, prepared cell, history, cost and the test of variant 1."""
    run, test = resolve(variant="1", test="cell", preset="quick", sets=list(sets)), Cell()
    prepared = test.prepare(run)
    return run, prepared, *test.solve(prepared, run, SILENT), test


def test_a_sheared_cell_reports_work_mechanisms_and_crossings() -> None:
    run, prepared, history, cost, test = solved("rig.max_angle=4", "output.samples=300")
    curve, energies = history.curve, history.energies
    # work an area is the integral of the conjugate force over the angle, which the curve ends at; the last row is later
    force, angle = curve["conjugate_force"], np.deg2rad(curve["shear_angle_deg"])
    work = prepared.facts["area_mm2"] * cumulative_trapezoid(force, angle, initial=0.0)
    expected = np.interp(energies["time_ms"][-2], curve["time_ms"], work)
    assert energies["external_mj"][-2] == pytest.approx(expected, rel=1e-3)
    for part in ("warp", "weft", "knit"):
        whole = sum(energies[f"{m}_{part}_mj"] for m in ("stretching", "bending", "torsion"))
        assert np.diff(whole) == pytest.approx(np.diff(energies[f"internal_{part}_mj"]), abs=2e-5)
    assert history.contacts["warp_weft_angle_deg"][-1] == pytest.approx(86.0, abs=0.3)
    assert history.contacts["thickness_mm"][-1] == pytest.approx(2.16, abs=0.02)
    quality = test.assess(run, prepared, history, cost)
    assert not quality.failures and quality.ke_over_ie_max < 0.05
    assert test.results(run, prepared, history)["cell_shear_n_per_mm_at_deg.1"] > 0.0


def test_a_cell_that_ends_sooner_is_the_same_cell_up_to_there_and_is_judged_from_the_same_angle() -> None:
    found = []
    for sets in ([], ["rig.end_angle=2"]):
        run, prepared, history, cost, test = solved(
            "rig.max_angle=4", "rig.evaluated_from=25", "output.samples=60", *sets
        )
        quality = test.assess(run, prepared, history, cost)
        found.append((history, test.results(run, prepared, history), quality, checked_span(run, history)))
    (whole, numbers, _, span), (half, same, quality, own) = found
    rows = len(half.energies["time_ms"])
    for name, column in whole.energies.items():
        assert np.array_equal(column[:rows], half.energies[name]), name
    angle = half.curve["shear_angle_deg"]
    assert np.array_equal(whole.curve["shear_angle_deg"][: len(angle)], angle) and 1.98 < angle[-1] < 2.1
    assert np.array_equal(whole.curve["conjugate_force"][: len(angle)], half.curve["conjugate_force"])
    at = "cell_shear_n_per_mm_at_deg.1"
    assert same[at] == numbers[at] and same["cell_thickness_at_rest_mm"] == numbers["cell_thickness_at_rest_mm"]
    assert own == span and not quality.failures


def test_a_bent_cell_passes_its_gates_and_its_stiffness_holds() -> None:
    """Yarns off the middle surface would swing to it with more energy than bending takes."""
    run, prepared, history, cost, test = solved("rig.path=bending", "rig.max_curvature=0.03", "output.samples=60")
    assert not test.assess(run, prepared, history, cost).failures
    found = test.results(run, prepared, history)["cell_bending_stiffness_n_mm"]
    # that of the straight yarns alone, 15.0 N mm2 on 28 in 100 mm; loops add a tenth
    own = run.fabric.reinforcing.bending_stiffness_n_mm2.of("warp") * run.fabric.density_per_mm.of("warp")
    assert own < found < 1.12 * own
    late = history.curve["curvature_per_mm"] > 0.02
    secants = (history.curve["moment_n"][late] - history.curve["moment_n"][0]) / history.curve["curvature_per_mm"][late]
    assert secants.mean() == pytest.approx(found, rel=0.01) and np.abs(secants / found - 1.0).max() < 0.06


def test_the_curl_of_the_free_fabric_is_no_stiffness() -> None:
    curvature = np.linspace(0.0, 0.05, 60)
    assert secant(curvature, 4.0 * curvature) == pytest.approx(4.0)
    assert secant(curvature, 4.0 * curvature - 0.3) == pytest.approx(4.0)


def test_yarns_that_would_break_on_the_way_end_the_path_with_a_number() -> None:
    weak = ["rig.path=warp", "rig.transverse=held", "fabric.reinforcing.fracture_strain=0.2", "rig.max_strain=0.95"]
    with pytest.raises(InputError, match=r"whose fracture strain is 0.20 %; use --set rig\.max_strain=0\.\d+"):
        solved(*weak, "output.samples=60")
