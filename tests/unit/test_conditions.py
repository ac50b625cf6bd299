"""Sizes of specimens: stated in files, compared like with like, and for the nominal size of whole yarns."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from export_sample import cost, quality, strip
from report_sample import write_run
from strip_reading import read_lab

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.base.history import History, Specimen
from knittest.base.result_rows import result_rows
from knittest.cli.main import cli
from knittest.config.loading import resolve
from knittest.config.yaml_writer import dump
from knittest.experiment.comparison import compare_columns, compare_results
from knittest.experiment.conditions import Conditions
from knittest.experiment.curves import ReferenceCurve, load_curve, normalise_force, scale_to_width, to_force_per_width
from knittest.experiment.tables import published_rows
from knittest.laboratory.base import fabric_laminate, tension_curve
from knittest.laboratory.cantilever.test import stiffness_by_overhang
from knittest.laboratory.forming.results import strengths
from knittest.laboratory.pull_out.report import (
    embedded_length,
    length_factor,
    scale_curve_to_length,
    scale_row_to_length,
)
from knittest.laboratory.reference_curves import own_curves
from knittest.laboratory.report_base import REPORTS
from knittest.materials.trellis import crosshead_force
from knittest.runs.run_files import compare_run, references_of
from knittest.studies.batch.page import _result
from knittest.studies.batch.picture import _values
from knittest.studies.calibrate.targets import NumberTarget
from knittest.studies.trials.trial import Record

HEAD = "variant,direction,quantity,mean,sd,n,unit,table\n"
STRAIN = np.linspace(0.0, 1.6, 81)


def tensile(width=50.0, direction="warp", scale="macro", **more):
    """A run of variant 1."""
    sets = [f"rig.width={width}", *(f"{k}={v}" for k, v in more.items())]
    return resolve(variant="1", scale=scale, test="tensile", direction=direction, sets=sets)


def rows_of(tmp_path, rows, run):
    """``rows`` of a table as the report of ``run`` scales them."""
    (tmp_path / "tensile-warp.csv").write_text(HEAD + rows)
    found = published_rows(tmp_path, "mine", "warp", ("peak_force_n", "fracture_strain_pct"))
    return REPORTS[run.rig.kind].scaled(run, found)


def curve_file(path: Path, head: str, factor: float = 1.0, column: str = "force_n") -> Path:
    """A curve of 6400 N x ``factor`` at 1.6 %."""
    rows = "".join(f"{e:.3f},{factor * 6400.0 * (e / 1.6) ** 2:.4f}\n" for e in STRAIN)
    path.parent.mkdir(exist_ok=True, parents=True)
    path.write_text(f"{head}strain_pct,{column}\n{rows}")
    return path


@pytest.mark.parametrize(
    ("own", "width", "peak", "note"),
    [
        (100, 50.0, 3200.0, ", scaled from 100 to 50 mm"),
        (50, 100.0, 12800.0, ", scaled from 50 to 100 mm"),
        (50, 50.0, 6400.0, ""),
    ],
)
def test_rows_are_scaled_from_the_width_that_their_table_states(tmp_path, own, width, peak, note):
    text = f"mine,warp,peak_force_n,6400,320,5,N,5 strips\nmine,,strip_width_mm,{own},,,mm,5 strips\n"
    text += "mine,warp,fracture_strain_pct,1.6,0.1,5,%,5 strips\n"
    force, strain = rows_of(tmp_path, text, tensile(width))
    assert (force.mean, force.sd, force.table) == (peak, 0.05 * peak, f"5 strips{note}")
    assert (strain.mean, strain.sd, strain.table) == (1.6, 0.1, "5 strips")


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("", r"tensile-warp\.csv:2: the strip width of peak_force_n .* row strip_width_mm .*import --width"),
        ("mine,,strip_width_mm,5,,,cm,own\n", "unit = 'cm'; expected mm"),
        ("mine,,strip_width_mm,0.1,,,mm,own\n", "strip_width_mm: 0.1"),
        (
            "mine,,strip_width_mm,50,,,mm,own\nmine,warp,strip_width_mm,100,,,mm,own\n",
            r":4: strip_width_mm: 100, but .*:3 states 50",
        ),
    ],
)
def test_an_unknown_or_impossible_width_is_refused_and_that_of_another_table_does_not_count(tmp_path, rows, says):
    (tmp_path / "cantilever-warp.csv").write_text(HEAD + "mine,warp,strip_width_mm,25,,,mm,own\n")
    with pytest.raises(InputError, match=says):
        rows_of(tmp_path, "mine,warp,peak_force_n,6400,320,5,N,own\n" + rows, tensile())


def test_the_force_of_whole_yarns_is_taken_to_the_width(tmp_path):
    """At 28 in 100 mm, 15 mm are 4.2 yarns, of which 4 are modelled; 50 mm are 14."""
    text = "mine,warp,peak_force_n,6400,320,5,N,own\nmine,,strip_width_mm,50,,,mm,own\n"
    (row,) = rows_of(tmp_path, text, tensile(15.0, scale="meso"))
    factor = "simulated x 1.05: 4 yarns modelled, 4.2 in the real strip"
    assert row.table == f"own, scaled from 50 to 15 mm, {factor}" and row.mean == pytest.approx(1920.0)
    (found,) = compare_results({"peak_force_n": 1900.0}, [row], {"peak_force_n": "predicted"})
    assert found["simulated"] == pytest.approx(1900.0 * 4.2 / 4) and found["modelled"] == 1900.0
    assert found["deviation_pct"] == pytest.approx(100.0 * (1900.0 * 1.05 / 1920.0 - 1.0))
    assert rows_of(tmp_path, text, tensile(50.0, scale="meso"))[0].table == "own"
    assert rows_of(tmp_path, text, tensile(15.0))[0].table == "own, scaled from 50 to 15 mm"


def test_a_tension_curve_is_force_per_width_whatever_the_strip(tmp_path, monkeypatch):
    """100 mm of 6400 N and 25 mm of 1600 N are the same 64 N/mm at the end; without a width they are refused."""
    monkeypatch.chdir(tmp_path)
    for name, head, factor, column in (
        ("wide", "# kind: measured\n# strip_width_mm: 100\n", 1.0, "force_n"),
        ("narrow", "# kind: measured\n# strip_width_mm: 25\n", 0.25, "force_n"),
        ("given", "# kind: measured\n", 0.01, "force_n_per_mm"),
    ):
        path = curve_file(tmp_path / f"{name}.csv", head, factor, column)
        run = resolve(
            variant="1", scale="macro", test="tensile", direction="warp",
            sets=[f"fabric.macro.tension={{warp: {path}, weft: {path}}}", "fabric.macro.fracture_strain.warp=1.6"],
        )  # fmt: skip
        curve = tension_curve(run.fabric, "warp")
        assert curve.y_name == "force_n_per_mm" and curve.mean[-1] == pytest.approx(64.0)
        assert strengths(run)["warp"] == pytest.approx(64.0 / 0.28)
        assert fabric_laminate(run).slope[0].sum() > 0.0
    curve_file(path, "# kind: measured\n")
    words = r"macro\.tension\.warp: .*given\.csv.*'# strip_width_mm: .*data import --width"
    with pytest.raises(InputError, match=words):
        fabric_laminate(run)


def test_a_weft_curve_feeds_no_warp(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = curve_file(tmp_path / "c.csv", "# kind: measured\n# direction: weft\n# strip_width_mm: 50\n")
    sets = [f"fabric.macro.tension={{warp: {path}, weft: {path}}}"]
    run = resolve(variant="1", scale="macro", test="tensile", direction="warp", sets=sets)
    with pytest.raises(InputError, match=r"macro\.tension\.warp: .*c\.csv is a curve of tensile weft"):
        fabric_laminate(run)


@pytest.mark.parametrize("peak", ["peak_force_n: 6400", "peak_force_n_per_mm: 64"])
def test_a_stated_peak_is_in_the_unit_of_the_column(tmp_path, peak):
    head = f"# kind: measured\n# strip_width_mm: 100\n# fracture_strain_pct: 1.7\n# {peak}\n"
    curve = load_curve(curve_file(tmp_path / "c.csv", head, 0.01, "force_n_per_mm"))
    assert curve.peak == pytest.approx((1.7, 64.0))
    assert scale_to_width(curve, 25.0).peak == pytest.approx((1.7, 1600.0))
    whole = load_curve(curve_file(tmp_path / "c.csv", head))
    assert whole.peak == pytest.approx((1.7, 6400.0)) and to_force_per_width(whole).peak == pytest.approx((1.7, 64.0))


def test_a_column_per_width_is_not_read_as_newtons(tmp_path):
    path = curve_file(tmp_path / "c.csv", "", 0.01, "force_n_per_mm")
    assert load_curve(path).y_name == "force_n_per_mm" and "counts as measured" in load_curve(path).note
    with pytest.raises(InputError, match="is a force per width; expected the force of the whole strip"):
        read_lab(path)


@pytest.mark.parametrize(
    ("head", "says"),
    [
        ("# direction: weft\n# strip_width_mm: 50\n", "a curve of tensile weft .*the run is tensile warp"),
        ("# test: cantilever\n# strip_width_mm: 50\n", "a curve of cantilever .*the run is tensile warp"),
        ("", "strip width of force_n is unknown; add .*'# strip_width_mm: .*compare --width"),
        ("# strip_width_mm: 50\n# strip_width_mm: 100\n", ":3: # strip_width_mm: 100, but .*:2 states 50"),
        ("# strip_width_mm: wide\n", ":2: strip_width_mm: 'wide'; expected a number"),
        ("# direction: bias\n", ":2: direction: bias; expected one of warp, weft"),
    ],
)
def test_a_curve_of_another_test_or_unknown_size_is_refused(tmp_path, head, says):
    path = curve_file(tmp_path / "c.csv", "# kind: measured\n" + head)
    with pytest.raises(InputError, match=says):
        own_curves(tensile(), [path])


def test_a_folder_says_the_direction_where_the_header_does_not(tmp_path):
    path = curve_file(tmp_path / "weft" / "corridor.csv", "# kind: measured\n# strip_width_mm: 50\n")
    with pytest.raises(InputError, match="a curve of tensile weft"):
        own_curves(tensile(), [path])
    (curve,) = own_curves(tensile(direction="weft"), [path])
    assert "direction" not in curve.note


def test_options_state_what_a_file_leaves_open_and_contradict_nothing(tmp_path):
    path = curve_file(tmp_path / "c.csv", "")
    (curve,) = own_curves(tensile(25.0), [path], Conditions(strip_width_mm=100.0, gauge_length_mm=100.0))
    assert curve.mean[-1] == pytest.approx(1600.0)
    assert "scaled from 100 to 25 mm" in curve.note and "no direction, warp is assumed" in curve.note
    assert "200 instead of 100 mm between the clamps; strain is relative" in curve.note
    stated = curve_file(tmp_path / "c.csv", "# kind: measured\n# strip_width_mm: 50\n")
    with pytest.raises(InputError, match=r"c\.csv: the header states strip_width_mm: 50.0, but --width is 100"):
        own_curves(tensile(), [stated], Conditions(strip_width_mm=100.0))


def frame_file(path, fabric, frame, head=True):
    """File of a frame that shears a fabric of S = 0.02 tan(gamma) N/mm."""
    angle = np.linspace(0.0, 40.0, 81)
    gamma = np.deg2rad(angle)
    force = crosshead_force(0.02 * np.tan(gamma), gamma, fabric, frame)
    sides = f"# frame_side_mm: {frame}\n# fabric_side_mm: {fabric}\n" if head else ""
    rows = "".join(f"{a},{f:.8f}\n" for a, f in zip(angle, force, strict=True))
    path.write_text(f"# kind: measured\n{sides}shear_angle_deg,force_n\n{rows}")
    return path


@pytest.mark.parametrize(("fabric", "frame"), [(200.0, 200.0), (140.0, 216.0), (50.0, 50.0)])
def test_frames_of_any_side_agree_by_the_normalised_force(tmp_path, fabric, frame):
    """A run of 50 mm against frames of 50 and 200 mm, and one with arms: the same material within 3 %."""
    run = resolve(variant="1", scale="macro", test="picture-frame", sets=["rig.side=50"])
    (curve,) = own_curves(run, [frame_file(tmp_path / "f.csv", fabric, frame)])
    angle = np.linspace(0.0, 42.0, 421)
    gamma = np.deg2rad(angle)
    force = crosshead_force(0.02 * np.tan(gamma), gamma, 50.0, 50.0)
    along = 0.5 * force / np.cos(np.pi / 4 - gamma / 2)
    names = ("frame_shear_angle_deg", "shear_force_n", "normalised_shear_force_n_per_mm")
    columns = dict(zip(names, (angle, force, along * 50.0 / 50.0**2), strict=True))
    found = compare_columns(columns, curve)
    errors = [at["error_pct"] for at in found["normalised_shear_force_n_per_mm_at_deg"].values()]
    assert np.abs(errors).max() < 3.0 and found["rating"]["grade"] == "excellent"
    assert f"normalised with the tested sides, fabric {fabric:g} mm and frame {frame:g} mm" in found["note"]


def test_a_frames_force_needs_both_sides(tmp_path):
    run = resolve(variant="1", scale="macro", test="picture-frame")
    path = frame_file(tmp_path / "f.csv", 200.0, 200.0, head=False)
    words = r"'# fabric_side_mm: \.\.\.' and '# frame_side_mm: .*--fabric-side, --frame-si"
    with pytest.raises(InputError, match=words):
        own_curves(run, [path])
    with pytest.raises(InputError, match=r"with '# frame_side_mm: \.\.\.' in the header"):
        own_curves(run, [path], Conditions(fabric_side_mm=100.0))
    with pytest.raises(InputError, match="fabric_side_mm: 200 is larger than frame_side_mm: 100"):
        own_curves(run, [path], Conditions(fabric_side_mm=200.0, frame_side_mm=100.0))
    curve = load_curve(path, Conditions(fabric_side_mm=200.0, frame_side_mm=200.0))
    (same,) = own_curves(run, [path], Conditions(fabric_side_mm=200.0, frame_side_mm=200.0))
    assert normalise_force(curve).mean == pytest.approx(same.mean)


def test_what_the_shells_were_made_of_is_an_input(tmp_path, monkeypatch):
    """tension.csv is what they are fed with, corridor.csv the same strips."""
    monkeypatch.chdir(tmp_path)
    head = "# kind: measured\n# source: mine, 5 strips of 50 mm, warp\n# strip_width_mm: 50\n"
    tension, corridor = (curve_file(tmp_path / "warp" / f"{name}.csv", head) for name in ("tension", "corridor"))
    other = curve_file(tmp_path / "other.csv", head.replace("5 strips", "3 strips"), 1.02)
    sets = [f"fabric.macro.tension={{warp: {tension}, weft: pham2019/curves/tensile-v1-weft.csv}}"]
    run = resolve(variant="1", scale="macro", test="tensile", direction="warp", sets=sets)
    assert [c.kind for c in own_curves(run, [tension, corridor, other])] == ["input", "input", "measured"]
    assert "of the same source" in own_curves(run, [corridor])[0].note


def test_bending_stiffness_is_compared_per_width():
    """Table 3 has it for a strip of 50 mm: 2530 mN cm2 are 5.06 N mm, whatever the width of the run."""

    def run(width):
        return resolve(variant="1", scale="macro", test="cantilever", direction="warp", sets=[f"rig.width={width}"])

    assert stiffness_by_overhang(run(25.0), 171.0, 41.5) == stiffness_by_overhang(run(50.0), 171.0, 41.5)
    assert stiffness_by_overhang(run(25.0), 171.0, 41.5) == pytest.approx(5.0536, rel=1e-4)
    (row,) = published_rows(data_dir() / "pham2019", "1", "warp", ("bending_stiffness_mncm2",))
    rows = REPORTS["cantilever"].scaled(run(25.0), [row])
    assert [r.quantity for r in rows] == ["bending_stiffness_eq2_n_mm_per_width", "bending_stiffness_n_mm_per_width"]
    assert all(r.mean == pytest.approx(5.06) and r.unit == "N mm" for r in rows)
    with pytest.raises(InputError, match=r"strip width .* is unknown"):
        REPORTS["cantilever"].scaled(run(50.0), [replace(row, conditions=Conditions())])


def test_a_pull_force_is_compared_under_its_own_normal_force(tmp_path):
    path = tmp_path / "pull.csv"
    path.write_text("# kind: measured\n# direction: warp\ndisplacement_mm,pull_force_n\n0,0\n1,300\n2,300\n")
    run = resolve(variant="1", scale="macro", test="friction", direction="warp", sets=["rig.normal_force=2000"])
    (curve,) = own_curves(run, [path], Conditions(normal_force_n=2000.0))
    assert curve.mean.tolist() == [0.0, 300.0, 300.0]
    for given, says in ((None, "an unknown normal force"), (1000.0, "1000 N, in the run")):
        with pytest.raises(InputError, match=says):
            own_curves(run, [path], Conditions(normal_force_n=given))


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
    found = compare_columns(report.scale_to_nominal_size(run, columns), curve)
    errors = found["peak_error_pct"], found["rmse_pct_of_peak"]
    assert errors == pytest.approx((0.0, 0.0), abs=0.01) and STATED in found["note"]
    assert report.scale_to_nominal_size(run, columns)["force_moving_n"] is force  # what the model felt
    assert report.size_free_curve(run, columns)[1]["force_n"][-1] == pytest.approx(7332.0 / 50.0)


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
    found = compare_run(run, [specimen], references_of(run, [tmp_path / "c.csv"]))
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
    number = NumberTarget("t", row.quantity, row.mean, row.sd, 1.0, row.table, "", "", row.factors)
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
    assert REPORTS["picture-frame"].scale_to_nominal_size(run, angle)["shear_force_n"] == pytest.approx([1.0])


def test_a_pull_out_counts_the_crossings_of_the_tested_length():
    """50 mm of variant 1's wales hold 14 crossings, 30 mm 8.4, of which 8 are modelled: 28.57 mm."""
    run = resolve(test="pull-out", variant="1", preset="quick", direction="weft", sets=["rig.length=30"])
    (row,) = published_rows(data_dir() / "pham2019", "1", "weft", ("peak_force_n",))
    tested = replace(row, quantity="pull_out_peak_n", conditions=replace(row.conditions, embedded_length_mm=30.0))
    found = scale_row_to_length(run, tested)
    assert embedded_length(run) == pytest.approx(8 * 100 / 28) and found.factors == (pytest.approx(8.4 / 8),)
    assert "28.57 mm embedded in whole pitches, 30 mm in the test" in found.scaled
    assert length_factor(run, 30.0, 10.0) == pytest.approx((30.0 - 10.0) / (800 / 28 - 10.0))
    x, conditions = np.array([0.0, 5.0, 10.0]), Conditions(embedded_length_mm=30.0)
    curve = ReferenceCurve("measured", x, 30.0 - x, None, "tail_travel_mm", "pull_force_n", "s", conditions=conditions)
    whole = scale_curve_to_length(run, curve)
    assert whole.mean == pytest.approx(curve.mean * (800 / 28 - curve.x) / (30.0 - curve.x))


@pytest.mark.parametrize("has_config", [True, False])
def test_a_curve_of_another_run_is_read_with_the_size_of_that_run(tmp_path, has_config):
    """A strip of 50 mm, simulated, beside a run of 25 mm: half the force; without its config the width is unknown."""
    path = tmp_path / "curve.csv"
    path.write_text("time_ms,displacement_mm,strain_pct,force_n\n0.1,0,0,0\n0.2,1,1,100\n0.3,0,0,0\n0.4,2,2,200\n")
    if has_config:
        (tmp_path / "config.yaml").write_text(dump(tensile(50.0)))
        (curve,) = own_curves(tensile(25.0), [path])
        assert curve.kind == "simulated" and not curve.doubt
        with pytest.raises(InputError, match=r"a curve of tensile warp .*the run is tensile weft"):
            own_curves(tensile(direction="weft"), [path])
    else:
        with pytest.raises(InputError, match="strip width of force_n is unknown"):
            own_curves(tensile(25.0), [path])
        (curve,) = own_curves(tensile(25.0), [path], Conditions(strip_width_mm=50.0))
    assert curve.x.tolist() == [0.0, 1.0, 2.0] and curve.mean.tolist() == [0.0, 50.0, 100.0]


def test_a_curve_without_known_columns_is_answered_by_what_the_command_has(tmp_path):
    path = tmp_path / "c.csv"
    path.write_text("A,B\n0,0\n1,100\n2,200\n")
    with pytest.raises(InputError, match=r"columns in line 1 are 'A', 'B': write a header row such as strain_pct"):
        own_curves(tensile(), [path])
