"""Depth of a yarn contact whose closest points travel: kept in a slide, given by no jump. Plain Python."""

import numpy as np
import pytest
from contact_cases import contacts_of, nodes_at
from plain import plain

from knittest.kernels.contact import SCRATCH
from knittest.kernels.contact_blocks import contact_forces
from knittest.kernels.state import ContactLaw

REACH, STIFFNESS, DEPTH = 0.75, 200.0, 0.02
LINE = np.arange(-4.0, 4.01, 0.45)


class Pair:
    """Two smooth yarns that cross, the upper one moved by hand; pressed by :data:`DEPTH` where they touch."""

    def __init__(self, upper: np.ndarray, lower: np.ndarray, viscous: float = 0.0) -> None:
        n = len(upper) + len(lower)
        self.upper = np.arange(n) < len(upper)
        self.nodes = nodes_at(np.vstack([upper, lower]).T)
        self.alive = np.ones(n)
        self.alive[[len(upper) - 1, n - 1]] = 0.0
        self.law = ContactLaw(STIFFNESS, 0.0, 0.0, 0.0, viscous)
        middle = (len(upper) // 2, len(upper) + len(lower) // 2)
        self.contacts = contacts_of(middle, reach=np.full(1, REACH))
        self._settle()
        normal = self.contacts.offset[:, 0] / self.distance
        self.nodes.position[:, self.upper] += ((REACH - DEPTH - self.distance) * normal)[:, None]
        self._settle()
        self.step(np.zeros(3))

    def _settle(self) -> None:
        """Find the closest points, at the full reach."""
        for _ in range(20):
            self.contacts.reach[:] = REACH
            self.step(np.zeros(3))
        self.contacts.reach[:] = REACH

    @property
    def distance(self) -> float:
        return float(np.linalg.norm(self.contacts.offset))

    @property
    def depth(self) -> float:
        return float(self.contacts.reach[0]) - self.distance

    def apart(self) -> np.ndarray:
        """Offset of the contact's points as they lie now, on the continuation of its pieces."""
        x, ends = self.nodes.position, []
        for (i,), (s,) in zip(self.contacts.piece, self.contacts.parameter, strict=True):
            first, second = x[:, i] - x[:, i - 1], x[:, i - 1] - 2.0 * x[:, i] + x[:, i + 1]
            ends.append(0.5 * (x[:, i - 1] + x[:, i]) + s * first + 0.5 * s * s * second)
        return ends[0] - ends[1]

    def step(self, move: np.ndarray) -> tuple[float, float]:
        """Move the upper yarn by ``move`` (3,) [mm]; returns the work on it and the loss by damping [mJ]."""
        before = self.contacts.force[:, 0].copy()
        self.nodes.position[:, self.upper] += move[:, None]
        _, _, damped = plain(contact_forces)(
            (0, 1), 1e-4, self.nodes, self.contacts, self.alive, self.law, self.law.spin, None, np.zeros(SCRATCH)
        )
        return float(0.5 * (before + self.contacts.force[:, 0]) @ move), damped


def straight(angle_deg: float) -> Pair:
    zero, angle = np.zeros_like(LINE), np.deg2rad(angle_deg)
    upper = np.column_stack([LINE * np.sin(angle), LINE * np.cos(angle), zero + REACH])
    return Pair(upper, np.column_stack([zero, LINE, zero]))


def wavy() -> Pair:
    lower = np.column_stack([0.15 * np.sin(1.3 * LINE), LINE, 0.15 * np.cos(1.7 * LINE)])
    return Pair(np.column_stack([LINE, 0.15 * np.sin(1.1 * LINE), 1.05 + 0.15 * np.cos(1.9 * LINE)]), lower)


@pytest.mark.parametrize(("angle", "step"), [(90.0, 2e-3), (90.0, 8e-3), (50.0, 4e-3)])
def test_a_slide_at_fixed_depth_keeps_its_force(angle, step):
    """2.8 mm at two speeds: N stays. Chords instead of the normal's way would lose v dt L / (2 g): 19 and 77 %."""
    pair = straight(angle)
    assert np.linalg.norm(pair.contacts.force) == pytest.approx(STIFFNESS * DEPTH, rel=1e-9)
    for _ in range(round(2.8 / step)):
        pair.step(np.array([0.0, step, 0.0]))
    assert np.linalg.norm(pair.contacts.force) == pytest.approx(STIFFNESS * DEPTH, rel=1e-6)


def test_a_slide_along_bends_keeps_its_reach_and_a_closed_path_makes_no_energy():
    """Work of a slide over waves, up to 0.03 mm deep, is the energy given; of one there and back it is nothing.

    The reach ends 1e-5 mm below the radii (third order); by chords it would end 3e-3 mm below.
    """
    pair, way = wavy(), np.array([0.5, 0.6, 0.0])
    start, step = pair.depth, way / 300.0
    there = sum(pair.step(step)[0] for _ in range(300))
    given = 0.5 * STIFFNESS * (start**2 - pair.depth**2)
    assert abs(given) > 0.02
    assert there == pytest.approx(given, rel=1e-3)
    back = sum(pair.step(-step)[0] for _ in range(300))
    assert there + back == pytest.approx(0.0, abs=1e-4 * abs(given))
    assert REACH - 1e-5 < pair.contacts.reach[0] <= REACH


def test_closest_points_that_jump_give_no_depth():
    """A contact whose points lag by 0.2 of a piece is 5.5 um less deep; it stays so when they catch up."""
    pair = straight(90.0)
    pair.contacts.parameter[1, 0] += 0.2
    pair.contacts.offset[1, 0] -= 0.2 * 0.45
    lagging = pair.depth
    assert lagging == pytest.approx(DEPTH - 5.5e-3, abs=1e-4)
    for _ in range(5):
        pair.step(np.zeros(3))
    assert pair.distance == pytest.approx(REACH - DEPTH, abs=1e-9)  # they caught up
    assert pair.depth == pytest.approx(lagging, abs=1e-12)


def test_closest_points_that_jump_in_a_gap_leave_the_reach():
    """A jump of the closest points where nothing touches only says how far apart the yarns are."""
    pair = straight(90.0)
    pair.step(np.array([0.0, 0.0, 0.05]))
    pair.contacts.parameter[1, 0] += 0.2
    pair.contacts.offset[1, 0] -= 0.2 * 0.45
    for _ in range(5):
        pair.step(np.zeros(3))
    assert pair.contacts.reach[0] == REACH


def test_yarns_that_close_press_and_those_that_part_do_not_by_a_slide():
    """Closed by 5 um while they slide by 5: N grows by that; damping sees the approach alone, not the slide."""
    pair = straight(90.0)
    pair.law = pair.law._replace(viscous=0.01)
    assert pair.step(np.array([0.0, 5e-3, 0.0]))[1] == pytest.approx(0.0, abs=1e-12)
    _, damped = pair.step(np.array([0.0, 5e-3, -5e-3]))
    assert pair.depth == pytest.approx(DEPTH + 5e-3, rel=1e-6)
    assert damped == pytest.approx(0.5 * 0.01 * 5e-3**2 / 1e-4, rel=1e-4)  # the mean: it was at rest before
    for _ in range(4):
        pair.step(np.array([0.0, 0.0, 1e-2]))
    assert np.abs(pair.contacts.force).max() == 0.0  # apart, and back to where they touched
    pair.step(np.array([0.0, 0.0, -3.0e-2]))
    assert pair.depth == pytest.approx(DEPTH + 5e-3 - 1e-2, rel=1e-6)


def there_and_back(pair: Pair, first: bool, slide: float, turned: int) -> None:
    """Slide one yarn by ``slide`` [mm] along itself and back; turn it by 0.01 in time, its ends along ``turned``."""
    which, axis, count = pair.upper if first else ~pair.upper, 0 if first else 1, 16
    here = pair.nodes.position[:, which].copy()
    along = here[axis] - here[axis].mean()
    for k in range(1, count + 1):
        phase, there = np.sin(2.0 * np.pi * k / count), here.copy()
        there[axis] += slide * phase
        there[turned] -= 0.01 * phase * along
        pair.nodes.velocity[:, which] = (there - pair.nodes.position[:, which]) / 1e-4
        pair.nodes.position[:, which] = there
        pair.step(np.zeros(3))


@pytest.mark.parametrize("slide", [0.3, -0.3])
@pytest.mark.parametrize("first", [True, False])
def test_a_yarn_that_rocks_while_it_slides_comes_back_as_deep_as_it_was(first, slide):
    """The place where it touches runs along what turns.

    Closed where the contact was, each step would change the depth by half of turn times slide, 1.9 um in all.
    """
    pair = straight(90.0)
    start = pair.depth
    there_and_back(pair, first, slide, turned=2)
    assert pair.depth == pytest.approx(start, abs=2e-5)


@pytest.mark.parametrize("slide", [0.3, -0.3])
@pytest.mark.parametrize("first", [True, False])
def test_a_yarn_that_swings_while_it_slides_there_and_back_leaves_no_spring(first, slide):
    """Turned about the normal: the sticking spring comes back to nothing, it would keep 1.9 um."""
    pair = straight(90.0)
    pair.law, pair.contacts.spring[:] = ContactLaw(STIFFNESS, 100.0, 1e9, 1e9, 0.0), 0.0
    there_and_back(pair, first, slide, turned=1 if first else 0)
    assert np.abs(pair.contacts.spring).max() < 2e-5


def test_what_damping_takes_is_the_work_that_springs_do_not_give_back():
    """Pressed and let go at changing speed, as in a bounce: work is what is stored and what is damped, to rounding.

    Booked by the force at the end of each step, 10 % more would be taken.
    """
    pair = straight(90.0)
    pair.law = pair.law._replace(viscous=0.01)
    start, done, taken = pair.depth, 0.0, 0.0
    for move in 1e-3 * np.cos(np.linspace(0.0, 2.5, 12)):
        work, damped = pair.step(np.array([0.0, 0.0, -move]))
        done, taken = done + work, taken + damped
    stored = 0.5 * STIFFNESS * (pair.depth**2 - start**2)
    assert taken > 1e-4
    assert -done == pytest.approx(stored + taken, rel=1e-9)


@pytest.mark.parametrize("beyond", [0.3, -0.3])
@pytest.mark.parametrize("side", [0, 1])
def test_a_contact_that_ran_beyond_its_piece_goes_on_as_deep_on_the_next(side, beyond):
    """It lay on the continuation of its own: by 0.045 times the difference of the bends, 9 um here, it would close."""
    pair = wavy()
    contacts = pair.contacts
    contacts.parameter[side, 0] = 0.5 + 0.5 * np.sign(beyond) + beyond
    contacts.spring[:], contacts.slipping[:] = 0.0, 0.0
    contacts.offset[:, 0] = pair.apart()
    pair.law = pair.law._replace(tangential=100.0, static=1e9, kinetic=1e9)
    contacts.reach[:] = pair.distance + DEPTH
    pair.step(np.zeros(3))
    assert pair.depth == pytest.approx(DEPTH, abs=1e-9)
    assert contacts.spring[:, 0] == pytest.approx(0.0, abs=1e-9)
