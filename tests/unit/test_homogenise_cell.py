"""Paths of a cell become the same card as tests of yarns, and a path that tells less never does."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from homogenise_cases import BENDING, OUT, STRAIN, YARN_FORCE, Formulas, coupled, homogenise, outcome, pull, shear

from knittest.cli.main import run as knittest
from knittest.config.loading import resolve
from knittest.experiment.curves import load_curve
from knittest.kernels.biaxial import sample_law
from knittest.laboratory.base import fabric_laminate
from knittest.studies.homogenise.plan import (
    KNIT_ANGLES,
    PATH_ANGLES,
    PLANNED_TESTS,
    PlannedTest,
    Request,
    cell_macro_run,
    cell_run,
    coupled_tests,
    macro_run,
    planned_tests,
    strains_at_end,
    width,
)

CELL = Request(variant="2", preset="quick", source="cell")
#: fabrics of other structures
CONFIGS = Path(__file__).parents[2] / "configs" / "fabrics"
COUPLED = Request(variant="2", preset="quick", source="cell", coupled=True)
DENSITY = {"warp": 28.0, "weft": 41.0}


def test_the_card_is_the_material_and_tells_of_the_cell(tmp_path, monkeypatch):
    """Force per width as it comes, and a shear law whose first step counts: a cell has no start-up of a frame."""
    assert homogenise(tmp_path, monkeypatch, Formulas(), CELL, picture=True) == 0
    macro = resolve(fabric=OUT / "fabric.yaml", scale="macro").fabric.macro
    for direction, last in STRAIN.items():
        curve = load_curve(Path(macro.tension[direction]))
        peak = YARN_FORCE * 0.01 * DENSITY[direction]
        assert np.abs(curve.mean - 0.01 * DENSITY[direction] * pull(curve.x, last)).max() < 2e-3 * peak
        fracture = getattr(macro.fracture_strain, direction)
        assert fracture.value == pytest.approx(last, rel=2e-3)
        assert f"path {direction} of a periodic cell, all yarns of equal strength" in fracture.ref
        assert getattr(macro.bending_stiffness, direction).value == pytest.approx(BENDING[direction], rel=1e-6)
    law = load_curve(Path(macro.shear.curve))
    assert law.x[1] == pytest.approx(1.25, abs=0.06) and law.x[-1] == pytest.approx(41.25, abs=0.1)
    assert law.mean[1:] == pytest.approx(shear(law.x[1:]), rel=5e-3)
    assert "equal" not in macro.shear.ref and "path shear of a periodic cell" in macro.shear.ref
    found = outcome(tmp_path)
    assert found["status"] == "reproduced" and len(found["check"]) == 16
    assert "fail at a lower force and strain than this card" in found["note"]
    assert [one["test"] for one in found["runs"] if one["scale"] == "cell"] == [piece.name for piece in PLANNED_TESTS]


def test_shells_that_deviate_are_told(tmp_path, monkeypatch):
    request = Request(variant="2", preset="quick", source="cell", sets=("tensile.rig.max_strain=1.7",))
    assert homogenise(tmp_path, monkeypatch, Formulas(), request) == 3  # of yarns that do not fail there is no card
    assert "path weft: no yarn failed up to rig.max_strain = 1.7 %" in outcome(tmp_path)["reason"]
    assert homogenise(tmp_path, monkeypatch, Formulas(factor=1.08), CELL) == 5
    rows = {(row["test"], row["quantity"]): row for row in outcome(tmp_path)["check"]}
    for test, name in (
        ("tensile weft", "largest force"), ("picture-frame", "normalised force at 30 deg"),
        ("cantilever warp", "bending stiffness"),
    ):  # fmt: skip
        assert rows[test, name]["deviation"] == pytest.approx(8.0, abs=0.4)
    assert rows["tensile weft", "largest force"]["unit"] == "N/mm"


def test_paths_go_as_far_as_the_card_needs():
    runs = {piece.name: cell_run(CELL, piece) for piece in PLANNED_TESTS}
    yarn = runs["tensile weft"].fabric.reinforcing
    straight = (1.0 + yarn.crimp_fraction.weft) * (1.0 + yarn.fracture_strain_fraction) - 1.0
    assert runs["tensile weft"].rig.max_strain == pytest.approx(105.0 * straight, rel=1e-4)
    assert runs["tensile weft"].rig.at_fracture == "ends" and runs["tensile warp"].rig.path == "warp"
    assert runs["picture-frame"].rig.max_angle == 42.5 and runs["cantilever weft"].rig.bent_yarns == "weft"
    assert {run.rig.wales for run in runs.values()} == {1}
    loops = Request(variant="weft-only", preset="quick", source="cell")
    assert cell_run(loops, PLANNED_TESTS[2]).rig.max_angle == 60.0
    shorter = Request(variant="2", preset="quick", source="cell", sets=("picture-frame.rig.max_angle=30",))
    assert cell_run(shorter, PLANNED_TESTS[2]).rig.max_angle == 30.0


def test_shells_are_as_wide_as_whole_yarns_and_hang_as_the_card_says(tmp_path, monkeypatch):
    homogenise(tmp_path, monkeypatch, Formulas(), CELL)
    for piece in PLANNED_TESTS:
        run = cell_macro_run(piece, cell_run(CELL, piece), OUT / "fabric.yaml", 41.26, {"warp": 6.0, "weft": 4.0})
        if piece.direction:
            assert run.rig.width == pytest.approx(width(run))
        else:
            assert run.rig.max_angle == 41.2
            frame = resolve(test="picture-frame", variant="2", scale="meso", preset="quick")
            angles = [macro_run(piece, frame, OUT / "fabric.yaml", end).rig.max_angle for end in (41.26, 60.0)]
            assert angles == [41.2, frame.rig.max_angle]  # within the law, whose file rounds its end
        if piece.kind == "cantilever":
            weight = run.fabric.area_mass_g_per_mm2 * 9.81e-3
            assert weight * (0.5 * run.rig.overhang) ** 3 == pytest.approx(BENDING[piece.direction], rel=2e-3)


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("rig.path=shear", "tensile warp of a cell needs rig.path = warp: remove this setting"),
        ("tensile.rig.at_fracture=refused", "needs rig.at_fracture = ends"),
        ("variability.specimens=3", "all yarns of a cell are equal"),
        ("tensile.rig.gauge_length=50", "gauge_length"),
    ],
)
def test_settings_that_make_another_path_are_refused(tmp_path, monkeypatch, capsys, setting, said):
    monkeypatch.chdir(tmp_path)
    assert knittest(["homogenise", "--variant", "1", "--from", "cell", "--set", setting]) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "runs").exists()


def test_paths_of_both_strains_become_one_law(tmp_path, monkeypatch):
    """Up to what strips of either direction reach; forces of the card are those of the energy of the paths."""
    assert homogenise(tmp_path, monkeypatch, Formulas(), COUPLED, picture=True) == 0
    run = resolve(fabric=OUT / "fabric.yaml", scale="macro")
    macro = run.fabric.macro
    assert macro.tension is None and macro.fracture_strain is None and macro.missing_card_parts == ()
    assert "9 paths of both strains of a periodic cell" in macro.biaxial.ref and macro.biaxial.source == "derived"
    card = fabric_laminate(run)
    end = [0.97 * strains_at_end(cell_run(COUPLED, coupled_tests(PATH_ANGLES)[i]))[k] for i, k in ((2, 0), (6, 1))]
    strain = np.random.default_rng(0).uniform(-0.5, 1.0, (500, 2)) * end
    expected = coupled(strain)
    inside = (expected >= 0.0).all(axis=1)
    found = sample_law(strain[inside], card)[:, :2]
    assert inside.sum() > 200 and np.abs(found - expected[inside]).max() < 0.01 * np.abs(expected).max()
    numbers = outcome(tmp_path)["numbers"]
    assert numbers["biaxial, deviation from an energy beyond 3 % of the strain [%]"] < 0.5
    assert numbers["biaxial, largest warp strain [%]"] == pytest.approx(100.0 * end[0], rel=0.01)
    rows = outcome(tmp_path)["check"]
    assert len([row for row in rows if row["test"].startswith("biaxial")]) == 18
    (tmp_path / "b").mkdir()
    assert homogenise(tmp_path / "b", monkeypatch, Formulas(factor=1.08), COUPLED) == 5


def test_paths_of_both_strains_stay_within_those_of_inlays():
    """Largest strains by direction; with rig.max_strain less."""
    ends = np.array([strains_at_end(cell_run(COUPLED, piece)) for piece in coupled_tests(PATH_ANGLES)[:9]])
    alone = [cell_run(CELL, PLANNED_TESTS[i]).rig.max_strain for i in range(2)]
    assert 100.0 * ends.max(axis=0) == pytest.approx(alone) and 100.0 * ends.min(axis=0) == pytest.approx(
        [-v for v in alone]
    )
    less = Request(variant="2", preset="quick", source="cell", coupled=True, sets=("biaxial.rig.max_strain=1.2",))
    run = cell_run(less, coupled_tests(PATH_ANGLES)[1])
    assert strains_at_end(run) == pytest.approx((0.012, -0.012 * np.tan(np.deg2rad(22.5)))) and run.solver.speed == 0.4


def test_one_law_needs_a_cell(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert knittest(["homogenise", "--variant", "1", "--coupled"]) == 2
    assert "needs paths of a cell: add --from cell" in capsys.readouterr().err
    assert (
        knittest(["homogenise", "--variant", "1", "--from", "cell", "--coupled", "--set", "biaxial.rig.path=warp"]) == 2
    )
    assert "biaxial -45 deg of a cell needs rig.path = steps" in capsys.readouterr().err


def test_paths_of_a_knit_go_far_and_end_at_a_force():
    """Loops stretch by up to 80 % and contract by up to 60 %; inlays of the other direction keep their own strains."""
    knit = Request(fabric=CONFIGS / "jersey.yaml", preset="quick", source="cell")
    assert [piece.angle for piece in planned_tests(knit)[: len(KNIT_ANGLES)]] == list(KNIT_ANGLES)
    runs = {angle: cell_run(knit, PlannedTest("biaxial", angle=angle)) for angle in (-60.0, 0.0, 45.0, 112.5)}
    ends = {angle: strains_at_end(run) for angle, run in runs.items()}
    assert ends[0.0] == pytest.approx((0.8, 0.0)) and ends[45.0] == pytest.approx((0.8, 0.8))
    assert ends[-60.0] == pytest.approx((0.6 / np.sqrt(3.0), -0.6)) and ends[112.5][1] == pytest.approx(0.8)
    assert all(run.rig.max_force == 1.0 and run.solver.speed <= 1.0 for run in runs.values())
    weft = Request(fabric=CONFIGS / "weft-only.yaml", preset="quick", source="cell")
    inlay = cell_run(weft, PlannedTest("biaxial", angle=90.0))
    assert strains_at_end(inlay)[1] == pytest.approx(1.05 * inlay.fabric.straight_failure_strain("weft"), rel=1e-3)
    assert strains_at_end(cell_run(weft, PlannedTest("biaxial", angle=45.0)))[1] == strains_at_end(inlay)[1]
    stated = replace(knit, sets=("biaxial.rig.max_strain=20",))
    assert strains_at_end(cell_run(stated, PlannedTest("biaxial", angle=0.0))) == pytest.approx((0.2, 0.0))
