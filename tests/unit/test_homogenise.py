"""Tests of yarns become the card that they ask for, once, and a lost one never does."""

import signal
from pathlib import Path

import numpy as np
import pytest
from homogenise_cases import BENDING, OUT, STRAIN, YARN_FORCE, Formulas, homogenise, outcome, pull, shear

from knittest.base.errors import InputError, NumericalError, ResourceError
from knittest.base.interrupts import Interrupted
from knittest.cli.main import run as knittest
from knittest.config.loading import resolve
from knittest.experiment.curves import load_curve
from knittest.laboratory.base import fabric_laminate
from knittest.materials.heavy_elastica import chord_angle, stiffness_of
from knittest.runs.specimen import prepare
from knittest.studies.homogenise.card import LEAST_TANGENT, tension_curve
from knittest.studies.homogenise.plan import PLANNED_TESTS, Request, meso_run

#: yarns of variant 2 in 100 mm
DENSITY = {"warp": 28.0, "weft": 41.0}


def test_the_card_is_the_material(tmp_path, monkeypatch):
    """Of 20 weft yarns at 41 in 100 mm, which are 48.8 mm wide, the card holds the force per width."""
    assert homogenise(tmp_path, monkeypatch, Formulas()) == 0
    macro = resolve(fabric=OUT / "fabric.yaml", scale="macro").fabric.macro
    for direction, last in STRAIN.items():
        curve = load_curve(Path(macro.tension[direction]))
        peak = YARN_FORCE * 0.01 * DENSITY[direction]
        expected = 0.01 * DENSITY[direction] * pull(curve.x, last)
        assert curve.y_name == "force_n_per_mm" and curve.conditions.direction == direction
        assert curve.conditions.strip_width_mm == pytest.approx({"warp": 50.0, "weft": 20 / 0.41}[direction], rel=1e-5)
        assert np.abs(curve.mean - expected).max() < 2e-3 * peak and curve.kind == "simulated"
        assert curve.peak[1] == pytest.approx(peak, rel=5e-3)
        assert getattr(macro.fracture_strain, direction).value == pytest.approx(last, rel=2e-3)
        assert getattr(macro.bending_stiffness, direction).value == pytest.approx(BENDING[direction], rel=1e-5)
    law = load_curve(Path(macro.shear.curve))
    assert law.mean[1:] == pytest.approx(shear(law.x[1:]), rel=5e-3) and law.x[-1] > 43.0
    sheet = fabric_laminate(resolve(fabric=OUT / "fabric.yaml", scale="macro", preset="quick"))
    assert sheet.fail_strain == pytest.approx([0.016, 0.018], rel=2e-3)
    assert 2.0 * sheet.outer * sheet.layer_offset**2 == pytest.approx([6.0, 4.0], rel=1e-5)
    with pytest.raises(InputError, match="shear law"):
        prepare(resolve(fabric=OUT / "fabric.yaml", scale="macro", test="picture-frame", sets=["rig.max_angle=60"]))


def test_every_number_says_where_it_comes_from(tmp_path, monkeypatch):
    homogenise(tmp_path, monkeypatch, Formulas())
    (tmp_path / "elsewhere").mkdir()
    moved = tmp_path / "moved"
    (tmp_path / OUT).rename(moved)
    monkeypatch.chdir(tmp_path / "elsewhere")
    fabric = resolve(fabric=moved / "fabric.yaml", scale="macro").fabric
    keys = {path.name for path in (moved / "trials").iterdir()}
    macro = fabric.macro
    told = [macro.fracture_strain.warp, macro.bending_stiffness.weft, macro.shear]
    assert all(one.source == "derived" and "pham2019-v2, calibrated, preset quick, seed 1" in one.ref for one in told)
    assert macro.bending_stiffness.weft.ref.split("trials/")[1][16:].startswith(": cantilever weft, meso")
    assert macro.shear.ref.split("trials/")[1][:16] in keys
    text = (moved / "data/tension-weft.csv").read_text()
    assert "# kind: simulated" in text and "tensile weft, meso" in text
    assert fabric.name == "pham2019-v2-homogenised" and fabric.reinforcing is not None


def test_yarns_that_break_leave_a_curve_that_shells_take(tmp_path):
    """Every break lets the force fall by a third; the card's curve rises, and its end is that of the run."""
    strain = np.linspace(0.0, 2.0, 900)
    force = 3000.0 * strain * np.where((strain % 0.5 < 0.05) & (strain > 0.9), 0.67, 1.0)
    e, f = tension_curve(strain, force)
    tangents = np.diff(f) / np.diff(e)
    assert tangents.min() >= LEAST_TANGENT * f[-1] / e[-1] * (1.0 - 1e-6)
    assert (e[-1], f[-1]) == pytest.approx((strain[np.argmax(force)], force.max()))
    assert np.abs(f[e < 0.85] - 3000.0 * e[e < 0.85]).max() < 1.0
    for angle in (5.0, 41.5, 80.0):
        assert chord_angle(150.0, 8e-6, stiffness_of(angle, 150.0, 8e-6)) == pytest.approx(angle, abs=1e-4)
    with pytest.raises(NumericalError, match="40 rows up to the largest force; expected at least 80"):
        tension_curve(strain[:40], force[:40])


@pytest.mark.parametrize(
    ("scale", "status"),
    [("meso", "failed"), ("meso", "refused"), ("meso", "timeout"), ("meso", "crashed"), ("macro", "refused")],
)
def test_a_lost_test_leaves_no_card_and_says_why(tmp_path, monkeypatch, status, scale):
    assert homogenise(tmp_path, monkeypatch, Formulas()) == 0 and (tmp_path / OUT / "fabric.yaml").exists()
    request = Request(variant="2", preset="quick", sets=("cantilever.rig.overhang=150",))
    lost = (scale, "cantilever", "weft")

    def ends(trial):
        run = trial.run
        return status if (run.model.scale, run.rig.kind, run.direction) == lost else "completed"

    assert homogenise(tmp_path, monkeypatch, Formulas(ends), request) == 3
    found = outcome(tmp_path)
    assert found["reason"] == f"{scale}: cantilever weft {status}: {status} on purpose"
    assert found["card"] is None and found["numbers"] == {} and not (tmp_path / OUT / "fabric.yaml").exists()
    assert [one["status"] for one in found["runs"] if one["status"] != "completed"] == [status]


def test_what_is_finished_is_not_run_again(tmp_path, monkeypatch):
    class Stopping(Formulas):
        def run(self, *arguments):
            for record in super().run(*arguments):
                if len(self.asked) == 3:
                    signal.raise_signal(signal.SIGINT)
                yield record

    first, second, third = Stopping(), Formulas(), Formulas()
    with pytest.raises(Interrupted, match="run the same command again to resume"):
        homogenise(tmp_path, monkeypatch, first)
    assert homogenise(tmp_path, monkeypatch, second) == 0
    assert first.asked == ["tensile warp, meso", "tensile weft, meso", "picture-frame, meso"]
    assert second.asked[:3] == ["picture-frame, meso", "cantilever warp, meso", "cantilever weft, meso"]
    assert len(second.asked) == 8
    before = outcome(tmp_path)["check"]
    assert homogenise(tmp_path, monkeypatch, third) == 0
    assert third.asked == [] and outcome(tmp_path)["check"] == before
    assert outcome(tmp_path)["note"] == ""
    (tmp_path / "b").mkdir()
    full = Formulas(lambda trial: "blocked" if trial.run.rig.kind == "picture-frame" else "completed")
    with pytest.raises(ResourceError, match="finished runs are kept"):
        homogenise(tmp_path / "b", monkeypatch, full)
    again = Formulas()
    assert homogenise(tmp_path / "b", monkeypatch, again) == 0 and again.asked[0] == "picture-frame, meso"


def test_shells_that_deviate_are_told(tmp_path, monkeypatch):
    assert homogenise(tmp_path, monkeypatch, Formulas(factor=1.08), picture=True) == 5
    found = outcome(tmp_path)
    assert found["status"] == "not reproduced" and found["largest_deviation_pct"] == pytest.approx(8.0, abs=0.3)
    by_name = {(row["test"], row["quantity"]): row for row in found["check"]}
    frame = by_name["picture-frame", "normalised force at 30 deg"]
    assert frame["deviation"] == pytest.approx(8.0, abs=0.1) and not frame["within"]
    assert frame["yarns"] == pytest.approx(shear(30.0) / np.cos(np.pi / 6), rel=1e-2)
    assert by_name["cantilever warp", "bending stiffness"]["shells"] == pytest.approx(1.08 * BENDING["warp"], rel=1e-4)
    assert by_name["tensile weft", "strain there"]["within"] and by_name["cantilever weft", "chord angle"]["within"]
    assert (tmp_path / OUT / "fabric.yaml").exists() and (tmp_path / OUT / "homogenise.png").stat().st_size > 20_000


def test_settings_go_to_the_tests_they_name():
    sets = ("picture-frame.rig.side=30", "cantilever.rig.overhang=90", "model.meso.elements_per_wave=6")
    runs = {piece.name: meso_run(Request(variant="1", preset="quick", sets=sets), piece) for piece in PLANNED_TESTS}
    assert runs["picture-frame"].rig.side == 30.0 and runs["tensile warp"].rig.gauge_length == 50.0
    assert runs["cantilever warp"].rig.overhang == 90.0
    assert {run.model.meso.elements_per_wave for run in runs.values()} == {6}
    alone = meso_run(Request(variant="1", preset="quick"), PLANNED_TESTS[3]).rig
    assert alone.overhang == pytest.approx(160.8, abs=0.2)  # Eq. 2 of 15.0 N mm2, tuned; 171 mm with that of the strip


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "which fabric?"),
        (["--variant", "cao2008-weave"], "the meso scale needs loop_length, reinforcing, knitting"),
        (["--variant", "1", "--set", "rig.gauge_length=50"], "rig.gauge_length"),
        (["--variant", "1", "--set", "variability.specimens=3"], "a card is made of single specimens"),
    ],
)
def test_bad_commands_run_nothing(tmp_path, monkeypatch, capsys, arguments, said):
    monkeypatch.chdir(tmp_path)
    assert knittest(["homogenise", *arguments]) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "runs").exists()
