"""The largest axial force in every yarn of a formed blank, over its strength."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Frame, Mesh
from knittest.config.fabric import Direction
from knittest.config.run import Run
from knittest.laboratory.base import tension_curve
from knittest.materials.yarn_section import sections

Array = NDArray[np.float64]

DIRECTIONS: tuple[Direction, Direction] = ("warp", "weft")
Table = dict[str, Array]


def strengths(run: Run) -> dict[str, float]:
    """Force [N] at which a mean yarn of warp, weft and knit breaks: that of its law, or of the fabric's curve."""
    if run.model.scale == "macro":
        curves = {d: tension_curve(run.fabric, d) for d in DIRECTIONS}
        return {d: float(c.mean.max()) / run.fabric.density_per_mm.of(d) for d, c in curves.items()}
    cards = sections(run.fabric)
    breaks = (run.fabric.reinforcing, run.fabric.reinforcing, run.fabric.knitting)
    strain = [yarn.fracture_strain_fraction for yarn in breaks]
    return {
        name: float((card.hinge_slope * np.maximum(e - card.hinge_strain, 0.0)).sum())
        for name, card, e in zip(("warp", "weft", "knit"), cards, strain, strict=True)
    }


def yarn_forces(run: Run, mesh: Mesh, frames: Sequence[Frame]) -> Table:
    """One row a yarn, the most loaded first: its system and number, largest tension [N] in any of ``frames``, over its
    strength, and where: the place in that frame [mm] and the travel of the stamp [mm].
    """
    yarns = _of_shells(run, mesh, frames[0]) if mesh.kind == "shells" else _of_beams(mesh)
    strength = strengths(run)
    forces = {s: np.array([_force(run, mesh, frame, s) for frame in frames]) for s in {y[0] for y in yarns}}
    rows = []
    for system, number, cells in yarns:
        force = forces[system][:, cells]
        when, where = np.unravel_index(int(np.argmax(force)), force.shape)
        place = frames[int(when)].position[mesh.cells[cells[where]]].mean(axis=0)
        most = float(force.max())
        rows.append((system, number, most, 100.0 * most / strength[system], *place, frames[int(when)].coordinate))
    rows.sort(key=lambda row: -row[3])
    names = ("system", "yarn", "force_n", "utilisation_pct", "x_mm", "y_mm", "z_mm", "stamp_travel_mm")
    return {name: np.array(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)}


def _force(run: Run, mesh: Mesh, frame: Frame, system: str) -> Array:
    """Tension of a yarn of ``system`` in each element [N]."""
    if mesh.kind == "beams":
        return frame.fields["axial_force"]
    force: Array = frame.fields[f"force_{system}"] / run.fabric.density_per_mm.of(system)
    return force


def _of_beams(mesh: Mesh) -> list[tuple[str, int, NDArray[np.int64]]]:
    found = []
    for part, name in enumerate(mesh.part_names):
        numbers = np.unique(mesh.yarn[mesh.part == part])
        found += [(name, k + 1, np.flatnonzero(mesh.yarn == yarn)) for k, yarn in enumerate(numbers)]
    return found


def _of_shells(run: Run, mesh: Mesh, first: Frame) -> list[tuple[str, int, NDArray[np.int64]]]:
    """The shells that each yarn runs through."""
    centre = first.position[mesh.cells].mean(axis=1)
    found = []
    for axis, system in ((0, "warp"), (1, "weft")):
        low, high = first.position[:, axis].min(), first.position[:, axis].max()
        columns = np.unique(np.round(centre[:, axis], 6))
        count = max(round((high - low) * run.fabric.density_per_mm.of(system)), 1)
        places = low + (np.arange(count) + 0.5) * (high - low) / count
        nearest = columns[np.abs(columns - places[:, None]).argmin(axis=1)]
        found += [(system, k + 1, np.flatnonzero(np.abs(centre[:, axis] - x) < 1e-5)) for k, x in enumerate(nearest)]
    return found
