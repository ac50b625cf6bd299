"""Motion of the picture frame: its crosshead starts at the speed of the run, and ends at the largest angle."""

from math import radians

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.laboratory.picture_frame.rig import PictureFrameTest
from knittest.materials.trellis import crosshead


def frame(*sets: str) -> PictureFrameTest:
    run = resolve(test="picture-frame", variant="1", scale="macro", sets=["rig.side=180", "solver.ramp=1", *sets])
    return PictureFrameTest(run, np.zeros(0, np.int64), 180.0**2)


@pytest.mark.parametrize("side", [180.0, 250.0])
def test_the_crosshead_starts_at_the_speed_of_the_run(side):
    """d' = sqrt(2) L p' = L gamma' / sqrt(2) at small angles, with the frame's side L, not the fabric's."""
    rig = frame("solver.speed=0.5", f"rig.frame_side={side}")
    now, later = (crosshead(rig.angle(t), side) for t in (2.0, 3.0))  # after the closing and the start, 1 ms each
    assert later - now == pytest.approx(0.5, rel=0.01)


def test_it_ends_at_the_largest_angle_after_its_turns():
    rig = frame("solver.speed=2", "rig.max_angle=20")
    assert rig.angle(rig.duration) == pytest.approx(radians(20.0), rel=1e-6)
    turning = frame("solver.speed=2", "rig.max_angle=30", "rig.turns=[20, 5]")
    angles = np.array([turning.angle(t) for t in np.linspace(0.0, turning.duration, 400)])
    first = int(np.argmax(np.diff(angles) < 0.0))
    assert angles[first] == pytest.approx(radians(20.0), abs=0.002)
    assert angles[first:].min() == pytest.approx(radians(5.0), abs=0.002)
    assert angles[-1] == pytest.approx(radians(30.0), rel=1e-6)
