"""Bodies advanced by hand: however many steps a call makes, contacts are seen before anything passes through.

A yarn (or a sheet) comes from 1 mm at a speed that takes some hundreds of steps to cross it. With energy E and contact
stiffness k it stops within sqrt(2 E / k), far less than a diameter (or thickness).
"""

import numpy as np
import pytest

from knittest.base.errors import NumericalError
from knittest.pose import (
    ALL,
    Body,
    Chain,
    PeriodicBody,
    PeriodicChain,
    SheetContact,
    YarnContact,
    constant,
    linear_laminate,
    plane,
    section,
)

YARN = section(5e3, 1.0, 0.25, 1e-3)
CONTACT = YarnContact(normal=100.0, tangential=50.0, friction=0.2)
POINTS, MIDDLE = 11, 5
GAP, SPEED = 1.0, 2.0  # mm, mm/ms


def crossed(gap: float = GAP) -> list[np.ndarray]:
    """A yarn along x, and one along y whose surface is ``gap`` above it."""
    along, zero = np.linspace(-5.0, 5.0, POINTS), np.zeros(POINTS)
    return [np.column_stack([along, zero, zero]), np.column_stack([zero, along, zero + 0.5 + gap])]


def yarns(gap: float = GAP, contact: YarnContact = CONTACT) -> Body:
    """The upper yarn falls on the lower one."""
    body = Body.of_chains([Chain(points, YARN) for points in crossed(gap)], contact)
    body.velocity[POINTS:, 2] = -SPEED
    return body


def height(body: Body) -> float:
    """Height of the upper yarn over the lower one where they cross [mm]."""
    return float(body.position[POINTS + MIDDLE, 2] - body.position[MIDDLE, 2])


def test_yarns_do_not_pass_through_each_other_in_one_call() -> None:
    """0.01 g at 2 mm/ms are 0.02 mJ: they sink in by at most 0.02 mm of 0.5 mm. Unseen, they would be at -0.3 mm."""
    body, steps = yarns(), round(1.8 * GAP / SPEED / yarns().dt)
    body.step(steps)
    assert height(body) > 0.48
    again = yarns()
    again.advance(steps * again.dt)
    assert np.array_equal(body.position, again.position)


def test_readings_of_many_steps_are_means_over_all_of_them() -> None:
    """A yarn is pulled at a constant speed: the mean of n steps is that of the means of their halves."""
    pulls = []
    for parts in ((200,), (100, 100)):
        body = Body.of_chains([Chain(crossed()[0], YARN)])
        body.boundary.move([0], ALL)
        pulled = body.boundary.move([POINTS - 1], "x", constant(0.1))
        means = []
        for steps in parts:
            body.step(steps)
            means.append(body.reaction(pulled))
        pulls.append(np.mean(means))
    assert pulls[0] == pytest.approx(pulls[1], rel=1e-12)


def test_yarns_of_a_cell_do_not_pass_through_each_other_in_one_call() -> None:
    below, above = (points[:-1] for points in crossed())
    chains = [PeriodicChain(below, YARN, along=0), PeriodicChain(above, YARN, along=1)]
    body = PeriodicBody.of_cell(chains, [[10.0, 0.0, 0.0], [0.0, 10.0, 0.0]], CONTACT)
    upper = np.flatnonzero(body.position[:, 2] > 1.0)
    body.velocity[upper, 2] = -SPEED
    own = int(upper[np.argmin(np.linalg.norm(body.position[upper, :2], axis=1))])
    under = int(np.argmin(np.linalg.norm(body.position, axis=1)))
    body.step(round(1.6 * GAP / SPEED / body.dt))
    assert body.position[own, 2] - body.position[under, 2] > 0.48


def sheets() -> Body:
    """Two sheets of 6 x 6 mm, 1 mm thick, whose surfaces are 1 mm apart; the upper one falls on the lower one."""
    side = np.arange(7.0)
    flat = np.array([[x, y, 0.0] for y in side for x in side])
    cells = np.array([[7 * y + x, 7 * y + x + 1, 7 * y + x + 8, 7 * y + x + 7] for y in range(6) for x in range(6)])
    both = np.vstack([flat, flat + np.array([0.3, 0.2, 1.0 + GAP])])
    laminate = linear_laminate((100.0, 80.0), (2.0, 1.0), 0.5, 1.0)
    body = Body.of_shells(both, np.vstack([cells, cells + 49]), laminate, 8e-4, 1.0, self_contact=SheetContact(0.2))
    body.velocity[49:, 2] = -SPEED
    return body


def test_sheets_do_not_pass_through_each_other_in_one_call() -> None:
    body = sheets()
    body.step(round(1.8 * GAP / SPEED / body.dt))
    assert body.position[49:, 2].mean() - body.position[:49, 2].mean() > 0.9


def test_tools_are_seen_in_every_step() -> None:
    """A yarn falls on a plane 1 mm below its surface."""
    body = Body.of_chains([Chain(crossed()[0], YARN)])
    body.boundary.radius[:POINTS] = 0.25
    body.boundary.add_tool(plane((0.0, 0.0, -0.25 - GAP), (0.0, 0.0, 1.0)))
    body.velocity[:, 2] = -SPEED
    body.step(round(1.8 * GAP / SPEED / body.dt))
    assert body.position[:, 2].min() > -GAP - 0.05


@pytest.mark.parametrize("load", [0.1, 2.0])
def test_a_yarn_that_a_load_brings_from_afar_rests_on_the_other(load: float) -> None:
    """Dynamic relaxation takes chunks of 50 steps from rest: 2 N on each node bring it to 22 N / 100 N/mm in depth."""
    body = Body.of_chains([Chain(points, YARN) for points in crossed(3.0)], CONTACT)
    body.boundary.move([0, POINTS - 1], ALL)
    body.boundary.move([POINTS, 2 * POINTS - 1], ["x", "y", "rx", "ry", "rz"])
    body.boundary.load(np.arange(POINTS, 2 * POINTS), "z", -load)
    body.relax()
    pressed = np.abs(body.contact_forces()[1][:, 2]).sum()
    assert pressed == pytest.approx(POINTS * load, rel=1e-3)


def test_a_yarn_that_is_pressed_through_another_is_an_error() -> None:
    """A contact of 1 N/mm holds 0.5 N before centre-lines meet: what goes on below is no state of these yarns."""
    body = yarns(0.1, YarnContact(normal=1.0, tangential=0.5, friction=0.2))
    body.boundary.move([0, POINTS - 1], ALL)
    body.boundary.load([POINTS + MIDDLE], "z", -5.0)
    with pytest.raises(NumericalError, match=r"pass through each other .* ms; reduce safety or the speed of motion"):
        body.advance(2.0)


def test_a_body_whose_reactions_cancel_comes_to_rest_by_the_forces_inside_it() -> None:
    """A membrane whose rim is held 1 % wider, by one motion a direction: the sum of its reactions is 0.

    Its strains are 1 % all over. Over the sum of reactions the residual at rest was 58, whatever the tolerance.
    """
    side = np.arange(7.0)
    flat = np.array([[x, y, 0.0] for y in side for x in side])
    cells = np.array([[7 * y + x, 7 * y + x + 1, 7 * y + x + 8, 7 * y + x + 7] for y in range(6) for x in range(6)])
    body = Body.of_shells(flat, cells, linear_laminate((100.0, 80.0), (2.0, 1.0), 0.5, 1.0), 8e-4, 1.0)
    rim = np.flatnonzero(np.isin(flat[:, :2], [0.0, 6.0]).any(axis=1))
    for dof in ALL:
        body.boundary.move(rim, dof)
    wide = flat.copy()
    wide[rim, :2] = 3.0 + 1.01 * (flat[rim, :2] - 3.0)
    body.place(wide)
    found = body.relax(most_steps=1000)
    assert found.residual < 1e-4
    assert body.fields()["strain_warp"] == pytest.approx(0.01, rel=1e-4)


def test_a_released_cantilever_is_straight_when_its_residual_is_small() -> None:
    """Nothing is left inside it: the residual is over what rounding makes, and the tip is where it was to 1e-6 mm."""
    points = np.column_stack([np.linspace(0.0, 10.0, 21), np.zeros(21), np.zeros(21)])
    body = Body.of_chains([Chain(points, YARN)])
    body.boundary.move([0], ALL)
    turn = 0.05 * points[:, 0]
    bent = np.column_stack([np.sin(turn), 0.0 * turn, 1.0 - np.cos(turn)]) / 0.05
    body.place(bent, np.column_stack([0.0 * turn, -turn, 0.0 * turn]))
    found = body.relax()
    assert found.residual < 1e-4
    assert np.abs(body.position - points).max() < 1e-6


def test_yarns_that_are_pressed_through_each_other_in_one_call_are_an_error() -> None:
    body = yarns(0.2)
    body.boundary.move(np.arange(POINTS), ALL)
    body.boundary.move(np.arange(POINTS, 2 * POINTS), "z", constant(-SPEED))
    with pytest.raises(NumericalError, match="pass through each other"):
        body.step(round(2.0 / SPEED / body.dt))


def test_the_first_steps_are_few_where_yarns_start_fast() -> None:
    """At 100 mm/ms the upper yarn crosses the lower one within 20 steps. 1 mJ is stored then of 50 mJ of motion."""
    body = yarns(0.2)
    body.velocity[POINTS:, 2] = -100.0
    body.step(round(0.5 / 100.0 / body.dt))
    assert body.energies()["contact"] > 1.0


def test_the_first_steps_are_few_where_a_table_moves_yarns_fast() -> None:
    """At 50 mm/ms 20 steps are 0.4 mm. The contact is seen before the yarns are through each other."""
    body = yarns(0.2)
    body.velocity[:] = 0.0
    body.boundary.move(np.arange(POINTS), ALL)
    body.boundary.move(np.arange(POINTS, 2 * POINTS), "z", constant(-50.0))
    with pytest.raises(NumericalError, match="pass through each other"):
        body.step(round(1.4 / 50.0 / body.dt))
