"""The public Python interface: what it gives back against closed forms, and what it refuses."""

import doctest

import numpy as np
import pytest

import knittest.pose
from knittest.base.errors import InputError, NumericalError
from knittest.pose import (
    ALL,
    Body,
    Chain,
    Table,
    YarnContact,
    constant,
    cylinder,
    linear_laminate,
    plane,
    ramp,
    round_section,
    section,
)

ROUND = round_section(modulus=60e3, diameter=0.75, density=2.5e-3)
STIFFNESS = 60e3 * np.pi * 0.75**4 / 64.0  # EI [N mm2]
LINE = np.column_stack([np.linspace(0.0, 10.0, 21), np.zeros(21), np.zeros(21)])
SQUARES = np.array([[x, y, 0.0] for y in range(2) for x in range(3)], float)
CELLS = [[0, 1, 4, 3], [1, 2, 5, 4]]
LAMINATE = linear_laminate((100.0, 80.0), (2.0, 1.0), 0.5, 1.0)


def line(**options: float) -> Body:
    return Body.of_chains([Chain(LINE, ROUND)], **options)


def arc(n: int = 24) -> np.ndarray:
    turn = np.linspace(0.0, 1.5, n + 1)
    return 2.0 * np.column_stack([np.sin(turn), 1.0 - np.cos(turn), np.zeros(n + 1)])


def sheet() -> Body:
    return Body.of_shells(SQUARES, CELLS, LAMINATE, 8e-4, 1.0)


def test_the_example_of_the_module_runs():
    found = doctest.testmod(knittest.pose)
    assert found.failed == 0 and found.attempted > 5


def test_cantilever_gives_back_its_forces_and_moments():
    """M = F (L - x) in the middle of each beam, V = F, slope F L^2 / (2 EI), reactions -F and F L (bends little)."""
    body = line()
    held = [body.boundary.move([0], dof) for dof in ALL]
    body.boundary.load([20], "z", 0.1, ramp(1.0, 1.0))
    body.relax(tolerance=1e-6)
    found, middle = body.fields(), 0.5 * (LINE[1:, 0] + LINE[:-1, 0])
    assert found["bending"] == pytest.approx(0.1 * (10.0 - middle), rel=2e-3, abs=1e-4)
    assert found["moment"][:, 1] == pytest.approx(-0.1 * (10.0 - middle), rel=2e-3, abs=1e-4)
    assert found["shear_force"] == pytest.approx(0.1, rel=2e-3)
    assert found["force"][:, 2] == pytest.approx(0.1, rel=2e-3)
    assert np.abs(found["torsion"]).max() < 1e-9
    assert [body.reaction(held[2]), body.reaction(held[4])] == pytest.approx([-0.1, 1.0], rel=2e-3)
    slope = 2.0 * np.arcsin(body.rotation[20, 2])
    assert -slope == pytest.approx(0.1 * 10.0**2 / (2.0 * STIFFNESS), rel=5e-3)


def test_moment_of_a_bent_sheet():
    """Directors turned by kappa y about the weft: M = D kappa in the warp, none in the weft; twist of 2 kappa."""
    points = np.array([[x, y, 0.0] for x in range(2) for y in range(3)], float)
    laminate = linear_laminate((100.0, 80.0), (2.0, 1.0), 0.5, 1.0, twist=0.3)
    body = Body.of_shells(points, [[0, 3, 4, 1], [1, 4, 5, 2]], laminate, 8e-4, 1.0)  # warp along y, normal up
    kappa = 1e-3
    body.place(points, np.column_stack([kappa * points[:, 1], np.zeros(6), np.zeros(6)]))
    found = body.fields()
    assert np.abs(found["moment_warp"]) == pytest.approx(2.0 * kappa, rel=1e-5)  # (kappa y)^2 / 6
    assert np.abs(found["moment_weft"]).max() < 1e-9
    body.place(points, np.column_stack([kappa * points[:, 0], -kappa * points[:, 1], np.zeros(6)]))
    assert np.abs(body.fields()["moment_twist"]) == pytest.approx(0.3 * 2.0 * kappa, rel=1e-5)


def test_yarns_that_touch_say_where_and_how_hard():
    """Two crossed yarns that are pushed 1 um into each other at 100 N/mm: 0.1 N between them, half-way."""
    across = np.column_stack([np.zeros(5), np.linspace(-4.0, 4.0, 5), np.full(5, 1.02)])
    along = np.column_stack([np.linspace(-4.0, 4.0, 5), np.zeros(5), np.zeros(5)])
    card = section(axial=100.0, bending=1.0, radius=0.5, linear_density=1e-3)
    body = Body.of_chains([Chain(along, card), Chain(across, card)], YarnContact(100.0, 0.0, 0.0, damping=0.0))
    body.step()
    assert body.contact_forces()[0].shape == (0, 3)
    body.place(np.vstack([along, across - np.array([0.0, 0.0, 0.021])]))
    body.step()
    place, force, chains = body.contact_forces()
    assert place == pytest.approx(np.array([[0.0, 0.0, 0.4995]]), abs=1e-3)  # nodes have moved since
    assert force.shape == (1, 3) and chains.tolist() == [[0, 1]]
    assert force[0, :2] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert force[0, 2] == pytest.approx(-0.1, rel=1e-3)


@pytest.mark.parametrize("degree_of_set", [0.0, 0.4, 1.0])
def test_place_keeps_what_was_bent_in(degree_of_set):
    """A move that changes nothing costs nothing, and neither does a rigid turn, by a whole turn and more."""
    body = Body.of_chains([Chain(arc(), ROUND, degree_of_set=degree_of_set)])
    stored = body.model.stored_energies().internal.sum()
    body.place(arc())
    assert body.model.stored_energies().internal.sum() == pytest.approx(stored, rel=1e-12, abs=1e-12)
    for angle in (0.7, 2.0 * np.pi, 9.0):
        c, s = np.cos(angle), np.sin(angle)
        body.place(arc() @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]), (0.0, 0.0, angle))
        assert body.model.stored_energies().internal.sum() == pytest.approx(stored, rel=1e-9, abs=1e-9)


def test_turns_beyond_half_a_turn_do_not_blow_up():
    """Nodes wound up by 8 rad over the length: quaternions of neighbours on either side of 2 pi are of one sign."""
    body = line()
    turn = np.zeros((21, 3))
    turn[:, 0] = 8.0 * LINE[:, 0] / 10.0
    body.place(LINE, turn)
    torsion = STIFFNESS / 1.3  # GJ of the section
    assert body.model.stored_energies().internal.sum() == pytest.approx(0.5 * torsion * 0.8**2 * 10.0, rel=0.02)


def test_relax_at_rest_ends_at_once():
    """A body at rest, loaded or not, stays there: least number of steps, the residual no larger than before."""
    body = line()
    body.boundary.move([0], ALL)
    assert body.relax().steps <= 50
    loaded = line()
    loaded.boundary.move([0], ALL)
    loaded.boundary.load([20], "z", 0.5)
    first = loaded.relax()
    again = loaded.relax()
    assert again.steps <= 300 < first.steps
    assert again.residual <= 1.5 * first.residual


def test_a_shaft_comes_to_rest_twisted():
    """T L / GJ in every beam: nothing but turns tells whether it is at rest."""
    body = line()
    body.boundary.move([0], ALL)
    body.boundary.load([20], "rx", 1.0)
    body.relax(tolerance=1e-6)
    twist = 2.0 * np.arctan2(body.rotation[:, 1], body.rotation[:, 0])
    assert twist == pytest.approx(LINE[:, 0] / ROUND.torsion, rel=1e-6, abs=1e-12)


def test_a_sheet_under_an_end_moment_comes_to_rest():
    """Moments of loads act on spins and are in no sum of a node, yet balance those of the shells.

    Turn M L / (D b); chords of shells are short by a sixth of the square of half their turn.
    """
    body = sheet()
    body.boundary.move([0, 3], ALL)
    body.boundary.load([2, 5], "ry", -0.01)
    assert body.relax(tolerance=1e-6, most_steps=20_000).residual < 1e-6
    assert -2.0 * np.arcsin(body.rotation[[2, 5], 2]) == pytest.approx(0.02 * 2.0 / 1.0, rel=1e-4)


def test_yarns_that_rub_come_to_rest():
    """Friction turns yarns about their axes, which their torsion carries: its moments are balanced at rest."""
    touching = np.column_stack([np.full(21, 5.0), np.linspace(-5.0, 5.0, 21), np.full(21, 0.75)])
    contact = YarnContact(normal=100.0, tangential=50.0, friction=0.5)
    body = Body.of_chains([Chain(LINE, ROUND), Chain(touching, ROUND)], contact)
    body.boundary.move([0, 20, 21, 41], ALL)
    body.boundary.load([31], "z", -0.5)
    body.boundary.load([31], "x", 0.1)
    assert body.relax(most_steps=50_000).residual < 1e-4


def test_relax_that_does_not_come_to_rest_raises():
    body = line()
    body.boundary.move([0], ALL)
    body.boundary.load([20], "z", 0.5)
    with pytest.raises(NumericalError, match=r"no equilibrium after 500 steps.*most_steps"):
        body.relax(most_steps=500)
    assert not body.relax(must_converge=False, most_steps=500).converged


def test_relax_refuses_a_motion_that_does_not_end():
    body = line()
    body.boundary.move([0], ALL)
    body.boundary.move([20], "z", constant(0.1))
    with pytest.raises(InputError, match="motion 1 ends at a nonzero speed"):
        body.relax()


def test_reaction_of_a_scaled_group_is_a_force():
    """Two ends pulled at speeds 2 and 0.5 times the table: the sum of both forces, and the power over the table."""
    body = Body.of_chains([Chain(LINE, ROUND), Chain(LINE + np.array([0.0, 5.0, 0.0]), ROUND)])
    body.boundary.move([0, 21], ALL)
    group = body.boundary.move([20, 41], "x", Table((0.0, 1.0, 2.0), (0.0, 5e-3, 0.0)), scale=[2.0, 0.5])
    body.advance(2.0)
    body.relax()
    stiffness = ROUND.axial / 10.0
    pulled = 5e-3 * np.array([2.0, 0.5])
    assert body.reaction(group) == pytest.approx(stiffness * pulled.sum(), rel=1e-3)
    assert body.conjugate(group) == pytest.approx(stiffness * (pulled * [2.0, 0.5]).sum(), rel=1e-3)


def test_damping_may_change_between_advances():
    """A free body at speed v keeps it without damping, and loses exp(-c t) of it with."""
    body = line()
    body.velocity[:, 2] = 1.0
    body.advance(0.05)
    assert body.velocity[:, 2] == pytest.approx(1.0)
    body.damping = 10.0
    steps = round(0.05 / body.dt)
    body.step(steps)
    assert body.velocity[:, 2] == pytest.approx(np.exp(-10.0 * steps * body.dt), rel=1e-9)


def test_a_free_tool_falls():
    """v = F t / m of a tool that nothing holds."""
    body = line()
    floor = body.boundary.add_tool(plane((0.0, 0.0, -50.0), (0.0, 0.0, 1.0)))
    body.boundary.free_tool(floor, "z", mass=2.0, force=constant(-4.0))
    body.advance(0.1)
    assert body.readings().tool_position[0, 2] == pytest.approx(-50.0 - 0.5 * 2.0 * body.time**2, rel=1e-4)


def test_strength_of_single_shells():
    """The shell of half the strength breaks at half the strain."""
    laminate = linear_laminate((100.0, 80.0), (2.0, 1.0), 0.5, 1.0, fail_strain=(0.02, np.inf))
    points = SQUARES[:, [1, 0, 2]]  # the warp, y, runs through both
    body = Body.of_shells(points, [[0, 3, 4, 1], [1, 4, 5, 2]], laminate, 8e-4, 1.0)
    body.set_strength([1.0, 0.5])
    body.place(points * [1.0, 1.015, 1.0])
    body.step()
    assert body.fields()["alive"].tolist() == [1.0, 0.0]


def moved(*motions: tuple) -> None:
    """A body with ``motions``, each what move takes, as the kernel would get it."""
    body = line()
    for motion in motions:
        body.boundary.move(*motion)
    body.boundary.drive()


def tool_moved(*motions: tuple, again: bool = False) -> None:
    """A tool with ``motions``, each a method and what it takes; in a second body if it is so ``again``."""
    floor = plane((0.0, 0.0, -50.0), (0.0, 0.0, 1.0))
    body = line()
    number = body.boundary.add_tool(floor)
    for name, *given in motions:
        getattr(body.boundary, name)(number, *given)
    if again:
        line().boundary.add_tool(floor)


def tool_added_twice() -> None:
    body, floor = line(), plane((0.0, 0.0, -50.0), (0.0, 0.0, 1.0))
    body.boundary.add_tool(floor)
    body.boundary.add_tool(floor)


def one_shell() -> Body:
    """One shell on four of six points."""
    return Body.of_shells(SQUARES, [CELLS[0]], LAMINATE, 1e-3, 1.0)


PULL, PUSH = ramp(1.0, 1.0), ramp(1.0, -1.0)
REFUSED = {
    "held and moved": (lambda: moved(([0, 1], ALL), ([1], "z", PULL)), "z of node 1 .* motions 0 and 1"),
    "moved and held": (lambda: moved(([1], "rx", PULL), ([0, 1], ALL)), "rx of node 1 .* motions 0 and 1"),
    "moved twice": (lambda: moved(([1, 2], "x", PULL), ([2, 3], "x", PUSH)), "x of node 2 is prescribed twice"),
    "one call": (lambda: moved(([2, 2], "x", PULL, [1.0, 2.0])), "x of node 2 .* motions 0 and 0"),
    "tool twice": (tool_added_twice, "tool: it already belongs to a body"),
    "tool of others": (lambda: tool_moved(("move_tool", "z", PULL), again=True), "tool: it already belongs to a body"),
    "tool moved twice": (
        lambda: tool_moved(("move_tool", "z", PULL), ("move_tool", ("x", "z"), PUSH)), "already moved or free along z"
    ),
    "tool moved and free": (
        lambda: tool_moved(("move_tool", "z", PULL), ("free_tool", "z", 1.0)), "already moved or free along z"
    ),
    "two masses": (
        lambda: tool_moved(("free_tool", "z", 1.0), ("free_tool", "x", 2.0)), "tool 0 is already free"
    ),
    "node": (lambda: line().boundary.move([21], "x"), "21 is not a node; expected numbers from 0 to 20"),
    "negative node": (lambda: line().boundary.load([-1], "x", 1.0), "-1 is not a node"),
    "fraction": (lambda: line().boundary.move([0.5], "x"), "whole numbers"),
    "dof": (lambda: line().boundary.move([0], ["x", "q"]), "of freedom 'q': expected one of x, y, z, rx, ry, rz"),
    "dof of a load": (lambda: line().boundary.load([0], "q", 1.0), "degree of freedom 'q'"),
    "load": (lambda: line().boundary.load([0], "x", np.nan), "value of a load: not finite"),
    "loads": (lambda: line().boundary.load([0, 1, 2], "x", [1.0, 2.0]), "2,.*3 nodes"),
    "stray load": (lambda: one_shell().boundary.load([0, 5], "z", [1.0, 2.0]), "node 5 belongs to no element .1 such"),
    "table": (lambda: Table((0.0, 2.0, 1.0), (0.0, 0.0, 0.0)), "must not fall"),
    "points": (lambda: Body.of_chains([Chain(np.full((3, 3), np.nan), ROUND)]), "points of chain 0: not finite"),
    "one point": (lambda: Body.of_chains([Chain(LINE[:1], ROUND)]), "at least two"),
    "same point": (lambda: Body.of_chains([Chain(LINE[[0, 0, 1]], ROUND)]), "points 0 and 1 coincide"),
    "cell": (lambda: Body.of_shells(SQUARES, [[0, 1, 4, 9]], LAMINATE, 1e-3, 1.0), "9 is not a node"),
    "folded": (lambda: Body.of_shells(SQUARES, [[0, 4, 1, 3]], LAMINATE, 1e-3, 1.0), "cell 0 .*not convex"),
    "collapsed": (lambda: Body.of_shells(SQUARES, [[0, 1, 2, 2]], LAMINATE, 1e-3, 1.0), "cell 0 .*collapsed"),
    "bending": (lambda: linear_laminate((100.0, 80.0), 2.0, 0.5, 1.0), "bending: expected the shape \\(2\\)"),
    "middle": (lambda: linear_laminate((100.0, 80.0), (30.0, 1.0), 0.5, 1.0), "thickness above 1.095 mm"),
    "place": (lambda: line().place(np.full((21, 3), np.inf)), "position: not finite"),
    "group": (lambda: line().reaction(3), "expected a number returned by boundary.move"),
    "no tool": (lambda: line().boundary.free_tool(0, "z", mass=1.0), "tool 0: expected a number returned"),
    "unknown tool": (lambda: line().boundary.move_tool(3, "z", constant(1.0)), "tool 3.*below 0"),
    "normal": (lambda: plane((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), "normal or axis of a tool: expected a vector"),
    "place of a tool": (lambda: plane((np.nan, 0.0, 0.0), (0.0, 0.0, 1.0)), "point of a plane: not finite"),
    "tool size": (lambda: cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), -1.0, 2.0), "radius of a cylinder: -1"),
    "damping": (lambda: line(damping=np.nan), "damping .* not finite: nan"),
    "negative damping": (lambda: setattr(line(), "damping", -1.0), "damping .*: -1; expected at least 0"),
    "safety": (lambda: line(safety=0.0), "safety: 0; expected more than 0"),
    "too fast": (lambda: line(safety=1.1), "safety: 1.1; expected at most 1"),
    "threads": (lambda: line(threads=-1), "threads: -1; expected at least 1"),
    "strength": (lambda: sheet().set_strength([1.0, 0.0]), "strength of shell 1: expected more than 0"),
    "axial": (lambda: section(0.0, 1.0, 0.1, 1e-3), "EA of a section .*: 0; expected more than 0"),
    "density": (lambda: section(1.0, 1.0, 0.1, 0.0), "linear_density of a section"),
    "torsion": (lambda: section(1.0, 1.0, 0.1, 1e-3, torsion=-1.0), "GJ of a section: -1"),
    "falling law": (lambda: section(1.0, 1.0, 0.1, 1e-3, law=([0.0, 1.0, 2.0], [0.0, 2.0, 1.0])), "do not fall"),
    "law": (lambda: section(1.0, 1.0, 0.1, 1e-3, law=([0.1, 1.0], [0.3, 1.0])), r"starting at \(0, 0\)"),
    "fail": (lambda: Body.of_chains([Chain(LINE, ROUND, fail_strain=np.nan)]), "fail_strain of chain 0: not a number"),
    "elements": (lambda: Body.of_chains([Chain(LINE, ROUND, slack=np.zeros(3))]), "one of each of 20 elements"),
    "set": (lambda: Body.of_chains([Chain(LINE, ROUND, degree_of_set=1.5)]), "chain 0: expected 0 to 1"),
    "part": (lambda: Body.of_chains([Chain(LINE, ROUND, part=1)]), "part 1 of chain 0: there are 1 part_names"),
    "no chain": (lambda: Body.of_chains([]), "chains: expected at least one"),
    "contact": (lambda: Body.of_chains([Chain(LINE, ROUND)], YarnContact(-1.0, 0.0, 0.0)), "normal of the contact: -1"),
    "area mass": (lambda: Body.of_shells(SQUARES, CELLS, LAMINATE, 0.0, 1.0), "area_mass"),
    "warp": (lambda: Body.of_shells(SQUARES, CELLS, LAMINATE, 1e-3, 1.0, warp=(0, 0, 1)), "warp.* normal to cell 0"),
    "hourglass": (lambda: linear_laminate((100.0, 80.0), (2.0, 1.0), 0.5, 1.0, hourglass=-1.0), "hourglass: -1"),
    "fracture": (lambda: linear_laminate((9.0, 8.0), (2.0, 1.0), 0.5, 1.0, fail_strain=(0.0, 1.0)), "fail_strain"),
    "duration": (lambda: line().advance(-1.0), "duration .*: -1; expected at least 0"),
    "mass": (lambda: line().boundary.free_tool(0, "z", mass=0.0), "expected more than 0"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_bad_input_is_refused(name):
    make, message = REFUSED[name]
    with pytest.raises(InputError, match=message):
        make()


def test_corners_may_be_held_twice_and_tools_move_along_each_axis():
    """Two holds of one degree of freedom are one; a motion of nothing is a hold; a free tool has one mass."""
    moved(([0, 1], ALL), ([1, 2], "z"), ([1], "y", constant(0.0)), ([0], "x", PULL, 0.0))
    moved(([0, 1], "x", PULL), ([0, 1], "y", PUSH), ([2], "x", PUSH))
    tool_moved(("move_tool", ("x", "y"), PULL), ("free_tool", "z", 1.0))
    tool_moved(("free_tool", "x", 1.0), ("free_tool", "z", 1.0))


@pytest.mark.parametrize("add", ["load", "move", "add_tool"])
def test_nothing_is_added_after_the_start(add):
    body = line()
    body.step()
    late = {
        "load": lambda: body.boundary.load([0], "x", 1.0),
        "move": lambda: body.boundary.move([0], "x"),
        "add_tool": lambda: body.boundary.add_tool(plane((0, 0, 0), (0, 0, 1))),
    }
    with pytest.raises(InputError, match="after the start"):
        late[add]()
