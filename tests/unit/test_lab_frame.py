"""Import of picture frames: what it makes of displacement, sides, cycles and preload, against the closed form."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from strip_reading import refused

from knittest.base.errors import InputError
from knittest.base.kinds import kinds
from knittest.config.fabric import MacroMaterial
from knittest.config.loading import resolve
from knittest.experiment.conditions import UNKNOWN
from knittest.experiment.curves import load_curve
from knittest.experiment.lab_table import ReadOptions
from knittest.experiment.tables import published_rows
from knittest.laboratory.picture_frame.lab_files import LAB as FRAME_LAB
from knittest.laboratory.picture_frame.lab_files import shear_law
from knittest.laboratory.report_base import REPORTS
from knittest.materials.trellis import DEFINITIONS, crosshead, crosshead_force

FRAME, FABRIC = 200.0, 160.0
STIFFNESS = 0.1  # S = STIFFNESS gamma [N/mm]


def frame_file(path, side=FRAME, fabric=FABRIC, end=45.0, back=0.0, preload=0.0, offset=0.0, stiffness=STIFFNESS):
    """File that a machine writes of the linear law, with decimal commas; after ``end`` [deg] it goes ``back`` [deg]."""
    up = np.linspace(0.0, end, 181)
    angle = np.deg2rad(np.concatenate([up, np.arange(end - 0.5, end - back, -0.5)]))
    force = crosshead_force(stiffness * angle, angle, fabric, side) * np.where(np.arange(len(angle)) < 181, 1.0, 0.5)
    rows = [f"{d + offset:.6f};{f + preload:.6f}" for d, f in zip(crosshead(angle, side), force, strict=True)]
    head = [f"Rahmenlänge;{side:g};mm", f"Gewebeseite: {fabric / 10.0:g} cm", "Weg [mm];Kraft [N]"]
    path.write_text("\n".join(line.replace(".", ",") for line in [*head, *rows]) + "\n", encoding="utf-8")
    return path


def series(folder, *stiffnesses):
    """Frames that differ in their stiffness."""
    paths = [frame_file(folder / f"{k}.csv", stiffness=s) for k, s in enumerate(stiffnesses)]
    return [FRAME_LAB.read(path, ReadOptions())[0] for path in paths]


def test_a_frame_in_displacement_gives_the_law_back(tmp_path):
    (one,) = FRAME_LAB.read(frame_file(tmp_path / "a.csv"), ReadOptions())
    assert (one.frame_side, one.fabric_side, one.turned) == (FRAME, FABRIC, False)
    assert one.angle[-1] == pytest.approx(45.0, abs=1e-4)
    gamma = np.deg2rad(one.angle)
    assert one.normalised_force[1:] == pytest.approx((STIFFNESS * gamma / np.cos(gamma))[1:], rel=1e-3)
    angle, force = shear_law(FRAME_LAB.results([one], "", []).curves.band)
    assert (angle[0], force[0]) == (0.0, 0.0) and angle[-1] == pytest.approx(45.0, abs=1e-3)
    assert force == pytest.approx(STIFFNESS * np.deg2rad(angle), rel=2e-3) and (np.diff(angle) > 0.0).all()


def test_frames_of_any_side_give_one_curve_and_forces_of_their_own(tmp_path):
    found = {}
    for side, fabric in ((200.0, 160.0), (50.0, 50.0)):
        path = frame_file(tmp_path / f"{side:g}.csv", side, fabric)
        results = FRAME_LAB.results(FRAME_LAB.read(path, ReadOptions()), "", [])
        for angle in (10.0, 20.0, 30.0, 40.0):
            gamma = np.deg2rad(angle)
            expected = crosshead_force(STIFFNESS * gamma, gamma, fabric, side)
            assert results.found[f"shear_force_n_at_deg.{angle:g}"] == pytest.approx([expected], rel=1e-3)
        found[side] = results.curves.band
    assert found[200.0].mean == pytest.approx(found[50.0].mean, rel=1e-3)


def test_only_the_first_loading_counts(tmp_path):
    (one,) = FRAME_LAB.read(frame_file(tmp_path / "a.csv", back=40.0), ReadOptions())
    (alone,) = FRAME_LAB.read(frame_file(tmp_path / "b.csv"), ReadOptions())
    assert one.turned and one.angle == pytest.approx(alone.angle) and one.force == pytest.approx(alone.force)
    assert any("first loading only" in line for line in FRAME_LAB.lines([one]))


def test_a_start_that_is_not_square_or_not_free_of_force_is_asked_about(tmp_path):
    path = frame_file(tmp_path / "a.csv", offset=3.0)
    words = r"starts at 3, a shear angle of 1\.\d+ deg .*--zero, .* for the frame square"
    refused(words, FRAME_LAB.read, path, ReadOptions())
    (moved,) = FRAME_LAB.read(path, ReadOptions(zero=3.0))
    (alone,) = FRAME_LAB.read(frame_file(tmp_path / "b.csv"), ReadOptions())
    assert moved.angle == pytest.approx(alone.angle, abs=1e-3)
    assert FRAME_LAB.read(path, ReadOptions(zero=0.0))[0].angle[0] == pytest.approx(1.22, abs=0.01)
    path = frame_file(tmp_path / "c.csv", preload=5.0)
    words = r"the force starts at 5 N \(its maximum is 31\.27 N.*--preload subtract"
    refused(words, FRAME_LAB.read, path, ReadOptions())
    assert FRAME_LAB.read(path, ReadOptions(preload="subtract"))[0].force == pytest.approx(alone.force, abs=1e-5)
    assert FRAME_LAB.read(path, ReadOptions(preload="keep"))[0].force[0] == 5.0


@pytest.mark.parametrize("unit", ["deg", "rad", "°"])
def test_an_angle_needs_its_unit(tmp_path, unit):
    angle = np.linspace(0.0, 40.0, 81)
    shown = np.deg2rad(angle) if unit == "rad" else angle
    rows = "".join(f"{a:.6f},{0.5 * b:.4f}\n" for a, b in zip(shown, angle, strict=True))
    path, given = tmp_path / "a.csv", ReadOptions(sizes={"frame_side_mm": 200.0, "fabric_side_mm": 200.0})

    def read(name):
        path.write_text(f"{name},force [N]\n{rows}")
        return FRAME_LAB.read(path, given)

    assert read(f"shear angle [{unit}]")[0].angle == pytest.approx(angle, abs=1e-3)
    refused(r":1: column 'shear angle' has no unit of angle; write", read, "shear angle")
    if unit == "rad":
        refused(r"up to 0\.698 deg \(it looks like rad: 40 deg\)", read, "shear angle [deg]")


@pytest.mark.parametrize(
    ("frame", "fabric", "words"),
    [
        (None, None, r"no frame side and no fabric side: give --frame-side \[mm\] and --fabric-side \[mm\]"),
        (200.0, None, r"states no fabric side: give --fabric-side \[mm\]"),
        (100.0, 200.0, "fabric side 200 mm exceeds the frame side 100 mm"),
        (50.0, 50.0, "displacement 30 mm; a frame of 50 mm allows"),
        (0.2, 0.2, r"--frame-side 0\.2: implausible"),
    ],
)
def test_sides_must_be_known_and_fit(tmp_path, frame, fabric, words):
    path, sizes = tmp_path / "a.csv", {"frame_side_mm": frame, "fabric_side_mm": fabric}
    path.write_text("Weg;Kraft\n0;0\n10;1\n20;3\n30;8\n")
    refused(words, FRAME_LAB.read, path, ReadOptions(sizes={name: side for name, side in sizes.items() if side}))
    stated, other = frame_file(tmp_path / "b.csv"), ReadOptions(sizes={"frame_side_mm": 160.0})
    refused(r":1: frame side 200 mm, but --frame-side is 160 mm", FRAME_LAB.read, stated, other)


@pytest.mark.parametrize(
    ("name", "how", "words"),
    [
        ("x", {"stiffness": 1.0}, r"x\.csv: specimen x: normalised force at 45 deg 1\.1"),
        ("y", {"stiffness": 1e-4}, r"y\.csv: .*implausible.*it looks like kN"),
        ("z", {"side": 100.0, "fabric": 80.0}, r"z\.csv: frame side 100 mm, but .*0\.csv has 200 mm"),
        ("w", {}, "specimens 0 and w have the same curve"),
        ("v", {"end": 8.0}, "ends at 8 deg; expected 10 deg"),
    ],
)
def test_slips_of_a_series_are_named(tmp_path, name, how, words):
    bad = FRAME_LAB.read(frame_file(tmp_path / f"{name}.csv", **how), ReadOptions())
    refused(words, FRAME_LAB.results, [*series(tmp_path, 0.1, 0.11), *bad], "", [])


def test_the_folder_of_frames_is_for_comparison_calibration_and_the_fabric(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    out = Path("data/mine")
    assert FRAME_LAB.write(series(tmp_path, 0.09, 0.11), out, "", ["0.csv", "1.csv"]) == "mine"
    at_20, side = published_rows(out, "mine", "", ("shear_force_n_at_deg.20", "frame_side_mm"))
    gamma = np.deg2rad(20.0)
    assert at_20.mean == pytest.approx(crosshead_force(STIFFNESS * gamma, gamma, FABRIC, FRAME), rel=1e-3)
    assert at_20.sd == pytest.approx(at_20.mean * 0.1 * np.sqrt(2.0), rel=1e-3) and (at_20.n, side.mean) == (2, 200.0)
    corridor, law = (load_curve(out / "picture-frame" / name) for name in ("corridor.csv", "shear.csv"))
    assert corridor.y_name == "normalised_shear_force_n_per_mm" and corridor.sd is not None
    assert corridor.source == "mine, 2 frames of 200 mm, fabric of 160 mm"
    assert DEFINITIONS[law.y_name] == "conjugate" and law.mean[-1] == pytest.approx(STIFFNESS * np.pi / 4.0, rel=2e-3)
    part = yaml.safe_load((out / "fabric.yaml").read_text())
    assert part["macro"]["shear"]["curve"] == "mine/picture-frame/shear.csv"
    assert part["macro"]["shear"]["source"] == "measured" and set(part["macro"]) <= set(MacroMaterial.model_fields)


def test_rows_of_a_frame_are_for_the_sides_of_the_run_or_for_any(tmp_path, monkeypatch):
    """The law S = STIFFNESS gamma, tested at 160 in 200 mm, in the frame of 50 mm of a run."""
    monkeypatch.chdir(tmp_path)
    FRAME_LAB.write(FRAME_LAB.read(frame_file(tmp_path / "a.csv"), ReadOptions()), tmp_path / "mine", "", ["a.csv"])
    names = ("normalised_shear_force_n_per_mm_at_deg.20", "shear_force_n_at_deg.20")
    run = resolve(test="picture-frame", variant="1", scale="macro", sets=["rig.side=50"])
    assert set(names[:1]) <= set(kinds()["picture-frame"].published)
    rows = published_rows(tmp_path / "mine", "mine", "", names)
    free, force = REPORTS["picture-frame"].scaled(run, rows)
    gamma = np.deg2rad(20.0)
    assert free.mean == pytest.approx(STIFFNESS * gamma / np.cos(gamma), rel=1e-3) and free.unit == "N/mm"
    assert force.mean == pytest.approx(crosshead_force(STIFFNESS * gamma, gamma, 50.0, 50.0), rel=1e-3)
    assert "for a square of 50 mm in a frame of 50 mm instead of 160 in 200 mm" in force.table
    with pytest.raises(InputError, match="of a frame with unknown sides"):
        REPORTS["picture-frame"].scaled(run, [replace(rows[1], conditions=UNKNOWN)])


@pytest.mark.parametrize(
    ("name", "stiffness", "words"),
    [
        ("Kraft [kN]", 2.0, r"implausible, .*\(it looks like N: \d+\.?\d* N or cN"),
        # F_s = F / (2 cos(45 deg - gamma / 2)): read as F, the law would be 1.5 to 2 times too soft
        *(
            (name, STIFFNESS, r"a\.csv:3: column '.*looks like the force F_s along the sides; expected the crosshead")
            for name in ("shear force [N]", "Scherkraft [N]", "side force [N]")
        ),
    ],
)
def test_a_force_of_another_kind_or_unit_is_not_taken_for_that_of_the_crosshead(tmp_path, name, stiffness, words):
    path = frame_file(tmp_path / "a.csv", stiffness=stiffness)
    path.write_text(path.read_text(encoding="utf-8").replace("Kraft [N]", name), encoding="utf-8")
    refused(words, lambda: FRAME_LAB.results(FRAME_LAB.read(path, ReadOptions()), "", []))


def test_two_forces_over_one_displacement_are_not_two_frames(tmp_path):
    path = tmp_path / "a.csv"
    head = "frame side [mm],200\nfabric side [mm],160\ndisplacement [mm],force [N],filtered force [N]\n"
    path.write_text(head + "".join(f"{d},{d},{d}\n" for d in range(50)), encoding="utf-8")
    words = r"'force \[N\]' and 'filtered force \[N\]' share the column 'displacement \[mm\]'"
    refused(words, FRAME_LAB.read, path, ReadOptions())
