"""Strips and frames of yarns with elliptic inlays, called as a user does, beside those of circles of their area."""

import pytest
from fabric_cases import ellipses

import knittest

QUIET = {"scale": "meso", "preset": "quick", "frames": False, "pictures": False, "quiet": True, "threads": 1}
STRIP = {"rig.width": 10, "rig.gauge_length": 10}
FRAME = {"rig.side": 15, "rig.max_angle": 11}
#: all fibres of a yarn at a packing of 0.9
ALL = {
    "fabric.reinforcing.section": {
        "shape": "ellipse", "fibre_density": 1.53, "packing": {"warp": 0.9, "weft": 0.9},
        "width_to_height": {"warp": 1.5, "weft": 1.5},
    }
}  # fmt: skip


def strip(folder, more):
    return knittest.tensile("2", direction="warp", set=STRIP | more, out=folder, **QUIET)


def test_a_strip_of_ellipses_breaks_as_one_of_circles(tmp_path):
    """The inlays carry the force, and their sections only press the loops."""
    flat, circle = strip(tmp_path / "flat", ellipses()), strip(tmp_path / "round", {})
    assert flat.quality_checks.passed, flat.quality_checks.refused
    for name, share in (("peak_force_n", 0.005), ("fracture_strain_pct", 0.01)):
        assert flat.results[name] == pytest.approx(circle.results[name], rel=share)
    assert flat.summary["rest"]["thickness_mm"] < 0.95 * circle.summary["rest"]["thickness_mm"]


def test_a_strip_of_all_fibres_breaks_as_one_of_circles_too(tmp_path):
    """Its loops bend along the sections; taut inlays do not change by it. It was refused."""
    flat, circle = strip(tmp_path / "all", ALL), strip(tmp_path / "round", {})
    assert flat.quality_checks.passed, flat.quality_checks.refused
    for name, share in (("peak_force_n", 0.01), ("fracture_strain_pct", 0.03)):
        assert flat.results[name] == pytest.approx(circle.results[name], rel=share)


def test_a_frame_of_ellipses_passes_its_gates_and_is_stiffer(tmp_path):
    """Wider inlays leave the loops less way to turn: 1.12 times the force at 10 deg."""
    flat, circle = (
        knittest.picture_frame("2", set=FRAME | more, out=tmp_path / name, **QUIET)
        for name, more in (("flat", ellipses()), ("round", {}))
    )
    assert flat.quality_checks.passed, flat.quality_checks.refused
    force = [run.results["shear_force_n_at_deg"]["10"] for run in (flat, circle)]
    assert 1.05 < force[0] / force[1] < 1.2
