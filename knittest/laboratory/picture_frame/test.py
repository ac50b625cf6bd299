"""Picture frame: a square of fabric on needles along four hinged sides, its wrinkles and its cycles."""

import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import LinearNDInterpolator

from knittest.base.history import Frame, History, Mesh, Quality
from knittest.fabric.strip import turned
from knittest.laboratory.after_rest import row_check
from knittest.laboratory.base import Prepared, Test, fabric_laminate
from knittest.laboratory.judging import Span, assess, locking
from knittest.laboratory.law_end import refuse_beyond_law
from knittest.laboratory.picture_frame.config import PictureFrameRun
from knittest.laboratory.picture_frame.rig import ANGLES, PictureFrameTest
from knittest.laboratory.strips import AngleScatter, angle_scatter, crossing_angles, cut, on_needles, shell_angles
from knittest.materials.trellis import NORMALISED
from knittest.models.macro import build_sheet, self_contact
from knittest.models.meso import build_meso
from knittest.solve.simulate import simulate
from knittest.solve.state import SILENT, Observer, Simulation, SimulationCost

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: cells of the height map along a side
CELLS = 100
#: share of the side left out at every edge, where the needles hold the fabric
MARGIN = 0.05
#: share of the amplitude that a crest must rise above the trough before it to count
PROMINENCE = 0.5


@dataclass(frozen=True)
class Wrinkles:
    """Height map [mm] over x, y [mm] of a frame; ``amplitude`` is half its range [mm], ``count`` its crests along the
    diagonal that is compressed.
    """

    x: Array
    y: Array
    height: Array
    amplitude: float
    count: int


def measure_wrinkles(frame: Frame, history: History, side: float) -> Wrinkles:
    """Wrinkles of ``frame``; of yarns the mean over both reinforcing systems, which form the mid-surface."""
    start, points, values = _surface(frame, history)
    inside = np.abs(_square(start)).max(axis=1) < (0.5 - MARGIN) * side
    height = LinearNDInterpolator(points[:, :2], values)
    span = np.abs(points[inside, :2]).max(axis=0)
    x, y = np.meshgrid(np.linspace(-span[0], span[0], CELLS), np.linspace(-span[1], span[1], CELLS))
    mapped = height(x, y)
    # only what lies in the sheared square, less its margin
    shape = (np.abs(x) / max(span[0], 1e-9) + np.abs(y) / max(span[1], 1e-9)) <= 1.0
    mapped = np.where(shape, mapped, np.nan)
    amplitude = 0.5 * float(np.nanmax(mapped) - np.nanmin(mapped))
    profile = height(np.linspace(-span[0], span[0], 4 * CELLS), np.zeros(4 * CELLS))
    return Wrinkles(x, y, mapped, amplitude, _crests(profile[np.isfinite(profile)], amplitude))


def _surface(frame: Frame, history: History) -> tuple[Array, Array, Array]:
    """Start and present positions of the points of the mid-surface, and their height."""
    mesh, first = history.mesh, history.frames[0].position
    if mesh.kind == "shells":
        return first, frame.position, frame.position[:, 2] - 0.0
    names = list(mesh.part_names)
    nodes = np.unique(mesh.cells[np.isin(mesh.part, [names.index("warp"), names.index("weft")])])
    rise = frame.position[nodes, 2] - first[nodes, 2]
    return first[nodes], frame.position[nodes], rise


def _square(points: Array) -> Array:
    """Coordinates along the sides of the square whose diagonals lie along x and y."""
    return np.column_stack([points[:, 0] + points[:, 1], points[:, 1] - points[:, 0]]) / np.sqrt(2.0)


def _crests(profile: Array, amplitude: float) -> int:
    """Crests of a height profile that stand out by a share of the amplitude."""
    from scipy.signal import find_peaks

    if not amplitude > 0.0:
        return 0
    return len(
        find_peaks(np.concatenate([[profile.min()], profile, [profile.min()]]), prominence=PROMINENCE * amplitude)[0]
    )


# Cycles of a picture frame: work of loading, what a cycle takes, and what is left where the force is gone.
#
# Of shells whose shear law S = s gamma has a share f of friction behind a spring as stiff as the law, a first cycle to
# gamma takes f s gamma^2 (1 - f) / (1 + f) per area, 2 f (1 - f) / (1 + f) of the work of loading.


@dataclass(frozen=True)
class Cycle:
    """Work of loading and loss (area of the loop) [mJ], share of the loss in the work [%], angle on the way back at
    which the force is gone [deg], nan where it stays, and time of its start and end [ms].
    """

    work: float
    loss: float
    share: float
    residual: float
    begin: float
    end: float


def cycles_of(curve: Mapping[str, Array], count: int) -> list[Cycle]:
    """The ``count`` cycles of ``curve``, each from a smallest angle to the next; those that were not finished are not
    there.
    """
    angle, force, way = (curve[name] for name in ("frame_shear_angle_deg", "shear_force_n", "displacement_mm"))
    if not len(angle) or not count:
        return []
    half = 0.5 * float(angle.max())
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
        time = curve["time_ms"]
        share = 100.0 * loss / work if work > 0.0 else float("nan")
        found.append(Cycle(work, loss, share, residual, float(time[start]), float(time[end])))
    return found


def cycle_results(curve: Mapping[str, Array], energies: Mapping[str, Array], count: int) -> dict[str, float]:
    """Numbers of the first and, where there are more, of the last cycle; friction's share [%] in the loss of the first,
    by the energies.
    """
    if not count:
        return {}
    found = cycles_of(curve, count)
    if len(found) < count:
        return {"cycle_work_mj": float("nan"), "cycle_loss_mj": float("nan"), "cycle_loss_share_pct": float("nan")}
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
#: wrinkles begin where their amplitude passes this share of the thickness
ONSET = 0.5
#: half the range of angles [deg] over which a force is averaged
NEAR = 0.5
#: a frame lags by at most this angle [deg] behind the curve
LAG = 0.1
#: shear angle at which wrinkles are mapped [deg]: the paper scans the sample there
MAPPED = 40.0


class PictureFrame(Test[PictureFrameRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    ends_at_failure = False
    lowers_speed = True

    def prepare(self, run: PictureFrameRun, specimen: int = 0, observer: Observer = SILENT) -> Prepared:
        """The square, its diagonals along x and y."""
        meso = run.model.scale == "meso"
        return self._yarns(run, specimen, observer) if meso else self._shells(run, specimen)

    def _shells(self, run: PictureFrameRun, specimen: int) -> Prepared:
        refuse_beyond_law(run, run.rig.max_angle)
        side, size = run.rig.side_mm, run.model.macro.element_size_mm
        n = max(round(side / size), 2)
        u = np.linspace(-0.5 * side, 0.5 * side, n + 1)
        points = np.column_stack([np.tile(u, n + 1), np.repeat(u, n + 1), np.zeros((n + 1) ** 2)])
        corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
        cells = np.column_stack([corner, corner + 1, corner + n + 2, corner + n + 1])
        edge = np.abs(points[:, :2]).max(axis=1) > 0.4999 * side
        rng = np.random.default_rng(run.variability.seed + specimen)
        height = run.rig.imperfection_mm
        points[~edge, 2] = rng.uniform(-height, height, int((~edge).sum()))
        fabric = run.fabric
        warp = turned(np.array([[0.0, 1.0, 0.0]]))[0]
        model = build_sheet(
            turned(points), cells, fabric_laminate(run), fabric.area_mass_g_per_mm2, fabric.thickness_mm, warp,
            contact=self_contact(fabric, run.model.macro, run.solver.safety),
        )  # fmt: skip
        test = PictureFrameTest(run, np.flatnonzero(edge), side**2)
        return Prepared(model, test, facts=_facts(run, np.full(2, side)))

    def _yarns(self, run: PictureFrameRun, specimen: int, observer: Observer) -> Prepared:
        start = clock.perf_counter()
        fabric = run.fabric
        n_wales, n_courses = _whole_pitches(run)
        piece = cut(run, n_wales, n_courses, specimen, observer)
        size = np.array([n_wales * fabric.wale_spacing, n_courses * fabric.course_spacing, 0.0])
        paths = [replace(p, points=turned(p.points - 0.5 * size)) for p in piece.paths]
        model = build_meso(run, paths, piece.draws, run.rig.membrane_share)
        position = model.position()
        beyond = np.abs(position[:, 1] - position[:, 0]) * sqrt(0.5) - 0.5 * size[1]
        held = on_needles(beyond, model.group.chain)
        facts = _facts(run, size[:2])
        test = PictureFrameTest(run, held, facts["area_mm2"])
        return Prepared(model, test, clock.perf_counter() - start, piece.table, facts)

    def solve(self, prepared: Prepared, run: PictureFrameRun, observer: Observer) -> tuple[History, SimulationCost]:
        """Shear to the largest angle; raises :class:`TooFastError` by ``prepared.restarts``."""
        rig, mass = prepared.rig, prepared.model.mass
        assert isinstance(rig, PictureFrameTest)

        def judged(state: Simulation, energies: dict[str, Array]) -> dict[str, Array]:
            return _without_rigid_motion(rig, energies, mass, state.frames[0].position)

        check = row_check(run, prepared.restarts, "frame_shear_angle_deg", ANGLES[0] - NEAR, judged)
        return simulate(prepared.model, rig, run.solver, run.output, observer, check)

    def results(self, run: PictureFrameRun, prepared: Prepared, history: History) -> dict[str, float]:
        """Force at the angles; where wrinkles begin, and what the fabric looks like at 40 deg if it gets there."""
        frames = first_loading(history)
        amplitudes = [measure_wrinkles(f, history, run.rig.side_mm).amplitude for f in frames]
        onset = _reached([f.coordinate for f in frames], amplitudes, ONSET * run.fabric.thickness_mm)
        found = forces_at(history, run.rig.max_angle)
        if history.curve["frame_shear_angle_deg"].max() >= MAPPED:
            found |= _mapped(history, run.rig.side_mm)
        found |= cycle_results(history.curve, history.energies, run.rig.cycles)
        return found | {"wrinkle_onset_deg": onset}

    def assess(self, run: PictureFrameRun, prepared: Prepared, history: History, cost: SimulationCost) -> Quality:
        """Standard gates; the kinetic energy of evenly sheared fabric, whose inertia does no work, does not count."""
        rig, energies = prepared.rig, history.energies
        assert isinstance(rig, PictureFrameTest)
        energies = _without_rigid_motion(rig, energies, prepared.model.mass, history.frames[0].position)
        history = replace(history, energies=energies)
        quality = assess(run, prepared, history, cost, self.span(history))
        return quality.warning(*locking(history, run.rig.max_angle))

    def span(self, history: History) -> Span:
        """The whole way, from the first angle at which a force is read."""
        first = history.curve["frame_shear_angle_deg"] >= ANGLES[0] - NEAR
        times = history.curve["time_ms"]
        return Span(reported_from=float(times[np.argmax(first)]) if first.any() else np.inf)


def _without_rigid_motion(
    rig: PictureFrameTest, energies: dict[str, Array], mass: Array, start: Array
) -> dict[str, Array]:
    """``energies`` without the kinetic energy of evenly sheared fabric, whose inertia does no work."""
    own = rig.carried(energies, mass, start)
    spent = energies["kinetic_mj"] / np.maximum(energies["kinetic_ratio"], 1e-30)
    ratio = np.abs(energies["kinetic_mj"] - own) / np.maximum(spent, 1e-30)
    return energies | {"external_mj": energies["external_mj"] - own, "kinetic_ratio": ratio}


def _facts(run: PictureFrameRun, fabric: Array) -> dict[str, float]:
    """Side and area of ``fabric`` (along weft, along warp) [mm], and sides of the frame around it: that of one without
    a side of its own is the fabric's, which of yarns comes in whole pitches.
    """
    frame = np.maximum(fabric, run.rig.frame_side_mm or 0.0)
    own = {"side_mm": run.rig.side_mm, "area_mm2": float(np.prod(fabric))}
    return own | dict(zip(FRAME_SIDES, frame.tolist(), strict=True))


def fabric_side(run: PictureFrameRun) -> float:
    """Side [mm] of a square of the fabric's area, which of yarns comes in whole pitches."""
    side = run.rig.side_mm
    if run.model.scale == "macro":
        return side
    n_wales, n_courses = _whole_pitches(run)
    return sqrt(n_wales * run.fabric.wale_spacing * n_courses * run.fabric.course_spacing)


def _whole_pitches(run: PictureFrameRun) -> tuple[int, int]:
    """Wales and courses of the square of yarns."""
    side = run.rig.side_mm
    return max(round(side / run.fabric.wale_spacing), 2), max(round(side / run.fabric.course_spacing), 2)


def forces_at(history: History, most: float) -> dict[str, float]:
    """Force [N] and normalised force [N/mm] at each of :data:`ANGLES` up to ``most`` [deg] on first loading, means over
    half a degree about it.
    """
    angle = history.curve["frame_shear_angle_deg"]
    first = np.append(True, angle[1:] > np.maximum.accumulate(angle)[:-1])
    most = min(most, float(angle.max()))
    around = {a: first & (np.abs(angle - a) < NEAR) for a in ANGLES if a <= most}
    return {
        f"{name}_at_deg.{a:g}": float(history.curve[name][near].mean())
        for name in ("shear_force_n", NORMALISED)
        for a, near in around.items()
    }


def material_scatter(history: History) -> list[tuple[float, AngleScatter]]:
    """Angle of the frame [deg] and scatter of the material's, by shells or crossings, at each frame of the first
    loading.
    """
    return [(f.coordinate, angle_scatter(material_angles(history.mesh, f))) for f in first_loading(history)]


def material_angles(mesh: Mesh, frame: Frame) -> Array:
    """Shear angle [rad] of each shell or crossing, (n,)."""
    return shell_angles(frame) if mesh.kind == "shells" else crossing_angles(mesh, frame)[0]


def _mapped(history: History, side: float) -> dict[str, float]:
    """Wrinkles, and mean and sd of the material's shear angle, at 40 deg of the frame."""
    frame = frame_at(history, MAPPED)
    wrinkles, scatter = measure_wrinkles(frame, history, side), angle_scatter(material_angles(history.mesh, frame))
    return {
        "material_shear_angle_deg_at_40deg": scatter.mean,
        "material_shear_angle_sd_deg_at_40deg": scatter.sd,
        "wrinkle_amplitude_mm_at_40deg": wrinkles.amplitude,
        "wrinkle_count_at_40deg": float(wrinkles.count),
    }


def first_loading(history: History) -> list[Frame]:
    """The frames in which the square is sheared further than ever before."""
    reached = np.maximum.accumulate(history.curve["frame_shear_angle_deg"])
    found: list[Frame] = []
    for frame in history.frames:
        most = float(np.interp(frame.time, history.curve["time_ms"], reached))
        if frame.coordinate > most - LAG and (not found or frame.coordinate > found[-1].coordinate):
            found.append(frame)
    return found


def frame_at(history: History, angle: float) -> Frame:
    """The frame nearest to a shear angle [deg] on first loading."""
    return min(first_loading(history), key=lambda f: abs(f.coordinate - angle))


def _reached(angle: Sequence[float], value: Sequence[float], limit: float) -> float:
    """Angle at which ``value`` first passes ``limit``, on lines between the frames; nan if it never does."""
    k = next((k for k, v in enumerate(value) if v > limit), None)
    if k is None or k == 0:
        return float("nan") if k is None else angle[0]
    return float(np.interp(limit, value[k - 1 : k + 1], angle[k - 1 : k + 1]))
