"""Shapes of rigid tools: distances, normals, and contact forces as gradients of an energy."""

from math import pi

import numpy as np
from cases.row import Row
from cases.series import order
from cases.shell_static import sheet
from shell_cases import grid

from knittest.kernels.tool_contact import SCRATCH, tool_energies, touch_tools
from knittest.kernels.tool_shapes import tool_distance
from knittest.models.boundary import new_tally
from knittest.pose import Body, Tool, plane, plate, sampled

RADIUS = 3.0


def sphere(spacing: float) -> Tool:
    """Sphere about the origin, sampled on a cube of half side 4.8 mm."""
    ticks = np.arange(-4.8, 4.8 + 0.5 * spacing, spacing)
    x, y, z = np.meshgrid(ticks, ticks, ticks, indexing="ij")
    return sampled((-4.8, -4.8, -4.8), spacing, np.sqrt(x**2 + y**2 + z**2) - RADIUS)


def square(tool: Tool) -> Body:
    """One free shell of 1 mm with ``tool``."""
    body = sheet(*grid(1, 1, 1.0, 1.0))
    body.boundary.add_tool(tool)
    return body


def distances(tool: Tool, points: np.ndarray) -> np.ndarray:
    """Distance and normal of ``points`` (n, 3): (n, 4)."""
    tools = square(tool).boundary.drive().tools
    return np.array([tool_distance(0, tools, *p) for p in points])


def sampled_sphere() -> list[Row]:
    """Trilinear interpolation of a distance: its error is h^2 / 8 sum |f,ii| = h^2 / (4 r), its gradient's of order h.

    Against |x| - R at 400 points within 0.5 mm of the surface (de Boor, A Practical Guide to Splines, on the error).
    """
    rng = np.random.default_rng(5)
    direction = rng.normal(size=(400, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    reach = RADIUS + rng.uniform(-0.5, 0.5, 400)
    far, turned = [], []
    for spacing in (0.4, 0.2, 0.1):
        found = distances(sphere(spacing), reach[:, None] * direction)
        far.append(float(np.abs(found[:, 0] - reach + RADIUS).max()))
        turned.append(float(np.linalg.norm(found[:, 1:] - direction, axis=1).max()))
    case, source = "sampled sphere", "|x| - R"
    return [
        Row(case, source, "largest error of the distance [mm]", 0.0, far[-1], "h = 0.1 mm", order(far)),
        Row(case, source, "largest error of the normal [-]", 0.0, turned[-1], "h = 0.1 mm", order(turned)),
    ]


def contact_gradient(tool: Tool, name: str, place: np.ndarray) -> list[Row]:
    """Normal forces of a tool are minus the gradient of its contact energy, by central differences of 1e-6 mm.

    Elastic contact energy k depth^2 / 2; the damping is off because nothing moves. Error of differences: rounding,
    1e-16 U / (h F).
    """
    body = square(tool)
    body.boundary.radius[:] = 0.5
    body.place(place)
    drive = body.boundary.drive()
    nodes, tally, count = body.model.nodes, new_tally(body.boundary), len(place)
    scratch = np.zeros(SCRATCH)

    def energy() -> float:
        nodes.force[:] = 0.0
        touch_tools(0, 0, count, body.dt, nodes, drive.tools, drive.touch, tally, scratch)
        return tool_energies(nodes, drive.tools, drive.touch, count)[0]

    energy()
    force, slope, h = nodes.force[:, :count].copy(), np.zeros((3, count)), 1e-6
    for k, i in np.ndindex(3, count):
        nodes.position[k, i] += h
        up = energy()
        nodes.position[k, i] -= 2.0 * h
        slope[k, i] = -(up - energy()) / (2.0 * h)
        nodes.position[k, i] += h
    size = float(np.abs(force).max())
    off = size + float((slope - force).ravel()[np.argmax(np.abs(slope - force))])
    return [Row(f"contact with a {name}", "f = -dU/dx", "largest force component [N]", off, size, "4 nodes", None)]


def contact_gradients() -> list[Row]:
    """:func:`contact_gradient` for a sampled sphere (off the planes of the grid), a plate at its edge, a plane."""
    corners = np.array([[2.05, 1.5, 2.1], [2.2, 1.1, 2.05], [1.7, 1.9, 1.9], [0.3, 0.2, 3.3]])
    edge = np.array([[4.9, 0.0, 0.8], [5.2, 1.0, 0.7], [4.95, 1.95, 0.85], [0.0, 0.0, 1.1]])
    return [
        *contact_gradient(sphere(0.4), "sampled sphere", corners),
        *contact_gradient(plate((0.0, 0.0, 0.0), (10.0, 4.0, 2.0), 0.6), "plate", edge),
        *contact_gradient(plane((0.0, 0.0, 2.5), (0.3, -0.2, 1.0)), "plane", corners),
    ]


def rounded_edge() -> list[Row]:
    """Along a path at 0.3 mm round the edge of a plate the normal turns by the path over radius + 0.3, without jumps.

    A quarter circle between two straight pieces: largest turn a millimetre 1 / (0.5 + 0.3), total pi / 2; the distance
    stays 0.3 mm.
    """
    edge, off, step = 0.5, 0.3, 1e-3
    flat, arc = np.arange(-1.0, 0.0, step), np.arange(0.0, 0.5 * pi * (edge + off), step) / (edge + off)
    top = np.column_stack([flat, np.full(flat.size, edge + off)])
    bend = (edge + off) * np.column_stack([np.sin(arc), np.cos(arc)])
    side = np.column_stack([np.full(flat.size, edge + off), flat[::-1] - flat.max() - step])
    path = np.vstack([top, bend, side]) + np.array([4.5, 0.5])
    points = np.column_stack([path[:, 0], np.zeros(len(path)), path[:, 1]])
    found = distances(plate((0.0, 0.0, 0.0), (10.0, 4.0, 2.0), edge), points)
    turns = np.linalg.norm(np.diff(found[:, 1:], axis=0), axis=1)
    case, source, mesh = "rounded edge", "geometry", "steps of 1e-3 mm"
    return [
        Row(case, source, "largest turn of the normal [1/mm]", 1.0 / (edge + off), turns.max() / step, mesh, None),
        Row(case, source, "whole turn of the normal [rad]", 0.5 * pi, float(turns.sum()), mesh, None),
        Row(case, source, "distance, farthest off [mm]", off, _farthest(found[:, 0], off), mesh, None),
    ]


def _farthest(values: np.ndarray, from_: float) -> float:
    return float(values[np.argmax(np.abs(values - from_))])


def rows() -> list[Row]:
    """All cases of this module."""
    return [*sampled_sphere(), *contact_gradients(), *rounded_edge()]
