"""The start loop has the wanted length and, for the studied cells, the studied bulge."""

import numpy as np
import pytest
from fabric_cases import COURSE, LOOP_LENGTH, WALE

from knittest.base.errors import InputError
from knittest.fabric.loop import start_loop

REACH = 0.625


@pytest.mark.parametrize(("variant", "bulge", "height"), [("V1", 0.730544, 4.6875), ("V2", 0.729417, 3.6707)])
def test_studied_cells_are_met(variant: str, bulge: float, height: float) -> None:
    loop = start_loop(WALE, COURSE[variant], LOOP_LENGTH[variant], REACH)
    assert loop.bulge == pytest.approx(bulge, abs=2e-4)
    assert loop.height == pytest.approx(height, abs=1e-3)
    assert loop.length() == pytest.approx(LOOP_LENGTH[variant], abs=1e-9)


def test_loop_runs_from_sinker_arc_to_sinker_arc() -> None:
    loop = start_loop(WALE, COURSE["V1"], 14.4, REACH)
    start, needle, end = loop.points(np.array([0.0, np.pi, 2.0 * np.pi]))
    np.testing.assert_allclose(end - start, [WALE, 0.0, 0.0], atol=1e-12)
    assert needle[1] - start[1] == pytest.approx(loop.height)
    assert (start[2], needle[2]) == pytest.approx((loop.sinker, loop.needle))


def test_shape_scales_with_the_fabric() -> None:
    small, large = start_loop(WALE, COURSE["V2"], 13.4, REACH), start_loop(2 * WALE, 2 * COURSE["V2"], 26.8, 2 * REACH)
    angles = np.linspace(0.0, 2.0 * np.pi, 50)
    np.testing.assert_allclose(large.points(angles), 2.0 * small.points(angles), atol=1e-9)


def test_a_short_loop_starts_longer_and_is_drawn_in_later() -> None:
    assert start_loop(WALE, COURSE["V1"], 12.5, REACH).length() > 14.0


def test_a_loop_too_long_for_its_cell_is_refused() -> None:
    with pytest.raises(InputError, match=r"fabric.loop_length = 30 mm is too long .* expected less than 1\d\.\d\d mm"):
        start_loop(WALE, COURSE["V1"], 30.0, REACH)
