"""The macro model: sheets of square shells with lumped masses, critical step and a mesh for viewers."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from knittest.base.arrays import Array, Index
from knittest.base.history import Mesh
from knittest.config.fabric import Direction, Fabric
from knittest.config.run import MacroModel
from knittest.kernels.in_plane import Bends
from knittest.kernels.shell_state import Laminate, Shells, build_shells, set_strength
from knittest.models.explicit_model import make_nodes, make_partitions
from knittest.models.fabric_model import FabricModel
from knittest.models.in_plane import bend_bound, build_bends, highest_stiffness, rotary_inertia
from knittest.models.sheet_tracker import SheetContact, SheetTracker


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
    laminate: Laminate, position: Array, conn: Index, shells: Shells, area_mass: float, thickness: float, bends: Bends
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


#: strength of a shell above that of the weakest one, relative
STRENGTH_MARGIN = 0.03
ALONG, ACROSS = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class StripShape:
    """Lengths of a strip between two jaws and of its shells, and largest seeded offset of its nodes [mm]."""

    gauge_length: float
    width: float
    jaw_length: float
    element_size: float
    imperfection: float = 0.0
    seed: int = 1


def build_strip(
    fabric: Fabric, laminate: Laminate, direction: Direction, shape: StripShape, contact: SheetContact | None = None
) -> FabricModel:
    """Strip of ``direction`` yarns along y: gauge between two jaws, shells of about the size that ``shape`` says.

    A row of nodes lies on each jaw edge. The imperfection is an out-of-plane offset of the nodes in the gauge, free of
    stress. The strip touches itself if ``contact`` says how.
    """
    rows = _rows(shape.gauge_length, shape.jaw_length, shape.element_size)
    position, conn = rectangle(rows, shape.width, shape.element_size)
    edge = 0.5 * shape.gauge_length * (1.0 - 1e-9)
    free = np.abs(position[:, 1]) < edge
    rng, height = np.random.default_rng(shape.seed), shape.imperfection
    position[free, 2] = rng.uniform(-height, height, int(free.sum()))
    return build_sheet(
        position, conn, laminate, fabric.area_mass_g_per_mm2, fabric.thickness_mm,
        ALONG if direction == "warp" else ACROSS, strengths(position, conn, edge, shape.seed), contact,
    )  # fmt: skip


def self_contact(fabric: Fabric, macro: MacroModel, safety: float) -> SheetContact | None:
    """Law of the fabric's contact with itself at ``safety`` times the critical step, None if it is not to."""
    return SheetContact(fabric.macro.self_friction.value, safety=safety) if macro.self_contact else None


def build_rectangle(
    fabric: Fabric, laminate: Laminate, direction: Direction, y: Array, width: float, element_size: float
) -> FabricModel:
    """Strip of ``direction`` yarns along y with node rows at ``y`` [mm]; all shells are equally strong."""
    position, conn = rectangle(y, width, element_size)
    along = ALONG if direction == "warp" else ACROSS
    return build_sheet(position, conn, laminate, fabric.area_mass_g_per_mm2, fabric.thickness_mm, along)


def rectangle(y: Array, width: float, element_size: float) -> tuple[Array, Index]:
    """Nodes (n, 3) [mm] in rows at ``y`` and quadrilaterals of about ``element_size``."""
    x = np.linspace(-0.5 * width, 0.5 * width, max(1, round(width / element_size)) + 1)
    position = np.column_stack([np.tile(x, len(y)), np.repeat(y, len(x)), np.zeros(len(x) * len(y))])
    corner = (np.arange(len(y) - 1)[:, None] * len(x) + np.arange(len(x) - 1)).ravel()
    return position, np.column_stack([corner, corner + 1, corner + len(x) + 1, corner + len(x)])


def strengths(position: Array, conn: Index, edge: float, seed: int) -> Array:
    """Strength of each shell over the fracture strain: 1 for the weakest one, seeded, inside the gauge, else more.

    Under even tension all shells would reach one limit in the same step and the strip would vanish instead of tearing.
    """
    centre = np.abs(position[conn, 1].mean(axis=1))
    strength = np.full(len(conn), 1.0 + STRENGTH_MARGIN)
    strength[np.random.default_rng(seed).choice(np.flatnonzero(centre < 0.8 * edge))] = 1.0
    return strength


def _rows(gauge: float, jaw: float, size: float) -> Array:
    """Heights of the node rows [mm], with one on each jaw edge."""
    n_gauge, n_jaw = max(1, round(gauge / size)), max(1, round(jaw / size))
    upper = 0.5 * gauge + jaw * np.arange(1, n_jaw + 1) / n_jaw
    return np.concatenate([-upper[::-1], np.linspace(-0.5 * gauge, 0.5 * gauge, n_gauge + 1), upper])
