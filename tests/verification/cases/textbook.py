"""Plates under even load, and a rod that is twisted until it loops, posed through :mod:`knittest.pose`.

Both are missed by a relaxation that ends too early: the load is light beside the stiffness in the plane, and the rod
soft near its critical moment.
"""

import numpy as np
from cases.row import Row
from cases.series import BEAM, beam, line, settle
from cases.shell_curved import Plate, Sheet

from knittest.pose import ALL

TIMOSHENKO = "Timoshenko & Woinowsky-Krieger 1959"
#: sag of the middle of a square plate over q a^4 / D, nu = 0.3, by what holds its rim
SAG = {"clamped": 0.00126532, "simply supported": 0.00406235}
#: first root of tan u = u
ROOT = 4.493409


def sag(n: int, held: str, load: float, nu: float = 0.3) -> float:
    """Sag over that of the closed form of a plate of side 1 mm, 0.005 mm thick, under ``load`` [MPa]; a quarter of
    ``n`` x ``n`` shells.
    """
    sheet, modulus, thickness = Sheet.of(n, n), 1e6, 0.005
    points = 0.5 * np.column_stack([sheet.s, sheet.t, 0.0 * sheet.s])
    body = Plate(modulus, thickness, nu).body(points, sheet.cells)
    rim = np.union1d(sheet.where(s=1.0), sheet.where(t=1.0))
    body.boundary.move(rim, ALL if held == "clamped" else ["x", "y", "z"])
    body.boundary.move(sheet.where(s=0.0), ["x", "ry", "rz"])
    body.boundary.move(sheet.where(t=0.0), ["y", "rx", "rz"])
    body.boundary.load(np.arange(len(points)), "z", -0.25 * load * sheet.shares())
    settle(body, 1e-5)
    stiffness = modulus * thickness**3 / 12.0 / (1.0 - nu**2)
    return float(-body.position[sheet.where(0.0, 0.0)[0], 2]) * stiffness / load


def plate(held: str, n: int = 16) -> Row:
    """Square plate under even load, w = 0.00126532 or 0.00406235 q a^4 / D in the middle, nu = 0.3.

    Timoshenko & Woinowsky-Krieger, Theory of Plates and Shells, tables 35 and 8. At most 0.004 of the thickness, so
    that the middle does not stretch.
    """
    return Row(f"{held} plate", TIMOSHENKO, "sag D / (q a^4)", SAG[held], sag(n, held, 1e-4), f"{n} x {n}", None)


def light_plate(n: int = 8) -> Row:
    """The clamped plate sags in proportion to its load, down to 5e-8 of its thickness: nothing else is linear so far.

    Relaxation bounds what rounding makes by the stiffness in the plane, 10000 times that of bending.
    """
    heavy, light = (sag(n, "clamped", load) for load in (1e-4, 1e-7))
    case = "clamped plate, a thousandth of the load"
    return Row(case, "linearity", "sag D / (q a^4)", heavy, light, f"{n} x {n}", None)


def twisted_rod(n: int = 40) -> Row:
    """Rod with clamped ends, one free to move along: it leaves its axis at M = 2 u EI / L, tan u = u.

    Greenhill (1883); Timoshenko & Gere (1961), section 2.21. Read at 0.9 and 0.95 of it from the sag under a light load
    across, which grows by 1 / (1 - (M / Mcr)^2), as Southwell reads that of a column.
    """
    torsion, critical = 0.8, 2.0 * ROOT * BEAM["bending"]
    points, found = line(n), []
    for share in (0.9, 0.95):
        body = beam(points, axial=1e3, torsion=torsion)
        body.boundary.move([0], ALL)
        twist = body.boundary.move([n], ["rx"])
        body.boundary.move([n], ["y", "z", "ry", "rz"])
        body.boundary.load([n // 2], "z", 1e-3)
        turn = share * critical / torsion * points[:, 0]
        body.place(points, np.column_stack([turn, 0.0 * turn, 0.0 * turn]))
        settle(body, 1e-5)
        found.append((body.reaction(twist) ** 2, 1.0 / np.hypot(*body.position[:, 1:].T).max()))
    (a, high), (b, low) = found
    moment = float(np.sqrt(b + low * (b - a) / (high - low)))
    return Row("twisted rod", "Greenhill 1883", "critical moment [N mm]", critical, moment, f"{n}", None)


def rows() -> list[Row]:
    """All cases of this module."""
    plates = [plate(held, n) for held in SAG for n in (8, 16)]
    return [*plates, light_plate(), twisted_rod(20), twisted_rod(40)]
