"""docs/validation.md: what its rows say, that failures stand there, and that no stored run is stale."""

import json
import math
import re
from dataclasses import replace
from types import SimpleNamespace

import pytest

from benchmarks import validation
from docs import generate_validation, stored_cells, stored_runs, validation_rows
from docs.generate_validation import validation_page
from docs.stored_runs import StoredRun, inputs_of
from docs.validation_fabric import cell_rows, shear_line, shear_rows
from docs.validation_fabric import verdict as cell_verdict
from docs.validation_rows import rows_of, trivial
from knittest.config.fabric import yarn_area_mass
from knittest.config.loading import resolve
from knittest.fabric import relaxation
from knittest.fabric.cell import CellSpec
from knittest.fabric.relaxation import start_curves

OPTIONS = {
    "test": "tensile", "variant": "1", "scale": "meso", "preset": "paper", "direction": "weft",
    "parameters": "calibrated", "specimens": 1, "sets": [],
}  # fmt: skip
QUALITY = {"ke_over_ie_max": 0.02, "energy_error_max": 0.001}
COST = {"elements": 100, "steps": 10, "cpu_s": 5.0}
#: heads of the columns that hold what was simulated
SIMULATED = ("simulated ±", "simulated", "V2 over V1")


def stored(peak=5744.0, strain=1.6, error=None, **options) -> StoredRun:
    """A run that came to ``peak`` and ``strain``."""
    chosen = OPTIONS | options
    inputs = inputs_of(resolve(**chosen).model_dump(mode="json"))
    errors = {} if error is None else {"peak_force_n": {"error": error}, "fracture_strain_pct": {"error": None}}
    results = {"peak_force_n": peak, "fracture_strain_pct": strain}
    return StoredRun(chosen, inputs, results, QUALITY, COST, [], [], "c" * 40, "2026-11-22T00:00:00", "a cpu", errors)


def only(runs, quantity="peak_force_n"):
    (row,) = (row for row in rows_of(runs, "tensile", "meso") if row.quantity == quantity)
    return row


def test_a_strip_of_whole_yarns_is_compared_by_the_yarns_of_the_real_one():
    """50 mm of variant 2 hold 20.5 weft yarns, of which 20 are modelled; ensembles alternate with 21."""
    row = only([stored(7332.0 * 20 / 20.5, error=20.0, variant="2")])
    scaled = "simulated x 1.025: 20 yarns modelled, 20.5 in the real strip"
    assert row.measured.scaled == scaled and generate_validation._how(row) == f"paper, single, {scaled}"
    assert row.deviation == pytest.approx(0.0, abs=1e-12) and row.error == pytest.approx(20.5)
    assert generate_validation._how(only([stored()])) == "paper, single"
    run = stored(7332.0, variant="2", specimens=2)
    peaks = {"mean": 7332.0, "sd": 253.0, "values": [7332.0 * 20 / 20.5, 7332.0 * 21 / 20.5]}
    mean = only([replace(run, results=run.results | {"peak_force_n": peaks})])
    assert (mean.value, mean.sd) == (pytest.approx(7332.0), pytest.approx(0.0, abs=1e-9))


@pytest.mark.parametrize(
    ("peak", "error", "verdict"),
    [
        (5744.0 + 353.0, None, "passed"),
        (5744.0 - 355.0, None, "**FAILED**"),
        (6000.0, 90.0, "passed"),
        (6000.0, 110.0, "passed, within ± open"),
        (6200.0, 110.0, "**FAILED**, within ± open"),
        (6200.0, 90.0, "**FAILED**"),
    ],
)
def test_a_row_passes_within_one_sd_and_a_numerical_error_that_could_turn_it_is_said(peak, error, verdict):
    """The limit is 354 N off 5744 N: 6098 N."""
    assert only([stored(peak, error=error)]).verdict == verdict


def test_shells_return_their_input_within_a_percent():
    for peak, verdict in ((5744 * 1.009, "passed"), (5744 * 1.011, "**FAILED**")):
        row = next(iter(rows_of([stored(peak, scale="macro")], "tensile", "macro")))
        assert (row.kind, row.verdict) == ("input", verdict)


def test_a_refused_run_is_no_row_that_passes():
    assert only([replace(stored(), refused=["kinetic energy"])]).verdict == "**rejected**"


def test_what_was_chosen_by_the_forces_is_never_predicted():
    """The load area was chosen because Table 3 needs it."""
    assert only([stored()]).kind == "tuned"
    assert only([stored(parameters="as-measured")]).kind == "tuned"
    assert only([stored()], "fracture_strain_pct").kind == "predicted"
    assert not validation_rows.fitted(only([stored()]))
    assert validation_rows.fitted(only([stored(direction="warp")]))


@pytest.mark.parametrize(
    ("row", "value", "of"),
    [
        (("1", "weft", "peak_force_n"), 5820.0, "V1 warp"),
        (("1", "warp", "peak_force_n"), 5744.0, "V1 weft"),
        (("2", "weft", "peak_force_n"), 5820.0 * 41 / 28, "V1 warp x 1.46"),
        (("2", "weft", "fracture_strain_pct"), 1.6, "V1 warp"),
    ],
)
def test_the_trivial_predictor_copies_and_counts_yarns(row, value, of):
    copy = trivial(*row)
    assert copy.value == pytest.approx(value) and copy.of == of
    assert trivial("1", "warp", "overhang_mm") is None


def test_numerical_error_is_its_own_or_a_share_from_another_preset():
    verified = stored(5000.0, error=100.0, preset="standard")
    own = replace(stored(6000.0, error=30.0))
    assert (only([own]).error, only([own]).error_of) == (30.0, "paper")
    rows = [r for r in rows_of([verified, stored(6000.0)], "tensile", "meso") if r.quantity == "peak_force_n"]
    paper = next(r for r in rows if r.run.options["preset"] == "paper")
    assert (paper.error, paper.error_of) == (pytest.approx(120.0), "standard")
    other = stored(6000.0, direction="warp")
    row = next(r for r in rows_of([verified, other], "tensile", "meso") if r.run is other)
    assert math.isnan(row.error)


def test_an_ensemble_is_judged_by_its_mean():
    run = stored(specimens=8)
    run = replace(
        run, results=run.results | {"peak_force_n": {"mean": 5800.0, "sd": 400.0, "values": [5400.0, 6200.0]}}
    )
    row = only([run])
    assert (row.value, row.sd) == (5800.0, 400.0)
    assert run.command.endswith("--direction weft --specimens 8")


def test_a_stored_run_is_stale_when_its_command_means_other_numbers():
    run = stored()
    assert run.stale() == []
    changed = replace(run, inputs=run.inputs | {"fabric.reinforcing.youngs_modulus.value": 59.3, "solver.gone": 1.0})
    assert changed.stale() == [
        "fabric.reinforcing.youngs_modulus.value was 59.3, is 67.5", "solver.gone was 1.0, is not there",
    ]  # fmt: skip
    assert "solver.max_kinetic_ratio" not in run.inputs and "fabric.macro.shear.kind" not in run.inputs


def test_runs_come_back_as_they_were_stored(tmp_path):
    runs = [stored(), stored(variant="2"), stored(5000.0, parameters="as-measured")]
    stored_runs.save(runs, tmp_path / "runs.json")
    back = stored_runs.load(tmp_path / "runs.json")
    assert sorted(r.command for r in back) == sorted(r.command for r in runs)
    assert {r.command: r for r in back} == {r.command: r for r in runs}


def test_a_run_folder_is_read_with_the_options_that_repeat_it(tmp_path):
    run = resolve(**{**OPTIONS, "test": "cantilever", "scale": "macro", "sets": ["rig.mode=overhang"]})
    (tmp_path / "config.yaml").write_text(json.dumps(run.model_dump(mode="json")))
    summary = {"results": {"a": {"10": 1.0}}, "quality": QUALITY, "cost": COST, "refused": [], "warnings": []}
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    (tmp_path / "manifest.json").write_text(json.dumps({"git_commit": "c", "ended": "2026", "cpu": "x"}))
    read = validation.read(tmp_path)
    assert read.command == (
        "knittest cantilever --variant 1 --scale macro --preset paper --direction weft --set rig.mode=overhang"
    )
    assert read.results == {"a.10": 1.0} and read.stale() == []
    other = run.model_dump(mode="json")
    other["fabric"]["area_mass"]["value"] = 800.0
    (tmp_path / "config.yaml").write_text(json.dumps(other))
    with pytest.raises(ValueError, match=r"fabric\.area_mass\.value"):
        validation.read(tmp_path)


def test_area_mass_is_lengths_of_yarns_times_tex():
    """By hand, variant 1: 280 m of inlay a square metre each way with its crimp at 1.2 g/m, and 14.4 mm of loop at 0.23
    g/m a cell of 3.571 mm.
    """
    cell = stored_cells.load()["1"]
    inlays = 280.0 * (2.0 + cell.crimp["warp"] + cell.crimp["weft"]) * 1.2
    expected = inlays + 14.4 / (100.0 / 28.0) ** 2 * 0.23 * 1e3
    assert cell.area_mass_g_m2 == pytest.approx(expected, rel=1e-4)
    assert yarn_area_mass(stored_cells.fabric_of("1")) == pytest.approx(expected, rel=1e-3)  # by the card's crimp


def test_mass_and_thickness_stand_with_their_copies():
    lines = {(line[0], line[1].split(" [")[0]): line for line in cell_rows(stored_cells.load())[1]}
    mass, thickness = lines["1", "area mass"], lines["2", "thickness"]
    assert mass[3:8] == ["937.1 ± 0.057", "972.9", "+13.7 %", "+18.0 %", "+2.47"] and mass[-1] == "**FAILED**"
    assert thickness[3:5] == ["2.416 ± 0.0033", "2.22"] and thickness[-2:] == ["predicted", "**FAILED**"]
    assert lines["1", "thickness"][-2:] == ["tuned", "passed, within ± open"]


@pytest.mark.parametrize(
    ("deviation", "error", "told"),
    [(-0.81, 0.18, "passed"), (-0.81, 0.20, "passed, within ± open"), (1.1, 0.09, "**FAILED**"),
     (-1.1, 0.11, "**FAILED**, within ± open")],
)  # fmt: skip
def test_a_cell_is_judged_with_its_error(deviation, error, told):
    assert cell_verdict(deviation, error) == told


def test_the_error_of_a_cell_is_that_of_one_with_finer_yarns(monkeypatch):
    """Of second order, with 1.5 times the nodes and a safety of 3: 5.4 times the change."""
    cells = {1.0: (2.0, 900.0), stored_cells.FINER: (2.01, 899.5)}
    spec = SimpleNamespace(wale=1.0, course=1.0)
    monkeypatch.setattr(
        relaxation, "relaxed_cell", lambda *_: SimpleNamespace(spec=spec, crimp=lambda _: 0.01, size=1.0)
    )
    monkeypatch.setattr(relaxation, "relax_cell", lambda _, finer: SimpleNamespace(spec=spec, size=finer))
    names = ("thickness_mm", "area_mass_g_m2")
    monkeypatch.setattr(stored_cells, "_numbers", lambda _, cell: dict(zip(names, cells[cell.size], strict=True)))
    found = stored_cells.relaxed("1")
    assert found.thickness_mm == 2.0 and found.error == pytest.approx({names[0]: 0.054, names[1]: 2.7})


def test_a_finer_cell_has_more_nodes():
    spec = CellSpec.of(stored_cells.fabric_of("1"))
    assert [[len(curve) for curve in start_curves(spec, finer)] for finer in (1.0, 1.5)] == [[64, 16, 16], [96, 24, 24]]


def test_what_has_no_error_is_listed_with_what_it_would_take():
    told = validation_page().split("## Values without numerical error")[1].split("##")[0]
    open_rows = [r for r in rows_of(stored_runs.load(), "cantilever", "meso") if not math.isfinite(r.error)]
    assert "of variant 2 over that of variant 1 in shear" in told and "mass" not in told
    assert (f"- cantilever, meso: {len(open_rows)} of " in told) == bool(open_rows)
    assert "tensile" not in told and "macro" not in told


@pytest.mark.parametrize(("second", "verdict"), [(0.99, "passed"), (1.01, "**FAILED**")])
def test_variant_2_is_to_lie_below_variant_1(second, verdict):
    assert shear_line(20.0, 1.0, second)[-1] == verdict


def test_every_simulated_number_has_its_error_or_says_that_none_is_known():
    found, column = [], None
    for line in validation_page().splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if not cells or set(cells) == {"---"}:
            column = column if cells else None
        elif column is None:
            column = next((cells.index(head) for head in SIMULATED if head in cells), -1)
        elif column >= 0:
            found.append(cells[column])
    assert len(found) >= 50 and all(re.search(r"± ([0-9.e-]+|not estimated)", cell) for cell in found)
    assert "171 ± 0.19" in found and "4998 ± 150" in found and "937.1 ± 0.057" in found


def test_the_page_says_that_shear_fails():
    """Remove this test when the model has variant 2 below variant 1, as the paper has it."""
    assert [line[-1] for line in shear_rows()[1]] == ["**FAILED**"] * 4
    assert "force of V2 over that of V1 at 20 deg 1.14 (+14 %)" in validation_page()


@pytest.mark.parametrize("run", stored_runs.load(), ids=lambda run: run.command)
def test_no_stored_run_is_stale(run):
    assert run.stale() == [], f"run again, then benchmarks/validation.py: {run.command}"
    assert "-dirty" not in run.commit


def test_no_stored_cell_is_stale():
    for variant, cell in stored_cells.load().items():
        assert cell.stale(variant) == []


def test_ensembles_are_of_both_variants_and_both_directions():
    """Of calibrated yarns, eight specimens."""
    runs = [run for run in stored_runs.load() if (run.options["test"], run.options["scale"]) == ("tensile", "meso")]
    have = {(run.options["variant"], run.options["direction"]) for run in runs if run.specimens == 8}
    assert have == {(variant, direction) for variant in ("1", "2") for direction in ("warp", "weft")}


def test_a_refused_row_and_a_failed_one_stand_in_the_summary(monkeypatch):
    """Failures are listed with their deviation; the counts leave them out."""
    runs = [stored(4000.0), replace(stored(direction="warp"), refused=["kinetic energy"])]
    monkeypatch.setattr(stored_runs, "load", lambda: runs)
    page = validation_page()
    summary = page.split("## Tensile test, meso")[0]
    assert "tensile meso V1 weft peak_force_n (calibrated, paper, single) -30.4 %" in summary
    assert "tensile meso V1 warp fracture_strain_pct (calibrated, paper, single) +0.0 %" in summary
    assert "`tuned`: 1 of 4 rows pass" in summary  # the thickness of variant 1 alone
    assert "is nearer to the experiment than the baseline in 0 of" in summary
