"""Waves along the rim of a blank: what is a wave and what is a flange that lifts as a whole."""

import numpy as np
import pytest

from knittest.laboratory.forming.formed import WINDOW, rim_waves

SIDE = 100.0


def rim(step: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """Points round a square blank (n, 2) [mm] and the way along it (n,) [mm]."""
    way = np.arange(0.0, 4.0 * SIDE, step)
    side, s = np.divmod(way, SIDE)
    s = s - 0.5 * SIDE
    half = np.full_like(s, 0.5 * SIDE)
    corners = [(s, -half), (half, s), (-s, half), (-half, -s)]
    return np.array([np.column_stack(c)[k] for k, c in ((k, corners[int(q)]) for k, q in enumerate(side))]), way


def test_a_flange_that_lifts_tilts_and_dishes_has_no_waves() -> None:
    points, _ = rim()
    x, y = points.T
    found = rim_waves(points, 30.0 + 0.2 * x - 0.1 * y + 4e-3 * (x**2 + y**2) - 2e-3 * x * y, 0.5)
    assert found.largest < 1e-9 and found.count == 0


@pytest.mark.parametrize("waves", [10, 14])
def test_waves_are_counted_from_crest_to_trough(waves: int) -> None:
    """a sin(2 pi n s / l) has 2 a between crest and trough, less what the mean over a window takes: sinc(n w / l)."""
    points, way = rim()
    length = 4.0 * SIDE
    found = rim_waves(points, 20.0 + 3.0 * np.sin(2.0 * np.pi * waves * way / length), 0.5)
    assert found.count == waves
    assert found.largest == pytest.approx(6.0 * np.sinc(waves * WINDOW / length), rel=0.08)


def test_small_waves_do_not_count_and_a_crest_across_the_start_counts_once() -> None:
    points, way = rim()
    ripple = 0.1 * np.sin(2.0 * np.pi * 20 * way / (4.0 * SIDE))
    found = rim_waves(points, ripple + 3.0 * np.cos(2.0 * np.pi * 10 * way / (4.0 * SIDE)), 0.5)
    assert found.count == 10
    assert rim_waves(points, ripple, 0.5).count == 0


def test_a_crest_stands_over_the_troughs_beside_it_not_over_the_lowest_of_the_rim() -> None:
    """Even waves of 2 a on a rim that is higher on one side, which no paraboloid takes out (cubic in x)."""
    points, way = rim()
    length = 4.0 * SIDE
    uneven = 1.5 * (points[:, 0] / (0.5 * SIDE)) ** 3
    found = rim_waves(points, uneven + np.sin(2.0 * np.pi * 12 * way / length), 0.5)
    assert found.count == 12
    assert np.ptp(found.height) > 1.2 * found.largest
    assert found.largest == pytest.approx(2.0 * np.sinc(12 * WINDOW / length), rel=0.15)
