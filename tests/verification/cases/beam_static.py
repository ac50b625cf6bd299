"""Static states of beams against closed forms, posed through :mod:`knittest.pose`.

The element has one integration point: second order in its length, exact where strain and curvature are constant.
"""

import numpy as np
from cases.row import Row
from cases.series import BEAM, beam, converging, line, order, settle
from scipy.integrate import quad, solve_bvp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import ellipe, ellipk

from knittest.pose import ALL, Body

EI = BEAM["bending"]


def cantilever(n: int, **changes: float) -> Body:
    """``n`` elements along x, clamped at node 0."""
    body = beam(line(n), **changes)
    body.boundary.move([0], ALL)
    return body


def rigid_rotation() -> list[Row]:
    """A curved yarn turned by 140 degrees about a skew axis: no node feels a force (frame indifference).

    Crisfield & Jelenic (1999), Proc. R. Soc. A 455, 1125. To rounding: 1e-16 a step of arithmetic, some tens of them.
    """
    arc = np.linspace(0.0, 1.5, 13)
    points = np.column_stack([np.sin(arc), np.cos(arc), 0.2 * arc])
    turn = np.array([1.2, -0.7, 2.0])
    body = beam(points)
    body.place(Rotation.from_rotvec(turn).apply(points), turn)
    groups = [body.boundary.move([i], [dof]) for i in range(13) for dof in ALL]
    body.step(1)
    worst = max(abs(body.reaction(g)) for g in groups) / BEAM["axial"]
    return [Row("rigid rotation", "Crisfield & Jelenic 1999", "largest force over EA [-]", 0.0, worst, "12", None)]


def patch() -> list[Row]:
    """Uneven elements under an end pull, and under a small end moment: u = N x / EA and w = M x^2 / (2 EI) at nodes.

    Gere & Timoshenko, Mechanics of Materials. Both exact up to the large rotations, (M / EI)^2 / 6 = 2e-7, and to what
    is left of the relaxation, 1e-6.
    """
    x = np.array([0.0, 0.07, 0.25, 0.32, 0.6, 0.71, 1.0])
    points = np.column_stack([x, np.zeros((7, 2))])
    rows = []
    for name, dof, value, axis, exact in (
        ("constant axial strain", "x", 1.0, 0, 1e-3 * x),
        ("constant curvature", "ry", -1e-3, 2, 0.5e-3 * x**2 / EI),
    ):
        body = beam(points, axial=1e3)
        body.boundary.move([0], ALL)
        body.boundary.load([6], dof, value)
        moved = (settle(body).position - points)[1:, axis]
        k = int(np.argmax(np.abs(moved / exact[1:] - 1.0)))
        quantity = "displacement of the worst node [mm]"
        source = "Gere & Timoshenko 1997"
        rows.append(Row(f"patch, {name}", source, quantity, exact[k + 1], moved[k], "6 uneven", None))
    return rows


def tip_of_elastica(alpha: float) -> tuple[float, float]:
    """Deflection w / L and approach u / L of the tip of a cantilever under P L^2 / EI = ``alpha``.

    With the end slope phi, sqrt(alpha) = int_0^phi dt / sqrt(2 (sin phi - sin t)), Bisshopp & Drucker (1945); the
    substitution sin t = sin phi (1 - s^2) takes the singularity away.
    """

    def integral(phi: float, power: int) -> float:
        top = np.sin(phi)

        def integrand(s: float) -> float:
            sine = top * (1.0 - s * s)
            return sine**power * np.sqrt(2.0 * top) / np.sqrt(1.0 - sine * sine)

        return float(quad(integrand, 0.0, 1.0, epsabs=1e-13, epsrel=1e-12)[0])

    phi = brentq(lambda p: integral(p, 0) - np.sqrt(alpha), 1e-3, 1.57, xtol=1e-13)
    return integral(phi, 1) / np.sqrt(alpha), 1.0 - np.sqrt(2.0 * np.sin(phi) / alpha)


def elastica() -> list[Row]:
    """Cantilever under an end force that keeps its direction, P L^2 / EI = 1 and 10."""
    rows = []
    for alpha in (1.0, 10.0):
        exact = np.array(tip_of_elastica(alpha))
        tips = []
        for n in (4, 8, 16):
            body = cantilever(n, axial=2e5)
            body.boundary.load([n], "z", alpha * EI)
            x, _, z = settle(body).position[n]
            tips.append([z, 1.0 - x])
        for k, name in enumerate(("w / L", "u / L")):
            case, source = f"elastica, P L^2 / EI = {alpha:g}", "Bisshopp & Drucker 1945"
            rows.append(converging(case, source, f"tip {name} [-]", exact[k], [t[k] for t in tips], "4, 8, 16"))
    return rows


def roll_up() -> list[Row]:
    """End moment 2 pi EI / L: the beam closes to a circle and its tip returns to the clamp.

    Simo & Vu-Quoc (1986), CMAME 58, 79. An element turns by t (1 - t^2 / 12), t = M h / EI, so the gap is
    2 pi (2 pi / n)^2 / 12 of the circle's radius: order 2, 0.0021 at 40 elements.
    """
    gaps = []
    for n in (10, 20, 40):
        body = cantilever(n)
        body.boundary.load([n], "ry", -2.0 * np.pi * EI)
        gaps.append(float(np.linalg.norm(settle(body).position[n])))
    return [converging("roll-up", "Simo & Vu-Quoc 1986", "gap over length [-]", 0.0, gaps, "10, 20, 40")]


#: 45 degree bend: a unit square with E = 1e7, nu = 0, whose torsion constant is 0.1406
BEND = {"radius": 100.0, "bending": 1e7 / 12.0, "torsion": 0.1406 * 5e6, "axial": 1e7, "shear": 5e6}


def tip_of_bend(load: float) -> np.ndarray:
    """Tip of the 45 degree bend under ``load`` along z: Reissner's rod by collocation.

    r' = R (e + C^-1 R^T n), q' = q k / 2, m' = n x r', n constant, with curvature k = C^-1 R^T m + k0.
    """
    force = np.array([0.0, 0.0, load])
    stiff = np.array([BEND["torsion"], BEND["bending"], BEND["bending"]])
    soft = np.array([1.0 / BEND["axial"], 1.0 / BEND["shear"], 1.0 / BEND["shear"]])
    natural = np.array([0.0, 0.0, -1.0 / BEND["radius"]])
    base = Rotation.from_euler("z", 90.0, degrees=True)  # tangent along y, bending towards x

    def slope(_: np.ndarray, y: np.ndarray) -> np.ndarray:
        frame = Rotation.from_quat(y[[4, 5, 6, 3]].T)
        tangent = frame.apply([1.0, 0.0, 0.0] + soft * frame.inv().apply(force))
        w, (a, b, c) = y[3], y[4:7]
        k, l, m = 0.5 * (frame.inv().apply(y[7:].T) / stiff + natural).T  # noqa: E741
        turn = [-a * k - b * l - c * m, w * k + b * m - c * l, w * l + c * k - a * m, w * m + a * l - b * k]
        return np.vstack([tangent.T, turn, np.cross(force, tangent).T])

    def ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        x, y, z, w = base.as_quat()
        return np.concatenate([a[:3], a[3:7] - [w, x, y, z], b[7:]])

    s = np.linspace(0.0, 0.25 * np.pi * BEND["radius"], 41)
    guess = np.zeros((10, 41))
    for share in np.linspace(0.1, 1.0, 10):
        force[2] = share * load
        if share < 0.15:
            x, y, z, w = (base * Rotation.from_rotvec(np.outer(s, natural))).as_quat().T
            guess[3:7] = w, x, y, z
        found = solve_bvp(slope, ends, s, guess, tol=1e-7, max_nodes=20000)
        if not found.success:
            raise RuntimeError(found.message)
        guess = found.sol(s)
    return found.sol(s[-1])[:3]


def bend_45(load: float, published: tuple[float, ...] = ()) -> list[Row]:
    """A bend of 45 degrees loaded out of its plane: bending, torsion and large rotations in space.

    ``published``: Bathe & Bolourchi (1979), IJNME 14, 961, three digits from 8 straight elements, which at second
    order leave 1.5 %. The order is found against Reissner's rod integrated here.
    """
    exact = tip_of_bend(load)
    tips = []
    for n in (8, 16, 32):
        angle = np.linspace(0.0, 0.25 * np.pi, n + 1)
        points = BEND["radius"] * np.column_stack([1.0 - np.cos(angle), np.sin(angle), np.zeros(n + 1)])
        body = beam(points, **BEND | {"radius": 0.5})
        body.boundary.move([0], ALL)
        body.boundary.load([n], "z", load)
        tips.append(settle(body).position[n])
    errors = [float(np.linalg.norm(t - exact)) for t in tips]
    case = f"45 degree bend, P = {load:g}"
    rows = [
        Row(case, "Bathe & Bolourchi 1979", f"tip {axis} [mm]", published[k], tips[0][k], "8", None)
        for k, axis in enumerate("xyz"[: len(published)])
    ]
    rod, series = "Reissner's rod, collocation", tuple(e / float(np.linalg.norm(exact)) for e in errors)
    return rows + [
        Row(case, rod, f"tip {axis} [mm]", exact[k], tips[-1][k], "8, 16, 32", order(errors), series)
        for k, axis in enumerate("xyz")
    ]


def buckling() -> list[Row]:
    """Pinned column under P = Pcr / 2 and a sine of side load: the sag doubles, w = w0 / (1 - P / Pcr).

    Pcr = pi^2 EI / L^2 (Euler 1744), read from the sags with and without P as Southwell (1932) does. Shear and
    shortening take (1 + EA / GA) pi^2 EI / (EA L^2) = 1e-4 of it, the large rotations (pi w / L)^2 / 8 = 1e-4.
    """
    critical = np.pi**2 * EI
    found = []
    for n in (4, 8, 16):
        sag = []
        for push in (0.0, 0.5 * critical):
            body = beam(line(n), axial=4e5)
            body.boundary.move([0], ["x", "y", "z"])
            body.boundary.move([n], ["y", "z"])
            body.boundary.load([n], "x", -push)
            body.boundary.load(np.arange(1, n), "z", 0.5 / n * np.sin(np.pi * np.arange(1, n) / n))
            sag.append(settle(body, 1e-5).position[:, 2].max())
        found.append(0.5 * critical / (1.0 - sag[0] / sag[1]))
    return [
        converging("Euler buckling", "Euler 1744; Southwell 1932", "critical load [N]", critical, found, "4, 8, 16")
    ]


def post_buckling() -> list[Row]:
    """Clamped column, end slope 60 degrees: P = (K / L)^2 EI, tip at x / L = 2 E / K - 1, y / L = 2 p / K.

    p = sin 30 degrees; 1.152 times the critical load, 0.741 and 0.593 in Timoshenko & Gere (1961), section 2.7.
    """
    m = np.sin(np.deg2rad(30.0)) ** 2
    k, e = ellipk(m), ellipe(m)
    exact = np.array([2.0 * e / k - 1.0, 2.0 * np.sqrt(m) / k])
    tips = []
    for n in (4, 8, 16):
        body = cantilever(n)
        body.boundary.load([n], "x", -(k**2) * EI)
        bent = np.pi / 3.0 * np.linspace(0.0, 1.0, n + 1)  # an arc to start from: the straight column balances too
        zero = np.zeros(n + 1)
        body.place(
            np.column_stack([np.sin(bent), zero, 1.0 - np.cos(bent)]) / bent[-1], np.column_stack([zero, -bent, zero])
        )
        tips.append(settle(body, 1e-5).position[n, [0, 2]])
    case, source = "buckled column", "Timoshenko & Gere 1961"
    return [
        converging(case, source, f"tip {name} [-]", exact[k], [t[k] for t in tips], "4, 8, 16")
        for k, name in enumerate(("x / L", "y / L"))
    ]


def wavy_yarn() -> list[Row]:
    """A wave of crimp c pulled straight: strain T / EA + c [1 - (1 + T / T*)^-2], T* = EI (2 pi / lambda)^2.

    Initially curved tie rod, Timoshenko & Gere (1961), section 1.12: the amplitude falls to a / (1 + T / T*). Shallow:
    terms of (pi a / lambda)^2 = 1e-4 are left out.
    """
    wavelength, amplitude, axial = 1.0, 0.0032, 1e6
    star = EI * (2.0 * np.pi / wavelength) ** 2
    rows = []
    for share in (0.3, 3.0):
        strains = []
        for n in (8, 16, 32):
            x = np.linspace(0.0, wavelength, n + 1)
            wave = np.column_stack([x, np.zeros(n + 1), amplitude * np.cos(2.0 * np.pi * x)])
            body = beam(wave, axial=axial)
            body.boundary.move([0], ["x", "ry"])  # crests stay level
            body.boundary.move([n], ["ry"])
            body.boundary.load([n], "x", share * star)
            strains.append(settle(body, 1e-5).position[n, 0] / wavelength - 1.0)
        crimp = (np.pi * amplitude / wavelength) ** 2
        exact = share * star / axial + crimp * (1.0 - (1.0 + share) ** -2)
        case, source = f"wavy yarn, T = {share:g} T*", "Timoshenko & Gere 1961"
        rows.append(converging(case, source, "strain [-]", exact, strains, "8, 16, 32"))
    return rows


def chord_angle(gamma: float) -> float:
    """Chord angle [degrees] of the heavy elastica: B theta'' = w (L - s) cos theta below the horizontal."""

    def slope(s: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.array([y[1], -gamma * (1.0 - s) * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    def ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.array([a[0], b[1], a[2], a[3]])

    s = np.linspace(0.0, 1.0, 201)
    found = solve_bvp(slope, ends, s, np.array([s, 1.0 - s, s, 0.5 * s]), tol=1e-10, max_nodes=100000)
    return float(np.rad2deg(np.arctan2(found.y[3, -1], found.y[2, -1])))


def heavy_elastica() -> list[Row]:
    """A cantilever under its own weight, w L^3 / B = 8.0042: its chord falls to 41.5 degrees.

    The exact elastica; the formula of Peirce (1930), J. Text. Inst. 21, T377, has 7.569 there.
    """
    gamma, exact = 8.0042, 41.5
    angles = []
    for n in (5, 10, 20):
        body = cantilever(n, axial=4e5)
        weight = gamma * EI * body.model.mass / body.model.mass.sum()
        body.boundary.gravity(weight)
        x, _, z = settle(body).position[n]
        angles.append(float(np.rad2deg(np.arctan2(-z, x))))
    return [converging("heavy elastica", "elastica, collocation", "chord angle [deg]", exact, angles, "5, 10, 20")]


def rows() -> list[Row]:
    """All static cases of beams."""
    return [
        *rigid_rotation(), *patch(), *elastica(), *roll_up(), *bend_45(300.0),
        *bend_45(600.0, (15.9, 47.2, 53.4)), *buckling(), *post_buckling(), *wavy_yarn(), *heavy_elastica(),
    ]  # fmt: skip
