"""Speed of the stamp: it follows the kinetic energy within its bounds, stops at the depth, and resumes as it was."""

from types import SimpleNamespace

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.kernels.state import Tables
from knittest.laboratory.forming.config import FormingRun
from knittest.laboratory.forming.rig import KINETIC_SHARE, FormingTest
from knittest.models.tool import Table, put_table

#: kinetic energy over the work at the configured speed, which grows with the square of the speed, from the travel [mm]
SMALL, LARGE = 1e-4, 0.03
LIMIT = 0.05


def forming(speedup: float) -> FormingTest:
    run = resolve(
        variant="1", scale="macro", test="forming", preset="quick",
        sets=["rig.blank_holder_force=100", "solver.speed=0.5", "solver.ramp=10", f"rig.stamp_speedup={speedup}"],
    )  # fmt: skip
    assert isinstance(run, FormingRun)
    assert run.solver.max_kinetic_ratio == 100.0 * LIMIT
    return FormingTest(run, SimpleNamespace(holder=object()), 2.0, np.zeros(1), np.zeros(1))


class Stroke:
    """Rows of a stroke with the kinetic energy ratio ``at_speed``(travel) at the configured speed."""

    def __init__(self, test: FormingTest, at_speed) -> None:
        self.test, self.at_speed = test, at_speed
        room = 2000
        self.drive = SimpleNamespace(tables=Tables(np.zeros(1, np.int64), *np.zeros((2, 1, room)), np.zeros((2, 1))))
        put_table(self.drive.tables, 0, test.move)
        self.solver, self.time, self.rows, self.energy_rows = test.run.solver, 0.0, [], []
        self.damping, self.speeds = 1.0, []

    def set_damping(self, share: float) -> None:
        self.damping = share

    def speed(self, time: float) -> float:
        tables = self.drive.tables
        knots = int(tables.knots[0])
        return -float(np.interp(time, tables.time[0, :knots], tables.value[0, :knots]))

    def advance(self, rows: int = 10000, row: float = 0.26) -> "Stroke":
        for _ in range(rows):
            self.time += row
            speed = self.speed(self.time)
            ratio = self.at_speed(self.test.travel(self.time)) * (speed / self.test.speed) ** 2
            self.speeds.append((self.time, speed))
            self.rows.append({})
            self.energy_rows.append(
                {"time_ms": self.time, "kinetic_mj": ratio, "external_mj": 1.0, "kinetic_ratio": ratio}
            )
            self.test.adjust(self)
            if self.test.is_finished(0.0, 0.0, False):
                break
        return self


@pytest.mark.parametrize(("ratio", "largest"), [(SMALL, 1.5), (LARGE, 0.5)])
def test_the_stamp_is_as_fast_as_its_bounds_allow(ratio, largest):
    test = forming(3.0)
    stroke = Stroke(test, lambda travel: ratio).advance()
    time, speed = np.array(stroke.speeds).T
    assert speed.max() == pytest.approx(largest, rel=1e-9)
    full = (time > test.full_speed_at) & (time < test.end - 2.0 * test.rise)
    assert speed[full].min() >= 0.5 * (1.0 - 1e-9)
    assert test.end < test.duration if largest > 0.5 else test.end == pytest.approx(test.duration, abs=0.01)


def test_the_stroke_ends_at_rest_at_its_depth():
    test = forming(3.0)
    stroke = Stroke(test, lambda travel: SMALL).advance()
    assert test.travel(test.end) == pytest.approx(test.rig.depth_mm, abs=1e-9)
    assert stroke.speed(test.end - test.rise) == 0.0 and stroke.speed(test.end) == 0.0
    assert stroke.time == pytest.approx(test.end, abs=0.26)
    assert test.share_done(stroke.time) >= 1.0


def test_the_kinetic_energy_settles_at_its_share():
    """A ratio that falls with the travel, as work accumulates, is held by a speed that rises as its root."""
    test = forming(10.0)
    stroke = Stroke(test, lambda travel: 0.8 * KINETIC_SHARE * LIMIT * (10.0 / max(travel, 1.0)) ** 0.5).advance()
    ratios = np.array([row["kinetic_ratio"] for row in stroke.energy_rows])
    travel = np.array([test.travel(row["time_ms"]) for row in stroke.energy_rows])
    middle = (travel > 15.0) & (travel < 30.0)
    assert ratios[middle] == pytest.approx(KINETIC_SHARE * LIMIT, rel=0.08)


def test_it_accelerates_as_slowly_as_it_starts_and_damps_by_one_force():
    test = forming(3.0)
    stroke = Stroke(test, lambda travel: SMALL)
    for _ in range(400):
        stroke.advance(1)
        if stroke.time > test.full_speed_at + 1.0 and not test.stops:
            assert stroke.damping * stroke.speed(stroke.time) == pytest.approx(0.5, rel=1e-9)
    time, speed = np.array(stroke.speeds).T
    rising = (time[1:] < test.end - 2.0 * test.rise) & (time[1:] > test.full_speed_at)
    growth = np.diff(speed)[rising] / np.diff(time)[rising] / speed[:-1][rising]
    assert growth.max() <= 1.0 / test.rise * (1.0 + 1e-9)
    assert growth.max() > 0.9 / test.rise


def test_a_constant_speed_is_left_alone():
    test = forming(1.0)
    before = test.move
    stroke = Stroke(test, lambda travel: SMALL).advance()
    assert test.move is before and stroke.damping == 1.0
    assert test.end == test.duration and stroke.time == pytest.approx(test.duration, abs=0.26)


@pytest.mark.parametrize("rows", [100, 230])
def test_a_resumed_stroke_goes_on_as_it_would_have(rows):
    """Also one that is about to stop: the state holds the motion so far and the planned end."""
    ratio = lambda travel: 0.02 * (10.0 / max(travel, 1.0))  # noqa: E731
    whole = Stroke(forming(3.0), ratio).advance()
    begun = Stroke(forming(3.0), ratio).advance(rows)
    resumed = Stroke(forming(3.0), ratio)
    resumed.test.restore(begun.test.state(), resumed.drive.tables)
    resumed.time, resumed.rows, resumed.energy_rows = begun.time, begun.rows, begun.energy_rows
    resumed.advance()
    assert resumed.test.move == whole.test.move and resumed.test.end == whole.test.end
    for one, other in zip(resumed.drive.tables, whole.drive.tables, strict=True):
        knots = int(whole.drive.tables.knots[0])
        np.testing.assert_array_equal(one[..., :knots], other[..., :knots])


def test_a_motion_continues_from_any_time():
    table = Table((0.0, 1.0, 3.0), (0.0, 2.0, 2.0)).continued(2.0, (4.0, 5.0), (6.0, 0.0))
    assert (table.time, table.value) == ((0.0, 1.0, 2.0, 4.0, 5.0), (0.0, 2.0, 2.0, 6.0, 0.0))
    assert table.integral(5.0) == pytest.approx(1.0 + 2.0 + 8.0 + 3.0)


@pytest.mark.parametrize("time", [-1.0, 0.0, 0.5, 1.0, 2.0, 2.5, 4.0, 7.0])
def test_the_integral_of_a_table_is_that_of_its_samples(time):
    """Also before its first knot, after its last, and where it jumps."""
    table = Table((0.5, 2.0, 2.0, 4.0), (1.0, 3.0, -1.0, 2.0))
    at = np.linspace(0.0, time, 200001)
    assert table.integral(time) == pytest.approx(np.trapezoid(np.interp(at, table.time, table.value), at), abs=1e-4)
