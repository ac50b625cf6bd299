"""A reference that goes on beyond the run: no rating, and with which setting there would be one."""

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.base.kinds import kinds
from knittest.config.loading import resolve
from knittest.experiment.compare import compare_columns, compare_curves
from knittest.experiment.curves import ReferenceCurve
from knittest.laboratory.base import fabric_laminate, refuse_too_strong
from knittest.laboratory.friction.test import Friction
from knittest.laboratory.report_base import REPORTS
from knittest.report_page.blocks import Table
from knittest.report_page.results import _metrics as page_metrics
from knittest.runs.show import curve_line

LEVEL = 200.0


def pulled(end: float, top: float = 220.0) -> tuple[np.ndarray, np.ndarray]:
    """Travel up to ``end`` [mm], and a force that rises to ``top`` [N] at 1 mm and slides at a lower level."""
    x = np.linspace(0.0, end, 4001)
    return x, np.where(x < 1.0, top * x, LEVEL)


def reference(end: float) -> ReferenceCurve:
    return ReferenceCurve("measured", *pulled(end, 230.0), None, "displacement_mm", "pull_force_n", "strips")


def found(run_end: float, reference_end: float, reach: str = "rig.travel"):
    x, y = pulled(run_end)
    return compare_columns({"displacement_mm": x, "pull_force_n": y}, reference(reference_end), reach)


def test_a_longer_pull_is_not_rated_by_its_first_part_and_says_how_to_reach_its_end():
    axes = REPORTS["friction"].axes
    assert (axes.reach, REPORTS["picture-frame"].axes.reach) == ("rig.travel", "rig.max_angle")
    short = found(10.0, 16.0)
    assert short["rating"] is None
    assert short["no_rating"] == (
        "the common range leaves out 38 % of the reference curve: --set rig.travel=16 would reach its end"
    )
    assert found(16.0, 16.0)["rating"]["overall"] > 0.8
    assert found(15.0, 16.0)["rating"] is not None and found(14.0, 16.0)["rating"] is None  # a tenth
    assert found(16.0, 10.0)["no_rating"] == "the common range leaves out 38 % of the simulated curve"
    assert "--set" not in found(10.0, 16.0, "")["no_rating"]


def test_a_pull_is_judged_by_its_levels_and_not_by_where_its_largest_force_lies():
    x, y = pulled(16.0)
    y = np.where(np.abs(x - 12.0) < 0.1, 260.0, y)  # a spike while it slides
    metrics = compare_columns({"displacement_mm": x, "pull_force_n": 1.1 * y}, reference(16.0), "rig.travel")
    assert metrics["static_error_pct"] == pytest.approx(100.0 * (1.1 * 220.0 / 230.0 - 1.0), abs=1.0)
    assert metrics["kinetic_error_pct"] == pytest.approx(10.0, abs=1.5)
    assert metrics["reference_levels"] == {"static_n": pytest.approx(230.0, abs=3.0), "kinetic_n": 200.0}
    assert {"fracture_strain_error_pct", "peak_error_pct"}.isdisjoint(metrics)
    assert "mean force of the second half +1" in curve_line(metrics)
    (table,) = [b for b in page_metrics(metrics) if isinstance(b, Table)]
    names = [row[0].text for row in table.rows]
    assert "error of the largest force of the first half" in names and not any("strain" in name for name in names)


def test_a_largest_force_at_the_start_of_one_pull_only_is_no_other_unit():
    x, y = pulled(16.0, 230.0)
    late = np.where(x > 15.5, 240.0, y)  # thirty times as far along as that of the other
    early = ReferenceCurve("measured", x, np.where(x < 0.5, 250.0, y), None, "displacement_mm", "pull_force_n", "s")
    assert compare_curves(x, late, early)["comparable"]
    told = compare_curves(x, late * 1000.0, early)
    assert not told["comparable"] and "in other units" in told["reason"]


def test_a_frame_says_its_angle():
    gamma = np.linspace(0.0, 40.0, 81)
    one = ReferenceCurve("measured", gamma, gamma, None, "shear_angle_deg", "shear_force_n", "frames")
    told = compare_curves(gamma[:41], gamma[:41], one, "rig.max_angle")["no_rating"]
    assert told.endswith("--set rig.max_angle=40 would reach its end")


def test_a_travel_that_needs_a_longer_strip_says_how_long():
    run = resolve(test="friction", variant="1", scale="macro", direction="warp", sets=["rig.travel=60"])
    with pytest.raises(InputError, match=r"pulled end sticks out; --set rig\.length=250 leaves enough"):
        Friction().prepare(run)


def test_a_strip_of_two_shells_is_refused_with_a_size_that_does():
    small = ["rig.length=20", "rig.width=15", "rig.travel=2", "rig.plate_length=10", "rig.plate_width=20"]
    run = resolve(test="friction", variant="1", scale="macro", preset="quick", direction="warp", sets=small)
    with pytest.raises(InputError, match=r"--set model\.macro\.element_size=6\.67 or less"):
        Friction().prepare(run)


@pytest.mark.parametrize("test", ["picture-frame", "bias-extension"])
def test_a_test_that_ends_at_an_angle_says_which_field_goes_on(test):
    assert REPORTS[test].axes.reach == kinds()[test].sheared_to == "rig.max_angle"


def test_a_curve_that_no_fibres_of_the_area_mass_can_carry_is_refused() -> None:
    """The force of a strip 50 mm wide in a column per width: at 285 g/m2 fibres carry 6 N/tex, 1710 N/mm, at most."""
    fabric = resolve(variant="1", scale="macro", sets=["fabric={area_mass: 600}"]).fabric
    x = np.linspace(0.0, 1.6, 5)

    def curve(top: float) -> ReferenceCurve:
        return ReferenceCurve(
            "measured", x, top * x / 1.6, None, "strain_pct", "force_n_per_mm", "mine", file="mine.csv"
        )

    refuse_too_strong(fabric, {"warp": curve(3590.0)})
    words = (
        r"macro\.tension\.weft \(mine\.csv\): 3610 N/mm at area_mass = 600 g/m2, expected at most 3600 N/mm, 6 N/tex"
    )
    with pytest.raises(InputError, match=words):
        refuse_too_strong(fabric, {"warp": curve(116.0), "weft": curve(3610.0)})


def test_shells_are_not_made_of_such_a_curve(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "strip.csv").write_text("strain_pct,force_n_per_mm\n0,0\n0.8,1500\n1.7,5820\n")
    run = resolve(variant="1", scale="macro", sets=["fabric.macro.tension.warp=strip.csv"])
    with pytest.raises(InputError, match=r"5820 N/mm at area_mass = 824\.2 g/m2, .* the force of a whole strip\?"):
        fabric_laminate(run)
