"""Shells that start curved or twisted against published tables, posed through :mod:`knittest.pose`."""

from dataclasses import dataclass

import numpy as np
from cases.row import Row
from cases.series import settle
from scipy.spatial.transform import Rotation
from shell_cases import grid

from knittest.pose import ALL, Body, linear_laminate

Array = np.ndarray
MACNEAL = "MacNeal & Harder 1985"
AXIS = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class Plate:
    """Isotropic plate: Young's ``modulus``, ``thickness`` and ``poisson``'s ratio."""

    modulus: float
    thickness: float
    poisson: float = 0.0

    def body(self, points: Array, cells: Array, warp: Array = AXIS) -> Body:
        """Shells that weigh as much as makes the speed of sound 1."""
        stretch = self.modulus * self.thickness
        bend, shear = stretch * self.thickness**2 / 12.0, 0.5 * stretch / (1.0 + self.poisson)
        twist = shear * self.thickness**2 / 12.0
        both = (stretch, stretch), (bend, bend)
        laminate = linear_laminate(*both, shear, self.thickness, twist=twist, poisson=self.poisson)
        return Body.of_shells(points, cells, laminate, stretch, self.thickness, warp=warp)


@dataclass(frozen=True)
class Sheet:
    """Nodes of an ``n`` x ``m`` mesh of the unit square by their coordinates ``s``, ``t`` (n_nodes,), and ``cells``."""

    s: Array
    t: Array
    cells: Array

    @classmethod
    def of(cls, n: int, m: int) -> "Sheet":
        """Mesh of ``n`` elements along s and ``m`` along t."""
        points, cells = grid(n, m, 1.0, 1.0)
        return cls(points[:, 0], points[:, 1], cells)

    def where(self, s: float | None = None, t: float | None = None) -> Array:
        """Nodes on the line of constant ``s`` or ``t``, or at the point of both."""
        chosen = np.ones(len(self.s), bool)
        for values, wanted in ((self.s, s), (self.t, t)):
            chosen &= wanted is None or np.isclose(values, wanted)
        return np.flatnonzero(chosen)

    def shares(self) -> Array:
        """Share of the area that each node carries, (n_nodes,)."""
        count = np.bincount(self.cells.ravel(), minlength=len(self.s))
        return count / count.sum()


def tube(sheet: Sheet, radius: float, length: float, opening: float) -> Array:
    """Points of a cylinder about x: x = length s, angle ``opening`` [rad] t from the z axis towards y."""
    angle = opening * sheet.t
    return np.column_stack([length * sheet.s, radius * np.sin(angle), radius * np.cos(angle)])


def scordelis_lo(n: int) -> list[Row]:
    """Roof under its weight, 0.3024 at the middle of its free edge (nu = 0); one quarter, small load."""
    sheet, small = Sheet.of(n, n), 1e-2
    opening = np.deg2rad(40.0)
    points = tube(sheet, 25.0, 25.0, opening)
    body = Plate(4.32e8, 0.25).body(points, sheet.cells)
    body.boundary.move(sheet.where(s=0.0), ["y", "z"])
    body.boundary.move(sheet.where(s=1.0), ["x", "ry", "rz"])
    body.boundary.move(sheet.where(t=0.0), ["y", "rx", "rz"])
    weight = 90.0 * 25.0 * 25.0 * opening
    body.boundary.load(np.arange(len(points)), "z", -small * weight * sheet.shares())
    settle(body)
    edge = sheet.where(1.0, 1.0)[0]
    sag = float(points[edge, 2] - body.position[edge, 2]) / small
    return [Row("Scordelis-Lo roof", MACNEAL, "sag of the edge", 0.3024, sag, f"{n} x {n}", None)]


def twisted_beam(n: int = 24, rows: int = 4) -> list[Row]:
    """Cantilever twisted by 90 degrees under unit end forces across (z) and along (y) the width of its root."""
    found, small = [], 1e-2
    for axis, name, exact in ((2, "across", 5.424e-3), (1, "along", 1.754e-3)):
        sheet = Sheet.of(n, rows)
        turn = Rotation.from_rotvec(np.outer(0.5 * np.pi * sheet.s, AXIS))
        offset = np.column_stack([0.0 * sheet.t, 1.1 * (sheet.t - 0.5), 0.0 * sheet.t])
        points = turn.apply(offset) + np.outer(12.0 * sheet.s, AXIS)
        body = Plate(29e6, 0.32, 0.22).body(points, sheet.cells)
        body.boundary.move(sheet.where(s=0.0), ALL)
        tip = sheet.where(s=1.0)
        share = np.where(np.isin(sheet.t[tip], (0.0, 1.0)), 0.5, 1.0) / rows
        body.boundary.load(tip, "xyz"[axis], small * share)
        settle(body)
        moved = float((body.position - points)[tip, axis] @ share) / small
        found.append(Row("twisted beam", MACNEAL, f"tip, {name}", exact, moved, f"{n} x {rows}", None))
    return found


def hemisphere(n: int) -> list[Row]:
    """Hemisphere with a hole of 18 degrees between two pairs of unit forces, nu = 0.3; a quarter."""
    sheet, small = Sheet.of(n, n), 1e-2
    around, up = 0.5 * np.pi * sheet.s, np.deg2rad(72.0) * sheet.t
    points = 10.0 * np.column_stack([np.cos(around) * np.cos(up), np.sin(around) * np.cos(up), np.sin(up)])
    warp = np.column_stack([-np.sin(around), np.cos(around), 0.0 * around])[sheet.cells].mean(axis=1)
    body = Plate(6.825e7, 0.04, 0.3).body(points, sheet.cells, warp)
    body.boundary.move(sheet.where(s=0.0), ["y", "rx", "rz"])
    body.boundary.move(sheet.where(s=1.0), ["x", "ry", "rz"])
    body.boundary.move(sheet.where(s=0.5, t=1.0), ["z"])
    pulled, pushed = sheet.where(0.0, 0.0), sheet.where(1.0, 0.0)
    body.boundary.load(pulled, "x", small)
    body.boundary.load(pushed, "y", -small)
    settle(body)
    moved = float((body.position - points)[pulled[0], 0]) / small
    return [Row("pinched hemisphere", MACNEAL, "displacement", 0.0940, moved, f"{n} x {n}", None)]


def pinched_cylinder(n: int) -> list[Row]:
    """Cylinder between diaphragms under two opposite unit forces, nu = 0.3: 1.8248e-5; an octant."""
    radius, length = 300.0, 600.0
    sheet = Sheet.of(n, n)
    points = tube(sheet, radius, 0.5 * length, 0.5 * np.pi)
    body = Plate(3e6, 3.0, 0.3).body(points, sheet.cells)
    body.boundary.move(sheet.where(s=0.0), ["y", "z"])
    body.boundary.move(sheet.where(s=1.0), ["x", "ry", "rz"])
    body.boundary.move(sheet.where(t=0.0), ["y", "rx", "rz"])
    body.boundary.move(sheet.where(t=1.0), ["z", "rx", "ry"])
    top = sheet.where(1.0, 0.0)
    body.boundary.load(top, "z", -0.25)
    settle(body)
    sag = float((points - body.position)[top[0], 2])
    return [
        Row("pinched cylinder, diaphragms", "Lindberg, Olson & Cowper 1969", "sag", 1.8248e-5, sag, f"{n} x {n}", None)
    ]


def rows() -> list[Row]:
    """All cases of this module."""
    cases = [scordelis_lo(n) for n in (8, 16, 32)] + [twisted_beam(), twisted_beam(48, 8)]
    cases += [hemisphere(8), hemisphere(16), pinched_cylinder(16), pinched_cylinder(32)]
    return [row for case in cases for row in case]
