"""Specimens of whole yarns are compared for their nominal size: like with like, in rows, curves, tables and targets.

50 mm of variant 2 hold 20.5 weft yarns, of which 20 are modelled: what the model felt is multiplied by 1.025.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from export_sample import cost, quality, strip
from report_sample import write_run

from knittest.base.files import data_dir
from knittest.base.history import History, Specimen
from knittest.base.result_rows import result_rows
from knittest.cli.main import cli
from knittest.config.loading import resolve
from knittest.experiment.compare import compare_columns, compare_results
from knittest.experiment.conditions import Conditions
from knittest.experiment.curves import ReferenceCurve
from knittest.experiment.tables import published
from knittest.laboratory.given_data import own_curves
from knittest.laboratory.pull_out.report import embedded, for_length, for_whole_pitches, length_factor
from knittest.laboratory.report_base import REPORTS
from knittest.runs.writing import judge, references_of
from knittest.studies.batch.page import _result
from knittest.studies.batch.picture import _values
from knittest.studies.calibrate.targets import Number
from knittest.studies.trials.trial import Record

FACTOR = 20.5 / 20
ENSEMBLE = "simulated x 1.025 or 0.9762: 20 or 21 yarns modelled, 20.5 in the real strip"
STATED = "simulated x 1.025: 20 yarns modelled, 20.5 in the real strip"


def weft(*sets, scale="meso", specimens=1):
    more = [f"variability.specimens={specimens}", *sets]
    return resolve(test="tensile", variant="2", scale=scale, direction="weft", sets=more)


def peak_row(run):
    return next(row for row in references_of(run, ()).rows if row.quantity == "peak_force_n")


def test_the_factor_is_the_yarns_of_the_width_over_those_that_are_modelled():
    report = REPORTS["tensile"]
    assert report.factors(weft()) == (pytest.approx(FACTOR),)
    assert report.factors(weft(specimens=3)) == pytest.approx((20.5 / 20, 20.5 / 21, 20.5 / 20))
    assert report.factors(weft("rig.width=20")) == (pytest.approx(8.2 / 8),)
    assert report.factors(weft(scale="macro")) == ()
    assert report.factors(resolve(test="tensile", variant="1", scale="meso", direction="warp")) == ()


def test_a_row_states_what_was_modelled_and_its_factor():
    row = peak_row(weft())
    (found,) = compare_results({"peak_force_n": 7195.0}, [row], {"peak_force_n": "tuned"})
    assert (row.mean, row.scaled) == (7332.0, STATED)
    assert (found["modelled"], found["factors"]) == (7195.0, [pytest.approx(FACTOR)])
    assert found["simulated"] == pytest.approx(7195.0 * FACTOR)
    assert found["deviation_pct"] == pytest.approx(0.59, abs=0.01)


def test_a_table_shows_the_number_that_is_compared_with_its_error():
    row = peak_row(weft())
    compared = compare_results({"peak_force_n": 7195.0}, [row], {"peak_force_n": "tuned"})
    error = {"peak_force_n": {"error": 80.0}}
    summary = {"results": {"peak_force_n": 7195.0}, "comparison": compared, "numerical_error": error}
    (shown,) = result_rows(summary, refused=False)
    assert shown.simulated == "7375 ± 82" and shown.experiment == f"7332 ± 380 ({STATED})"
    assert shown.value == pytest.approx(7195.0 * FACTOR)
    assert result_rows(summary, refused=True)[0].simulated == "7195 ± 80"


def test_each_specimen_of_an_ensemble_has_its_own_factor():
    """Forces in proportion to the yarns do not scatter."""
    values = [360.0 * n for n in (20, 21, 20)]
    peaks = {"mean": float(np.mean(values)), "sd": float(np.std(values, ddof=1)), "values": values}
    compared = compare_results({"peak_force_n": peaks}, [peak_row(weft(specimens=3))], {"peak_force_n": "tuned"})
    assert compared[0]["simulated"] == pytest.approx(360.0 * 20.5) and compared[0]["scaled"] == ENSEMBLE
    (shown,) = result_rows({"results": {"peak_force_n": peaks}, "comparison": compared}, refused=False)
    assert shown.simulated == "7380 ± 0 (n 3)"


def test_curves_are_compared_by_the_same_factor(tmp_path: Path):
    strain = np.linspace(0.0, 1.6, 50)
    text = "".join(f"{e:.4f},{7332.0 * (e / 1.6) ** 2:.6f}\n" for e in strain)
    head = "# kind: measured\n# direction: weft\n# strip_width_mm: 50\n# gauge_length_mm: 50\nstrain_pct,force_n\n"
    (tmp_path / "c.csv").write_text(head + text)
    run, report = weft("rig.gauge_length=50"), REPORTS["tensile"]
    (curve,) = own_curves(run, [tmp_path / "c.csv"])
    force = 7332.0 / FACTOR * (strain / 1.6) ** 2
    columns = {"strain_pct": strain, "force_n": force, "force_moving_n": force}
    found = compare_columns(report.for_nominal_size(run, columns), curve)
    errors = found["peak_error_pct"], found["rmse_pct_of_peak"]
    assert errors == pytest.approx((0.0, 0.0), abs=0.01) and STATED in found["note"]
    assert report.for_nominal_size(run, columns)["force_moving_n"] is force  # what the model felt
    assert report.size_free(run, columns)[1]["force_n"][-1] == pytest.approx(7332.0 / 50.0)


def test_runs_and_compare_take_the_curve_to_the_nominal_size(tmp_path: Path):
    """A reference that is 1.025 times what the run felt agrees with it, during the run and afterwards."""
    run, sets = weft("rig.gauge_length=50"), ["rig.gauge_length=50"]
    strain = np.linspace(0.0, 1.6, 50)
    columns = {"time_ms": strain, "strain_pct": strain, "force_n": 7195.0 * (strain / 1.6) ** 2}
    rows = "".join(f"{e:.9f},{FACTOR * f:.6f}\n" for e, f in zip(strain, columns["force_n"], strict=True))
    head = "# kind: measured\n# direction: weft\n# strip_width_mm: 50\n# gauge_length_mm: 50\nstrain_pct,force_n\n"
    (tmp_path / "c.csv").write_text(head + rows)
    results = {"peak_force_n": 7195.0, "fracture_strain_pct": 1.6}
    energies = {"time_ms": strain}
    specimen = Specimen(History(strip(2, 2)[0], columns, energies, []), results, quality(), cost(), {})
    found = judge(run, [specimen], references_of(run, [tmp_path / "c.csv"]))
    force = next(row for row in found.comparison["rows"] if row["quantity"] == "peak_force_n")
    assert force["simulated"] == pytest.approx(7195.0 * FACTOR)
    assert found.own[0]["peak_error_pct"] == pytest.approx(0.0, abs=1e-3)
    assert found.summary["results"]["peak_force_n"] == 7195.0
    folder = write_run(tmp_path / "r", direction="weft", scale="meso", variant="2", sets=sets)
    pd.DataFrame(columns).to_csv(folder / "curve.csv", index=False)
    told = CliRunner().invoke(cli, ["compare", str(folder), "--against", str(tmp_path / "c.csv"), "--json"])
    assert told.exit_code == 0, told.output
    assert json.loads(told.stdout)["peak_error_pct"] == pytest.approx(0.0, abs=1e-3)


def test_targets_of_a_calibration_are_met_by_the_nominal_size():
    row = peak_row(weft(specimens=2))
    number = Number("t", row.quantity, row.mean, row.sd, 1.0, row.table, "", "", row.factors)
    peaks = {"mean": 7332.0, "sd": 253.0, "values": [7332.0 * n / 20.5 for n in (20, 21)]}
    single = replace(number, factors=peak_row(weft()).factors)
    for target, value in ((number, peaks), (single, 7332.0 / FACTOR)):
        record = Record("k", "completed", summary={"results": {"peak_force_n": value}})
        assert target.deviations(record, Path()) == pytest.approx([0.0], abs=1e-12)


def test_a_batch_shows_the_numbers_that_were_compared():
    forces = {"peak_force_n": [7195.0, 7000.0], "peak_force_n_simulated": [7375.0, np.nan]}
    table = pd.DataFrame({"status": ["completed", "refused"], **forces})
    assert _values(table, "peak_force_n").tolist() == [7375.0, 7000.0]
    assert _result(table.iloc[0], "peak_force_n").text == "7375"


def test_a_frame_of_whole_pitches_is_compared_for_its_square():
    """Side 50 mm of variant 2: 14 wales of 3.571 mm and 20 courses of 2.439 mm; forces grow with the area."""
    run = resolve(test="picture-frame", variant="2", scale="meso", sets=["rig.side=50"])
    area = 14 * 100 / 28 * 20 * 100 / 41
    assert REPORTS["picture-frame"].factors(run) == (pytest.approx(2500.0 / area),)
    assert REPORTS["picture-frame"].size(run)[0] == 50.0
    angle = {"frame_shear_angle_deg": np.array([1.0]), "shear_force_n": np.array([area / 2500.0])}
    assert REPORTS["picture-frame"].for_nominal_size(run, angle)["shear_force_n"] == pytest.approx([1.0])


def test_a_pull_out_counts_the_crossings_of_the_tested_length():
    """50 mm of variant 1's wales hold 14 crossings, 30 mm 8.4, of which 8 are modelled: 28.57 mm."""
    run = resolve(test="pull-out", variant="1", preset="quick", direction="weft", sets=["rig.length=30"])
    (row,) = published(data_dir() / "pham2019", "1", "weft", ("peak_force_n",))
    tested = replace(row, quantity="pull_out_peak_n", conditions=replace(row.conditions, embedded_length_mm=30.0))
    found = for_length(run, tested)
    assert embedded(run) == pytest.approx(8 * 100 / 28) and found.factors == (pytest.approx(8.4 / 8),)
    assert "28.57 mm embedded in whole pitches, 30 mm in the test" in found.scaled
    assert length_factor(run, 30.0, 10.0) == pytest.approx((30.0 - 10.0) / (800 / 28 - 10.0))
    x, conditions = np.array([0.0, 5.0, 10.0]), Conditions(embedded_length_mm=30.0)
    curve = ReferenceCurve("measured", x, 30.0 - x, None, "tail_travel_mm", "pull_force_n", "s", conditions=conditions)
    whole = for_whole_pitches(run, curve)
    assert whole.mean == pytest.approx(curve.mean * (800 / 28 - curve.x) / (30.0 - curve.x))
