"""The macro model: a strip of square shells between jaws."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.config.fabric import Direction, Fabric
from knittest.config.run import MacroModel
from knittest.kernels.shell_state import Laminate
from knittest.models.fabric_model import FabricModel
from knittest.models.sheet import build_sheet
from knittest.models.sheet_tracker import SheetContact

Array = NDArray[np.float64]
Index = NDArray[np.int64]

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
    return build_sheet(
        position,
        conn,
        laminate,
        fabric.area_mass_g_per_mm2,
        fabric.thickness_mm,
        ALONG if direction == "warp" else ACROSS,
    )


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
