"""Strips: extent, exact tiles, wave scale, and no penetration where the contact lies, on the splines."""

import numpy as np
import pytest
from fabric_cases import relaxed, spline_points
from scipy.spatial import cKDTree

from knittest.fabric.cell import Cell
from knittest.fabric.loop import polyline_length
from knittest.fabric.strip import YarnPath, centre_lines, strip, wave_elements, wave_scale

WALES, COURSES = 4, 3
AXIS = {"warp": 1, "weft": 0, "knit": 0}


def plain(cell: Cell, scale: float = 1.0, per_wave: int = 8, crimped: bool = False) -> dict[str, list[YarnPath]]:
    """Strip by system: the control points follow the relaxed waves, or the polygons have their crimp."""
    amplitude = {}
    for system, count in (("warp", WALES), ("weft", COURSES)):
        factor = 1.0 if crimped else wave_scale(cell.of(system)[0], wave_elements(cell, system, per_wave))
        amplitude[system] = np.full(count, scale / factor)
    paths = strip(cell, WALES, COURSES, 32, per_wave, amplitude)
    return {s: [p for p in paths if p.system == s] for s in AXIS}


@pytest.mark.parametrize("variant", ["V1", "V2"])
def test_counts_and_extent(variant: str) -> None:
    cell = relaxed(variant)
    yarns = plain(cell)
    assert {s: [p.index for p in yarns[s]] for s in yarns} == {
        "warp": [0, 1, 2, 3],
        "weft": [0, 1, 2],
        "knit": [0, 1, 2],
    }
    size = np.array([WALES * cell.spec.wale, COURSES * cell.spec.course])
    for system, paths in yarns.items():
        for path in paths:
            along = path.points[:, AXIS[system]]
            assert (along[0], along[-1]) == (0.0, pytest.approx(size[AXIS[system]], abs=1e-12))
    assert [p.points[:, 0].mean() for p in yarns["warp"]] == pytest.approx((np.arange(4) + 0.5) * cell.spec.wale)
    assert [p.points[:, 1].mean() for p in yarns["weft"]] == pytest.approx(
        (np.arange(3) + 0.5) * cell.spec.course, abs=1e-3
    )
    assert len(yarns["knit"][0].points) == 32 * WALES + 1


@pytest.mark.parametrize("system", ["warp", "weft", "knit"])
def test_every_period_is_an_exact_tile(system: str) -> None:
    cell = relaxed("V1")
    for path in plain(cell)[system]:
        count = {"warp": COURSES, "weft": WALES, "knit": WALES}[system]
        n = (len(path.points) - 1) // count
        np.testing.assert_allclose(
            path.points[n:] - path.points[:-n], np.tile(cell.of(system)[0].period, (n * (count - 1) + 1, 1)), atol=1e-12
        )


def test_knit_is_cut_in_its_needle_arcs() -> None:
    knit = plain(relaxed("V1"))["knit"][1].points
    top = 0.5 * (knit[::32, 1].min() + knit[::32, 1].max())
    assert knit[:, 1].max() - top < 0.02
    assert knit[16::32, 1].max() < knit[:, 1].min() + 0.02


def test_amplitude_scales_the_wave_only() -> None:
    cell = relaxed("V1")
    once, twice = plain(cell), plain(cell, 2.0)
    for system in ("warp", "weft"):
        axis = AXIS[system]
        for one, two in zip(once[system], twice[system], strict=True):
            np.testing.assert_allclose(two.points[:, axis], one.points[:, axis], atol=1e-12)
            assert np.ptp(two.points[:, 2]) == pytest.approx(2.0 * np.ptp(one.points[:, 2]))
            assert two.points[:-1, 2].mean() == pytest.approx(one.points[:-1, 2].mean())
    for one, two in zip(once["knit"], twice["knit"], strict=True):
        np.testing.assert_array_equal(one.points, two.points)


@pytest.mark.parametrize("per_wave", [6, 8, 16])
@pytest.mark.parametrize("system", ["warp", "weft"])
def test_the_polygon_has_the_crimp(system: str, per_wave: int) -> None:
    cell = relaxed("V2")
    path = plain(cell, 1.0, per_wave, crimped=True)[system][0].points
    assert polyline_length(path) / np.linalg.norm(path[-1] - path[0]) - 1.0 == pytest.approx(
        cell.crimp(system), rel=2e-4
    )


def test_beams_of_both_inlays_are_about_as_long() -> None:
    cell = relaxed("V2")
    assert {s: wave_elements(cell, s, 8) for s in ("warp", "weft")} == {"warp": 6, "weft": 8}
    assert [wave_elements(cell, "warp", n) for n in (4, 6, 16)] == [4, 4, 10]


@pytest.mark.parametrize("crimp", [0.0, 0.006])
@pytest.mark.parametrize("variant", ["V1", "V2"])
def test_splines_do_not_penetrate(variant: str, crimp: float) -> None:
    """Brute force over all pairs of yarns: less than 1 % of the smaller radius at 32 and 8 pieces."""
    cell = relaxed(variant, crimp)
    yarns = [p for paths in plain(cell).values() for p in paths]
    lines = [spline_points(p.points, 8 if p.system == "knit" else 32) for p in yarns]
    worst = -np.inf
    for a, tree in enumerate(map(cKDTree, lines)):
        for b in range(a):
            radii = cell.spec.radius[yarns[a].system], cell.spec.radius[yarns[b].system]
            worst = max(worst, (sum(radii) - tree.query(lines[b])[0].min()) / min(radii))
    assert -0.01 < worst < 0.01  # they touch


def test_centre_lines_are_the_relaxed_cell() -> None:
    cell = relaxed("V2")
    paths = centre_lines(cell, WALES, COURSES)
    assert len(paths) == WALES + 2 * COURSES
    low = min(p.points[:, 2].min() - cell.spec.radius[p.system] for p in paths)
    high = max(p.points[:, 2].max() + cell.spec.radius[p.system] for p in paths)
    assert (low, high) == pytest.approx((-0.5 * cell.thickness, 0.5 * cell.thickness), abs=2e-3)
    knit = next(p for p in paths if p.system == "knit").points
    assert polyline_length(knit) == pytest.approx(WALES * cell.spec.loop_length, rel=2e-3)
