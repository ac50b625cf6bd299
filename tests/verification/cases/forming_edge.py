"""A yarn drawn over the shoulder of a die: Euler's capstan, and no snagging."""

from math import pi, radians, tan

import numpy as np
from cases.row import Row

from knittest.config.tools import Die, Stamp
from knittest.models.surface import surface
from knittest.models.tool import Tool
from knittest.pose import Body, Chain, ramp, section
from knittest.tooling.toolset import RigidTool, build_tools

FRICTION, SIZE, HOLD, SPEED, SHOULDER, DEPTH = 0.2, 0.375, 5.0, 0.2, 8.0, 40.0
#: clearance, and what the draft widens the stamp [mm]
OFFSET = 8.0 + DEPTH * tan(radians(2.0))
#: where the opening's wall is met, and the direction away from it: the long side of the bar; its rounded corner, centre
#: (63, 63) and radius 12 mm, along the diagonal
SIDE = (np.array([0.0, 75.0 + OFFSET]), np.array([0.0, 1.0]))
CORNER = (63.0 + (12.0 + OFFSET) * np.full(2, 0.5**0.5), np.full(2, 0.5**0.5))


def default_die() -> RigidTool:
    """The die of the default stamp."""
    return build_tools(Stamp(), Die(), None, DEPTH, 2.6, (330.0, 330.0)).die


def drawn(tool: Tool, wall: np.ndarray, out: np.ndarray) -> tuple[np.ndarray, float]:
    """Tensions over the hold while five elements of 1 mm pass, and the largest slip sideways [mm].

    ``wall`` (2,) in plan, ``out`` (2,) away from the opening. The yarn lies on the face, turns by pi / 2 round the
    shoulder and hangs along the wall, where it is drawn down.
    """
    radius, count = SHOULDER + SIZE, 13
    turn, h = np.linspace(0.0, 0.5 * pi, count + 1), radius * 0.5 * pi / count
    arc = np.column_stack([SHOULDER - radius * np.sin(turn), radius * np.cos(turn) - 1.3 - SHOULDER])
    face = np.column_stack([SHOULDER + h * np.arange(9, 0, -1), np.full(9, SIZE - 1.3)])
    down = arc[-1] - np.column_stack([np.zeros(3), h * np.arange(1, 4)])
    path = np.vstack([face, arc, down])
    body = Body.of_chains(
        [Chain(np.column_stack([wall + path[:, :1] * out, path[:, 1]]), section(2e3, 1e-3, SIZE, 1e-3))], damping=1.0
    )
    body.boundary.radius[:] = SIZE
    tool.friction = (FRICTION, FRICTION)
    body.boundary.add_tool(tool)
    for dof, share in zip("xy", out, strict=True):
        body.boundary.load([0], dof, share * HOLD, ramp(0.5, 1.0))
    pull = body.boundary.move([len(path) - 1], ["z"], ramp(1.0, -SPEED))
    body.advance(1.0 + h / SPEED)
    tension: list[float] = []
    body.advance(5.0 * h / SPEED, lambda b: tension.append(-b.reaction(pull)))
    off = (body.position[:, :2] - wall) @ np.array([-out[1], out[0]])
    return np.array(tension) / HOLD, float(np.abs(off).max())


def shoulder() -> list[Row]:
    """T2 = T1 exp(mu theta), theta = pi / 2 (Euler 1769): mean, and half the range over the mean, which a snag would
    widen; by dimensions at a straight side and a corner, and as an STL file sampled at 1 mm.
    """
    die = default_die()
    box = [[-20.0, 60.0, -30.0], [20.0, 120.0, 5.0]]
    sampled = surface(die.solid.points, die.solid.triangles, 1.0, box)
    exact, rows = float(np.exp(0.5 * pi * FRICTION)), []
    for name, tool, place in (("side", die.tool, SIDE), ("corner", die.tool, CORNER), ("side, STL", sampled, SIDE)):
        ratio, sideways = drawn(tool, *place)
        case, source = f"die's shoulder, {name}", "Euler 1769; Eytelwein 1808"
        swing = float(0.5 * np.ptp(ratio) / ratio.mean())
        rows += [
            Row(case, source, "T2 / T1 [-]", exact, float(ratio.mean()), "1 mm", None),
            Row(case, "geometry", "half the range of T2 over its mean [-]", 0.0, swing, "1 mm", None),
            Row(case, "symmetry", "slip sideways [mm]", 0.0, sideways, "1 mm", None),
        ]
    return rows


def rows() -> list[Row]:
    """All cases of this module."""
    return shoulder()
