"""Specimens of yarns in a rig: strips with scatter, needles, weights, shear angles, and rigid parts of frames."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, floor, lcm
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.history import Array, Body, Frame, History, Mesh, Specimen
from knittest.config.fabric import Direction, Fabric
from knittest.config.rigs import StripRig
from knittest.config.run import Run
from knittest.config.structure import DIRECTIONS, KNIT, Inlays, repeat_of
from knittest.fabric.relaxation import relaxed_cell
from knittest.fabric.strip import YarnPath, strip, yarn_count
from knittest.fabric.topology import YarnDraws, draw
from knittest.materials.yarn_section import systems_of
from knittest.models.boundary import Readings
from knittest.models.explicit_model import ExplicitModel
from knittest.models.tool import Table, ramp
from knittest.solve.state import SILENT, Observer

AXIS = {"warp": 1, "weft": 0}


@dataclass(frozen=True)
class YarnStrip:
    """Paths and draws of a piece of fabric of whole pitches; ``table`` is that of yarns.csv."""

    paths: list[YarnPath]
    draws: dict[str, YarnDraws]
    table: dict[str, np.ndarray]


def pattern_repeat(fabric: Fabric, direction: str) -> int:
    """Wales (warp) or courses (weft) after which the inlays of ``direction`` repeat: 1 where each has one or none."""
    return lcm(*(1 if all(one.pattern) else len(one.pattern) for one in fabric.inlays_along(direction)))


def whole_repeats(fabric: Fabric, direction: str, length: float) -> int:
    """Wales (warp) or courses (weft) of a piece of about ``length`` [mm], two at least, in whole repeats of the inlays.

    So the piece has the inlay density of the fabric.
    """
    repeat = pattern_repeat(fabric, direction)
    spacing = fabric.wale_spacing if direction == "warp" else fabric.course_spacing
    return max(round(length / (repeat * spacing)) * repeat, repeat, 2)


def yarns_across(run: Run, direction: Direction, specimen: int = 0, *, repeats: bool = True) -> int:
    """Whole wales (warp) or courses (weft) in the width of a strip along ``direction``.

    ``repeats``: whole repeats of its inlays. A fraction is rounded down or up, alternately in an ensemble.
    """
    assert isinstance(run.rig, StripRig)
    repeat = pattern_repeat(run.fabric, direction) if repeats else 1
    exact = run.rig.width_mm * run.fabric.density_per_mm.of(direction) / repeat
    if abs(exact - round(exact)) < 0.25:
        return max(round(exact), 1) * repeat
    up = (run.rig.yarn_rounding == "up") != (run.variability.specimens > 1 and specimen % 2 == 1)
    return max(ceil(exact) if up else floor(exact), 1) * repeat


def inlays_across(run: Run, direction: Direction, specimen: int = 0) -> int:
    """Inlays of ``direction`` in the width of a meso strip, those of all layers."""
    pitches = yarns_across(run, direction, specimen)
    return sum(one.count(pitches) for one in run.fabric.inlays_along(direction))


def modelled_width(run: Run, direction: Direction, specimen: int = 0) -> float:
    """Width [mm] of a strip: its own (macro), or that of its whole wales or courses (meso)."""
    assert isinstance(run.rig, StripRig)
    if run.model.scale == "macro":
        return run.rig.width_mm
    return yarns_across(run, direction, specimen) / run.fabric.density_per_mm.of(direction)


def full_layer(fabric: Fabric, direction: Direction) -> str:
    """Name of the first layer with an inlay in every wale (warp) or course (weft); empty without."""
    return next((one.name for one in fabric.inlays_along(direction) if all(one.pattern)), "")


def has_all_crossings(fabric: Fabric) -> bool:
    """Tell whether inlays of both directions cross in every stitch."""
    return all(full_layer(fabric, direction) for direction in DIRECTIONS)


def check_shows_shear(run: Run, n_wales: int, n_courses: int, field: str) -> None:
    """Raise :class:`InputError` where a piece of ``n_wales`` by ``n_courses`` stitches shows no shear angle.

    Without a crossing of inlays in every stitch it is read from the loops; ``field`` is the size of the piece.
    """
    fabric = run.fabric
    if run.model.scale == "macro" or has_all_crossings(fabric):
        return
    if not run.model.meso.knitting:
        raise InputError(
            "model.meso.knitting = false: inlays do not cross in every stitch of this fabric, and its shear angle is "
            "read from the loops; set it to true"
        )
    wales, courses = (2 + count for count in repeat_of(fabric.grid, fabric.inlays))
    if n_wales < wales or n_courses < courses:
        enough = ceil(max(wales * fabric.wale_spacing, courses * fabric.course_spacing))
        raise InputError(
            f"{field}: {n_wales} wales and {n_courses} courses are too few, expected at least {wales} and {courses}: "
            f"the shear angle of this fabric is read over a repeat of its loops; use --set {field}={enough}"
        )


def check_has_inlays(fabric: Fabric, direction: Direction, field: str, what: str) -> None:
    """Raise :class:`InputError` for a fabric without inlays along ``direction``, which the test needs."""
    if not fabric.inlays_along(direction):
        given = {one.direction for one in fabric.inlays}
        remedy = f"set {field}={next(iter(given))}" if given else "choose a fabric with inlays"
        raise InputError(f"{field} = {direction}: this test {what}, but the fabric has no {direction} inlays; {remedy}")


def pitch(run: Run, direction: Direction) -> float:
    """Distance of the yarns across a strip of ``direction`` [mm]: the period along it."""
    return run.fabric.course_spacing if direction == "warp" else run.fabric.wale_spacing


def cut_piece(
    run: Run,
    n_wales: int,
    n_courses: int,
    specimen: int = 0,
    observer: Observer = SILENT,
    gripped: tuple[Direction, float] | None = None,
) -> YarnStrip:
    """Yarn paths of ``n_wales`` by ``n_courses`` stitches; ``gripped``: a direction and its held share at both ends."""
    observer.phase("generating the yarns")  # the cell was relaxed, and announced, before the folder was opened
    cell = relaxed_cell(run.fabric)
    systems, sizes = systems_of(run.fabric), (n_wales, n_courses)
    counts = {s: yarn_count(cell, s, sizes[1 - cell.spec.axis(s)]) for s in systems}
    draws = {s: draw(run.fabric, run.variability, s, n, specimen) for s, n in counts.items()}
    if gripped is not None:
        direction, share = gripped
        for one in run.fabric.inlays_along(direction):
            held = draws[one.name]
            draws[one.name] = replace(held, weakest=share + (1.0 - 2.0 * share) * held.weakest)
    columns: dict[str, list[Any]] = {
        "system": [[s] * len(d.slack) for s, d in draws.items()],
        "yarn": [np.arange(1, len(d.slack) + 1) for d in draws.values()],
        "fracture_strain_pct": [100.0 * d.fracture_strain for d in draws.values()],
        "slack_pct": [100.0 * d.slack for d in draws.values()],
        "wave_amplitude_relative": [d.amplitude for d in draws.values()],
    }
    if (loop := draws[KNIT].loop) is not None:
        slacks = ((s, d.slack) for s, d in draws.items())
        columns["loop_length_relative"] = [loop if s == KNIT else np.ones_like(slack) for s, slack in slacks]
    table = {name: np.concatenate(parts) for name, parts in columns.items()}
    draws |= {one.name: _add_slack_to_wave(one, draws[one.name]) for one in run.fabric.inlays}
    mesh, amplitude = run.model.meso, {s: drawn.amplitude for s, drawn in draws.items()}
    paths = strip(cell, n_wales, n_courses, mesh.elements_per_loop, mesh.elements_per_wave, amplitude)
    if not mesh.knitting:
        paths = [p for p in paths if p.system != KNIT]
    return YarnStrip(paths, draws, table)


def _add_slack_to_wave(inlays: Inlays, draws: YarnDraws) -> YarnDraws:
    """Add slack of wavy yarns to their wave: a law without force makes a yarn a row of loose, rattling links."""
    if inlays.crimp <= 0.0:
        return draws
    wider = np.sqrt(1.0 + draws.slack / inlays.crimp)
    return replace(draws, amplitude=draws.amplitude * wider, slack=np.zeros_like(draws.slack))


#: share of a course by which arcs of edge loops may lie inside the sides: thick layers draw them in
INSIDE = 0.2


def needle_nodes(beyond: NDArray[np.float64], chain: NDArray[np.int64], course: float) -> NDArray[np.int64]:
    """Nodes on needles: ends of each ``chain`` (n,), and crests of edge loops, ``beyond`` (n,) [mm] the sides.

    ``course`` [mm] is the course spacing.
    """
    change = chain[1:] != chain[:-1]
    ends = np.append(True, change) | np.append(change, True)
    crest = np.append(False, (beyond[1:-1] >= beyond[:-2]) & (beyond[1:-1] > beyond[2:]))
    return np.flatnonzero(ends | (np.append(crest, False) & (beyond > -INSIDE * course)))


def random_offsets(height: float, seed: int, count: int) -> Array:
    """Random offsets (count,) up to ``height`` [mm] either way, from which wrinkles start."""
    return np.random.default_rng(seed).uniform(-height, height, count)


def centre_paths(paths: Iterable[YarnPath], size: Array) -> list[YarnPath]:
    """``paths`` of a piece of ``size`` (2,) [mm] along x and y, moved about the origin."""
    middle = 0.5 * np.append(size, 0.0)
    return [replace(path, points=path.points - middle) for path in paths]


def wale_course_counts(direction: str, along: int, across: int) -> tuple[int, int]:
    """Numbers of wales and courses of a strip with ``along`` and ``across`` pitches, cut along ``direction``."""
    return (across, along) if direction == "warp" else (along, across)


def node_weights(fabric: Fabric, gravity: float, model: ExplicitModel, area: float) -> Array:
    """Weight of each node [N] under ``gravity`` [mm/ms^2], of the measured area mass on ``area`` [mm^2]."""
    given = fabric.area_mass_g_per_mm2 * area
    return model.mass * (given / model.mass.sum()) * gravity


#: least depth of a jaw over the width that it holds, and what it stands out beyond the specimen over its depth
DEPTH, AROUND = 0.06, 0.35
#: facts of a strip between two jaws: where their faces are at the start, along the strip
STRIP_JAWS = ("fixed_jaw_mm", "moving_jaw_mm")


def make_block(name: str, section: Array, sides: tuple[float, float], offset: Array, *, along: int = 1) -> Body:
    """Block between ``sides`` [mm] with a convex ``section`` (k, 2) [mm] in the plane of axis ``along`` and z."""
    k = len(section)
    points = np.zeros((2 * k, 3))
    points[:, along], points[:, 2] = np.tile(section, (2, 1)).T
    points[:, 1 - along] = np.repeat(sides, k)
    first, here, there = np.arange(1, k - 1), np.arange(k), np.roll(np.arange(k), -1)
    lid = np.column_stack([np.zeros_like(first), first, first + 1])
    around = np.vstack([np.column_stack([here, there, k + there]), np.column_stack([here, k + there, k + here])])
    return Body(name, points, np.vstack([lid, lid + k, around]), offset)


def plate_block(name: str, centre: Array, lengths: Array, offset: Array) -> Body:
    """A plate of ``lengths`` (3,) about ``centre`` (3,) [mm], moved by ``offset`` (n_frames, 3) [mm]."""
    low, high = centre - 0.5 * lengths, centre + 0.5 * lengths
    section = np.array([[low[1], low[2]], [high[1], low[2]], [high[1], high[2]], [low[1], high[2]]])
    return make_block(name, section, (float(low[0]), float(high[0])), offset)


def make_jaw(
    name: str, history: History, axis: int, face: tuple[float, float], offset: Array, *, aside: float = AROUND
) -> Body:
    """Jaw beyond ``face``: its place along ``axis`` [mm] and direction; moved by ``offset``; ``aside`` its margin."""
    place, way = face
    first, radius = history.frames[0].position, float(history.mesh.radius.max())
    low, high = first.min(axis=0) - radius, first.max(axis=0) + radius
    held = way * ((high if way > 0.0 else low)[axis] - place)
    depth = max(float(held), DEPTH * float((high - low)[1 - axis]))
    out = depth * np.insert([aside, AROUND], axis, 0.0)
    low, high = low - out, high + out
    low[axis], high[axis] = sorted((place, place + way * depth))
    return plate_block(name, 0.5 * (low + high), high - low, offset)


def strip_jaws(specimen: Specimen, axis: int) -> list[Body]:
    """The fixed and the moving jaw of a strip that is pulled along ``axis`` (0: x, 1: y)."""
    history, (fixed, moving) = specimen.history, (specimen.facts[name] for name in STRIP_JAWS)
    moved = offsets(history, {axis: "displacement_mm"})
    still = np.zeros_like(moved)
    return [
        make_jaw("fixed jaw", history, axis, (fixed, -1.0), still),
        make_jaw("moving jaw", history, axis, (moving, 1.0), moved),
    ]


def creep_speed(speed: float, share: float, ramp_time: float, start: float, full: float) -> Table:
    """Velocity [mm/ms] over time [ms]: 0 until ``start``, a ``share`` of ``speed``, all of it from ``full`` on."""
    slow, faster = ramp(ramp_time, share * speed), ramp(ramp_time, (1.0 - share) * speed)
    time = (0.0, *(start + t for t in slow.time), *(full + t for t in faster.time))
    return Table(time, (0.0, *slow.value, *(slow.value[-1] + v for v in faster.value)))


def two_plates(centres: Array, lengths: Array, offsets: Sequence[Array]) -> list[Body]:
    """The lower and the upper plate of ``lengths`` (3,) about ``centres`` (2, 3) [mm], moved by ``offsets``."""
    placed = zip(("lower plate", "upper plate"), centres, offsets, strict=True)
    return [plate_block(name, centre, lengths, offset) for name, centre, offset in placed]


def clamp_forces(readings: Readings) -> dict[str, float]:
    """Mean force [N] of both clamps, and each: after a break the moving one still feels inertia."""
    fixed, moving = readings.reaction[:2]
    return {"force_n": 0.5 * float(moving - fixed), "force_moving_n": float(moving), "force_fixed_n": -float(fixed)}


def offsets(history: History, columns: Mapping[int, str], way: float = 1.0) -> Array:
    """Motion (n_frames, 3) [mm] of a body that moves along axes by ``columns`` of the curve, times ``way``."""
    found = np.zeros((len(history.frames), 3))
    for axis, column in columns.items():
        found[:, axis] = way * values_at_frames(history, column)
    return found


def values_at_frames(history: History, column: str) -> Array:
    """Values of a ``column`` of the curve at the times of the frames, (n_frames,), by the line between its rows."""
    times = [frame.time for frame in history.frames]
    return np.asarray(np.interp(times, history.curve["time_ms"], history.curve[column]))


#: share of the material between the bounds of the scatter [%]
BOUNDS = (5.0, 95.0)


@dataclass(frozen=True)
class AngleScatter:
    """Mean, standard deviation and bounds of the middle 90 % of a field of shear angles [deg]."""

    mean: float
    sd: float
    low: float
    high: float


def angle_scatter(angle: Array) -> AngleScatter:
    """Scatter of shear angles ``angle`` [rad], (n,), one for each equal piece of the material (shell or crossing)."""
    degrees = np.rad2deg(angle)
    low, high = np.percentile(degrees, BOUNDS)
    return AngleScatter(float(degrees.mean()), float(degrees.std()), float(low), float(high))


def shell_angles(frame: Frame) -> Array:
    """Shear angle [rad] of each shell, (n_el,), positive as the frame's, which closes warp and minus weft."""
    return -frame.fields["shear_angle"]


def crossing_angles(mesh: Mesh, frame: Frame, systems: Sequence[str] = DIRECTIONS) -> tuple[Array, Array]:
    """Shear angle [rad] at each crossing, (n,), between both pitches there, signed as the frame's; its place [mm].

    ``systems`` are a layer of warp and one of weft, with an inlay in every wale and course.
    """
    counts = [len(yarn_nodes(mesh, system)) for system in systems]
    warp, weft = (pitch_vectors(mesh, frame, s, n) for s, n in zip(systems, reversed(counts), strict=True))
    across = weft[0].transpose(1, 0, 2)
    cosine = np.sum(warp[0] * across, axis=2)
    cosine /= np.linalg.norm(warp[0], axis=2) * np.linalg.norm(across, axis=2)
    return np.arcsin(cosine).ravel(), warp[1][..., :2].reshape(-1, 2)


def stitch_angles(run: Run, mesh: Mesh, frame: Frame) -> tuple[Array, Array]:
    """Shear angle [rad] between the needle arcs of a repeat of loops, (n,), signed as the frame's; its place [mm].

    Loops at the cut ends of the courses and those of the last course are left out: no loop holds them.
    """
    arcs = needle_arcs(run, mesh)[:-1, 1:-1]
    wales, courses = repeat_of(run.fabric.grid, run.fabric.inlays)
    here, above, beside = (
        frame.position[a] for a in (arcs[:-courses, :-wales], arcs[courses:, :-wales], arcs[:-courses, wales:])
    )
    warp, weft = above - here, beside - here
    cosine = np.sum(warp * weft, axis=2) / np.linalg.norm(warp, axis=2) / np.linalg.norm(weft, axis=2)
    return np.arcsin(cosine).ravel(), 0.5 * (above + beside)[..., :2].reshape(-1, 2)


def material_angles(run: Run, mesh: Mesh, frame: Frame) -> tuple[Array, Array]:
    """Shear angle [rad] of each shell, crossing or repeat of loops, (n,), and its place in plan [mm], (n, 2)."""
    if mesh.kind == "shells":
        return shell_angles(frame), frame.position[mesh.cells].mean(axis=1)[:, :2]
    if not has_all_crossings(run.fabric):
        return stitch_angles(run, mesh, frame)
    return crossing_angles(mesh, frame, [full_layer(run.fabric, direction) for direction in DIRECTIONS])


def yarn_nodes(mesh: Mesh, system: str) -> NDArray[np.int64]:
    """Nodes of the yarns of a ``system``, which are equally long: (n_yarns, n_nodes)."""
    yarns = np.unique(mesh.yarn[mesh.part == mesh.part_names.index(system)])
    cells = np.array([mesh.cells[mesh.yarn == yarn] for yarn in yarns])
    return np.concatenate([cells[..., 0], cells[:, -1:, 1]], axis=1)


def needle_arcs(run: Run, mesh: Mesh) -> NDArray[np.int64]:
    """Nodes in the needle arcs of the loops and at the cut ends, (n_courses, n_wales + 1)."""
    return yarn_nodes(mesh, KNIT)[:, :: run.model.meso.elements_per_loop]


def stitch_counts(run: Run, mesh: Mesh) -> tuple[int, int]:
    """Wales and courses of a piece of yarns, by its loops or by its inlays, of which one lies in each of them."""
    if KNIT in mesh.part_names and (mesh.part == mesh.part_names.index(KNIT)).any():
        courses, ends = needle_arcs(run, mesh).shape
        return ends - 1, courses
    wales, courses = (len(yarn_nodes(mesh, full_layer(run.fabric, direction))) for direction in DIRECTIONS)
    return wales, courses


def surface_nodes(mesh: Mesh) -> NDArray[np.int64]:
    """Nodes of the mid-surface: those of a sheet, of the inlays, or of the loops where there are no inlays."""
    inlays = np.isin(mesh.part, [k for k, name in enumerate(mesh.part_names) if name != KNIT])
    return np.unique(mesh.cells[inlays if inlays.any() else slice(None)])


def pitch_vectors(mesh: Mesh, frame: Frame, system: str, pitches: int) -> tuple[Array, Array]:
    """Direction and middle of each of the ``pitches`` of all yarns of a system, both (n_yarns, n_pitches, 3) [mm]."""
    node = yarn_nodes(mesh, system)
    ends = frame.position[node[:, :: (node.shape[1] - 1) // pitches]]
    return ends[:, 1:] - ends[:, :-1], 0.5 * (ends[:, 1:] + ends[:, :-1])


def angle_table(rows: Iterable[tuple[float, AngleScatter]]) -> dict[str, Array]:
    """Columns of shear-angle.csv from the frame's angles [deg] and the scatter of the material's."""
    values = np.array([(frame, s.mean, s.sd, s.low, s.high) for frame, s in rows]).reshape(-1, 5)
    names = ("frame_shear_angle_deg", "mean_deg", "sd_deg", "percentile_5_deg", "percentile_95_deg")
    return dict(zip(names, values.T, strict=True))
