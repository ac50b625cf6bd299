"""A reference that goes on beyond the run: no rating, and with which setting there would be one."""

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.experiment.compare import compare_columns, compare_curves
from knittest.experiment.curves import ReferenceCurve
from knittest.laboratory.friction.test import Friction
from knittest.laboratory.registry import REPORTS
from knittest.report_page.blocks import Table
from knittest.report_page.results import _metrics as page_metrics
from knittest.runs.show import curve_line

LEVEL = 200.0


def pulled(end: float, top: float = 220.0) -> tuple[np.ndarray, np.ndarray]:
    """Travel up to ``end`` [mm], and a force that rises to ``top`` [N] at 1 mm and slides at a lower level."""
    x = np.linspace(0.0, end, 400)
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


def test_the_place_of_the_largest_pull_is_a_travel_and_no_strain():
    metrics = found(16.0, 16.0)
    assert "fracture_strain_error_pct" not in metrics and "travel at it" in curve_line(metrics)
    (table,) = [b for b in page_metrics(metrics) if isinstance(b, Table)]
    names = [row[0].text for row in table.rows]
    assert "travel at the peak off" in names and not any("strain" in name for name in names)


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
