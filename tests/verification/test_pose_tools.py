"""Rigid tools of a posed body that comes to rest, and what is refused of tools, tables and selections."""

import numpy as np
import pytest

from knittest.base.errors import InputError, NumericalError
from knittest.pose import ALL, Body, Chain, constant, linear_laminate, plane, plate, ramp, round_section

ROUND = round_section(modulus=60e3, diameter=0.75, density=2.5e-3)
LINE = np.column_stack([np.linspace(0.0, 10.0, 11), np.zeros(11), np.zeros(11)])


def line() -> Body:
    body = Body.of_chains([Chain(LINE, ROUND)])
    body.boundary.move([0], ALL)
    return body


def with_weight(mass: float, force: float, gap: float) -> tuple[Body, int]:
    """A cantilever and, a ``gap`` [mm] above its tip, a small plate that may fall with ``force`` [N]."""
    body = line()
    tool = body.boundary.add_tool(plate((10.0, 0.0, 0.5 + gap), (0.6, 2.0, 1.0), 0.0))
    body.boundary.free_tool(tool, "z", mass, constant(-force))
    return body, tool


def test_a_weight_that_lies_on_the_tip_bends_it():
    """F L^3 / (3 EI), wherever the weight started; it presses with what it weighs, and stands still."""
    body, tool = with_weight(1e-2, 0.5, gap=1e-2)
    found = body.relax(most_steps=8000)  # twice as many, undamped
    assert found.residual < 1e-4
    assert body.position[10, 2] == pytest.approx(-0.5 * 10.0**3 / (3.0 * ROUND.bending), rel=6e-3)
    body.step()
    assert body.readings().tool_force[tool, 2] == pytest.approx(0.5, rel=1e-3)
    assert abs(body.start().drive.tools.velocity[tool, 2]) < 1e-4


def test_a_weight_in_the_air_is_not_at_rest():
    body, _ = with_weight(1.0, 0.5, gap=20.0)
    with pytest.raises(NumericalError, match="no equilibrium after 500 steps, residual 1"):
        body.relax(most_steps=500)


def test_a_tool_keeps_its_drag():
    """Relaxation damps a free tool as it does the nodes, and gives it back as it was."""
    body = line()
    tool = body.boundary.add_tool(plane((0.0, 0.0, -50.0), (0.0, 0.0, 1.0)))
    body.boundary.free_tool(tool, "z", 2.0, drag=3.0)
    body.relax()
    assert body.start().drive.tools.drag[tool] == 3.0
    assert body.readings().tool_position[tool, 2] == -50.0


def relaxed_under_a_tool_that_moves() -> None:
    body = line()
    body.boundary.add_tool(plane((0.0, 0.0, -60.0), (0.0, 0.0, 1.0)))
    body.boundary.add_tool(plane((0.0, 0.0, -50.0), (0.0, 0.0, 1.0)))
    body.boundary.move_tool(1, "z", ramp(1.0, 0.1))
    body.relax()


def freed_after_the_start() -> None:
    body = line()
    tool = body.boundary.add_tool(plane((0.0, 0.0, -50.0), (0.0, 0.0, 1.0)))
    body.step()
    body.boundary.free_tool(tool, "z", mass=1.0)


def laminate(shear: object = 0.5, thickness: object = 1.0) -> None:
    linear_laminate((100.0, 80.0), (2.0, 1.0), shear, thickness)  # type: ignore[arg-type]


REFUSED = {
    "moving tool": (relaxed_under_a_tool_that_moves, "table of tool 1 ends at a nonzero speed"),
    "late": (freed_after_the_start, "motion of a tool was added after the start"),
    "no table": (lambda: line().boundary.load([1], "x", 1.0, 2.0), r"expected a Table, such as constant\(2.0\)"),
    "no nodes": (lambda: line().boundary.load(np.flatnonzero(LINE[:, 0] > 11.0), "x", 1.0), "nodes: expected at"),
    "no dofs": (lambda: line().boundary.move([1], []), "degrees of freedom: expected at least one"),
    "two dofs": (lambda: line().boundary.load([1], ["x", "y"], 1.0), "one degree of freedom, got 2"),
    "dof number": (lambda: line().boundary.move([1], 0), "degree of freedom 0: expected one of x"),
    "ragged": (lambda: line().boundary.move([[0, 1], [2]], "x"), "nodes: expected whole numbers"),
    "gravity": (lambda: line().boundary.gravity(np.ones(11), (0.0, -1.0)), r"direction of gravity: .*shape \(3\)"),
    "turn": (lambda: line().place(LINE, np.zeros((5, 3))), r"turn: expected the shape \(11, 3\), got \(5, 3\)"),
    "steps": (lambda: line().step(-3), "steps: -3; expected a whole number"),
    "part of a step": (lambda: line().step(1.5), "steps: 1.5; expected a whole number"),
    "ramp": (lambda: ramp(-1.0, 1.0), "duration of a ramp .*: -1"),
    "shear": (lambda: laminate(shear=np.inf), "shear .*: not finite: inf"),
    "thickness": (lambda: laminate(thickness=(1.0, 1.0)), r"thickness .*: expected the shape \(\), got \(2,\)"),
    "group": (lambda: line().reaction("z"), "reaction of group z: expected a number"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_bad_input_is_refused(name):
    make, message = REFUSED[name]
    with pytest.raises(InputError, match=message):
        make()
