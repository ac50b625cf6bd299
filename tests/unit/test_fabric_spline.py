"""The quadratic B-spline of the control points follows the centre-line."""

import numpy as np
import pytest
from fabric_cases import relaxed, spline_points
from scipy.spatial import cKDTree

from knittest.fabric.loop import arc_at, control_points, points_on, polyline_length

PERIOD = np.array([3.0, 0.0, 0.0])


def wave(n: int, amplitude: float = 0.1) -> np.ndarray:
    share = np.arange(n) / n
    return np.column_stack([3.0 * share, np.zeros(n), amplitude * np.cos(2.0 * np.pi * share)])


def closed(control: np.ndarray, period: np.ndarray) -> np.ndarray:
    return np.vstack([control[-1:] - period, control, control[:1] + period])


def test_piece_middles_lie_on_the_curve() -> None:
    knit, n = relaxed("V1").of("knit")[0], 32
    curve, period = knit.points, knit.period
    control = closed(control_points(curve, period, n), period)
    middles = (control[:-2] + 6.0 * control[1:-1] + control[2:]) / 8.0
    np.testing.assert_allclose(middles, points_on(curve, period, n), atol=1e-12)


def test_control_points_of_a_small_wave() -> None:
    """A cosine of n pieces has control points of the amplitude a / (3/4 + cos(2 pi / n) / 4)."""
    n, a = 8, 1e-4
    control = control_points(wave(64, a), PERIOD, n)
    expected = a / (0.75 + 0.25 * np.cos(2.0 * np.pi / n)) * np.cos(2.0 * np.pi * np.arange(n) / n)
    np.testing.assert_allclose(control[:, 2], expected, atol=1e-6 * a)
    np.testing.assert_allclose(control[:, 0], 3.0 * np.arange(n) / n, atol=1e-6 * a)


@pytest.mark.parametrize("variant", ["V1", "V2"])
def test_spline_stays_close_to_the_loop(variant: str) -> None:
    """Between the fitted middles the distance falls at least with the square of the piece; 32 pieces: 1 % of r."""
    cell = relaxed(variant)
    knit, period = cell.of("knit")[0].points, cell.of("knit")[0].period
    fine = points_on(knit, period, 20_000)
    tree = cKDTree(np.vstack([fine - period, fine, fine + period]))
    coarse, usual = (
        tree.query(spline_points(closed(control_points(knit, period, n), period), 8))[0].max() for n in (16, 32)
    )
    assert usual < 0.01 * cell.spec.radius["knit"]
    assert usual < 0.25 * coarse


def test_points_start_where_they_are_told() -> None:
    curve = wave(200)
    start = arc_at(curve, PERIOD, 0, 1.2)
    points = points_on(curve, PERIOD, 10, start)
    np.testing.assert_allclose(points[0], [1.2, 0.0, 0.1 * np.cos(2.0 * np.pi * 0.4)], atol=1e-4)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert np.ptp(steps) < 2e-3 * steps.mean()


def test_plane_nearest_to_the_middle_is_taken() -> None:
    """A loop that crosses a plane three times: the crossing in the middle of the period counts."""
    share = np.arange(400) / 400
    curve = np.column_stack([3.0 * (share - 0.5) + 1.5 * np.sin(4.0 * np.pi * share), np.zeros(400), np.zeros(400)])
    half = 0.5 * polyline_length(np.vstack([curve, curve[:1] + PERIOD]))
    assert np.count_nonzero(np.diff(np.sign(curve[:, 0]))) >= 3
    assert arc_at(curve, PERIOD, 0, 0.0) == pytest.approx(half, abs=1e-6)
