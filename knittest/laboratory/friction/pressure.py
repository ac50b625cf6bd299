"""Contact pressure between the fabric and the plates, on a grid that lies on the fabric."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import History, Mesh

Array = NDArray[np.float64]

#: tools of the friction rig, in their order: the lower plate lies on the technical back, the upper on the face
PLATES = ("back", "face")


@dataclass(frozen=True)
class PressureMap:
    """Mean pressure [MPa] of each plate, (n_tools, n_x, n_y), in cells between ``x`` and ``y`` [mm]."""

    x: Array
    y: Array
    pressure: Array

    @property
    def force(self) -> Array:
        """Normal force [N] of each plate, (n_tools,)."""
        area = np.diff(self.x)[:, None] * np.diff(self.y)
        return np.array([float((p * area).sum()) for p in self.pressure])

    def table(self) -> dict[str, Array]:
        """One row a cell: its centre and the pressure of both plates."""
        middle = (0.5 * (edges[1:] + edges[:-1]) for edges in (self.x, self.y))
        x, y = np.meshgrid(*middle, indexing="ij")
        columns = {"x_mm": x.ravel(), "y_mm": y.ravel()}
        return columns | {f"pressure_{p}_mpa": v.ravel() for p, v in zip(PLATES, self.pressure, strict=True)}


def pressure_map(history: History, cell: float) -> PressureMap:
    """Mean pressure in square cells of side ``cell`` [mm], from ``history.tool_force`` in the last frame.

    The force on a node is shared evenly by its elements and counts at their centres, so that a shell at the edge, with
    fewer nodes of its own, shows the pressure that it has. The sum over all cells is the normal force.
    """
    mesh, position = history.mesh, history.frames[-1].position
    centre = position[mesh.cells].mean(axis=1)[:, :2]
    forces = [_on_elements(mesh, force) for force in history.tool_force]
    edges = [_edges(centre[:, axis], cell) for axis in (0, 1)]
    grids = [np.histogram2d(centre[:, 0], centre[:, 1], edges, weights=f)[0] / cell**2 for f in forces]
    return PressureMap(edges[0], edges[1], np.array(grids))


def _on_elements(mesh: Mesh, force: Array) -> Array:
    """Force of each element, (n_el,), from those of the nodes; nodes without elements carry none."""
    degree = np.bincount(mesh.cells.ravel(), minlength=len(force))
    return np.asarray((force / np.maximum(degree, 1))[mesh.cells].sum(axis=1))


def _edges(at: Array, cell: float) -> Array:
    """Edges of cells about the points, with the same margin at both ends."""
    low, high = float(at.min()), float(at.max())
    count = int((high - low) / cell + 1e-6) + 1
    half = 0.5 * cell * count
    return np.linspace(0.5 * (low + high) - half, 0.5 * (low + high) + half, count + 1)


def shares(history: History) -> dict[str, float]:
    """Share of the plates' force [%] that each part of the mesh carries."""
    mesh = history.mesh
    total = np.zeros(len(mesh.part_names))
    for force in history.tool_force:
        total += np.bincount(mesh.part, _on_elements(mesh, force), len(mesh.part_names))
    return {
        name: 100.0 * float(v) / max(float(total.sum()), 1e-12) for name, v in zip(mesh.part_names, total, strict=True)
    }
