"""Nothing is rated against what the shells were given: the strips of their import, in whatever file they stand."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from report_sample import write_run

from knittest.cli.main import run as command
from knittest.config.loading import resolve
from knittest.experiment.comparison import compare_columns
from knittest.experiment.conditions import Conditions
from knittest.experiment.curves import load_curve, to_force_per_width
from knittest.experiment.statistics import Specimen
from knittest.laboratory.picture_frame.lab_files import LAB as FRAME_LAB
from knittest.laboratory.picture_frame.lab_files import FrameSpecimen
from knittest.laboratory.reference_curves import own_curves
from knittest.laboratory.report_base import REPORTS
from knittest.laboratory.tensile.lab_files import LAB as TENSILE

SHARE = np.linspace(0.0, 1.0, 60)
ENDS = (1.5, 1.56, 1.62)


def raw(path: Path, end: float, force: float, power: float = 2.0) -> Path:
    """A strip of 100 mm as a laboratory exports it: decimal comma, kN, every point rounded."""
    rows = "".join(f"{end * s:.4f};{1e-3 * force * s**power:.5f}\n" for s in SHARE)
    path.write_text(("Breite;100;mm\nDehnung [%];Kraft [kN]\n" + rows).replace(".", ","))
    return path


def strip_force(end: float) -> float:
    return 6000.0 * end


@pytest.fixture
def imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A fabric whose tension curves and shear law are made of an import in data/mine."""
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "data/mine"
    for direction, factor in (("warp", 1.0), ("weft", 0.7)):
        strips = [
            Specimen(f"s{k}", e * SHARE, factor * strip_force(e) * SHARE**2, 100.0, 200.0) for k, e in enumerate(ENDS)
        ]
        TENSILE.write(strips, out, direction, ["a.csv"])
    force = 40.0 * SHARE[1:] ** 2
    frames = [
        FrameSpecimen(f"f{k}", 45.0 * SHARE[1:], factor * force, False, 250.0, 180.0, path=tmp_path / f"f{k}.csv")
        for k, factor in enumerate((1.0, 1.1, 1.3))
    ]
    FRAME_LAB.write(frames, out, "", ["f.csv"])
    assert command(["new", "mine", "--from", "data/mine"]) == 0
    return tmp_path


def compared(path: Path, test: str = "tensile", scale: str = "macro", direction: str = "warp", **given):
    run = resolve(test=test, variant="mine", scale=scale, direction=direction if test == "tensile" else None)
    (curve,) = own_curves(run, [path], Conditions(**given))
    columns = {curve.x_name: curve.x, curve.y_name: 1.01 * curve.mean}
    return compare_columns(columns, curve)


def judged_as_input(metrics) -> bool:
    assert metrics["comparable"]
    if metrics["reference_kind"] != "input":
        return False
    assert metrics["rating"] is None and metrics["no_rating"].startswith("the reference is an input of the model")
    return True


@pytest.mark.parametrize("name", ["corridor", "tension", "specimen-01", "specimen-03"])
def test_files_of_the_import_are_inputs_of_shells_and_rated_for_yarns(imported, name):
    path = imported / f"data/mine/warp/{name}.csv"
    found = compared(path)
    assert judged_as_input(found) and "input of the macro model" in found["note"]
    assert not judged_as_input(compared(path, scale="meso"))


@pytest.mark.parametrize("end", ENDS)
def test_the_laboratorys_own_file_of_an_imported_strip_is_an_input(imported, end):
    path = raw(imported / "warp-strip.csv", end, strip_force(end))
    found = compared(path)
    assert judged_as_input(found)
    assert "input of the macro model" in found["note"]


def test_a_strip_of_another_series_is_rated(imported):
    """Its force lies 2 % off every strip of the import, its shape or its end elsewhere."""
    for name, end, force, power in (
        ("warp-1", 1.56, 1.02 * strip_force(1.56), 2.0),
        ("warp-2", 1.56, strip_force(1.56), 1.9),
        ("warp-3", 1.75, strip_force(1.75), 2.0),
    ):
        found = compared(raw(imported / f"{name}.csv", end, force, power))
        assert not judged_as_input(found) and found["rating"]["grade"] == "excellent"


def test_a_copy_of_the_curve_or_of_the_import_is_recognised(imported):
    """Without its head, with other points and the width given by hand; the import's folder moved."""
    curve = to_force_per_width(load_curve(imported / "data/mine/warp/tension.csv"))
    x = np.linspace(0.0, curve.x[-1], 500)
    rows = "".join(
        f"{a:.3f},{100.0 * b:.1f}\n" for a, b in zip(x[1:], np.interp(x, curve.x, curve.mean)[1:], strict=True)
    )
    copy = imported / "my-warp.csv"
    copy.write_text("strain_pct,force_n\n" + rows)
    found = compared(copy, strip_width_mm=100.0)
    assert judged_as_input(found) and "input of the macro model: the same data" in found["note"]
    shutil.copytree(imported / "data/mine", imported / "elsewhere")
    for old in (imported / "data/mine").glob("*/specimen-*.csv"):
        old.unlink()
    assert judged_as_input(compared(imported / "elsewhere/warp/specimen-02.csv"))


def test_the_frames_of_a_shear_law_are_its_inputs(imported):
    folder = imported / "data/mine/picture-frame"
    for name in ("corridor", "specimen-01", "specimen-03"):
        assert judged_as_input(compared(folder / f"{name}.csv", "picture-frame")), name
    law = load_curve(folder / "shear.csv")
    normalised = law.mean / np.cos(np.deg2rad(law.x))  # S / cos gamma, knittest/materials/trellis.py
    for factor, given in ((1.0, True), (1.02, False)):
        own = imported / "frame.csv"
        rows = "".join(f"{a:.6f},{factor * f:.8f}\n" for a, f in zip(law.x, normalised, strict=True))
        own.write_text("shear_angle_deg,normalised_shear_force_n_per_mm\n" + rows)
        assert judged_as_input(compared(own, "picture-frame")) == given


def test_a_strip_of_unknown_direction_is_not_rated(imported, capsys):
    path = raw(imported / "strip.csv", 1.75, strip_force(1.75))
    found = compared(path)
    assert found["reference_kind"] == "measured" and found["rating"] is None
    assert found["no_rating"] == (
        "the file states no direction, warp is assumed; confirm it by a line '# direction: warp'"
    )
    folder = write_run(imported / "r", variant="mine")
    own = load_curve(path)
    pd.DataFrame({"strain_pct": own.x, "force_n": 0.5 * own.mean}).to_csv(folder / "curve.csv", index=False)
    assert command(["compare", str(folder), "--against", str(path)]) == 0
    assert "no rating: the file states no direction" in capsys.readouterr().out
    assert command(["compare", str(folder), "--against", str(path), "--direction", "warp"]) == 0
    assert "rating 1.00 (excellent)" in capsys.readouterr().out
    assert command(["compare", str(folder), "--against", str(path), "--direction", "weft"]) == 2


def tuned(
    imported: Path, labels: list[str], scale: str = "meso", direction: str = "warp", file: str = "warp/corridor.csv"
):
    """Comparison of a run of ``mine`` whose yarns were tuned on ``labels`` with a curve of the import."""
    path = imported / "configs/mine.yaml"
    data = yaml.safe_load(path.read_text())
    data["reinforcing"]["youngs_modulus"] |= {"source": "tuned", "tuned_on": labels}
    path.write_text(yaml.safe_dump(data))
    return compared(imported / "data/mine" / file, scale=scale, direction=direction)


@pytest.mark.parametrize(
    "label",
    ["Vmine warp max. tensile force", "warp peak_force_n = 6900", "warp curve corridor.csv", "warp fracture strain"],
)
def test_a_curve_that_yarns_were_tuned_on_is_said_to_be_and_not_rated(imported, label):
    found = tuned(imported, [label])
    assert found["reference_kind"] == "tuned" and found["rating"] is None and label in found["note"]
    assert found["no_rating"].startswith("a model parameter was fitted to the reference")
    assert abs(found["peak_error_pct"]) > 0.0  # the errors stay


def test_the_other_direction_still_judges_a_calibration(imported):
    found = tuned(imported, ["Vmine warp max. tensile force"], direction="weft", file="weft/corridor.csv")
    assert found["reference_kind"] == "measured" and found["rating"] is not None


def test_shells_are_not_tuned_by_yarns_that_they_do_not_read(imported):
    assert judged_as_input(tuned(imported, ["Vmine warp max. tensile force"], "macro"))


def test_a_strip_of_another_laboratory_judges_a_row_but_not_a_curve_it_may_be(imported):
    """A renamed copy of the curve that was fitted cannot be told from it; a row is of the fabric's own tests."""
    other = raw(imported / "warp-other.csv", 1.56, 1.02 * strip_force(1.56))
    for label, kind in (("Vmine warp max. tensile force", "measured"), ("warp curve elsewhere.csv", "tuned")):
        tuned(imported, [label])
        assert compared(other, scale="meso")["reference_kind"] == kind
    tuned(imported, ["Vmine warp max. tensile force"])
    copy = imported / "warp-copy.csv"
    copy.write_bytes((imported / "data/mine/warp/specimen-02.csv").read_bytes())
    assert compared(copy, scale="meso")["reference_kind"] == "tuned"


def test_the_fabrics_own_curve_beside_its_yarns_is_tuned_too(imported):
    tuned(imported, ["Vmine warp max. tensile force"])
    for direction, kind in (("warp", "tuned"), ("weft", "measured")):
        run = resolve(test="tensile", variant="mine", scale="meso", direction=direction)
        assert REPORTS["tensile"].reference_curve(run).kind == kind
