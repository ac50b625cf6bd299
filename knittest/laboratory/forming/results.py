"""Results of forming: mid-surface, rim waves, work of the stamp, draw-in, largest force of every yarn."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Array, Frame, History, Mesh
from knittest.config.fabric import Direction
from knittest.config.run import Run
from knittest.config.structure import KNIT, direction_of
from knittest.laboratory.base import tension_curve
from knittest.laboratory.strips import surface_nodes, yarn_nodes
from knittest.materials.yarn_section import sections, systems_of
from knittest.tooling.toolset import ToolSet

Index = NDArray[np.int64]

#: slope of a tool [deg] up to which the fabric should follow it; between the tools it spans freely
FOLLOW_ANGLE = 30.0
#: step of the finite difference that gives a tool's slope [mm]
STEP = 0.01


@dataclass(frozen=True)
class MidSurface:
    """Points of the mid-surface, (n, 3) [mm]; ``height`` (n,) above stamp or die (``on_die``), nan between them."""

    start: Array
    now: Array
    height: Array
    on_die: NDArray[np.bool_]

    @property
    def flange_heights(self) -> Array:
        """Heights above the die [mm] of the fabric that should lie on it."""
        return np.asarray(self.height[np.isfinite(self.height) & self.on_die])

    @property
    def stamp_distances(self) -> Array:
        """Distances from the stamp [mm] of the fabric that should follow it; the die's floor limits them."""
        return np.asarray(self.height[np.isfinite(self.height) & ~self.on_die])


def measure_mid_surface(history: History, frame: Frame, tools: ToolSet, thickness: float, travel: float) -> MidSurface:
    """Mid-surface in ``frame``, the stamp ``travel`` [mm] down from its start on the blank of ``thickness`` [mm]."""
    nodes = surface_nodes(history.mesh)
    start, now = history.frames[0].position[nodes], frame.position[nodes]
    half, offset, up = 0.5 * thickness, start[:, 2], np.array([0.0, 0.0, STEP])
    steep = np.cos(np.deg2rad(FOLLOW_ANGLE))
    below, above = now, now + np.array([0.0, 0.0, travel])
    die, stamp = tools.die.distance(below), tools.stamp.distance(above)
    on_die = tools.die.distance(below + up) - die > STEP * steep
    on_stamp = stamp - tools.stamp.distance(above + up) > STEP * steep
    height = np.where(on_die, die - half - offset, np.inf)
    height = np.where(on_stamp & (stamp < die), stamp - half + offset, height)
    return MidSurface(start, now, np.where(np.isfinite(height), height, np.nan), on_die & ~(on_stamp & (stamp < die)))


#: length of the rim [mm] over which heights are averaged: single yarn ends stand off
WINDOW = 8.0


@dataclass(frozen=True)
class RimWaves:
    """``height`` (n,) [mm] of the rim over a paraboloid, ``count`` of crests, ``largest`` over their higher trough."""

    height: Array
    largest: float
    count: int


def rim_waves(start: Array, rise: Array, least: float) -> RimWaves:
    """Waves, from ``least`` [mm] on, of the rim of a blank at ``start`` (n, 2), in order, risen by ``rise`` (n,)."""
    from scipy.signal import find_peaks

    size = np.abs(start).max()
    x, y = start.T / size
    surface = np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y])
    over = rise - surface @ np.linalg.lstsq(surface, rise, rcond=None)[0]
    steps = np.linalg.norm(np.diff(start, axis=0, append=start[:1]), axis=1)
    way, length = np.append(0.0, np.cumsum(steps[:-1])), float(steps.sum())
    apart = np.abs(way[:, None] - way)
    near = np.minimum(apart, length - apart) <= 0.5 * WINDOW
    height = near @ over / near.sum(axis=1)
    # the rim is closed: begin and end in its deepest trough
    low = int(np.argmin(height))
    profile = np.append(np.roll(height, -low), height[low])
    crests = find_peaks(profile, prominence=least)[0]
    if not len(crests):
        return RimWaves(height, float(np.ptp(profile)), 0)
    troughs = np.minimum.reduceat(profile, np.append(0, crests))
    over = profile[crests] - np.maximum(troughs[:-1], troughs[1:])
    return RimWaves(height, float(over.max()), len(crests))


Table = dict[str, Array]

#: mechanisms by name: their label, the columns of the energies that they sum up, of warp those of all layers, and those
#: that are subtracted
MECHANISMS: dict[str, tuple[str, tuple[str, ...], tuple[str, ...]]] = {
    "stretching": ("stretching of inlays", ("stretching_warp_mj", "stretching_weft_mj", "stretching_fabric_mj"), ()),
    "bending": ("bending of inlays", ("bending_warp_mj", "bending_weft_mj", "bending_fabric_mj"), ()),
    "in_plane_bending": ("bending of inlays in the plane", ("in_plane_bending_fabric_mj",), ()),
    "torsion": ("torsion of inlays", ("torsion_warp_mj", "torsion_weft_mj"), ()),
    "loop_stretching": ("stretching of loops", ("stretching_knit_mj",), ()),
    "loop_bending": ("bending of loops", ("bending_knit_mj",), ()),
    "loop_torsion": ("torsion of loops", ("torsion_knit_mj",), ()),
    "shear": ("shear", ("shear_fabric_mj",), ()),
    "fabric_contact": (
        "contact of the fabric with itself", ("contact_mj",), ("contact_tools_mj", "contact_recovery_mj")
    ),
    "fabric_friction": ("friction in the fabric", ("friction_mj",), ("friction_tools_mj",)),
    "tool_contact": ("contact with tools", ("contact_tools_mj",), ()),
    "tool_friction": ("friction at tools", ("friction_tools_mj",), ()),
    "hourglass": ("hourglass control", ("hourglass_mj",), ()),
    "damping": ("damping", ("damping_mj", "contact_damping_mj"), ()),
    "kinetic": ("kinetic", ("kinetic_mj",), ()),
    "torn": ("torn elements", ("eroded_mj",), ()),
    "balance_error": ("error of the balance", ("balance_error_mj",), ()),
}  # fmt: skip


def stamp_work(history: History) -> Table:
    """Travel [mm], work of stamp, of holder and weight [mJ], and :data:`MECHANISMS`, which add up, over rows."""
    curve, energies = history.curve, history.energies
    travel, force = curve["stamp_travel_mm"], curve["stamp_force_n"]
    steps = np.diff(travel, prepend=0.0)
    before = np.append(force[:1], force[:-1])
    work = np.interp(energies["time_ms"], curve["time_ms"], np.cumsum(0.5 * (before + force) * steps))
    found = {
        "stamp_travel_mm": np.interp(energies["time_ms"], curve["time_ms"], travel),
        "stamp_mj": work,
        "holder_and_weight_mj": energies["external_mj"] - work,
    }
    for name, (_, plus, less) in MECHANISMS.items():
        columns = [values for column, values in energies.items() if _without_layer(column) in plus]
        if columns:
            taken = sum((energies[column] for column in less), np.zeros_like(work))
            found[f"{name}_mj"] = np.sum(columns, axis=0) - taken
    return found


def _without_layer(column: str) -> str:
    """Name of a ``column`` of the energies without the number of its layer: bending_warp_mj of bending_warp2_mj."""
    return f"{direction_of(column.removesuffix('_mj'))}_mj" if column.endswith("_mj") else column


#: distance [mm] from an edge within which a node of a sheet belongs to it
EDGE = 1e-6
#: share of a side about its middle over which the draw-in of the side is a mean
MIDDLE = 0.1
#: sides by the direction of the yarns that end there, with the axis across them and the direction outwards
SIDES = {"weft_low": (0, -1.0), "warp_low": (1, -1.0), "weft_high": (0, 1.0), "warp_high": (1, 1.0)}


@dataclass(frozen=True)
class DrawIn:
    """Edges of the blank: ``start``, ``now`` (n, 2), index of the ``side``, ``drawn`` inwards, ``rise`` (n,) [mm]."""

    start: Array
    now: Array
    side: Index
    drawn: Array
    rise: Array

    def middle(self, side: str) -> float:
        """Mean draw-in of the middle of a side [mm]."""
        here = self.side == list(SIDES).index(side)
        along = self.start[here, 1 - SIDES[side][0]]
        near = np.abs(along) <= max(MIDDLE * np.abs(along).max(), np.abs(along).min())
        return float(self.drawn[here][near].mean())

    def table(self) -> dict[str, Array]:
        """Columns of draw-in.csv."""
        return {
            "side": np.array(list(SIDES))[self.side],
            "start_x_mm": self.start[:, 0],
            "start_y_mm": self.start[:, 1],
            "x_mm": self.now[:, 0],
            "y_mm": self.now[:, 1],
            "draw_in_mm": self.drawn,
        }


def draw_in(mesh: Mesh, first: Frame, last: Frame) -> DrawIn:
    """The four edges, round the blank, between two frames."""
    rows = []
    for k, (name, (axis, sign)) in enumerate(SIDES.items()):
        edge = _edge(mesh, first.position, name)
        order = edge[np.argsort(first.position[edge, 1 - axis] * (1.0 if k in (1, 2) else -1.0))]
        start, now = first.position[order], last.position[order]
        drawn, rise = sign * (start[:, axis] - now[:, axis]), now[:, 2] - start[:, 2]
        rows.append((start[:, :2], now[:, :2], np.full(len(order), k), drawn, rise))
    return DrawIn(*(np.concatenate(column) for column in zip(*rows, strict=True)))


def _edge(mesh: Mesh, position: Array, side: str) -> Index:
    """Nodes of a side: the outermost of a sheet; the ends of the yarns that are cut there, or else its row of loops."""
    axis, sign = SIDES[side]
    if mesh.kind == "shells":
        out = sign * position[:, axis]
        return np.flatnonzero(out > out.max() - EDGE)
    direction = side.split("_")[0]
    system = next((name for name in mesh.part_names if direction_of(name) == direction), KNIT)
    nodes = yarn_nodes(mesh, system)
    if system == KNIT and direction == "warp":  # the arcs of the first or last course
        row = nodes[np.argmax(sign * position[nodes, axis].mean(axis=1))]
        out = sign * position[row, axis]
        return row[1:-1][(out[1:-1] >= out[:-2]) & (out[1:-1] > out[2:])]
    ends = nodes[:, [0, -1]]
    return np.asarray(np.take_along_axis(ends, np.argmax(sign * position[ends, axis], axis=1)[:, None], axis=1)[:, 0])


DIRECTIONS: tuple[Direction, Direction] = ("warp", "weft")


def yarn_density(run: Run, direction: str) -> float:
    """Inlays of ``direction`` per length across them [1/mm]; wales or courses where no inlays are described."""
    return run.fabric.inlay_density_per_mm(direction) or run.fabric.density_per_mm.of(direction)


def strengths(run: Run) -> dict[str, float]:
    """Force [N] at which a mean yarn of warp, weft and knit breaks, by its law or the fabric's curve."""
    if run.model.scale == "macro":
        curves = {d: tension_curve(run.fabric, d) for d in DIRECTIONS}
        return {d: float(c.mean.max()) / yarn_density(run, d) for d, c in curves.items()}
    yarns = [*(one.yarn for one in run.fabric.inlays), run.fabric.knitting]
    found = {}
    for name, yarn, card in zip(systems_of(run.fabric), yarns, sections(run.fabric), strict=True):
        strain = yarn.fracture_strain_fraction
        found[name] = float((card.hinge_slope * np.maximum(strain - card.hinge_strain, 0.0)).sum())
    return found


def yarn_forces(run: Run, mesh: Mesh, frames: Sequence[Frame]) -> Table:
    """Rows of yarns, the most loaded first: largest tension [N], over its strength [%], place and travel [mm]."""
    yarns = _shell_yarns(run, mesh, frames[0]) if mesh.kind == "shells" else _beam_yarns(mesh)
    strength = strengths(run)
    forces, rows = {}, []
    for system in {yarn[0] for yarn in yarns}:
        if mesh.kind == "beams":
            forces[system] = np.array([frame.fields["axial_force"] for frame in frames])
        else:
            density = yarn_density(run, system)
            forces[system] = np.array([frame.fields[f"force_{system}"] / density for frame in frames])
    for system, number, cells in yarns:
        force = forces[system][:, cells]
        when, where = np.unravel_index(int(np.argmax(force)), force.shape)
        place = frames[int(when)].position[mesh.cells[cells[where]]].mean(axis=0)
        most = float(force.max())
        rows.append((system, number, most, 100.0 * most / strength[system], *place, frames[int(when)].coordinate))
    rows.sort(key=lambda row: -row[3])
    names = ("system", "yarn", "force_n", "utilisation_pct", "x_mm", "y_mm", "z_mm", "stamp_travel_mm")
    return {name: np.array(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)}


def _beam_yarns(mesh: Mesh) -> list[tuple[str, int, NDArray[np.int64]]]:
    found = []
    for part, name in enumerate(mesh.part_names):
        numbers = np.unique(mesh.yarn[mesh.part == part])
        found += [(name, k + 1, np.flatnonzero(mesh.yarn == yarn)) for k, yarn in enumerate(numbers)]
    return found


def _shell_yarns(run: Run, mesh: Mesh, first: Frame) -> list[tuple[str, int, NDArray[np.int64]]]:
    centre = first.position[mesh.cells].mean(axis=1)
    found = []
    for axis, system in ((0, "warp"), (1, "weft")):
        low, high = first.position[:, axis].min(), first.position[:, axis].max()
        columns = np.unique(np.round(centre[:, axis], 6))
        count = max(round((high - low) * yarn_density(run, system)), 1)
        places = low + (np.arange(count) + 0.5) * (high - low) / count
        nearest = columns[np.abs(columns - places[:, None]).argmin(axis=1)]
        found += [(system, k + 1, np.flatnonzero(np.abs(centre[:, axis] - x) < 1e-5)) for k, x in enumerate(nearest)]
    return found
