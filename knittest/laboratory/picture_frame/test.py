"""Picture frame: a square of fabric on needles along four hinged sides, its wrinkles and its cycles."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from scipy.interpolate import LinearNDInterpolator

from knittest.base.errors import InputError
from knittest.base.history import Array, Frame, History, Quality
from knittest.experiment.time_history import NodeHistory
from knittest.fabric.strip import rotate_to_bias
from knittest.laboratory.base import PreparedSpecimen, sheet_model
from knittest.laboratory.fabric_test import FabricTest
from knittest.laboratory.picture_frame.config import PictureFrameRun
from knittest.laboratory.picture_frame.rig import ANGLES, PictureFrameTest
from knittest.laboratory.quality_checks import Span, locking_warning
from knittest.laboratory.reactions import reactions_of
from knittest.laboratory.restart import make_row_check
from knittest.laboratory.shear_law_end import check_law_range
from knittest.laboratory.strips import (
    AngleScatter,
    angle_scatter,
    centre_paths,
    check_shows_shear,
    cut_piece,
    material_angles,
    needle_nodes,
    random_offsets,
    surface_nodes,
    whole_repeats,
)
from knittest.materials.trellis import NORMALISED, crosshead, normalised_force
from knittest.models.meso import build_meso
from knittest.solve.state import Observer, Simulation, SimulationCost

#: cells of the height map along a side
CELLS = 100
#: share of the side left out at every edge, where the needles hold the fabric
MARGIN = 0.05
#: prominence of a crest that counts, over the amplitude
PROMINENCE = 0.5


@dataclass(frozen=True)
class Wrinkles:
    """Height map [mm] over x, y [mm]; ``amplitude`` is half its range [mm], ``count`` its crests across the pull."""

    x: Array
    y: Array
    height: Array
    amplitude: float
    count: int


def measure_wrinkles(frame: Frame, history: History, side: float) -> Wrinkles:
    """Wrinkles of ``frame``; the mid-surface of a meso model is that of its inlays, or of its loops."""
    from scipy.signal import find_peaks

    mesh, first, points = history.mesh, history.frames[0].position, frame.position
    start, values = first, points[:, 2] - 0.0
    if mesh.kind == "beams":
        nodes = surface_nodes(mesh)
        start, points, values = first[nodes], points[nodes], points[nodes, 2] - first[nodes, 2]
    along_sides = np.column_stack([start[:, 0] + start[:, 1], start[:, 1] - start[:, 0]]) / np.sqrt(2.0)
    inside = np.abs(along_sides).max(axis=1) < (0.5 - MARGIN) * side
    height = LinearNDInterpolator(points[:, :2], values)
    span = np.abs(points[inside, :2]).max(axis=0)
    x, y = np.meshgrid(np.linspace(-span[0], span[0], CELLS), np.linspace(-span[1], span[1], CELLS))
    # only what lies in the sheared square, less its margin
    shape = (np.abs(x) / max(span[0], 1e-9) + np.abs(y) / max(span[1], 1e-9)) <= 1.0
    mapped = np.full(x.shape, np.nan)
    mapped[shape] = height(x[shape], y[shape])  # points outside all triangles are the slow ones
    amplitude = 0.5 * float(np.nanmax(mapped) - np.nanmin(mapped))
    profile = height(np.linspace(-span[0], span[0], 4 * CELLS), np.zeros(4 * CELLS))
    crests = np.zeros(0, int)
    if amplitude > 0.0:
        within = np.pad(profile[np.isfinite(profile)], 1, mode="minimum")
        crests = find_peaks(within, prominence=PROMINENCE * amplitude)[0]
    return Wrinkles(x, y, mapped, amplitude, len(crests))


# Cycles of a picture frame: work of loading, loss, and residual angle. For a shear law S = s gamma with a share f of
# friction behind a spring as stiff as the law, the loss of a first cycle to gamma is f s gamma^2 (1 - f) / (1 + f) per
# area, 2 f (1 - f) / (1 + f) of the work of loading.


@dataclass(frozen=True)
class Cycle:
    """Work of loading and loss [mJ], ``share`` [%], ``residual`` angle without force [deg], begin and end [ms]."""

    work: float
    loss: float
    share: float
    residual: float
    begin: float
    end: float


def cycles_of(curve: Mapping[str, Array], count: int) -> list[Cycle]:
    """The first ``count`` cycles of ``curve`` that were finished, each from a smallest angle to the next."""
    angle, force, way = (curve[name] for name in ("frame_shear_angle_deg", "shear_force_n", "displacement_mm"))
    if not len(angle) or not count:
        return []
    half, time = 0.5 * float(angle.max()), curve["time_ms"]
    up = np.flatnonzero((angle[1:] > half) & (angle[:-1] <= half))
    down = np.flatnonzero((angle[1:] <= half) & (angle[:-1] > half))
    ends = [int(d + np.argmin(angle[d : (up[k + 1] if k + 1 < len(up) else len(angle))])) for k, d in enumerate(down)]
    found = []
    for k, end in enumerate(ends[:count]):
        start = ends[k - 1] if k else 0
        top = start + int(np.argmax(angle[start : end + 1]))
        work = float(np.trapezoid(force[start : top + 1], way[start : top + 1]))
        loss = float(np.trapezoid(force[start : end + 1], way[start : end + 1]))
        gone = np.flatnonzero(force[top : end + 1] <= 0.0)
        residual = float(angle[top + gone[0]]) if len(gone) else float("nan")
        share = 100.0 * loss / work if work > 0.0 else float("nan")
        found.append(Cycle(work, loss, share, residual, float(time[start]), float(time[end])))
    return found


def cycle_results(curve: Mapping[str, Array], energies: Mapping[str, Array], count: int) -> dict[str, float]:
    """Numbers of the first and the last cycle, and friction's share [%] in the loss of the first."""
    if not count:
        return {}
    found = cycles_of(curve, count)
    if len(found) < count:
        return dict.fromkeys(("cycle_work_mj", "cycle_loss_mj", "cycle_loss_share_pct"), float("nan"))
    first, last = found[0], found[-1]
    rubbed = np.interp([first.begin, first.end], energies["time_ms"], energies["friction_mj"])
    results = {
        "cycle_work_mj": first.work,
        "cycle_loss_mj": first.loss,
        "cycle_loss_share_pct": first.share,
        "cycle_friction_share_pct": 100.0 * float(rubbed[1] - rubbed[0]) / first.loss if first.loss else float("nan"),
        "cycle_residual_angle_deg": first.residual,
    }
    return results | ({"last_cycle_loss_share_pct": last.share} if count > 1 else {})


#: facts of the frame: its sides along weft and warp, from hinge to hinge
FRAME_SIDES = ("frame_weft_mm", "frame_warp_mm")
#: amplitude of the onset of wrinkles over the thickness
ONSET = 0.5
#: half the range of angles [deg] over which a force is averaged
NEAR = 0.5
#: a frame lags by at most this angle [deg] behind the curve
LAG = 0.1
#: shear angle at which wrinkles are mapped [deg]: the paper scans the sample there
MAPPED_ANGLE = 40.0


class PictureFrame(FabricTest[PictureFrameRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    lowers_speed = True

    def check_run(self, run: PictureFrameRun) -> None:
        """Raise :class:`InputError` for a square that shows no shear angle."""
        check_shows_shear(run, *_whole_pitches(run), "rig.side")

    def mount_shells(self, run: PictureFrameRun, specimen: int) -> PreparedSpecimen:
        """Make the square of shells, its diagonals along x and y."""
        check_law_range(run, run.rig.max_angle)
        side, size = run.rig.side_mm, run.model.macro.element_size_mm
        n = max(round(side / size), 2)
        u = np.linspace(-0.5 * side, 0.5 * side, n + 1)
        points = np.column_stack([np.tile(u, n + 1), np.repeat(u, n + 1), np.zeros((n + 1) ** 2)])
        corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
        cells = np.column_stack([corner, corner + 1, corner + n + 2, corner + n + 1])
        edge = np.abs(points[:, :2]).max(axis=1) > 0.4999 * side
        seed = run.variability.seed + specimen
        points[~edge, 2] = random_offsets(run.rig.imperfection_mm, seed, int((~edge).sum()))
        model = sheet_model(run, rotate_to_bias(points), cells, rotate_to_bias(np.array([[0.0, 1.0, 0.0]]))[0])
        test = PictureFrameTest(run, np.flatnonzero(edge), side**2)
        return PreparedSpecimen(model, test, facts=_facts(run, np.full(2, side)))

    def mount_yarns(self, run: PictureFrameRun, specimen: int, observer: Observer) -> PreparedSpecimen:
        """Make the square of whole pitches, its diagonals along x and y."""
        n_wales, n_courses = _whole_pitches(run)
        piece = cut_piece(run, n_wales, n_courses, specimen, observer)
        size = np.array([n_wales * run.fabric.wale_spacing, n_courses * run.fabric.course_spacing])
        paths = [replace(path, points=rotate_to_bias(path.points)) for path in centre_paths(piece.paths, size)]
        model = build_meso(run, paths, piece.draws, run.rig.membrane_share)
        position = model.position()
        beyond = np.abs(position[:, 1] - position[:, 0]) * sqrt(0.5) - 0.5 * size[1]
        held = needle_nodes(beyond, model.group.chain, run.fabric.course_spacing)
        facts = _facts(run, size)
        return PreparedSpecimen(model, PictureFrameTest(run, held, facts["area_mm2"]), yarns=piece.table, facts=facts)

    def make_row_check(self, run: PictureFrameRun, prepared: PreparedSpecimen) -> Callable[[Simulation], None]:
        """Check the energy ratios, without rigid motion, from the first angle of a result on."""
        rig, mass = prepared.rig, prepared.model.mass
        assert isinstance(rig, PictureFrameTest)

        def evaluated(state: Simulation, energies: dict[str, Array]) -> dict[str, Array]:
            return _own_energies(rig, energies, mass, state.frames[0].position)

        return make_row_check(run, prepared.restarts, "frame_shear_angle_deg", ANGLES[0] - NEAR, evaluated)

    def results(self, run: PictureFrameRun, prepared: PreparedSpecimen, history: History) -> dict[str, float]:
        """Forces at the angles, onset of wrinkles, wrinkles and shear of the material at 40 deg, cycles."""
        frames = first_loading(history)
        amplitudes = [measure_wrinkles(f, history, run.rig.side_mm).amplitude for f in frames]
        onset = _onset_angle([f.coordinate for f in frames], amplitudes, ONSET * run.fabric.thickness_mm)
        found = forces_at(history, run.rig.max_angle)
        if history.curve["frame_shear_angle_deg"].max() >= MAPPED_ANGLE:
            frame = frame_at(history, MAPPED_ANGLE)
            wrinkles = measure_wrinkles(frame, history, run.rig.side_mm)
            angles = angle_scatter(material_angles(run, history.mesh, frame)[0])
            found |= {
                "material_shear_angle_deg_at_40deg": angles.mean,
                "material_shear_angle_sd_deg_at_40deg": angles.sd,
                "wrinkle_amplitude_mm_at_40deg": wrinkles.amplitude,
                "wrinkle_count_at_40deg": float(wrinkles.count),
            }
        found |= cycle_results(history.curve, history.energies, run.rig.cycles)
        return found | {"wrinkle_onset_deg": onset}

    def assess(
        self, run: PictureFrameRun, prepared: PreparedSpecimen, history: History, cost: SimulationCost
    ) -> Quality:
        """Evaluate the standard checks without the kinetic energy of evenly sheared fabric, and whether it locks."""
        rig, energies = prepared.rig, history.energies
        assert isinstance(rig, PictureFrameTest)
        energies = _own_energies(rig, energies, prepared.model.mass, history.frames[0].position)
        history = replace(history, energies=energies)
        return super().assess(run, prepared, history, cost).with_warnings(*locking_warning(history, run.rig.max_angle))

    def span(self, history: History) -> Span:
        """Return the span from the first angle of a result on."""
        return Span.from_value(history, "frame_shear_angle_deg", ANGLES[0] - NEAR)


def _own_energies(rig: PictureFrameTest, energies: dict[str, Array], mass: Array, start: Array) -> dict[str, Array]:
    own = rig.carried(energies, mass, start)
    spent = energies["kinetic_mj"] / np.maximum(energies["kinetic_ratio"], 1e-30)
    kinetic = np.abs(energies["kinetic_mj"] - own)
    ratio = kinetic / np.maximum(spent, 1e-30)
    return energies | {"external_mj": energies["external_mj"] - own, "kinetic_mj": kinetic, "kinetic_ratio": ratio}


def _facts(run: PictureFrameRun, fabric: Array) -> dict[str, float]:
    frame = np.maximum(fabric, run.rig.frame_side_mm or 0.0)
    own = {"side_mm": run.rig.side_mm, "area_mm2": float(np.prod(fabric))}
    return own | dict(zip(FRAME_SIDES, frame.tolist(), strict=True))


def fabric_side(run: PictureFrameRun) -> float:
    """Side [mm] of a square of the fabric's area: of whole pitches in a meso model."""
    side = run.rig.side_mm
    if run.model.scale == "macro":
        return side
    n_wales, n_courses = _whole_pitches(run)
    return sqrt(n_wales * run.fabric.wale_spacing * n_courses * run.fabric.course_spacing)


#: largest difference of the motion of a time history from that of the run, over its largest displacement
OTHER_MOTION = 0.01


def frame_curve(run: PictureFrameRun, history: NodeHistory) -> dict[str, Array]:
    """Curve of the frame of ``run`` from its needles in ``history``, a run of its deck in another solver.

    The force is the work of all needles over the displacement of the crosshead. Raises :class:`InputError` for needles
    that move otherwise over time than those of ``run``.
    """
    side, found = fabric_side(run), reactions_of(history)
    rig = PictureFrameTest(run, np.zeros(0, np.int64), side**2)
    stretch = np.array([rig.stretches(t) for t in history.time])
    stretch *= 1.0 - np.interp(history.time, rig.close.time, rig.close.value)[:, None]
    expected = stretch[:, 0] - 1.0  # displacement along y over the place
    moved = history.displacement[:, np.argmax(np.abs(history.displacement[-1, :, 1])), 1]
    place = (moved @ expected) / (expected @ expected)
    if np.abs(moved - place * expected).max() > OTHER_MOTION * np.abs(moved).max():
        raise InputError("time history: its needles move otherwise than those of the run; export the deck with the "
                         "settings of the run (solver.speed, rig.max_angle, sizes)")  # fmt: skip
    angle = np.array([rig.angle(t) for t in history.time])
    travel = crosshead(angle, rig.side)
    pulled = np.diff(travel)
    at = pulled != 0.0
    middle = np.array([rig.angle(t) for t in found.time])
    force, middle = found.work[at] / pulled[at], middle[at]
    return {
        "time_ms": found.time[at],
        "displacement_mm": crosshead(middle, rig.side),
        "frame_shear_angle_deg": np.rad2deg(middle),
        "shear_force_n": force,
        NORMALISED: normalised_force(force, middle, side, rig.side),
    }


def _whole_pitches(run: PictureFrameRun) -> tuple[int, int]:
    return whole_repeats(run.fabric, "warp", run.rig.side_mm), whole_repeats(run.fabric, "weft", run.rig.side_mm)


def forces_at(history: History, most: float) -> dict[str, float]:
    """Force [N] and normalised force [N/mm] at each of :data:`ANGLES` up to ``most`` [deg], means over a degree."""
    angle = history.curve["frame_shear_angle_deg"]
    first = np.append(True, angle[1:] > np.maximum.accumulate(angle)[:-1])
    most = min(most, float(angle.max()))
    around = {a: first & (np.abs(angle - a) < NEAR) for a in ANGLES if a <= most}
    return {
        f"{name}_at_deg.{a:g}": float(history.curve[name][near].mean())
        for name in ("shear_force_n", NORMALISED)
        for a, near in around.items()
    }


def material_scatter(run: PictureFrameRun, history: History) -> list[tuple[float, AngleScatter]]:
    """Angle of the frame [deg] and scatter of the material's angle, in each frame of the first loading."""
    return [(f.coordinate, angle_scatter(material_angles(run, history.mesh, f)[0])) for f in first_loading(history)]


def first_loading(history: History) -> list[Frame]:
    """Frames in which the square is sheared further than before."""
    reached = np.maximum.accumulate(history.curve["frame_shear_angle_deg"])
    found: list[Frame] = []
    for frame in history.frames:
        most = float(np.interp(frame.time, history.curve["time_ms"], reached))
        if frame.coordinate > most - LAG and (not found or frame.coordinate > found[-1].coordinate):
            found.append(frame)
    return found


def frame_at(history: History, angle: float) -> Frame:
    """Frame nearest to a shear angle [deg] on first loading."""
    return min(first_loading(history), key=lambda f: abs(f.coordinate - angle))


def _onset_angle(angle: Sequence[float], value: Sequence[float], limit: float) -> float:
    """Angle at which ``value`` first passes ``limit``, on lines between the frames; nan if it never does."""
    k = next((k for k, v in enumerate(value) if v > limit), None)
    if not k:
        return float("nan") if k is None else angle[0]
    return float(np.interp(limit, value[k - 1 : k + 1], angle[k - 1 : k + 1]))
