"""Curved shells that bend far and snap through, posed through :mod:`knittest.pose`, against published tables.

Sze = Sze, Liu & Lo (2004), Popular benchmark problems for geometric nonlinear analysis of shells, Finite Elements in
Analysis and Design 40, 1551-1569: thin shells of four nodes on the meshes below, by loads over the largest. Its numbers
were checked in others' copies of its tables: Table 9 for the roofs, that of A for the pull-out, the semicylinder; that
of B of the pull-out was in none.
"""

import numpy as np
from cases.row import Row
from cases.series import settle
from cases.shell_curved import Plate, Sheet, tube

from knittest.pose import ALL, Body, Table

Array = np.ndarray
SZE = "Sze, Liu & Lo 2004"
#: displacements [mm] by the share of the largest load: A of the pull-out, sag of the semicylinder
PULLED = {0.1: 1.707, 0.5: 2.473, 1.0: 2.768}
PINCHED = {0.2: 0.37582, 0.3: 0.66410, 0.5: 1.32653, 1.0: 1.71505}
#: largest load [N] of a hinged roof by its thickness [mm], and the deflection [mm] there
LIMITS = {12.7: (0.7421 * 3000.0, 11.293), 6.35: (0.1953 * 3000.0, 12.892)}


def pull_out(share: float = 1.0, n: int = 16, m: int = 24) -> list[Row]:
    """Open tube pulled apart by two forces of 40000 times ``share``, nu = 0.3125, an octant."""
    sheet = Sheet.of(n, m)
    points = tube(sheet, 4.953, 5.175, 0.5 * np.pi)
    body = Plate(10.5e6, 0.094, 0.3125).body(points, sheet.cells)
    body.boundary.move(sheet.where(s=1.0), ["x", "ry", "rz"])
    body.boundary.move(sheet.where(t=0.0), ["y", "rx", "rz"])
    body.boundary.move(sheet.where(t=1.0), ["z", "rx", "ry"])
    top, side = sheet.where(1.0, 0.0), sheet.where(1.0, 1.0)
    body.boundary.load(top, "z", 10000.0 * share)
    moved = settle(body, 1e-5).position - points
    found = [("A, out", PULLED[share], moved[top[0], 2])]
    if share == 1.0:
        found.append(("B, in", 4.551, -moved[side[0], 1]))
    case = f"pull-out cylinder, {40000.0 * share:g} N"
    return [Row(case, SZE, f"{name} [mm]", exact, float(v), f"{n} x {m}", None) for name, exact, v in found]


def semicylinder(share: float = 1.0, n: int = 40) -> list[Row]:
    """Half tube clamped at one end, pinched at the other by 2000 times ``share``, nu = 0.3, one half.

    Its sides lie in the plane that mirrors the tube: with turns about y left free there, sides that bend in that plane
    would let their normals tilt out of it.
    """
    sheet = Sheet.of(n, n)
    points = tube(sheet, 1.016, 3.048, 0.5 * np.pi)
    body = Plate(2.0685e7, 0.03, 0.3).body(points, sheet.cells)
    body.boundary.move(sheet.where(s=0.0), ALL)
    body.boundary.move(sheet.where(t=0.0), ["y", "rx", "rz"])
    body.boundary.move(sheet.where(t=1.0), ["z", "rx", "ry"])
    top = sheet.where(1.0, 0.0)
    body.boundary.load(top, "z", -1000.0 * share)
    settle(body, 1e-5)
    sag = float((points - body.position)[top[0], 2])
    case = f"pinched semicylinder, {2000.0 * share:g} N"
    return [Row(case, SZE, "sag [mm]", PINCHED[share], sag, f"{n} x {n}", None)]


def roof(n: int, thickness: float, deflection: float) -> tuple[float, float]:
    """Deflection of the middle [mm] and force [N] there of a roof of ``n`` x ``n`` shells a quarter, nu = 0.3, whose
    straight sides are hinged: its middle is moved by ``deflection``, then all comes to rest.
    """
    sheet = Sheet.of(n, n)
    points = tube(sheet, 2540.0, 254.0, 0.1)
    body: Body = Plate(3102.75, thickness, 0.3).body(points, sheet.cells)
    body.boundary.move(sheet.where(t=1.0), ["x", "y", "z"])
    body.boundary.move(sheet.where(s=1.0), ["x", "ry", "rz"])
    body.boundary.move(sheet.where(t=0.0), ["y", "rx", "rz"])
    middle, time = sheet.where(1.0, 0.0), 400.0 * body.dt
    pushed = body.boundary.move(middle, "z", Table((0.0, 0.5 * time, time), (0.0, -2.0 * deflection / time, 0.0)))
    body.advance(1.01 * time)
    settle(body, 1e-5)
    return float((points - body.position)[middle[0], 2]), -4.0 * body.reaction(pushed)


def hinged_roof(thickness: float, n: int = 16) -> list[Row]:
    """Largest load of :func:`roof`: the top of the parabola through three deflections about that of the table."""
    load, at = LIMITS[thickness]
    path = np.array([roof(n, thickness, at + step) for step in (-0.6, -0.2, 0.2)])
    top = np.poly1d(np.polyfit(path[:, 0] - at, path[:, 1], 2))
    largest = float(top(top.deriv().roots[0]))
    return [Row(f"hinged roof, {thickness:g} mm", SZE, "limit load [N]", load, largest, f"{n} x {n}", None)]


def rows() -> list[Row]:
    """All cases of this module, on the meshes of the tables; half a minute."""
    cases = [pull_out(share) for share in PULLED] + [semicylinder(share) for share in PINCHED]
    cases += [hinged_roof(thickness) for thickness in LIMITS]
    return [row for case in cases for row in case]
