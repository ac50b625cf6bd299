"""Static states of shells against closed forms, posed through :mod:`knittest.pose`.

The element has one point: exact where strain, curvature and twist are constant, else second order in its length.
"""

import numpy as np
from cases.beam_static import tip_of_elastica
from cases.row import Row
from cases.series import order, settle
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation
from shell_cases import PATCH, PATCH_CONN, X, Y, grid, wavy

from knittest.pose import ALL, Body, Table, linear_laminate

#: membrane stiffness [N/mm] and bending stiffness [N mm] of warp and weft, shear [N/mm], thickness [mm]
LAW = {"membrane": (90.0, 60.0), "bending": (4.84, 3.63), "shear": 0.5, "thickness": 1.0}
A, D = LAW["membrane"], LAW["bending"]
AREA_MASS = 1e-3
RIM, INNER = np.arange(4), np.arange(4, 8)
MACNEAL = "MacNeal & Harder 1985"


def sheet(points: np.ndarray, cells: np.ndarray, warp: ArrayLike = X, safety: float = 0.9, **changes) -> Body:
    """Shells of the laminate :data:`LAW` or changes of it."""
    law = LAW | changes
    laminate = linear_laminate(**law)
    return Body.of_shells(points, cells, laminate, AREA_MASS, law["thickness"], warp=warp, safety=safety)


def hold_each(body: Body, nodes: np.ndarray, dofs: tuple[str, ...] = ALL) -> np.ndarray:
    """Hold ``dofs`` of ``nodes``, each in a group of its own; the groups (n_nodes, n_dofs).

    The residual of the relaxation is measured against the reactions of groups, and those of a whole rim cancel.
    """
    return np.array([[body.boundary.move(i, [dof]) for dof in dofs] for i in nodes])


def strip(n: int, length: float, width: float, warp: np.ndarray = X, **changes) -> Body:
    """A row of ``n`` shells along x that moves in the plane x-z only, clamped at nodes 0 and 1."""
    body = sheet(*grid(n, 1, length, width), warp, **changes)
    body.boundary.move([0, 1], ALL)
    body.boundary.move(np.arange(2, 2 * n + 2), ["y", "rx", "rz"])
    return body


def worst(found: np.ndarray, exact: np.ndarray) -> tuple[float, float]:
    """The largest entry of ``exact``, and what it would be with the error of the worst entry of ``found``."""
    size = float(np.abs(exact).max())
    return size, size + float((found - exact).ravel()[np.argmax(np.abs(found - exact))])


def rigid_rotation() -> list[Row]:
    """A distorted, warped sheet turned by 140 degrees about a skew axis: no node feels a force.

    Frame indifference: the energy depends on scalar products of convected vectors alone. To round-off.
    """
    points, cells = wavy()
    turn = np.array([1.2, -0.7, 2.0])
    body = sheet(points, cells)
    body.place(Rotation.from_rotvec(turn).apply(points), turn)
    groups = hold_each(body, np.arange(len(points)))
    body.step(1)
    force = max(abs(body.reaction(g)) for g in groups.ravel()) / (A[0] * 5.0)
    return [Row("rigid rotation", "frame indifference", "largest force over A h [-]", 0.0, force, "4 x 3 warped", None)]


def membrane_patch() -> list[Row]:
    """Rim of an irregular mesh on x -> F x: inner nodes follow, U = area (A_a e_a^2 + A_b e_b^2 + S gamma^2) / 2.

    MacNeal & Harder (1985), Finite Elements in Analysis and Design 1, 3-20. To the tolerance of the relaxation.
    """
    gradient = np.array([[1.01, 0.006, 0.0], [0.02, 0.995, 0.0], [0.0, 0.0, 1.0]])
    exact = PATCH @ gradient.T
    body = sheet(PATCH, PATCH_CONN)
    body.place(np.where(np.arange(8)[:, None] < 4, exact, PATCH))
    hold_each(body, RIM, ("x", "y", "z", "rx", "ry"))  # turns with the gradient, which drilling sees
    settle(body)
    a, b = gradient[:, 0], gradient[:, 1]
    long_a, long_b = np.linalg.norm(a), np.linalg.norm(b)
    gamma = np.arcsin(a @ b / (long_a * long_b))
    density = A[0] * (long_a - 1.0) ** 2 + A[1] * (long_b - 1.0) ** 2 + LAW["shear"] * gamma**2
    energy, mesh = 0.5 * 24.0 * 12.0 * density, "5 irregular"
    moved = worst((body.position - PATCH)[INNER], (exact - PATCH)[INNER])
    return [
        Row("membrane patch", MACNEAL, "displacement, worst inner node [mm]", *moved, mesh, None),
        Row("membrane patch", MACNEAL, "energy [mJ]", energy, body.energies()["internal"], mesh, None),
    ]


def bending_patch(curvature: float = 1e-5) -> list[Row]:
    """Rim on w = (kx x^2 + ky y^2) / 2 + kxy x y with its normals: inner nodes follow.

    U = area (D_a kx^2 + D_b ky^2 + T (2 kxy)^2) / 2, T = S t^2 / 6; MacNeal & Harder (1985). The plate theory of the
    reference neglects the stretch by the slopes, of relative energy A w'^4 / (4 D k^2) <= A (k R^2)^2 / (4 D) at
    the radius R = 27 mm of the patch: 2e-4 at k = 1e-5 / mm.
    """
    kx, ky, kxy = curvature, -0.5 * curvature, 0.8 * curvature
    x, y = PATCH[:, 0], PATCH[:, 1]
    rise = 0.5 * (kx * x**2 + ky * y**2) + kxy * x * y
    slope_x, slope_y = kx * x + kxy * y, ky * y + kxy * x
    on_rim = (np.arange(8) < 4)[:, None]
    body = sheet(PATCH, PATCH_CONN)
    body.place(
        PATCH + on_rim * np.outer(rise, [0.0, 0.0, 1.0]), on_rim * np.column_stack([slope_y, -slope_x, np.zeros(8)])
    )
    hold_each(body, RIM)
    settle(body)
    twist = LAW["shear"] * LAW["thickness"] ** 2 / 6.0
    energy = 0.5 * 24.0 * 12.0 * (D[0] * kx**2 + D[1] * ky**2 + twist * (2.0 * kxy) ** 2)
    moved = worst(body.position[INNER, 2], rise[INNER])
    case, mesh = f"bending patch, {curvature:g} / mm", "5 irregular"
    return [
        Row(case, MACNEAL, "deflection, worst inner node [mm]", *moved, mesh, None),
        Row(case, MACNEAL, "energy [mJ]", energy, body.energies()["internal"], mesh, None),
    ]


def cantilever(direction: str, alpha: float = 5.0) -> list[Row]:
    """Strip bent by an end force P L^2 / (D b) = 5: tip at w / L = 0.71379, u / L = 0.38763.

    Elastica: Bisshopp & Drucker (1945), Quart. Appl. Math. 3, 272; table of Mattiasson (1981), IJNME 17, 145. One-point
    elements are off by 1 / (4 n^2) of bending: order 2. Transverse shear adds 3 t^2 / (5 L^2), here 2e-5.
    """
    length, width, stiffness = 100.0, 10.0, D[direction == "weft"]
    exact, tips = tip_of_elastica(alpha), []
    for n in (5, 10, 20):
        body = strip(n, length, width, X if direction == "warp" else Y, membrane=(100.0, 100.0), thickness=0.5)
        body.boundary.load([2 * n, 2 * n + 1], "z", 0.5 * alpha * stiffness * width / length**2)
        settle(body)
        tips.append([body.position[-1, 2] / length, 1.0 - body.position[-1, 0] / length])
    errors = np.array(tips) - exact
    source = "Bisshopp & Drucker 1945"
    return [
        Row(f"cantilever, {direction}", source, f"tip {name} [-]", exact[k], tips[-1][k], "20", order(errors[:, k]))
        for k, name in enumerate(("w / L", "u / L"))
    ]


def twisted_strip(angle: float) -> list[Row]:
    """Torque of a strip twisted by ``angle`` [rad] between ends that keep their distance; theta = angle / L:

    M = 4 T b theta (1 - tanh(q) / q) + A b^5 theta^3 / 160, q = b sqrt(K / T) / 2, twisting stiffness T, transverse
    shear K. First term: pure twist of a plate with transverse shear (Reissner, 1945, J. Appl. Mech. 12, A69), here for
    T and K; second: the outer fibres become helices, e = (theta y)^2 / 2 (Buckley, 1914, Phil. Mag. 28, 778); both
    for small slopes theta b / 2, whose square they neglect against 1.
    """
    length, width, stretch = 8.0, 4.0, 2000.0
    torques = []
    for n in (6, 12, 24):
        points, cells = grid(n, n, length, width)
        points = points - [0.0, 0.5 * width, 0.0]
        body = sheet(points, cells, membrane=(stretch, stretch), shear=40.0)
        turn = np.outer(points[:, 0] / length, [angle, 0.0, 0.0])
        body.place(Rotation.from_rotvec(turn).apply(points), turn)
        hold_each(body, np.arange(n + 1), ("x", "y", "z", "rx", "rz"))
        last = np.arange(n * (n + 1), (n + 1) ** 2)
        groups = hold_each(body, last, ("x", "y", "z", "rx", "rz"))
        settle(body, 1e-5)
        force = np.array([[body.reaction(g) for g in row] for row in groups])
        at = body.position[last]
        torques.append(float((at[:, 1] * force[:, 2] - at[:, 2] * force[:, 1] + force[:, 3]).sum()))
    law = body.model.laminate
    q, theta = 0.5 * width * np.sqrt(law.transverse[0] / law.twist), angle / length
    exact = 4.0 * law.twist * width * theta * (1.0 - np.tanh(q) / q) + stretch * width**5 * theta**3 / 160.0
    errors = [t / exact - 1.0 for t in torques]
    case, source = f"twisted strip, {angle:g} rad", "Reissner 1945; Buckley 1914"
    observed = order(errors) if angle < 0.1 else None  # beyond that the reference is not better than the mesh
    return [Row(case, source, "torque [N mm]", exact, torques[-1], "24 x 24", observed)]


def pinched_ring() -> list[Row]:
    """Open cylinder pinched along two opposite lines; its diameter shrinks by

    P R^3 / (D b) (pi / 4 - 2 / pi) + pi P R / (4 b) (1 / A + 1 / K): Timoshenko, Strength of Materials II (1956), art.
    15. (The pinched cylinder with diaphragms needs Poisson's ratio 0.3, which this laminate of fibres does not have.)
    """
    radius, width, load = 50.0, 10.0, 5e-5
    shrinks = []
    for n in (4, 8, 16):
        points, cells = grid(n, 1, 0.5 * np.pi, width)
        angle = points[:, 0]
        points = np.column_stack([radius * np.sin(angle), points[:, 1], radius * np.cos(angle)])
        along = np.cross([0.0, 1.0, 0.0], points[cells].mean(axis=1))
        body = sheet(points, cells, along)
        body.boundary.move([0, 1], ["x", "ry"])
        body.boundary.move([2 * n, 2 * n + 1], ["z", "ry"])
        body.boundary.move(np.arange(2 * n + 2), ["y", "rx", "rz"])
        body.boundary.load([0, 1], "z", -0.25 * load)
        settle(body, 1e-5)
        shrinks.append(2.0 * float(radius - body.position[0, 2]))
    shear = body.model.laminate.transverse[0]
    bend = load * radius**3 / (D[0] * width) * (0.25 * np.pi - 2.0 / np.pi)
    exact = bend + 0.25 * np.pi * load * radius / width * (1.0 / A[0] + 1.0 / shear)
    errors = [s / exact - 1.0 for s in shrinks]
    return [
        Row(
            "pinched ring",
            "Timoshenko 1956",
            "change of diameter [mm]",
            exact,
            shrinks[-1],
            "16 a quadrant",
            order(errors),
        )
    ]


def layers() -> list[Row]:
    """Membrane A and bending D are apart: D x 4 leaves the tension A e b as it is, A x 4 the sag under an end force.

    Sag P L^3 / (3 D b) (1 - 1 / (4 n^2)) + P L / (K b), where K = 5 D / t^2 follows the bending stiffness. Both to the
    tolerance of the relaxation.
    """
    length, width, n, strain, load = 40.0, 10.0, 8, 0.01, 1e-4
    stiff = (4.0 * A[0], 4.0 * A[1])

    def tension(bending: tuple[float, float]) -> float:
        points, cells = grid(n, 1, length, width)
        body = sheet(points, cells, membrane=stiff, bending=bending)
        body.place(points * [1.0 + strain, 1.0, 1.0])
        body.boundary.move([0, 1], ["x", "y", "z"])
        end = body.boundary.move([2 * n, 2 * n + 1], ["x"])
        settle(body)
        return body.reaction(end)

    def sag(membrane: tuple[float, float]) -> float:
        body = strip(n, length, width, membrane=membrane)
        body.boundary.load([2 * n, 2 * n + 1], "z", 0.5 * load)
        return float(settle(body).position[-1, 2])

    pull = stiff[0] * strain * width
    shear = load * length / (5.0 * D[0] / LAW["thickness"] ** 2 * width)
    exact = load * length**3 / (3.0 * D[0] * width) * (1.0 - 0.25 / n**2) + shear
    case, source = "layers", "laminate: A = sum E t, D = sum E t z^2"
    return [
        Row(case, source, "tension, D [N]", pull, tension(D), "8", None),
        Row(case, source, "tension, 4 D [N]", pull, tension((4.0 * D[0], 4.0 * D[1])), "8", None),
        Row(case, source, "sag, A [mm]", exact, sag(A), "8", None),
        Row(case, source, "sag, 4 A [mm]", exact, sag(stiff), "8", None),
    ]


def picture_frame(gamma: float, side: float = 200.0, n: int = 4) -> list[Row]:
    """Trellis of side L sheared to ``gamma``: F = S L / sin(pi / 4 - gamma / 2) with the linear law S = G gamma.

    Virtual work, F dd = S L^2 dgamma, with d = 2 L cos(pi / 4 - gamma / 2) - sqrt(2) L (Eq. 1 of Pham et al., 2019,
    solved for d). One side is held, the others follow tables of the rate of the turning side, times y; reactions are
    conjugate to the tables. Fibres keep their length, so the mesh plays no part; tables and steps make errors of the
    order (dt dgamma / dt)^2. F = R U turns by gamma / 2, and all nodes with it: drilling feels nothing.
    """
    duration = 60.0
    time = np.linspace(0.0, duration, 1001)
    u = time / duration
    angle, rate = gamma * u**3 * (10.0 - u * (15.0 - 6.0 * u)), gamma * 30.0 * u**2 * (1.0 - u) ** 2 / duration
    across, along = (Table(tuple(time), tuple(rate * f(angle))) for f in (np.cos, lambda a: -np.sin(a)))
    points, cells = grid(n, n, side, side)
    body = sheet(points, cells)
    rim = np.flatnonzero(np.isin(points[:, 0], (0.0, side)) | np.isin(points[:, 1], (0.0, side)))
    pulls = [
        body.boundary.move(rim, [dof], table, scale=points[rim, 1]) for dof, table in (("x", across), ("y", along))
    ]
    body.boundary.move(rim, ["z"])
    body.boundary.move(np.arange(len(points)), ["rz"], Table(tuple(time), tuple(-0.5 * rate)))
    body.advance(1.05 * duration)
    settle(body, 1e-8)  # reactions are conjugate to the table, here 200 mm times a force
    power = body.conjugate(pulls[0]) * np.cos(gamma) - body.conjugate(pulls[1]) * np.sin(gamma)
    lever = side * np.sin(0.25 * np.pi - 0.5 * gamma)
    far = np.linalg.norm(body.position[-1] - body.position[0]) - np.sqrt(2.0) * side
    case, source, mesh = f"picture frame, {gamma:g} rad", "virtual work; Pham et al. 2019, Eq. 1", f"{n} x {n}"
    return [
        Row(case, source, "frame force [N]", LAW["shear"] * gamma * side**2 / lever, power / lever, mesh, None),
        Row(
            case,
            source,
            "displacement d [mm]",
            2.0 * side * np.cos(0.25 * np.pi - 0.5 * gamma) - np.sqrt(2.0) * side,
            far,
            mesh,
            None,
        ),
    ]


def rows() -> list[Row]:
    """All cases of this module."""
    cases = [rigid_rotation(), membrane_patch(), bending_patch(), cantilever("warp"), cantilever("weft")]
    cases += [twisted_strip(0.05), twisted_strip(0.2), pinched_ring(), layers()]
    cases += [picture_frame(gamma) for gamma in (0.2, 0.5, 0.8)]
    return [row for case in cases for row in case]
