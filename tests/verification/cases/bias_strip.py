"""Bias extension of pin-jointed nets and of shells: closed forms, and strips pulled at 45 degrees to their yarns."""

from typing import NamedTuple

import numpy as np
from shell_cases import grid

from knittest.pose import Body, Table, linear_laminate

#: strip [mm] and shear stiffness [N/mm]
LENGTH, WIDTH, SHEAR = 200.0, 100.0, 0.1
BIAS = (0.5**0.5, 0.5**0.5, 0.0)
#: speed of a clamp [mm/ms], reached over a time [ms], and damping [1/ms]
SPEED, RAMP, DAMPING = 0.15, 20.0, 0.05


class Pulled(NamedTuple):
    """Shear angle of the middle [deg], force [N] and hourglass over internal energy [-] of a strip pulled."""

    angle: float
    force: float
    hourglass: float


def elongation(angle: float, free: float) -> float:
    """Elongation [mm] of a net whose middle shears by ``angle`` [deg]: free (sqrt 2 cos(45 - angle / 2) - 1).

    ``free`` is the length [mm] of the strip less its width: the triangles at the clamps stay as they are.
    """
    return free * (2.0**0.5 * np.cos(0.25 * np.pi - 0.5 * np.deg2rad(angle)) - 1.0)


def net_force(angle: float, free: float, full: float, half: float) -> float:
    """Force [N] of that net: what it takes, S gamma dgamma in the area ``full`` [mm^2] and a quarter of it in the area
    ``half`` that shears half as much, over the elongation.
    """
    gamma = np.deg2rad(angle)
    return SHEAR * gamma * (full + 0.25 * half) / (free * 0.5**0.5 * np.sin(0.25 * np.pi - 0.5 * gamma))


def strip_force(angle: float) -> float:
    """:func:`net_force` of the whole strip: (2 L - 3 W) W / 2 in the middle, W^2 beside it."""
    return net_force(angle, LENGTH - WIDTH, 0.5 * (2.0 * LENGTH - 3.0 * WIDTH) * WIDTH, WIDTH**2)


def pulled(size: float, ratio: float, angle: float) -> Pulled:
    """A quarter of the strip, of squares along the pull, whose yarns are ``ratio`` times as stiff as its shear."""
    nx, ny = round(0.5 * LENGTH / size), round(0.5 * WIDTH / size)
    points, cells = grid(nx, ny, 0.5 * LENGTH, 0.5 * WIDTH)
    body, clamp = _pull(points, cells, ratio, points[:, 0] < 1e-9)
    for axis, middle in (("x", 0.5 * LENGTH), ("y", 0.5 * WIDTH)):
        body.boundary.move(np.flatnonzero(np.abs(points[:, "xy".index(axis)] - middle) < 1e-9), [axis, "rz"])
    found = _at(body, points, clamp, 0.5 * elongation(angle, LENGTH - WIDTH))
    return found._replace(force=2.0 * found.force)


def diamonds(size: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Points and cells of the strip in squares of about ``size`` [mm] along the yarns, its edges jagged, and half the
    diagonal of a square.
    """
    nx, ny = round(LENGTH / (2.0**0.5 * size)), round(WIDTH / (2.0**0.5 * size))
    half = 0.5 * LENGTH / nx
    columns, rows = np.meshgrid(np.arange(1, 2 * nx), np.arange(1, 2 * ny), indexing="ij")
    middle = np.column_stack([columns.ravel(), rows.ravel()])[(columns + rows).ravel() % 2 == 1]
    corners = middle[:, None] + np.array([[-1, 0], [0, -1], [1, 0], [0, 1]])
    places, cells = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    return half * np.column_stack([places, np.zeros(len(places))]), cells.reshape(-1, 4), half


def pulled_along_yarns(size: float, ratio: float, angle: float, shaken: float = 0.0) -> tuple[Pulled, float]:
    """The strip in :func:`diamond_counts`, and the force [N] of the net of these squares.

    The clamps hold two rows of nodes, every yarn by one of them, so that the net is as long as the strip. Nodes away
    from the edges are moved by up to ``shaken`` [mm] each way.
    """
    points, cells, half = diamonds(size)
    far = points[:, 0].max() - points[:, 0]
    inside = (np.minimum(points[:, 0], far) > 1.5 * half) & (np.abs(points[:, 1] - 0.5 * WIDTH) < 0.5 * WIDTH - half)
    points[inside, :2] += np.random.default_rng(1).uniform(-shaken, shaken, (np.count_nonzero(inside), 2))
    body, clamp = _pull(points, cells, ratio, points[:, 0] < 1.5 * half)
    body.boundary.move(np.flatnonzero(far < 1.5 * half), ["x", "y", "rz"])
    middle, width = points[cells].mean(axis=1), points[:, 1].max()
    free = LENGTH - width
    # zones: a square is held by the yarns through it that a clamp holds
    along, across = np.abs(middle[:, 0] - 0.5 * LENGTH), np.abs(middle[:, 1] - 0.5 * width)
    loose = np.array([along + s * across for s in (1.0, -1.0)]) < 0.5 * free
    area = 2.0 * half**2
    full, part = area * np.count_nonzero(loose.all(axis=0)), area * np.count_nonzero(loose[0] != loose[1])
    return _at(body, points, clamp, elongation(angle, free)), net_force(angle, free, full, part)


def _pull(points: np.ndarray, cells: np.ndarray, ratio: float, clamped: np.ndarray) -> tuple[Body, int]:
    """A flat body whose ``clamped`` nodes move away, and the group of their reaction along the pull."""
    card = linear_laminate((ratio * SHEAR, ratio * SHEAR), (0.02, 0.02), SHEAR, 1.0)
    body = Body.of_shells(points, cells, card, 1e-3, 1.0, warp=BIAS, damping=DAMPING, threads=1)
    body.boundary.move(np.arange(len(points)), ["z", "rx", "ry"])
    clamp = body.boundary.move(np.flatnonzero(clamped), "x", Table((0.0, RAMP), (0.0, -SPEED)))
    body.boundary.move(np.flatnonzero(clamped), ["y", "rz"])
    return body, clamp


def _at(body: Body, points: np.ndarray, clamp: int, way: float) -> Pulled:
    """The body when its clamp has gone a ``way`` [mm]; the angle is that of the squares about its middle."""
    body.advance(way / SPEED + 0.5 * RAMP)
    energies, start = body.energies(), points[body.model.mesh.cells].mean(axis=1)
    middle = np.hypot(*(start - [0.5 * LENGTH, 0.5 * WIDTH, 0.0])[:, :2].T) < 0.15 * WIDTH
    angle = np.rad2deg(np.abs(body.model.fields()["shear_angle"][middle]).mean())
    return Pulled(float(angle), abs(body.reaction(clamp)), energies["hourglass"] / energies["internal"])
