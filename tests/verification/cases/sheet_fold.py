"""A sheet that folds and touches itself; posed through :mod:`knittest.pose`."""

from math import cos, pi, sin

import numpy as np
from cases.row import Row
from shell_cases import grid

from knittest.pose import Body, SheetContact, Table, linear_laminate, plane

AREA_MASS = 1e-3


def strip_on(shape, n: int, size: float, thickness: float, friction: float = 0.0, rows: int = 2, **options) -> Body:
    """Strip of ``n`` x ``rows`` shells, flat at rest, put on the curve ``shape``: arc length to (x, z, slope)."""
    points, cells = grid(n, rows, n * size, rows * size)
    law = linear_laminate((50.0, 50.0), (5.0, 5.0), 0.5, thickness)
    contact = SheetContact(friction, safety=options.get("safety", 0.9))
    body = Body.of_shells(
        points, cells, law, AREA_MASS, thickness, self_contact=contact, warp=(1.0, 0.0, 0.0), **options
    )
    x, z, slope = np.array([shape(s) for s in points[:, 0]]).T
    body.place(np.column_stack([x, points[:, 1], z]), np.column_stack([0.0 * x, -slope, 0.0 * x]))
    return body


def hairpin(length: float, radius: float):
    """A curve there and back round a half circle of ``radius`` in its middle, ``length`` long."""
    arm = 0.5 * (length - pi * radius)

    def shape(s: float) -> tuple[float, float, float]:
        if s < arm:
            return s, 0.0, 0.0
        if s > arm + pi * radius:
            return length - s, 2.0 * radius, pi
        a = (s - arm) / radius
        return arm + radius * sin(a), radius * (1.0 - cos(a)), a

    return shape


def pressed_fold(
    thickness: float = 2.0,
    size: float = 2.0,
    gap: float = 4.2,
    watch=None,
    friction: float = 0.3,
    rows: int = 2,
    **options,
) -> tuple[Body, dict[str, float]]:
    """A strip bent into a hairpin of 24 mm across, whose arms two planes press together to ``gap`` [mm] apart."""
    n, radius, closing = 60, 12.0, 20.0
    body = strip_on(hairpin(n * size, radius), n, size, thickness, friction, rows, **{"damping": 0.2} | options)
    body.boundary.move(np.arange((n + 1) * (rows + 1)), ["y", "rx", "rz"])
    body.boundary.radius[:] = 0.5 * thickness
    body.boundary.add_tool(plane((0.0, 0.0, -0.5 * thickness), (0.0, 0.0, 1.0)))
    lid = plane((0.0, 0.0, 2.0 * radius + 0.5 * thickness), (0.0, 0.0, -1.0))
    travel = 2.0 * radius + thickness - gap
    lid.motion[2] = body.boundary.table(Table((0.0, 2.0, closing, closing + 2.0), (0.0, *[-travel / closing] * 2, 0.0)))
    body.boundary.add_tool(lid)
    start, worst = body.energies(), 0.0
    balances, deepest = [], 0.0

    def look(b: Body) -> None:
        nonlocal deepest
        deepest = max(deepest, float(b.model.stored_energies().penetration.max(initial=0.0)))
        if watch is not None:
            watch(b)

    for _ in range(6):
        body.advance((closing + 6.0) / 6.0, look)
        energy = body.energies()
        balances.append(energy["balance"] - start["balance"])
        worst = max(worst, abs(energy["external"]))
    nearest = closest_layers(body.position.reshape(n + 1, rows + 1, 3)[:, 0, ::2], size, 1.6 * thickness + size)
    return body, {
        "nearest": nearest, "penetration": deepest, "energy_error": float(np.abs(balances).max() / worst),
        "touching": float(len(body.model.stored_energies().penetration)), "pressing": body.model.contact_force_sum(),
    }  # fmt: skip


def closest_layers(curve: np.ndarray, size: float, beyond: float) -> float:
    """Least distance [mm] of a node of a polyline (n, 2) from its segments farther than ``beyond`` along it."""
    least = np.inf
    for i, point in enumerate(curve):
        for j in range(len(curve) - 1):
            if min(abs(i - j), abs(i - j - 1)) * size <= beyond:
                continue
            a, b = curve[j], curve[j + 1]
            share = np.clip((point - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
            least = min(least, float(np.linalg.norm(point - a - share * (b - a))))
    return least


def bent(radius_over_thickness: float, degrees: float = 270.0, thickness: float = 2.6, size: float = 2.0) -> int:
    """Contacts that would touch on a strip with ``size`` < ``thickness``, bent to a circle."""
    radius = radius_over_thickness * thickness
    n = round(np.radians(degrees) * radius / size)
    body = strip_on(
        lambda s: (radius * sin(s / radius), radius * (1.0 - cos(s / radius)), s / radius), n, size, thickness
    )
    body.start()
    tracker = body.model.tracker
    return int((tracker.contacts.gap[: tracker.count] < thickness).sum())


def rows() -> list[Row]:
    """Everything, for the report."""
    found = pressed_fold(gap=3.98, damping=1.9, safety=0.45)[1]
    case, source, mesh = "fold of a strip pressed flat", "geometry", "60 x 2, half step"
    return [
        Row(case, source, "least distance of its layers [mm]", 2.0, found["nearest"], mesh, None),
        Row(case, "balance", "energy error over work [-]", 0.0, found["energy_error"], mesh, None),
    ]
