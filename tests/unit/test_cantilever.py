"""Cantilever: root curvature, membrane share, rest of yarns, and errors by the chord and the plane."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from report_sample import write_run

from knittest.base.errors import InputError
from knittest.base.history import History, Quality
from knittest.base.interrupts import Interrupts
from knittest.config.loading import resolve
from knittest.config.yaml_writer import dump
from knittest.laboratory.base import PreparedSpecimen, fabric_laminate
from knittest.laboratory.cantilever import meso_strip
from knittest.laboratory.cantilever.corrections import CantileverCorrections
from knittest.laboratory.cantilever.macro_strip import StripMount, mount_shells, root_curvature
from knittest.laboratory.cantilever.test import Cantilever, given_overhang, stiffness_by_overhang
from knittest.laboratory.numerical_error import mesh_factor
from knittest.laboratory.report_base import REPORTS, TESTS
from knittest.materials.heavy_elastica import chord_angle, heavy_elastica, overhang_ratio, stiffness_of
from knittest.materials.laminate import scale_membrane, share_for_bending
from knittest.runs.options import RunOptions
from knittest.solve.relaxation import Relaxation
from knittest.solve.state import Observer, SimulationCost
from knittest.studies import verify
from knittest.studies.trials.trial import Record

OVERHANG, WEIGHT = 171.0, 4.6e-4
STIFFNESS = WEIGHT * OVERHANG**3 / 8.0


@pytest.mark.parametrize("rows", [4, 10, 17, 34])
def test_a_coarse_strip_has_the_curvature_of_its_root_moment(rows: int) -> None:
    """M = w int x ds, kappa = M / B, from yarns (from two rows the stiffness came out a thousandfold) and from shells.

    Of shells by their turns: by their deflection, which shear and the rows' chords add to, it was 5 to 12 % too small.
    """
    arc = np.linspace(0.0, OVERHANG, 4001)
    moment = WEIGHT * np.trapezoid(heavy_elastica(arc, OVERHANG, WEIGHT, STIFFNESS)[0], arc)
    along = np.concatenate([[-OVERHANG / rows], np.linspace(0.0, OVERHANG, rows + 1)])
    reach, drop, turns = heavy_elastica(along, OVERHANG, WEIGHT, STIFFNESS)
    flat, now = (np.column_stack([0.0 * along, y, z]) for y, z in ((along, 0.0 * along), (reach, -drop)))
    assert StripMount(flat, np.zeros(len(along))).curvature(now) == pytest.approx(moment / STIFFNESS, rel=0.015)
    found = root_curvature(np.repeat(along, 2), np.repeat(np.where(along > 0.0, turns, 0.0), 2))
    assert found == pytest.approx(moment / STIFFNESS, rel=0.015)


def test_a_mount_that_only_holds_is_no_rig() -> None:
    """Nothing moves: no time passes, and nobody can simulate it by mistake."""
    held = PreparedSpecimen(None, StripMount(np.zeros((2, 3)), np.zeros(2)))  # type: ignore[arg-type]
    assert held.duration == 0.0
    with pytest.raises(TypeError, match="StripMount is a holder"):
        _ = held.rig
    assert not {"finished", "channels", "duration", "ring_time"} & set(dir(held.mount))


def test_shells_of_a_short_overhang_are_no_longer_across_than_along() -> None:
    """Four rows over 10 mm of shells 10 mm across: the chord came out 27 % too steep, the stiffness 62 % too small."""
    sets = ["rig.overhang=10", "model.macro.element_size=10"]
    run = resolve(test="cantilever", variant="1", scale="macro", preset="quick", direction="warp", sets=sets)
    place = mount_shells(run, 10.0).model.position()
    across, along = (np.diff(np.unique(np.round(place[:, k], 6))).max() for k in (0, 1))
    assert along == pytest.approx(2.5) and across <= along * 1.01


STIFF = "fabric.macro.bending_stiffness.warp=200"


def prepared(*sets: str) -> tuple[Any, PreparedSpecimen]:
    run = resolve(test="cantilever", scale="macro", preset="quick", variant="1", direction="warp", sets=list(sets))
    return run, Cantilever().prepare(run)


def judged(run: Any, mounted: PreparedSpecimen, hourglass: float = 0.0) -> Quality:
    """A strip at rest, its hourglass over its internal energy."""
    last = {"root_moment_nmm": 1.0, "weight_moment_nmm": 1.0, "converged": 1.0, "drift_deg": 0.0, "steps": 9.0} | {
        "hourglass_over_internal": hourglass
    }
    energies = {name: np.array([value]) for name, value in last.items()}
    return Cantilever().assess(run, mounted, History(mounted.model.mesh, {}, energies, []), SimulationCost())


def warned(run: Any, mounted: PreparedSpecimen) -> tuple[str, ...]:
    """Warnings on a strip at rest that no gate refuses."""
    quality = judged(run, mounted)
    assert not quality.failures
    return quality.warnings


@pytest.mark.parametrize(("sets", "share"), [((), 0.01), ((STIFF, "rig.membrane_share=0.5"), 0.5)])
def test_the_default_is_kept_where_it_is_enough_and_so_is_a_share_that_is_chosen(
    sets: tuple[str, ...], share: float
) -> None:
    run, mounted = prepared(*sets)
    assert mounted.facts["membrane_share"] == share and not warned(run, mounted)


def test_a_stiff_fabric_takes_what_is_enough_and_says_so() -> None:
    run, mounted = prepared(STIFF)
    share = mounted.facts["membrane_share"]
    card = fabric_laminate(run)
    assert (scale_membrane(card, share).slope > 0.0).all()
    with pytest.raises(InputError, match="leaves less membrane stiffness"):
        scale_membrane(card, 0.75 * share)  # hardly more than is needed
    (told,) = warned(run, mounted)
    assert f"rig.membrane_share = {share:g} instead of the default 0.01" in told


@pytest.mark.parametrize("share", ["0.01", "0.011"])  # the usual one as well, where it is chosen
def test_a_share_that_is_chosen_is_refused_where_it_is_too_small(share: str) -> None:
    with pytest.raises(InputError, match=r"use --set rig\.membrane_share"):
        prepared(STIFF, f"rig.membrane_share={share}")


def test_a_run_that_goes_on_from_its_folder_keeps_who_chose(tmp_path: Any) -> None:
    for sets, chosen in (((), None), (("rig.membrane_share=0.01",), 0.01)):
        path = tmp_path / "config.yaml"
        path.write_text(dump(prepared(*sets)[0]))
        assert resolve(config=path).rig.membrane_share == chosen


def test_enough_is_what_is_kept_unless_bending_needs_more() -> None:
    card = fabric_laminate(prepared()[0])
    least = float((2.0 * card.outer / (card.slope[:, 0] + 2.0 * card.outer)).max())
    assert share_for_bending(card, 1.01 * least) == 1.01 * least
    assert 1.2 * least <= share_for_bending(card, 0.99 * least) <= 1.2 * least + 0.01


@pytest.mark.parametrize(
    ("share", "failures", "warnings"), [(0.024, 0, 0), (0.026, 0, 1), (0.051, 1, 0), (np.nan, 1, 0)]
)
def test_hourglass_energy_of_a_strip_at_rest_is_judged(share: float, failures: int, warnings: int) -> None:
    quality = judged(*prepared(), share)
    assert (len(quality.failures), len(quality.warnings)) == (failures, warnings)
    told = [*quality.failures, *quality.warnings]
    assert all(text.startswith("hourglass energy over internal energy") for text in told)
    assert "model.macro.element_size" in "".join(quality.failures) or share != 0.051
    assert quality.hourglass_over_internal_max == pytest.approx(share, nan_ok=True)


def at_rest(monkeypatch, residual) -> tuple[Relaxation, list[float], list[int]]:
    """Relaxation of a strip whose residual is that of each turn, progress, and steps between the turns."""
    asked: list[int] = []
    rubbed: list[int] = []

    class Course:
        dt, overlaps, has_friction = 1e-3, None, False
        sections = SimpleNamespace(limit_turns=lambda curvature, most: curvature)

        def __init__(self, *_) -> None:
            self.done = Relaxation()

        def settle(self, steps: int, look=None) -> np.ndarray:
            asked.append(steps)
            return np.zeros(9)

        def update_residual(self, moments) -> None:
            self.done.residual = residual(len(asked) - 2)
            self.done.converged = self.done.residual < meso_strip.BALANCED

        def turn(self, *_) -> None:
            pass

        def rub(self) -> None:
            rubbed.append(len(asked) - 2)

        def carried(self) -> float:
            return 1.0

    model = SimpleNamespace(
        state=dict, restore=lambda state: None, fields=dict, position=lambda: np.zeros((1, 3)), n_nodes=1
    )
    mounting = SimpleNamespace(flat=np.zeros((1, 3)), moment=lambda now: 1.0, curvature=lambda now: 1.0)
    for name, value in {
        "_StripRelaxation": Course, "_strip_mount": lambda prepared: mounting, "_bend": lambda *_: None,
        "_chord_angle": lambda *_: 40.0, "_tips": lambda *_: [0],
    }.items():  # fmt: skip
        monkeypatch.setattr(meso_strip, name, value)
    run = resolve(variant="1", scale="meso", test="cantilever", preset="quick", direction="warp")
    prepared = SimpleNamespace(facts={"overhang_mm": 100.0, "width_mm": 25.0}, model=model)
    observer, shares = Observer(), list[float]()
    monkeypatch.setattr(observer, "relaxation_progress", shares.append, raising=False)
    found = meso_strip.relax_yarns(prepared, run, SimpleNamespace(), observer)
    assert rubbed in ([], [meso_strip.RUBBING])
    return found.relaxation, shares, asked[2:]


def test_a_strip_that_comes_to_rest_late_gets_the_turns_it_needs(monkeypatch):
    found, shares, steps = at_rest(monkeypatch, lambda turn: 0.5 * 0.9**turn)
    assert found.converged and len(steps) == 44
    assert set(steps) == {meso_strip.BETWEEN}
    assert shares == sorted(shares) and [shares[0], 1.0] == pytest.approx(
        [2.0 * meso_strip.FIRST, shares[-1]], abs=0.02
    )


@pytest.mark.parametrize(
    ("residual", "turns"),
    [
        (lambda turn: 0.1 if turn < 5 else 0.02, meso_strip.RUBBING + meso_strip.STALLED),
        (lambda turn: 0.1 - 1e-4 * turn, meso_strip.MOST_TURNS),
    ],
)
def test_a_strip_that_no_turn_improves_or_that_takes_too_many_is_given_up(monkeypatch, residual, turns):
    found, _, steps = at_rest(monkeypatch, residual)
    assert not found.converged and len(steps) == turns


FOUND = {"overhang_mm": 171.0, "bending_stiffness_eq2_n_mm_per_width": 5.0}


def cantilever(*sets: str) -> Any:
    return resolve(test="cantilever", scale="macro", variant="1", direction="warp", sets=list(sets))


def overhang_at(angle: float, stiffness: float, weight: float) -> float:
    """Overhang [mm] at which a strip has the chord ``angle``: w L^3 / B is that of a strip of 1 mm under 1 N/mm."""
    return float((stiffness / (weight * stiffness_of(angle, 1.0, 1.0))) ** (1.0 / 3.0))


@pytest.mark.parametrize(("angle", "other"), [(41.5, 41.2), (30.0, 41.5), (45.0, 45.0)])
def test_the_ratio_of_overhangs_is_that_of_one_strip(angle: float, other: float) -> None:
    there = overhang_at(other, 5.0, 8e-6) * overhang_ratio(angle, other)
    assert chord_angle(there, 8e-6, 5.0) == pytest.approx(angle, abs=1e-3)


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
    found = verify.read_outcome(resolve(config=folder / "config.yaml"), folder)
    return verify.verify_outcome(found, RunOptions(quiet=True), Interrupts()).summary


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


@pytest.mark.parametrize(
    ("mode", "chords", "overhang"),
    [("overhang", (41.74, 41.74, 41.74), 0.0032 * 171.0), ("angle", (41.54, 41.56, 41.45), 0.0)],
)
def test_a_chord_off_the_plane_alone_leaves_an_error_unless_the_overhang_was_given(
    tmp_path: Path, monkeypatch: Any, mode: str, chords: tuple[float, float, float], overhang: float
) -> None:
    errors = error_of(tmp_path / "r", monkeypatch, mode, chords)["numerical_error"]
    assert errors["overhang_mm"]["error"] == pytest.approx(overhang, rel=0.1)
    assert mode == "angle" or errors["chord_angle_deg"]["error"] == 0.0


def test_results_without_a_chord_stay_as_they_are() -> None:
    run = cantilever("rig.mode=overhang")
    for chord in (None, float("nan"), 0.2):
        assert CantileverCorrections().exact(run, FOUND | {"chord_angle_deg": chord})["overhang_mm"] == 171.0
    assert CantileverCorrections().exact(run, {"chord_angle_deg": 40.0, "overhang_mm": None})["overhang_mm"] is None


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
    assert (
        known.items() <= CantileverCorrections().correct_to_equilibrium(cantilever(f"rig.mode={mode}"), known).items()
    )


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
    from knittest.experiment.tables import published_rows

    run = cantilever(f"rig.mode={mode}", f"rig.plane_angle={plane}")
    rows = published_rows(data_dir() / "pham2019", "1", "warp", ("overhang_mm",))
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
