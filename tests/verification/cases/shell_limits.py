"""Limits of shells and rigid tools, measured; the numbers of ``docs/limits.md``."""

import numpy as np
from cases.row import Row
from cases.series import settle
from cases.shell_static import LAW, A, D, hold_each, sheet
from cases.shell_tools import rubbing
from cases.tool_shapes import distances
from scipy.spatial.transform import Rotation
from shell_cases import grid

from knittest.models.boundary import TOOL_STIFFNESS
from knittest.pose import ALL, Table, plane, plate


def irregular_cantilever(shape: str, n: int = 12, rows: int = 2) -> list[Row]:
    """Sag P L^3 / (3 D b) + P L / (K b) of ``n`` x ``rows`` shells whose cross sides lean, after MacNeal & Harder.

    Constant curvature is exact on any mesh (bending patch); one that varies is sampled at one point of elements whose
    sides do not follow it. A single row is soft besides: transverse shear feels the hourglass pattern of directors.
    """
    length, width, load, side = 60.0, 10.0, 1e-4, rows + 1
    points, cells = grid(n, rows, length, width)
    inside = (points[:, 0] > 0.0) & (points[:, 0] < length)
    column = np.round(points[:, 0] / (length / n))
    lean = {"rectangles": 0.0, "parallelograms": 0.4, "trapezoids": 0.4 * (-1.0) ** column}[shape]
    points[:, 0] += inside * lean * (points[:, 1] - 0.5 * width)
    body = sheet(points, cells)
    body.boundary.move(np.arange(side), ALL)
    body.boundary.move(np.arange(side, side * (n + 1)), ["rz"])
    share = np.bincount(np.arange(rows).repeat(2) + np.tile([0, 1], rows)) / (2.0 * rows)
    body.boundary.load(np.arange(side * n, side * (n + 1)), "z", load * share)
    settle(body)
    exact = load * length**3 / (3.0 * D[0] * width) + load * length / (5.0 * D[0] / LAW["thickness"] ** 2 * width)
    found = float(body.position[-side:, 2].mean())
    return [Row(f"irregular bending, {shape}", "beam theory", "sag [mm]", exact, found, f"{n} x {rows}", None)]


def free_drilling(held: bool) -> list[Row]:
    """Pure twist by turning the ends about x, their turn about the normal held or free: 4 T b theta less edges.

    Drilling alone keeps a node, whose other turns are held one by one, from spinning about its normal and carrying its
    director away.
    """
    length, width, angle, n = 8.0, 4.0, 0.05, 8
    points, cells = grid(n, n, length, width)
    points = points - [0.0, 0.5 * width, 0.0]
    body = sheet(points, cells, shear=40.0)
    turn = np.outer(points[:, 0] / length, [angle, 0.0, 0.0])
    body.place(Rotation.from_rotvec(turn).apply(points), turn)
    dofs = ("x", "y", "z", "rx", "rz") if held else ("x", "y", "z", "rx")
    hold_each(body, np.arange(n + 1), dofs)
    last = np.arange(n * (n + 1), (n + 1) ** 2)
    groups = hold_each(body, last, dofs)
    settle(body, 1e-5)
    force = np.array([[body.reaction(g) for g in row] for row in groups])
    at = body.position[last]
    torque = float((at[:, 1] * force[:, 2] - at[:, 2] * force[:, 1] + force[:, 3]).sum())
    law, theta = body.model.laminate, angle / length
    q = 0.5 * width * np.sqrt(law.transverse[0] / law.twist)
    exact = 4.0 * law.twist * width * theta * (1.0 - np.tanh(q) / q)
    case = f"twist, turn about the normal {'held' if held else 'free'}"
    return [Row(case, "Reissner 1945", "torque [N mm]", exact, torque, f"{n} x {n}", None)]


def penetration(pressure: float = 0.1, spacing: float = 2.5) -> list[Row]:
    """A sheet pressed onto a plane sinks in by p dt^2 / (0.4 m'): penalty 0.4 m / dt^2 of a node."""
    points, cells = grid(4, 4, 4.0 * spacing, 4.0 * spacing)
    body = sheet(points, cells)
    body.boundary.add_tool(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    share = body.model.mass / body.model.mass.sum()
    body.boundary.load(np.arange(25), "z", -pressure * (4.0 * spacing) ** 2 * share)
    settle(body)
    exact = pressure * body.dt**2 / (TOOL_STIFFNESS * 1e-3)
    found = -float(body.position[:, 2].mean())
    return [Row("penetration", "penalty", f"depth at {pressure:g} MPa [mm]", exact, found, "4 x 4", None)]


def friction_lever(friction: float = 0.2, normal: float = 1.0) -> list[Row]:
    """A sheet clamped along an edge lies on a plane that slides away under it: clamp moment F t / 2 of face friction.

    Tool friction acts on the nodes, in the middle of the sheet, so the moment of its lever is missing.
    """
    points, cells = grid(4, 1, 20.0, 5.0)
    body = sheet(points, cells)
    body.damping = 0.2
    body.boundary.radius[2:] = 0.5
    below = rubbing(plane((0.0, 0.0, -0.5), (0.0, 0.0, 1.0)), friction, friction)
    below.motion[0] = body.boundary.table(Table((0.0, 20.0), (0.0, 0.05)))
    body.boundary.add_tool(below)
    clamp = body.boundary.move([0, 1], ["x"])
    turn = body.boundary.move([0, 1], ["ry"])
    body.boundary.move([0, 1], ["y", "z", "rx", "rz"])
    body.boundary.load(np.arange(2, 10), "z", -normal / 8.0)
    body.advance(150.0)
    force, moment = body.reaction(clamp), body.reaction(turn)
    return [
        Row("friction on the face", "statics", "pull [N]", -friction * normal, force, "4 x 1", None),
        Row(
            "friction on the face", "statics", "moment of its lever [N mm]", 0.5 * friction * normal, moment, "4", None
        ),
    ]


def hourglass(rows: int, hourglass_share: float = 0.05) -> list[Row]:
    """Bending in the plane, P L^3 / (3 A b^3 / 12) + 6 P L / (5 S b): one row carries it by hourglass control alone.

    Rows of one-point elements miss 1 / rows^2 of A b^3 / 12, and the control gives its share of that back.
    """
    length, width, load, n = 40.0, 10.0, 1e-3, 16
    points, cells = grid(n, rows, length, width)
    body = sheet(points, cells, shear=50.0, hourglass=hourglass_share)
    side = rows + 1
    body.boundary.move(np.arange(side), ALL)
    body.boundary.move(np.arange(side, side * (n + 1)), ["z", "rx", "ry"])
    body.boundary.load(np.arange(side * n, side * (n + 1)), "y", load / side)
    settle(body)
    exact = load * length**3 / (3.0 * A[0] * width**3 / 12.0) + 1.2 * load * length / (50.0 * width)
    found = float((body.position - points)[-side:, 1].mean())
    return [Row(f"bending in the plane, {rows} rows", "beam theory", "sag [mm]", exact, found, f"{n} x {rows}", None)]


def deep_corner() -> list[Row]:
    """Inside a plate, deeper than its edge radius, the nearest face changes on a diagonal: the normal jumps there."""
    found = distances(plate((0.0, 0.0, 0.0), (10.0, 4.0, 2.0), 0.2), np.array([[4.499, 0.0, 0.5], [4.501, 0.0, 0.5]]))
    jump = float(np.linalg.norm(np.diff(found[:, 1:], axis=0)))
    return [Row("deep in a plate", "geometry", "jump of the normal [-]", 0.0, jump, "edge 0.2, depth 0.5 mm", None)]


def rows() -> list[Row]:
    """All limits."""
    shapes = ("rectangles", "parallelograms", "trapezoids")
    cases = [irregular_cantilever(shape, n) for shape in shapes for n in (6, 12)]
    cases += [irregular_cantilever("rectangles", 24, 1)]
    cases += [free_drilling(True), free_drilling(False), penetration(), friction_lever()]
    cases += [hourglass(n) for n in (1, 2, 4)]
    return [row for case in [*cases, deep_corner()] for row in case]
