"""Sheets against themselves and each other: pressure, friction, impact; posed through :mod:`knittest.pose`."""

from math import cos, pi, sin

import numpy as np
from cases.row import Row
from cases.series import order
from plain import plain
from shell_cases import grid

from knittest.kernels.sheet_contact import sheet_forces
from knittest.kernels.sheet_surface import find_facing_place, separation
from knittest.models.sheet_tracker import STIFFNESS
from knittest.pose import Body, SheetContact, Table, linear_laminate, ramp

AREA_MASS, THICKNESS, SIZE = 1e-3, 2.2, 2.5
LAW = linear_laminate((50.0, 50.0), (5.0, 5.0), 0.5, THICKNESS)
#: energies that come back
STORED = ("kinetic", "internal", "contact", "hourglass")


def stack(layers: list[tuple[tuple[int, int], tuple[float, float, float]]], friction: float = 0.0, **options) -> Body:
    """Sheets of (nx, ny) shells of side :data:`SIZE`, their first corners at the places given [mm], in one body."""
    points, cells, n = [], [], 0
    for (nx, ny), place in layers:
        p, c = grid(nx, ny, nx * SIZE, ny * SIZE)
        points.append(p + place)
        cells.append(c + n)
        n += len(p)
    return Body.of_shells(
        np.vstack(points), np.vstack(cells), LAW, AREA_MASS, THICKNESS, self_contact=SheetContact(friction), **options
    )


def tributary(nx: int, ny: int) -> np.ndarray:
    """Area of each node of a layer [mm^2]."""
    x, y = (np.r_[0.5, np.ones(n - 1), 0.5] for n in (nx, ny))
    return SIZE**2 * np.outer(x, y).ravel()


def pressed(pressure: float = 0.1) -> list[Row]:
    """A sheet pressed onto a larger held one, node on node: both carry p A, t - gap = p dt^2 / (2 k m').

    Two penalties k m / dt^2 act on every pair of nodes, that of the node and that of the corner it faces.
    """
    body = stack([((10, 8), (0.0, 0.0, 0.0)), ((4, 4), (5.0, 5.0, THICKNESS))], damping=2.0)
    below, above = np.arange(0, 99), np.arange(99, 124)
    group = body.boundary.move(below, ["z"])
    body.boundary.move(below, ["x", "y", "rx", "ry", "rz"])
    body.boundary.load(above, "z", -pressure * tributary(4, 4), ramp(2.0, 1.0))
    body.advance(8.0)
    sunk = THICKNESS - body.position[above, 2]
    depth = pressure * body.dt**2 / (2.0 * STIFFNESS * AREA_MASS)
    case, source = "sheet on sheet", "force balance"
    return [
        Row(case, source, "reaction p A [N]", pressure * 100.0, body.reaction(group), "4 x 4", None),
        Row(case, "two penalties in parallel", "least depth [mm]", depth, float(sunk.min()), "4 x 4", None),
        Row(case, "two penalties in parallel", "largest depth [mm]", depth, float(sunk.max()), "4 x 4", None),
    ]


def pulled(friction: float = 0.25, normal: float = 0.5) -> list[Row]:
    """A sheet pulled from between two others, nodes off nodes: mu N on each of them, 2 mu N and its drag to pull."""
    speed, damping = 0.2, 0.1
    body = stack(
        [((12, 6), (0.0, 0.0, 0.0)), ((8, 4), (1.0, 2.3, THICKNESS)), ((3, 2), (7.1, 3.7, 2.0 * THICKNESS))],
        friction, damping=damping,
    )  # fmt: skip
    below, middle, above = np.arange(0, 91), np.arange(91, 136), np.arange(136, 148)
    held = body.boundary.move(below, ["x"])
    body.boundary.move(below, ["y", "z", "rx", "ry", "rz"])
    stopped = body.boundary.move(above, ["x"])
    body.boundary.move(above, ["y", "rx", "ry", "rz"])
    body.boundary.load(above, "z", -normal * tributary(3, 2) / (6.0 * SIZE**2), ramp(2.0, 1.0))
    body.boundary.move(middle, ["y", "rz"])
    pull = body.boundary.move(middle, ["x"], Table((2.0, 4.0), (0.0, speed)))
    body.advance(10.0)
    read = []
    body.advance(SIZE / speed, lambda b: read.append([b.reaction(g) for g in (pull, held, stopped)]))
    mean, drag = np.mean(read, axis=0), damping * speed * float(body.model.mass[middle].sum())
    case, source, mesh = "sheet between sheets", "Coulomb, two faces", "8 x 4, off nodes"
    return [
        Row(case, source, "pulling force [N]", 2.0 * friction * normal + drag, float(mean[0]), mesh, None),
        Row(case, source, "force on the lower sheet mu N [N]", friction * normal, -float(mean[1]), mesh, None),
        Row(case, source, "force on the upper sheet mu N [N]", friction * normal, -float(mean[2]), mesh, None),
    ]


def momenta(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Momentum [g mm/ms] and angular momentum about the origin [g mm^2/ms], spins of the nodes included."""
    model, v, w = body.model, body.velocity, body.spin
    turning = np.cross(body.position, v) * model.mass[:, None] + w * model.inertia[:, None]
    return (model.mass[:, None] * v).sum(axis=0), turning.sum(axis=0)


def impact(friction: float = 0.4) -> list[Row]:
    """A free sheet strikes a larger free one aslant and off its middle: momenta are kept, the energy is booked."""
    body = stack([((8, 6), (0.0, 0.0, 0.0)), ((4, 3), (7.3, 5.1, THICKNESS + 0.2))], friction)
    small = np.arange(63, 83)
    body.velocity[small] = [2.0, 1.0, -3.0]
    before, start = momenta(body), 0.5 * float((body.model.mass[:, None] * body.velocity**2).sum())
    body.advance(3.0)
    after, energy = momenta(body), body.energies()
    kept = sum(energy[k] for k in (*STORED, "friction", "contact_damping"))
    case, source, mesh = "oblique impact of sheets", "conservation", "4 x 3 on 8 x 6"
    rows = [
        Row(
            case,
            source,
            f"change of {name} over its size",
            0.0,
            float(np.abs(b - a).max() / np.abs(a).max()),
            mesh,
            None,
        )
        for name, a, b in zip(("momentum", "angular momentum"), before, after, strict=True)
    ]
    rows.append(Row(case, source, "energy kept or booked [mJ]", start, kept, mesh, None))
    return [
        *rows,
        Row(
            case,
            "",
            "lost to friction and damping [mJ]",
            0.0,
            energy["friction"] + energy["contact_damping"],
            mesh,
            None,
        ),
    ]


def rattling() -> Row:
    """Three free sheets that close on each other, waves on them, and part: what they had is kept or booked.

    Damping takes a third of it; the error is that of the first and last step of each impact, order 2.
    """
    errors, count = [], 99
    for safety in (0.9, 0.45, 0.225):
        layers = [((10, 8), (0.0, 0.0, k * (THICKNESS + 0.05))) for k in range(3)]
        body = stack(layers, safety=safety)
        body.velocity[:, 2] = 0.5 * np.random.default_rng(0).standard_normal(3 * count)
        body.velocity[:count, 2] += 1.0
        body.velocity[2 * count :, 2] -= 1.0
        start = body.energies()["kinetic"]
        body.advance(3.0)
        energy = body.energies()
        errors.append(-energy["balance"] / start - 1.0)
    series = tuple(abs(e) for e in errors)
    case, quantity = "sheets that rattle", "energy error at a step of 0.225 [-]"
    return Row(case, "conservation", quantity, 0.0, errors[-1], "dt, dt/2, dt/4", order(errors), series)


def turned(axis: tuple[float, float, float], steps: int = 400) -> Row:
    """Two sheets that stick and press, turned as one by a right angle: their forces turn with them, unchanged."""
    body = stack([((4, 4), (0.0, 0.0, 0.0)), ((2, 2), (3.1, 2.2, THICKNESS - 0.01))], friction=0.8)
    body.start()
    model, tracker = body.model, body.model.tracker
    n = model.n_nodes
    tracker.contacts.reach[: tracker.count] = THICKNESS  # laid into each other by 0.01 mm, on purpose
    start, unit = body.position - body.position.mean(axis=0), np.array(axis) / np.linalg.norm(axis)

    def forces(position, velocity, spin):
        model.nodes.position[:, :n], model.nodes.velocity[:, :n] = position.T, velocity.T
        model.nodes.spin[:, :n] = np.asarray(spin)[:, None]
        mesh, contacts, count, law = tracker.arguments
        sheet_forces(0, count, body.dt, model.nodes, model.shells, mesh, law, contacts)
        if not (contacts.owners[:count] != 0).any():
            raise RuntimeError("nothing touches")
        return contacts.force[:, :count].copy()

    shove = np.zeros_like(start)
    shove[25:, :2] = np.array([0.004, 0.003]) / body.dt  # within the Coulomb limit: nothing slips
    forces(start, shove, np.zeros(3))
    first, last, at = forces(start, np.zeros_like(start), np.zeros(3)), np.zeros(0), start
    for k in range(1, steps + 1):
        matrix = rotation(unit, 0.5 * pi * k / steps)
        now = start @ matrix.T
        last = forces(now, (now - at) / body.dt, 0.5 * pi / steps / body.dt * unit)
        at = now
    error = float(np.abs(matrix.T @ last - first).max() / np.abs(first).max())
    return Row(
        "touching sheets turn as one",
        "objectivity",
        f"change of force about {axis}",
        0.0,
        error,
        f"{steps} steps",
        None,
    )


def rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation matrix about a unit axis (Rodrigues)."""
    k = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.eye(3) + sin(angle) * k + (1.0 - cos(angle)) * k @ k


def round_surface(radius: float = 6.0, height: float = 2.2) -> list[Row]:
    """Points above and below a cylinder of flat shells: distances are off by their sag, and never jump.

    The jump is that of distance and direction where a point's place goes from one shell to the next.
    """
    errors, sags, jumps = [], [], []
    for n in (16, 32, 64):
        half, worst, jump = pi / n, 0.0, 0.0
        rim = [(sin(s * half), 0.0, cos(s * half)) for s in (-1.0, 1.0, 3.0)]
        for side in (1.0, -1.0):
            at = radius + side * height
            edge = at * np.array(rim[1]) + (0.0, 0.5, 0.0)
            before, after = (_facing(rim[k : k + 2], radius, tuple(edge), side) for k in (0, 1))
            jump = max(jump, abs(before[0] - after[0]), float(np.abs(np.subtract(before[1], after[1])).max()))
            for angle in np.linspace(-half, half, 21):
                point = (at * sin(angle), 0.5, at * cos(angle))
                worst = max(worst, abs(_facing(rim[:2], radius, point, side)[0] - height))
        errors.append(worst)
        sags.append(radius * (1.0 - cos(half)))
        jumps.append(jump)
    case, source, mesh = "round surface of flat shells", "cylinder", "16, 32, 64 shells round"
    return [
        Row(case, source, "largest error of the distance, the sag [mm]", sags[-1], errors[-1], mesh, order(errors)),
        Row(case, "continuity", "jump from shell to shell [mm, -]", 0.0, max(jumps), mesh, None),
    ]


def _facing(rim, radius: float, point, side: float) -> tuple[float, tuple[float, float, float]]:
    """Distance and direction of a point from the shell between two points of a unit rim, 1 mm wide."""
    a, b = (tuple(radius * np.array(r)) for r in rim)
    p, m = (a, b, (b[0], 1.0, b[2]), (a[0], 1.0, a[2])), (rim[0], rim[1], rim[1], rim[0])
    u, v = find_facing_place(p, m, point, 0.5, 0.5, (-1.0, 2.0, -1.0, 2.0), 8, 0.3)
    distance, direction, _ = plain(separation)(p, m, point, u, v, side, False)
    return distance, direction


def rows() -> list[Row]:
    """Everything, for the report."""
    return [*pressed(), *pulled(), *impact(), rattling(), turned((0, 0, 1)), turned((1, 2, 3)), *round_surface()]
