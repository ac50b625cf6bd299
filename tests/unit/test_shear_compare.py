"""Own curve of a picture frame, read, matched and compared; a frame of yarns as the shear law of shells."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from knittest.base.errors import InputError
from knittest.base.history import Frame, History
from knittest.base.result_rows import fold_results, unfold_results
from knittest.cli.main import cli
from knittest.cli.main import run as knittest
from knittest.config.loading import resolve
from knittest.config.yaml_writer import dump
from knittest.experiment.comparison import columns_of, compare_columns
from knittest.experiment.curves import ReferenceCurve, find_curve, load_curve
from knittest.laboratory.picture_frame.shear_law import homogenised_law, write_law
from knittest.laboratory.picture_frame.test import first_loading, frame_at
from knittest.laboratory.reference_curves import own_curves
from knittest.laboratory.strips import angle_scatter, angle_table
from knittest.materials.trellis import NORMALISED

ANGLE = np.linspace(0.0, 45.0, 451)
#: a frame that shears to 30, turns to 10 and goes on to 45 deg
TURNING = np.concatenate([np.linspace(0, 30, 301), np.linspace(29.9, 10, 200), np.linspace(10.1, 45, 350)])


def columns(angle=ANGLE, factor=1.0):
    virgin = angle >= np.maximum.accumulate(angle)
    force = factor * np.where(virgin, angle**2, 0.1 * angle**2)
    return {
        "time_ms": angle, "frame_shear_angle_deg": angle, "shear_force_n": force,
        "normalised_shear_force_n_per_mm": 0.01 * force,
    }  # fmt: skip


def reference(name="shear_force_n", factor=1.0, end=40.0):
    angle = np.linspace(1.0, end, 79)
    return ReferenceCurve("measured", angle, factor * angle**2, None, "shear_angle_deg", name, "mine.csv")


@pytest.mark.parametrize(("name", "factor"), [("shear_force_n", 1.0), (NORMALISED, 0.01)])
@pytest.mark.parametrize("angle", [ANGLE, TURNING])
def test_the_force_of_that_name_and_only_the_first_loading_is_compared(name, factor, angle):
    """Force and normalised force each meet their own column; ways back and repeated ones are left out."""
    found = compare_columns(columns(angle), reference(name, factor, end=44.0))
    assert found["range_shear_angle_deg"] == [5.0, 44.0]  # before it a frame is starting
    at = found[f"{name}_at_deg"]
    assert list(at) == ["5", "10", "20", "30", "40", "44"]
    assert at["20"]["simulated"] == pytest.approx(400.0 * factor, rel=1e-3)
    assert at["20"]["error_pct"] == pytest.approx(0.0, abs=0.1)
    assert found["rating"]["grade"] == "excellent"
    assert found["rmse_pct_of_peak"] < 0.1
    assert all(abs(row["error_pct"]) < 0.5 for row in at.values())
    assert "peak_error_pct" not in found  # a shear curve ends, it does not break


def test_a_scaled_curve_is_off_by_that_everywhere():
    found = compare_columns(columns(factor=1.25), reference())
    assert [row["error_pct"] for row in found["shear_force_n_at_deg"].values()] == pytest.approx([25.0] * 5, abs=0.3)
    assert found["rmse_pct_of_peak"] == pytest.approx(25.0 * np.sqrt(np.mean((ANGLE[50:401] / 40.0) ** 4)), rel=0.02)


def test_a_strain_is_no_shear_angle():
    curve = ReferenceCurve("measured", np.arange(3.0), np.arange(3.0), None, "strain_pct", "force_n", "mine.csv")
    with pytest.raises(InputError, match=r"mine.csv: strain_pct: the run's curve has no such column.*shear_angle_deg"):
        columns_of(columns(), curve)


@pytest.mark.parametrize(
    "text",
    [
        "shear_angle_deg,force_n\n0,0\n10,2.5\n20,4\n",
        "Labor;X\nshear_angle_deg;force_n\n0;0\n10;2,5\n20;4\n",
        "# kind: measured\nshear_angle_deg,force_n\n0,0\n10,2.5\n20,4\n",
    ],
)
def test_plain_tables_are_read(tmp_path, text):
    path = tmp_path / "mine.csv"
    path.write_text(text)
    curve = load_curve(path)
    assert (curve.x_name, curve.y_name, curve.kind) == ("shear_angle_deg", "force_n", "measured")
    assert curve.x.tolist() == [0, 10, 20] and curve.mean.tolist() == [0, 2.5, 4]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "shear_angle_deg,torque\n0,0\n1,1\n2,2\n",
            r":1: shear_angle_deg needs a column of force; expected one of force_n",
        ),
        ("shear_angle_deg,force_n\n0,0\n2,1\n1,2\n", r":4: shear_angle_deg must rise .* first loading"),
        ("shear_angle_deg,force_n\n0,0\n2,x\n3,2\n", r":3: "),
        ("shear_angle_deg,force_n\n0,0\n2,\n3,2\n", r":3: "),
        ("shear_angle_deg,force_n\n0,0\n2,1\n", "2 points; at least three"),
    ],
)
def test_bad_tables_are_refused(tmp_path, text, says):
    path = tmp_path / "mine.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=says):
        load_curve(path)


def test_shipped_curves_are_found_by_name_and_say_what_they_are(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, end in (("uml", 48.0), ("ut", 34.0), ("kul1", 44.0)):
        curve = find_curve(Path(f"cao2008/curves/{name}.csv"))
        assert (curve.kind, curve.y_name, curve.x[-1]) == ("digitised", NORMALISED, end)


def test_the_curve_that_the_shear_law_was_taken_from_is_an_input():
    run = resolve(variant="cao2008-weave", scale="macro", test="picture-frame")
    curves = own_curves(run, [Path(f"cao2008/curves/{name}.csv") for name in ("uml", "ut")])
    assert [(c.source[-3:], c.kind) for c in curves] == [("UML", "input"), (" UT", "digitised")]


def test_a_run_refuses_a_curve_of_another_test_before_it_starts(tmp_path):
    curve = tmp_path / "tension.csv"
    curve.write_text("strain_pct,force_n\n0,0\n1,5\n2,6\n")
    out = tmp_path / "run"
    options = ["--variant", "1", "--scale", "macro", "--against", str(curve), "--out", str(out)]
    result = CliRunner().invoke(cli, ["picture-frame", *options])
    assert isinstance(result.exception, InputError) and "no such column" in str(result.exception)
    assert not out.exists()


def test_results_with_a_key_are_maps_in_the_summary():
    flat = {"shear_force_n_at_deg.10": 1.0, "shear_force_n_at_deg.20": 2.0, "wrinkle_onset_deg": 30.0}
    whole = fold_results(flat)
    assert whole == {"shear_force_n_at_deg": {"10": 1.0, "20": 2.0}, "wrinkle_onset_deg": 30.0}
    assert unfold_results(whole) == flat
    spread = {k: {"mean": v, "sd": 0.1, "values": [v - 0.1, v + 0.1]} for k, v in flat.items()}
    assert unfold_results(json.loads(json.dumps(fold_results(spread)))) == spread


def test_scatter_of_a_known_field():
    """Uniform from 30 to 40 deg: mean 35, sd 10 / sqrt(12), 5 % at 30.5 and 95 % at 39.5."""
    found = angle_scatter(np.deg2rad(np.linspace(30.0, 40.0, 10001)))
    assert (found.mean, found.low, found.high) == pytest.approx((35.0, 30.5, 39.5))
    assert found.sd == pytest.approx(10.0 / np.sqrt(12.0), rel=1e-3)
    table = angle_table([(0.0, found), (40.0, found)])
    assert table["frame_shear_angle_deg"].tolist() == [0.0, 40.0] and table["sd_deg"][1] == found.sd


def test_frames_on_the_way_back_do_not_count():
    """0 - 30 - 10 - 45 deg: 20 deg on the way back and again is no first loading, though no frame shows the turn."""
    time = np.arange(len(TURNING), dtype=float)
    frames = [Frame(time[k], TURNING[k], 0.0, np.zeros((1, 3)), {}) for k in (0, 100, 250, 310, 650, 850)]
    history = History(None, {"time_ms": time, "frame_shear_angle_deg": TURNING}, {}, frames)
    assert [f.time for f in first_loading(history)] == [0, 100, 250, 850]
    assert frame_at(history, 26.0).time == 250


def frame_curve(law, noise=0.0):
    """Normalised force of a frame whose material follows ``law``: conjugate = normalised cos gamma."""
    angle = np.linspace(0.0, 45.0, 2000)
    shaken = law(angle) * (1.0 + noise * np.sin(40.0 * angle))
    return angle, shaken / np.cos(np.deg2rad(angle))


def test_a_law_comes_back():
    angle, force = homogenised_law(*frame_curve(lambda a: 1e-3 * a + 1e-5 * a**2))
    assert (angle[0], force[0]) == (0.0, 0.0)
    assert force == pytest.approx(1e-3 * angle + 1e-5 * angle**2, rel=5e-3)


def test_a_shaken_law_does_not_fall():
    angle, force = homogenised_law(*frame_curve(lambda a: np.minimum(1e-3 * a, 0.01), noise=0.3))
    assert (np.diff(force) >= 0.0).all() and (np.diff(angle) > 0.0).all()
    assert force[-1] == pytest.approx(0.01, rel=0.05)


def test_only_the_first_loading_counts():
    angle, force = frame_curve(lambda a: 1e-3 * a)
    back = homogenised_law(np.append(angle, angle[::-1]), np.append(force, -force))
    assert back[1] == pytest.approx(homogenised_law(angle, force)[1])


def test_the_stop_of_the_frame_does_not_flatten_the_law():
    """The force falls where the frame comes to rest, 0.3 deg into a step; the law keeps its tangent to the end."""
    angle = np.linspace(0.0, 45.3, 2000)
    force = (1e-3 * angle * np.where(angle > 44.5, 0.9, 1.0)) / np.cos(np.deg2rad(angle))
    found = homogenised_law(angle, force)
    assert found[0][-1] == pytest.approx(43.75, abs=0.05)
    assert np.diff(found[1])[-1] / np.diff(found[0])[-1] > 0.5e-3


def run_folder(folder, law, refused=(), **of):
    (folder / "config.yaml").write_text(dump(resolve(variant="2", test="picture-frame", preset="quick", **of)))
    angle, force = frame_curve(law)
    table = pd.DataFrame({"frame_shear_angle_deg": angle, "normalised_shear_force_n_per_mm": force})
    table.to_csv(folder / "curve.csv", index=False)
    (folder / "summary.json").write_text(json.dumps({"refused": refused}))
    return folder


def test_the_file_says_what_its_force_hangs_on_and_is_read_as_a_law(tmp_path):
    sets = ["fabric.contact.friction_coefficient=0.4"]
    run = run_folder(tmp_path, lambda a: 1e-3 * a, scale="meso", sets=sets)
    angle, force = write_law(run, tmp_path / "mine" / "law.csv")
    text = (tmp_path / "mine" / "law.csv").read_text()
    assert "# yarn-yarn friction coefficient: 0.4 (user)" in text
    assert "# degree of set of the loops: 0.9 (assumed)" in text and "patch" not in text and "draw-in" not in text
    curve = load_curve(tmp_path / "mine" / "law.csv")
    assert (curve.kind, curve.source) == ("simulated", "picture frame of yarns, pham2019-v2 (calibrated), 50 mm")
    assert curve.x == pytest.approx(angle, abs=1e-4) and curve.mean == pytest.approx(force, abs=1e-6)


def test_the_file_names_patches_and_loop_shortening_where_the_fabric_states_them(tmp_path):
    drawn = ["fabric.knitting.loop_shortening=0.5"]
    run = run_folder(tmp_path, lambda a: 1e-3 * a, scale="meso", parameters="spin-friction", sets=drawn)
    write_law(run, tmp_path / "law.csv")
    head = (tmp_path / "law.csv").read_text()
    assert "# loop shortening [%]: 0.5 (user)\n" in head
    for pair, radius in (("inlays", 0.375), ("inlay and loop", 0.306), ("loops", 0.25)):
        assert f"# patch of a crossing, {pair} [mm]: {radius:g} (assumed)\n" in head


def test_a_frame_that_its_gates_refused_is_no_law(tmp_path):
    run = run_folder(tmp_path, lambda a: 1e-3 * a, refused=["energy error 7 % > 5 %"], scale="meso")
    with pytest.raises(InputError, match=r"quality checks failed \(energy error 7 % > 5 %\)"):
        write_law(run, tmp_path / "law.csv")
    (run / "summary.json").unlink()
    with pytest.raises(InputError, match="expected a finished run: continue with knittest resume"):
        write_law(run, tmp_path / "law.csv")
    assert not (tmp_path / "law.csv").exists()


def test_shells_have_no_law_of_their_own(tmp_path):
    run = run_folder(tmp_path, lambda a: 1e-3 * a, scale="macro")
    with pytest.raises(InputError, match="expected a picture frame of yarns"):
        write_law(run, tmp_path / "law.csv")


def test_folders_without_a_frame_are_refused(tmp_path):
    with pytest.raises(InputError, match="expected the folder of a finished picture-frame run"):
        write_law(tmp_path, tmp_path / "law.csv")
    (tmp_path / "curve.csv").write_text("strain_pct,force_n\n0,0\n1,5\n")
    assert knittest(["data", "shear-law", str(tmp_path), "--out", str(tmp_path / "law.csv")]) == 2
