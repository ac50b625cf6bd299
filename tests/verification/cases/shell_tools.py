"""Shells against rigid tools: friction, impact, wrapping; posed through :mod:`knittest.pose`."""

from itertools import pairwise
from math import cos, exp, pi, sin, sqrt, tan

import numpy as np
from cases.row import Row
from cases.series import order, settle
from cases.shell_static import sheet
from shell_cases import Y, grid

from knittest.kernels.tool_contact import FREE
from knittest.models.boundary import TOOL_STIFFNESS
from knittest.pose import Table, Tool, cylinder, plane, ramp

#: free fall [mm/ms^2]
GRAVITY = 9.81e-3
#: half thickness of the sheets [mm]
RADIUS = 0.5


def rubbing(tool: Tool, static: float, kinetic: float) -> Tool:
    """The tool with Coulomb coefficients."""
    tool.friction = (static, kinetic)
    return tool


def strip_between_plates(friction: float = 0.25, normal: float = 20.0) -> list[Row]:
    """Strip pulled from between a held plate and one loaded by N: F = 2 mu N, and N reaches the lower plate.

    Coulomb on both faces; the upper plate is a body of 2 g on the load table. Means over 60 ms of steady sliding.
    """
    points, cells = grid(8, 2, 40.0, 10.0)
    body = sheet(points, cells, membrane=(20.0, 20.0))
    body.damping = 0.5
    body.boundary.radius[:] = RADIUS
    body.boundary.add_tool(rubbing(plane((0.0, 0.0, -RADIUS), (0.0, 0.0, 1.0)), friction, friction))
    upper = rubbing(plane((0.0, 0.0, RADIUS), (0.0, 0.0, -1.0)), friction, friction)
    upper.motion[2], upper.load[2], upper.mass, upper.drag = FREE, body.boundary.table(ramp(20.0, -normal)), 2.0, 0.5
    body.boundary.add_tool(upper)
    speed = Table((20.0, 40.0), (0.0, 0.1))
    end = body.boundary.move(np.arange(24, 27), ["x"], speed)
    body.advance(140.0)
    read = []
    body.advance(60.0, lambda b: read.append([b.reaction(end), -b.readings().tool_force[0, 2]]))
    pull, below = np.mean(read, axis=0)
    case, source = "strip between plates", "Coulomb, two faces"
    return [
        Row(case, source, "pulling force 2 mu N [N]", 2.0 * friction * normal, float(pull), "8 x 2", None),
        Row(case, source, "force on the lower plate [N]", normal, float(below), "8 x 2", None),
    ]


def block_on_spring(
    speed: float, static: float, kinetic: float, normal: float, safety: float
) -> tuple[np.ndarray, float, float]:
    """One shell as a spring: its left edge is pulled, its right one is a block pressed onto a plane.

    Returns time [ms] and force of the spring [N] as rows, its stiffness [N/mm] and the mass of the block [g].
    """
    points, cells = grid(1, 1, 10.0, 10.0)
    body = sheet(points, cells, membrane=(20.0, 20.0), safety=safety)
    spring, mass = 20.0, float(body.model.mass[:2].sum())
    body.boundary.radius[:2] = RADIUS  # the pulled edge stays clear of the plane
    body.boundary.add_tool(rubbing(plane((0.0, 0.0, -RADIUS), (0.0, 0.0, 1.0)), static, kinetic))
    body.boundary.load([0, 1], "z", -0.5 * normal)
    body.boundary.move([0, 1], ["y"])
    body.boundary.move([2, 3], ["y", "z"])
    pulled = body.boundary.move([2, 3], ["x"], Table((2.0, 2.1), (0.0, speed)))
    history: list[tuple[float, float]] = []
    body.advance(2.1)
    while body.time < 7.5:
        body.step(1)
        history.append((body.time, body.reaction(pulled)))
    return np.array(history).T, spring, mass


def stick_slip() -> list[Row]:
    """Block on a spring k pulled at v: sticks up to mu_s N, then the force falls to (2 mu_k - mu_s) N, and again.

    With D = (mu_s - mu_k) N and w = sqrt(k / m) the period is 2 D / (k v) + 2 (pi - atan(D w / (k v))) / w: the slip is
    a piece of a harmonic that starts and ends at the speed of the block, 0. Den Hartog (1931), Trans. ASME 53, 107;
    Persson, Sliding Friction (2000). The stick spring's compliance, and its swing after a stop, fall with the step.
    """
    static, kinetic, normal, speed = 0.5, 0.3, 2.0, 0.05
    peaks, drops, periods = [], [], []
    shares = (0.2, 0.1, 0.05)
    for share in shares:
        (time, force), spring, mass = block_on_spring(speed, static, kinetic, normal, share)
        high = force > kinetic * normal
        falls = np.flatnonzero(high[:-1] & ~high[1:])
        peaks.append(float(np.mean([force[a:b].max() for a, b in pairwise(falls)])))
        drops.append(float(np.mean([force[a:b].min() for a, b in pairwise(falls)])))
        periods.append(float(np.diff(time[falls]).mean()))
    swing, omega = (static - kinetic) * normal, sqrt(spring / mass)
    period = 2.0 * swing / (spring * speed) + 2.0 * (pi - np.arctan(swing * omega / (spring * speed))) / omega
    case, source, mesh = "stick-slip", "Den Hartog 1931", "1, step x 0.05"
    return [
        Row(case, source, "force at slip mu_s N [N]", static * normal, peaks[-1], mesh, None),
        Row(
            case, source, "force at stop (2 mu_k - mu_s) N [N]", (2 * kinetic - static) * normal, drops[-1], mesh, None
        ),
        Row(case, source, "period [ms]", period, periods[-1], mesh, None),
    ]


def sheet_on_incline(angle: float, static: float, kinetic: float, duration: float) -> float:
    """Slide [mm] of a sheet that lies on a plane while it is tilted to ``angle`` in 20 ms, and for ``duration`` after.

    Held against tilting is only the weight across the plane, so that the sheet starts in equilibrium.
    """
    points, cells = grid(2, 2, 10.0, 10.0)
    down, normal = np.array([cos(angle), 0.0, -sin(angle)]), np.array([sin(angle), 0.0, cos(angle)])
    points = points[:, :1] * down + points[:, 1:2] * Y
    body = sheet(points, cells, down)
    body.boundary.add_tool(rubbing(plane((0.0, 0.0, 0.0), normal), static, kinetic))
    weight = GRAVITY * body.model.mass
    body.boundary.gravity(cos(angle) * weight, -normal)
    body.boundary.gravity(sin(angle) * weight, down, ramp(20.0, 1.0))
    depth = GRAVITY * cos(angle) * body.dt**2 / TOOL_STIFFNESS
    body.place(points - depth * normal)
    body.advance(20.0 + duration)
    return float(((body.position - points) @ down).mean())


def incline_threshold(angle: float = 0.4) -> list[Row]:
    """A body on an incline begins to slide where tan(angle) = mu_s (Coulomb); halvings down to a thousandth.

    Kinetic friction is lower, mu_k = 0.8 mu_s: once it slides it goes on.
    """
    low, high = 0.5 * tan(angle), 1.5 * tan(angle)
    while high - low > 1e-3 * tan(angle):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if sheet_on_incline(angle, middle, 0.8 * middle, 10.0) > 0.01 else (low, middle)
    return [Row("incline, threshold", "Coulomb", "mu_s [-]", tan(angle), 0.5 * (low + high), "2 x 2", None)]


def incline_slide(angle: float = 0.4, kinetic: float = 0.2) -> list[Row]:
    """Down an incline with a = g (sin - mu_k cos), from the second difference of the slide over equal times."""
    duration = 40.0
    ends = [sheet_on_incline(angle, 1.2 * kinetic, kinetic, k * duration) for k in (0.0, 1.0, 2.0)]
    found = (ends[2] - 2.0 * ends[1] + ends[0]) / duration**2
    exact = GRAVITY * (sin(angle) - kinetic * cos(angle))
    return [Row("incline, slide", "Coulomb, Newton", "acceleration [mm/ms^2]", exact, found, "2 x 2", None)]


def head_on(share: float) -> float:
    """Speed after over speed before of a sheet that falls flat on a held plane of ``share`` of the usual stiffness."""
    points, cells = grid(2, 2, 10.0, 10.0)
    body = sheet(points, cells)
    wall = plane((0.0, 0.0, -1e-3), (0.0, 0.0, 1.0))
    wall.stiffness = share
    body.boundary.add_tool(wall)
    body.velocity[:, 2] = -0.1
    body.advance(8.0)
    return float(body.velocity[:, 2].mean() / 0.1)


def restitution() -> list[Row]:
    """Rebound of a damped penalty that does not pull: e = exp(-z / sqrt(1 - z^2) (pi - 2 asin z)), z = 0.05.

    Schwager & Poeschel (2007), Granular Matter 9, 465. The step of the contact frequency w is dt w = sqrt(0.4 share);
    the force lags by half a step.
    """
    z = 0.05
    exact = exp(-z / sqrt(1.0 - z * z) * (pi - 2.0 * np.arcsin(z)))
    found = [head_on(share) for share in (1 / 4, 1 / 16, 1 / 64, 1 / 256)]
    errors = [f - exact for f in found]
    source, mesh = "Schwager & Poeschel 2007", "stiffness / 256"
    return [Row("impact, restitution", source, "speed after / before [-]", exact, found[-1], mesh, order(errors))]


def oblique_impact() -> list[Row]:
    """A sheet strikes a heavy free plane edge first, with friction: momentum m v + M V stays, energy is accounted for.

    Newton's third law: the momentum is that of the start to round-off; kinetic, elastic and dissipated energy add up
    to the kinetic energy of the start to the O(w^2 dt^2) of central differences.
    """
    points, cells = grid(6, 4, 30.0, 20.0)
    tilt = np.array([[cos(0.3), 0.0, sin(0.3)], [0.0, 1.0, 0.0], [-sin(0.3), 0.0, cos(0.3)]])
    points = points @ tilt
    body = sheet(points, cells, tilt[0])
    wall = rubbing(plane((0.0, 0.0, points[:, 2].min() - 0.01), (0.0, 0.0, 1.0)), 0.3, 0.2)
    wall.motion, wall.mass = [FREE, FREE, FREE], 2.0
    body.boundary.add_tool(wall)
    body.velocity[:] = [0.3, 0.1, -1.0]
    tools, mass = body.start().drive.tools, body.model.mass
    before, energy = mass @ body.velocity, 0.5 * float(mass @ (body.velocity**2).sum(axis=1))
    body.advance(40.0)
    after = mass @ body.velocity + 2.0 * tools.velocity[0]
    found = body.energies()
    held = ("kinetic", "internal", "hourglass", "contact", "friction", "contact_damping")
    rest = sum(found[name] for name in held)
    mesh = "6 x 4"
    return [
        Row("oblique impact", "Newton", f"momentum {axis} [g mm/ms]", float(b), float(a), mesh, None)
        for axis, b, a in zip("xyz", before, after, strict=True)
    ] + [Row("oblique impact", "first law", "energy [mJ]", energy, rest, mesh, None)]


def wrapped_cylinder(pull: float = 0.01) -> list[Row]:
    """Strip round a quarter of a smooth cylinder under the tension T: pressure p = T / (R + t / 2) per width.

    Capstan equation without friction, Euler (1769); R + t / 2 is the radius of the strip's middle. Forces of the nodes
    over arcs of the strip as laid: order 2. The pull's resultant on the cylinder is T in x and in z, exactly.
    """
    radius, width = 20.0, 5.0
    middle, errors, pressures = radius + RADIUS, [], []
    for n in (6, 12, 24):
        flat, cells = grid(n, 1, 0.5 * pi, width)
        angle = flat[:, 0]
        points = np.column_stack([middle * np.sin(angle), flat[:, 1], middle * np.cos(angle)])
        along = np.cross([0.0, 1.0, 0.0], points[cells].mean(axis=1))
        body = sheet(points, cells, along, bending=(0.001, 0.001))
        body.boundary.radius[:] = RADIUS
        body.boundary.add_tool(cylinder((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), radius, 4.0 * width))
        body.boundary.move([0, 1], ["x", "ry"])
        body.boundary.move([2 * n, 2 * n + 1], ["ry"])
        body.boundary.move(np.arange(2 * n + 2), ["y", "rx", "rz"])
        body.boundary.load([2 * n, 2 * n + 1], "z", -0.5 * pull)
        settle(body)
        touching = body.start().drive.touch.pressure[0].reshape(n + 1, 2).sum(axis=1)
        pressures.append(float(touching[n // 4 : -n // 4].mean() / (width * middle * 0.5 * pi / n)))
        errors.append(pressures[-1] / (pull / (middle * width)) - 1.0)
    force = body.readings().tool_force[0]
    exact = pull / (middle * width)
    return [
        Row("strip round a cylinder", "Euler 1769", "pressure [MPa]", exact, pressures[-1], "24", order(errors)),
        Row("strip round a cylinder", "statics", "force along z [N]", -pull, float(force[2]), "24", None),
    ]


def rows() -> list[Row]:
    """All cases of this module."""
    cases = [
        strip_between_plates(),
        stick_slip(),
        incline_threshold(),
        incline_slide(),
        restitution(),
        oblique_impact(),
    ]
    return [row for case in [*cases, wrapped_cylinder()] for row in case]
