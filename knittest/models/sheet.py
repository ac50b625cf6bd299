"""Assembles sheets of shells: lumped masses, critical step, mesh for viewers."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from knittest.base.history import Mesh
from knittest.kernels.in_plane_state import Bends
from knittest.kernels.shell_arrays import build_shells, set_strength
from knittest.kernels.shell_state import Laminate, Shells
from knittest.models.explicit_model import make_nodes, make_partitions
from knittest.models.fabric_model import FabricModel
from knittest.models.in_plane import build_bends
from knittest.models.in_plane_bound import bend_bound
from knittest.models.sheet_tracker import SheetContact, SheetTracker
from knittest.models.shell_step import highest_stiffness, rotary_inertia

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def build_sheet(
    points: Array,
    cells: Index,
    laminate: Laminate,
    area_mass: float,
    thickness: float,
    warp: ArrayLike = (0.0, 1.0, 0.0),
    strength: Array | None = None,
    contact: SheetContact | None = None,
) -> FabricModel:
    """Model of shells at rest in ``points`` (n, 3) [mm] with corners ``cells`` (n_el, 4).

    ``area_mass`` [g/mm^2], ``thickness`` [mm]; ``warp`` direction (3,) or (n_el, 3); ``strength`` (n_el,) over the
    laminate's fracture strains, 1 if not given. The sheets touch themselves and each other if ``contact`` says how.
    """
    points, cells = np.asarray(points, float), np.asarray(cells, np.int64)
    shells = build_shells(points, cells, np.asarray(warp, float))
    if strength is not None:
        set_strength(shells, strength)
    bends = build_bends(points, cells, shells, laminate.in_plane)
    mass, inertia, step = lump(laminate, points, cells, shells, area_mass, thickness, bends)
    n, n_el = len(points), len(cells)
    zeros = np.zeros(n_el, np.int64)
    mesh = Mesh("shells", cells, zeros, ("fabric",), zeros, np.full(n_el, 0.5 * thickness))
    wave = float(np.sqrt(laminate.slope.sum(axis=1).max() / area_mass))
    parts = make_partitions(np.arange(n + 1), np.full(n, -1))
    nodes = make_nodes(points, mass, inertia)
    tracker = SheetTracker(nodes, shells, parts, cells, mass, step, thickness, contact) if contact else None
    return FabricModel(nodes, parts, mass, inertia, mesh, step, 0.0, wave, shells, laminate, bends, tracker)


def lump(
    laminate: Laminate,
    position: Array,
    conn: Index,
    shells: Shells,
    area_mass: float,
    thickness: float,
    bends: Bends,
) -> tuple[Array, Array, float]:
    """Nodal mass [g] and rotary inertia [g mm^2] from the area mass, and the critical step [ms].

    The squared frequency of the model is at most that of its worst element with a quarter of its mass on each corner,
    and what the bending in the plane adds at its worst node.
    """
    translation, rotation, area = highest_stiffness(laminate, position, conn, shells)
    share = 0.25 * area_mass * area
    spread = rotary_inertia(translation, rotation, thickness)
    mass = np.bincount(conn.ravel(), np.repeat(share, 4), len(position)).astype(float)
    inertia = np.bincount(conn.ravel(), np.repeat(share * spread, 4), len(position))
    frequency2 = float(np.max((translation + rotation / spread) / share))
    if bends.first.size > 1:
        frequency2 += bend_bound(bends, mass)
    return mass, inertia.astype(float), 2.0 / frequency2**0.5
