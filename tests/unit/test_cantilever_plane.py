"""The overhang that a cantilever looks for: its error by a chord that misses the plane, and planes not at 41.5 deg."""

import math
from pathlib import Path
from typing import Any

import pytest
from report_sample import write_run

from knittest.base.errors import InputError
from knittest.base.interrupts import Interrupts
from knittest.config.loading import resolve
from knittest.laboratory.cantilever.corrections import after_drift, at_the_plane
from knittest.laboratory.cantilever.test import given_overhang, stiffness_by_overhang
from knittest.laboratory.numerical_error import mesh_factor
from knittest.laboratory.report_base import REPORTS, TESTS
from knittest.materials.heavy_elastica import chord_angle, overhang_ratio, stiffness_of
from knittest.runs.options import RunOptions
from knittest.studies import verify
from knittest.studies.trials.trial import Record

STIFFNESS, WEIGHT = 5.0, 8e-6
FOUND = {"overhang_mm": 171.0, "bending_stiffness_eq2_n_mm_per_width": 5.0}


def cantilever(*sets: str) -> Any:
    return resolve(test="cantilever", scale="macro", variant="1", direction="warp", sets=list(sets))


def overhang_at(angle: float, stiffness: float, weight: float) -> float:
    """Overhang [mm] at which a strip has the chord ``angle``: w L^3 / B is that of a strip of 1 mm under 1 N/mm."""
    return float((stiffness / (weight * stiffness_of(angle, 1.0, 1.0))) ** (1.0 / 3.0))


@pytest.mark.parametrize(("angle", "other"), [(41.5, 41.2), (30.0, 41.5), (45.0, 45.0)])
def test_the_ratio_of_overhangs_is_that_of_one_strip(angle: float, other: float) -> None:
    there = overhang_at(other, STIFFNESS, WEIGHT) * overhang_ratio(angle, other)
    assert chord_angle(there, WEIGHT, STIFFNESS) == pytest.approx(angle, abs=1e-3)


def error_of(folder: Path, monkeypatch: Any, mode: str, chords: tuple[float, float, float]) -> dict[str, Any]:
    """Numerical errors of a run and its repeats, of the same overhang, with ``chords`` [deg]."""
    own, half, mesh = (FOUND | {"chord_angle_deg": chord} for chord in chords)
    write_run(folder, "cantilever", sets=["output.verify=true", f"rig.mode={mode}"], results=own)

    def run(trials: Any, outcome: Any, options: Any) -> dict[str, Record]:
        cost = {"wall_s": 1.0, "cpu_s": 1.0}
        return {
            trial.key: Record(trial.key, "completed", "", {"results": results, "cost": cost})
            for trial, results in zip(trials, (half, mesh), strict=True)
        }

    monkeypatch.setattr(verify, "_records", run)
    found = verify.finished(resolve(config=folder / "config.yaml"), folder)
    return verify.verified(found, RunOptions(quiet=True), Interrupts()).summary


def test_an_overhang_taken_within_the_tolerance_of_the_plane_is_not_exact(tmp_path: Path, monkeypatch: Any) -> None:
    """All three runs take the measured overhang at their first trial: their chords differ, and miss the plane."""
    chords = 41.54, 41.56, 41.45
    summary = error_of(tmp_path / "r", monkeypatch, "overhang", chords)
    own, half, mesh = (171.0 * overhang_ratio(41.5, chord) for chord in chords)
    told = summary["verification"]["mesh"]
    factor = mesh_factor(told["ratio"], told["finer"])
    expected = 4.0 * abs(half - own) + factor * abs(mesh - own) + abs(own - 171.0)
    error = summary["numerical_error"]["overhang_mm"]
    assert error["error"] == pytest.approx(expected, rel=1e-6) and error["error"] > abs(mesh - 171.0)
    assert error["half_speed_pct"] == pytest.approx(100.0 * (half / own - 1.0))
    stiffness = summary["numerical_error"]["bending_stiffness_eq2_n_mm_per_width"]["error"]
    assert stiffness / 5.0 == pytest.approx(3.0 * expected / 171.0, rel=0.01)


def test_a_chord_off_the_plane_alone_leaves_an_error(tmp_path: Path, monkeypatch: Any) -> None:
    summary = error_of(tmp_path / "r", monkeypatch, "overhang", (41.74, 41.74, 41.74))
    assert summary["numerical_error"]["overhang_mm"]["error"] == pytest.approx(0.0032 * 171.0, rel=0.1)
    assert summary["numerical_error"]["chord_angle_deg"]["error"] == 0.0


def test_an_overhang_that_was_given_has_no_error(tmp_path: Path, monkeypatch: Any) -> None:
    summary = error_of(tmp_path / "r", monkeypatch, "angle", (41.54, 41.56, 41.45))
    assert summary["numerical_error"]["overhang_mm"]["error"] == 0.0


def test_results_without_a_chord_stay_as_they_are() -> None:
    run = cantilever("rig.mode=overhang")
    for chord in (None, float("nan"), 0.2):
        assert at_the_plane(run, FOUND | {"chord_angle_deg": chord})["overhang_mm"] == 171.0
    assert at_the_plane(run, {"chord_angle_deg": 40.0, "overhang_mm": None})["overhang_mm"] is None


@pytest.mark.parametrize("plane", [30.0, 41.5, 45.0])
def test_eq_2_is_that_of_the_strip_at_any_plane(plane: float) -> None:
    """Eq. 2 holds at 41.5 deg alone: taken at 30 deg as it is, it is 0.6 of the stiffness."""
    run = cantilever("rig.mode=overhang", f"rig.plane_angle={plane}")
    weight = run.fabric.area_mass_g_per_mm2 * run.rig.gravity_mm_per_ms2
    assert stiffness_by_overhang(run, overhang_at(plane, 5.0, weight), plane) == pytest.approx(5.0, rel=1e-3)


@pytest.mark.parametrize("chord", [30.0, 41.5, 60.0])
def test_eq_2_of_a_given_overhang_is_by_the_chord_that_was_found(chord: float) -> None:
    """The overhang is an input and the chord what the run finds: a strip twice as stiff gives twice the stiffness."""
    run = cantilever()
    weight = run.fabric.area_mass_g_per_mm2 * run.rig.gravity_mm_per_ms2
    assert run.rig.mode == "angle"
    assert stiffness_by_overhang(run, overhang_at(chord, 5.0, weight), chord) == pytest.approx(5.0, rel=1e-3)
    given = 171.0
    stiff, soft = (weight * given**3 * stiffness_of(angle, 1.0, 1.0) for angle in (20.0, 45.0))
    found = [stiffness_by_overhang(run, given, angle) for angle in (20.0, 45.0)]
    assert found == pytest.approx([stiff, soft], rel=1e-3) and stiff > 2.0 * soft


@pytest.mark.parametrize("mode", ["angle", "overhang"])
def test_the_error_of_yarns_holds_what_the_last_drift_would_change(tmp_path: Path, monkeypatch: Any, mode: str) -> None:
    """All runs agree, and the chord still moved by 0.3 deg: that is known no better."""
    monkeypatch.setitem(FOUND, "drift_deg", -0.3)
    errors = error_of(tmp_path / "r", monkeypatch, mode, (41.5, 41.5, 41.5))["numerical_error"]
    ratio = overhang_ratio(41.5, 41.8)
    assert errors["chord_angle_deg"]["error"] == pytest.approx(0.3)
    assert errors["bending_stiffness_eq2_n_mm_per_width"]["error"] == pytest.approx(5.0 * (1.0 - ratio**3), rel=1e-6)
    expected = 171.0 * (1.0 - ratio) if mode == "overhang" else 0.0
    assert errors["overhang_mm"]["error"] == pytest.approx(expected, abs=1e-9) and ratio < 1.0
    known = {"chord_angle_deg": 41.5, "overhang_mm": 171.0}
    assert known.items() <= after_drift(cantilever(f"rig.mode={mode}"), known).items()


@pytest.mark.parametrize("chord", [0.5, 86.0, float("nan")])
def test_a_chord_that_tells_no_stiffness_gives_none(chord: float) -> None:
    assert math.isnan(stiffness_by_overhang(cantilever(), 171.0, chord))


def test_the_measured_overhang_is_compared_at_the_plane_of_the_run() -> None:
    (measured,), (at_30,) = (_rows(plane, "overhang") for plane in (41.5, 30.0))
    assert at_30.mean / measured.mean == pytest.approx(overhang_ratio(30.0, 41.5)) and at_30.mean < measured.mean
    assert at_30.sd / at_30.mean == pytest.approx(measured.sd / measured.mean)
    assert "30 instead of 41.5 deg" in at_30.scaled and "30 instead of 41.5 deg" in at_30.table
    assert not measured.scaled and _rows(30.0, "angle")[0].mean == measured.mean


def _rows(plane: float, mode: str) -> Any:
    from knittest.base.files import data_dir
    from knittest.experiment.tables import published

    run = cantilever(f"rig.mode={mode}", f"rig.plane_angle={plane}")
    rows = published(data_dir() / "pham2019", "1", "warp", ("overhang_mm",))
    return REPORTS["cantilever"].scaled(run, rows)


def test_an_overhang_that_was_not_measured_is_that_of_the_model_of_the_run() -> None:
    """B of shells is that of their card, of yarns that of a yarn times their density; both may be of two fabrics.

    Studies need a stated one: an estimate would follow the stiffness of every sample.
    """
    for scale, stiffness in (("macro", 5.05), ("meso", 15.0 * 0.28)):
        run = resolve(test="cantilever", scale=scale, variant="1", direction="warp", sets=["fabric.experiment=null"])
        likely = round(2.0 * (stiffness / (824.2e-6 * 9.81e-3)) ** (1.0 / 3.0))
        with pytest.raises(InputError, match=rf"chord angle of 41.5 deg gives --set rig\.overhang={likely}$"):
            given_overhang(run)
        found, said = TESTS["cantilever"].completed(run)
        assert found.rig.overhang == likely and said.endswith(f"gives {likely} mm")
        assert TESTS["cantilever"].completed(found) == (found, "")
