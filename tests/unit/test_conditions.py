"""Sizes of specimens: stated in files, never taken for granted; forces of strips and frames meet free of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from strip_reading import read_lab

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.config.loading import resolve
from knittest.experiment.compare import compare_columns, compare_results
from knittest.experiment.conditions import Conditions
from knittest.experiment.curves import for_width, load_curve, normalised, per_width
from knittest.experiment.tables import published
from knittest.laboratory.base import fabric_laminate, tension_curve
from knittest.laboratory.cantilever.test import stiffness_by_overhang
from knittest.laboratory.forming.formed import strengths
from knittest.laboratory.given_data import own_curves
from knittest.laboratory.report_base import REPORTS
from knittest.materials.trellis import crosshead_force

HEAD = "variant,direction,quantity,mean,sd,n,unit,table\n"
STRAIN = np.linspace(0.0, 1.6, 81)


def tensile(width=50.0, direction="warp", scale="macro", **more):
    """A run of variant 1."""
    sets = [f"rig.width={width}", *(f"{k}={v}" for k, v in more.items())]
    return resolve(variant="1", scale=scale, test="tensile", direction=direction, sets=sets)


def rows_of(tmp_path, rows, run):
    """``rows`` of a table as the report of ``run`` scales them."""
    (tmp_path / "tensile-warp.csv").write_text(HEAD + rows)
    found = published(tmp_path, "mine", "warp", ("peak_force_n", "fracture_strain_pct"))
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


def test_a_table_without_a_width_is_refused_and_that_of_another_table_does_not_count(tmp_path):
    (tmp_path / "cantilever-warp.csv").write_text(HEAD + "mine,warp,strip_width_mm,25,,,mm,own\n")
    with pytest.raises(
        InputError, match=r"tensile-warp\.csv:2: the strip width of peak_force_n .* row strip_width_mm .*import --width"
    ):
        rows_of(tmp_path, "mine,warp,peak_force_n,6400,320,5,N,own\n", tensile())


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("mine,,strip_width_mm,5,,,cm,own\n", "unit = 'cm'; expected mm"),
        ("mine,,strip_width_mm,0.1,,,mm,own\n", "strip_width_mm: 0.1"),
        (
            "mine,,strip_width_mm,50,,,mm,own\nmine,warp,strip_width_mm,100,,,mm,own\n",
            r":4: strip_width_mm: 100, but .*:3 states 50",
        ),
    ],
)
def test_widths_that_cannot_be_are_refused(tmp_path, rows, says):
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
    with pytest.raises(
        InputError, match=r"macro\.tension\.warp: .*given\.csv.*'# strip_width_mm: .*data import --width"
    ):
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
    assert for_width(curve, 25.0).peak == pytest.approx((1.7, 1600.0))
    whole = load_curve(curve_file(tmp_path / "c.csv", head))
    assert whole.peak == pytest.approx((1.7, 6400.0)) and per_width(whole).peak == pytest.approx((1.7, 64.0))


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
    assert "scaled from 100 to 25 mm" in curve.note and "taken as warp" in curve.note
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
    with pytest.raises(
        InputError, match=r"'# fabric_side_mm: \.\.\.' and '# frame_side_mm: .*--fabric-side, --frame-si"
    ):
        own_curves(run, [path])
    with pytest.raises(InputError, match=r"with '# frame_side_mm: \.\.\.' in the header"):
        own_curves(run, [path], Conditions(fabric_side_mm=100.0))
    with pytest.raises(InputError, match="fabric_side_mm: 200 is larger than frame_side_mm: 100"):
        own_curves(run, [path], Conditions(fabric_side_mm=200.0, frame_side_mm=100.0))
    curve = load_curve(path, Conditions(fabric_side_mm=200.0, frame_side_mm=200.0))
    (same,) = own_curves(run, [path], Conditions(fabric_side_mm=200.0, frame_side_mm=200.0))
    assert normalised(curve).mean == pytest.approx(same.mean)


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
    (row,) = published(data_dir() / "pham2019", "1", "warp", ("bending_stiffness_mncm2",))
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
    for given, says in (
        (Conditions(), "an unknown normal force"),
        (Conditions(normal_force_n=1000.0), "1000 N, the run"),
    ):
        with pytest.raises(InputError, match=says):
            own_curves(run, [path], given)
