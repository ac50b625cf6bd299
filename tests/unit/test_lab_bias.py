"""Import of bias extension and biaxial tests: what it makes of travel, sizes and ratios, and what it refuses."""

import numpy as np
import pytest
import yaml
from strip_reading import refused

from knittest.base.kinds import kinds
from knittest.config.loading import resolve
from knittest.experiment.conditions import Conditions
from knittest.experiment.curves import load_curve
from knittest.experiment.lab_table import ReadOptions
from knittest.experiment.lab_tests import LAB_TESTS, read_files, recognise_test
from knittest.experiment.tables import published_rows
from knittest.laboratory.bias_extension.lab_files import LAB
from knittest.laboratory.bias_extension.report import normalise_curve
from knittest.laboratory.bias_extension.strip import BiasStrip
from knittest.laboratory.reference_curves import own_curves
from knittest.laboratory.report_base import REPORTS

STIFFNESS = 0.1  # S = STIFFNESS gamma [N/mm]


def bias_file(path, length=230.0, width=115.0, end=45.0, head=True, factor=1.0):
    """File that a machine writes of the linear law."""
    strip, angle = BiasStrip(length, width), np.deg2rad(np.linspace(0.0, end, 181))
    force = factor * strip.force(STIFFNESS * angle, 0.5 * STIFFNESS * angle, angle)
    rows = [f"{strip.travel(a):.6f};{f:.6f}" for a, f in zip(angle, force, strict=True)]
    sizes = [f"Gauge length;{length:g};mm", f"Specimen width;{width:g};mm"] if head else []
    path.write_text("\n".join(["Bias extension", *sizes, "Travel [mm];Force [N]", *rows]) + "\n", encoding="utf-8")
    return path


def biaxial_file(path, ratio=0.5, peak=100.0, head=True):
    strain = np.linspace(0.0, 1.5, 61)
    stated = [f"strain ratio;{ratio:g}", "Specimen width;80;mm"] if head else []
    rows = [f"{e:.5f};{80.0 * peak * (e / 1.5) ** 1.2:.4f}" for e in strain]
    path.write_text("\n".join([*stated, "Strain [%];Force [N]", *rows]) + "\n", encoding="utf-8")
    return path


def test_a_strip_in_travel_gives_the_law_back(tmp_path):
    (one,) = LAB.read(bias_file(tmp_path / "a.csv"), ReadOptions())
    gamma = np.deg2rad(one.angle)
    assert one.angle[-1] == pytest.approx(45.0, abs=1e-3)
    assert one.normalised_force[10:] == pytest.approx((STIFFNESS * gamma / np.cos(gamma))[10:], rel=2e-3)


def test_strips_of_any_size_have_one_normalised_force(tmp_path):
    found = [
        LAB.read(bias_file(tmp_path / f"{h:g}.csv", h, w), ReadOptions())[0]
        for h, w in ((230.0, 115.0), (450.0, 150.0))
    ]
    one, other = (np.interp([10.0, 30.0], s.angle, s.normalised_force) for s in found)
    assert one == pytest.approx(other, rel=2e-3) and found[0].force[-1] != pytest.approx(found[1].force[-1], rel=0.1)


def test_a_size_that_is_missing_or_too_short_is_refused(tmp_path):
    path = bias_file(tmp_path / "a.csv", head=False)
    refused(
        r"no gauge length and no strip width: give --gauge-length .* and --width", lambda: LAB.read(path, ReadOptions())
    )
    short, narrow, right = (
        ReadOptions(sizes={"gauge_length_mm": length, "strip_width_mm": width})
        for length, width in ((150.0, 115.0), (100.0, 50.0), (230.0, 115.0))
    )
    refused("150 mm long and 115 mm wide: expected at least 2 times", LAB.read, path, short)
    refused(r"a strip 50 mm wide, 100 mm between the clamps, allows 20\.71 mm at most", LAB.read, path, narrow)
    assert LAB.read(path, right)


def test_an_import_is_compared_by_its_normalised_rows(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    files = [bias_file(tmp_path / f"{k}.csv", factor=1.0 + 0.02 * k) for k in range(3)]
    strips = read_files("bias-extension", files, {})
    out = tmp_path / "data" / "mine"
    assert LAB_TESTS["bias-extension"].write(strips, out, None, ["0.csv"]) == "mine"
    rows = {r.quantity: r for r in published_rows(out, "mine", "", kinds()["bias-extension"].published)}
    gamma = np.deg2rad(30.0)
    row = rows["bias_normalised_force_n_per_mm_at_deg.30"]
    assert row.mean == pytest.approx(1.02 * STIFFNESS * gamma / np.cos(gamma), rel=2e-3) and row.n == 3
    assert row.conditions.gauge_length_mm == 230.0 and row.conditions.strip_width_mm == 115.0
    part = yaml.safe_load((out / "fabric.yaml").read_text(encoding="utf-8"))
    sizes = {"gauge_length": 230, "width": 115, "max_angle": pytest.approx(45, abs=0.11)}
    assert part["rigs"]["bias-extension"] == sizes
    assert "macro" not in part  # a law comes from frames: the bias extension judges it
    curve = load_curve(out / "bias-extension" / "corridor.csv")
    assert normalise_curve(curve) is curve and curve.conditions.test == "bias-extension"


def test_a_file_of_forces_is_normalised_by_its_own_strip(tmp_path):
    run = resolve(variant="cao2008-weave", scale="macro", preset="quick", test="bias-extension")
    strip, gamma = BiasStrip(230.0, 115.0), np.deg2rad(np.linspace(0.5, 40.0, 80))
    force = strip.force(STIFFNESS * gamma, 0.5 * STIFFNESS * gamma, gamma)
    rows = "".join(f"{a:.5f},{f:.5f}\n" for a, f in zip(np.rad2deg(gamma), force, strict=True))
    path = tmp_path / "own.csv"
    path.write_text(f"shear_angle_deg,force_n\n{rows}")
    refused(r"'# gauge_length_mm: \.\.\.' and '# strip_width_mm: \.\.\.'", own_curves, run, [path])
    (curve,) = own_curves(run, [path], Conditions(gauge_length_mm=230.0, strip_width_mm=115.0))
    assert curve.mean[20:] == pytest.approx((STIFFNESS * gamma / np.cos(gamma))[20:], rel=0.01)
    (frame,) = own_curves(run, [path], Conditions(test="picture-frame", frame_side_mm=200.0, fabric_side_mm=200.0))
    assert "of a picture frame" in frame.note and frame.mean[-1] != pytest.approx(curve.mean[-1], rel=0.1)


def test_a_biaxial_file_needs_its_ratio(tmp_path):
    path = biaxial_file(tmp_path / "a.csv", head=False)
    refused("no strain ratio: give --ratio", read_files, "biaxial", [path], {"width": 80.0})
    refused("11: must be at most 10", read_files, "biaxial", [path], {"width": 80.0, "ratio": 11.0})
    (one,) = read_files("biaxial", [path], {"width": 80.0, "ratio": 0.5})
    assert one.ratio == 0.5 and one.width == 80.0
    other = [biaxial_file(tmp_path / "b.csv")]
    refused(r"strain ratio 0\.5 1, but --ratio is 1 1", read_files, "biaxial", other, {"ratio": 1.0})
    assert recognise_test(tmp_path / "b.csv") == "biaxial"
    assert recognise_test(bias_file(tmp_path / "c.csv")) == "bias-extension"


def test_a_biaxial_import_is_compared_at_its_own_ratio_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    files = [biaxial_file(tmp_path / f"{k}.csv", peak=100.0 + k) for k in range(2)]
    out = tmp_path / "data" / "mine"
    LAB_TESTS["biaxial"].write(read_files("biaxial", files, {}), out, "warp", ["0.csv"])
    rows = published_rows(out, "mine", "warp", kinds()["biaxial"].published)
    assert [(r.quantity, r.mean) for r in rows] == [("biaxial_force_n_per_mm", 100.5), ("biaxial_strain_pct", 1.5)]
    part = yaml.safe_load((out / "fabric.yaml").read_text(encoding="utf-8"))
    assert part["rigs"] == {"biaxial": {"ratio": 0.5}} and "macro" not in part
    corridor, report = out / "biaxial-warp" / "corridor.csv", REPORTS["biaxial"]
    for ratio in (0.5, 1.0):
        run = resolve(
            variant="1", scale="macro", preset="quick", test="biaxial", direction="warp", sets=(f"rig.ratio={ratio}",)
        )
        if ratio == 0.5:
            (curve,) = own_curves(run, [corridor])
            assert curve.mean.max() == pytest.approx(100.5) and report.scaled(run, rows) == rows
            continue
        refused(r"tested at a strain ratio of 0\.5; .* strained 1 times", own_curves, run, [corridor])
        refused(r"biaxial_force_n_per_mm: tested at a strain ratio of 0\.5", report.scaled, run, rows)


def written(path, name, factor=0.5):
    rows = "".join(f"{factor * k:.4f};{k}\n" for k in range(60))
    path.write_text(f"gauge length;200;mm\nspecimen width;100;mm\n{name};Force [N]\n{rows}", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("shear angle [deg]", "a displacement of the clamp"),  # not that of pin-jointed yarns
        *(
            (name, r"a\.csv:3: column .*measures only a part of the specimen; expected the clamp travel")
            for name in ("Extensometer strain [%]", "Extensometer [mm]", "Feindehnung [%]")
        ),
    ],
)
def test_an_angle_or_an_extensometer_is_no_travel_of_the_clamp(tmp_path, name, words):
    refused(words, LAB.read, written(tmp_path / "a.csv", name), ReadOptions())


def test_a_strain_is_the_travel_over_the_length(tmp_path):
    travel, strain = (
        LAB.read(written(tmp_path / "a.csv", name, factor), ReadOptions())[0]
        for name, factor in (("Travel [mm]", 0.5), ("Strain [%]", 0.25))
    )
    assert strain.angle == pytest.approx(travel.angle, abs=1e-6) and travel.angle[-1] > 30.0
