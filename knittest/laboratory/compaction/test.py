"""Compaction test: two smooth plates close on a square of yarns until a pressure is reached."""

import time as clock
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import History, Quality
from knittest.laboratory.after_rest import after_rest
from knittest.laboratory.base import Prepared, Test
from knittest.laboratory.compaction.config import CompactionRun
from knittest.laboratory.compaction.van_wyk import PRESSURES, fit, thickness_at, work
from knittest.laboratory.judging import Span, assess
from knittest.laboratory.strips import cut, on_needles
from knittest.models.boundary import TOOL_STIFFNESS, Boundary, Readings
from knittest.models.meso import build_meso
from knittest.models.tool import Table, plate, ramp
from knittest.solve.simulate import simulate
from knittest.solve.state import SILENT, Observer, SimulationCost

Array = NDArray[np.float64]

# Compaction: two smooth plates close on a square of yarns, each at half the speed, until a pressure is reached.
#
# Both plates move, so that the fabric's middle stands still: its drag and its inertia press on both alike. The plates
# are smaller than the piece, as a presser foot is: loops at cut edges stick out and would carry the first pressure. The
# yarns' cut ends, and the loops' arcs beyond the edge, stay where they are in the plane.

#: thickness of the plates, and radius of their edges, outside their nominal size [mm]
THICKNESS, EDGE = 10.0, 1.0
#: distance between fabric and plates in which it comes to rest, and way of the plates on which they creep, at a share
#: of the speed, until they press [mm]
GAP, CREEP, CREEP_SHARE = 0.1, 0.3, 0.1
#: time in which the fabric comes to rest before the plates move [ms]
REST = 12.0
#: share of the thickness at the start by which the plates close at most
MOST = 0.5
#: stiffness of the plates against a node over m / dt^2 by which a node at the edge of stability would just be stable,
#: and largest factor on what tools have usually: 1 MPa shall not press the yarns into the plates
ROOM, STIFFEST = 3.6, 4.0


class CompactionTest:
    """Plates of ``size`` (2,) [mm] at heights ``faces`` (lower, upper) [mm] on the middle of a piece.

    ``radius`` [mm] is at which its nodes touch; those of the ``rim`` stay where they are in the plane.
    """

    coordinate, force = "compaction_mm", "plate_force_n"
    marks: tuple[float, ...] = ()
    mounted_at, averaged_from, locks = 0.0, np.inf, False

    def __init__(
        self, run: CompactionRun, faces: tuple[float, float], size: Array, radius: Array, rim: NDArray[np.int64]
    ) -> None:
        self.rim, self.size, area = rim, size, float(np.prod(size))
        self.faces, self.area, self.radius = (faces[0] - GAP, faces[1] + GAP), area, radius
        self.stiffness = plate_stiffness(run.solver.safety)
        self.start = self.faces[1] - self.faces[0]
        self.most = run.rig.max_pressure_mpa * area
        speed = run.solver.speed_mm_per_ms
        self.closing = _closing(speed, run.solver.ramp_ms)
        end = self.closing.time[-1]
        self.duration = end + (MOST * self.start - self.closing.integral(end)) / speed

    def constrain(self, boundary: Boundary) -> None:
        """Plates below and above the middle of the piece."""
        position = boundary.model.position()
        boundary.radius[:] = self.radius
        boundary.move(self.rim, ("x", "y"))
        speeds = self.closing.value
        for centre, side in zip(plate_centres(position, self.faces), (-1.0, 1.0), strict=True):
            tool = plate(centre, plate_lengths(self.size), EDGE)
            tool.stiffness = self.stiffness
            boundary.move_tool(
                boundary.add_tool(tool), "z", Table(self.closing.time, tuple(-0.5 * side * v for v in speeds))
            )

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs through the thickness."""
        return self.start / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Way of the plates, thickness between them, force (mean of both), and pressure on the square."""
        closed = self.closing.integral(time)
        lower, upper = readings.tool_force
        force = 0.5 * float(upper[2] - lower[2])
        return {
            "compaction_mm": closed,
            "thickness_mm": self.start - closed,
            "pressure_kpa": 1e3 * force / self.area,
            "plate_force_n": force,
            "lower_force_n": -float(lower[2]),
            "upper_force_n": float(upper[2]),
        }

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Over at the pressure."""
        return force >= self.most


def plate_lengths(size: Array) -> Array:
    """Lengths (3,) [mm] of a plate with its rounded edges, of a nominal ``size`` (2,) [mm]."""
    return np.append(size + 2.0 * EDGE, THICKNESS)


def plate_centres(position: Array, faces: tuple[float, float]) -> Array:
    """Centres (2, 3) [mm] of the plates with their ``faces`` (lower, upper) [mm] on the middle of a piece with nodes at
    ``position`` (n, 3).
    """
    centres = np.tile(0.5 * (position.min(axis=0) + position.max(axis=0)), (2, 1))
    centres[:, 2] = [faces[0] - 0.5 * THICKNESS, faces[1] + 0.5 * THICKNESS]
    return centres


def _closing(speed: float, ramp_time: float) -> Table:
    """Velocity [mm/ms] at which the plates close: at rest, creeping, at full speed, each after a smooth
    ramp.
    """
    slow, faster = ramp(ramp_time, CREEP_SHARE * speed), ramp(ramp_time, (1.0 - CREEP_SHARE) * speed)
    creeping = slow.time[-1] + max(CREEP / (CREEP_SHARE * speed) - ramp_time, 0.0)
    time = (0.0, *(REST + t for t in slow.time), *(REST + creeping + t for t in faster.time))
    return Table(time, (0.0, *slow.value, *(slow.value[-1] + v for v in faster.value)))


def plate_stiffness(safety: float) -> float:
    """Factor on the usual stiffness of a tool: what the time step at ``safety`` leaves room for.

    A node feels at most 4 safety^2 m / dt^2 of yarns and may feel 4 in all.
    """
    return min(max((ROOM - 4.0 * safety**2) / TOOL_STIFFNESS, 1.0), STIFFEST)


def touching_radius(position: Array, joined: NDArray[np.int64], radius: Array) -> Array:
    """Distance [mm] at which each node of ``position`` (n, 3) touches a plate: its yarn's ``radius`` (n,), less what
    the node lies off the centre line, which passes at (P[i-1] + 6 P[i] + P[i+1]) / 8 beside it.

    ``joined`` (n_el, 2) are the nodes of the beams. Ends of yarns lie on their centre line.
    """
    z = position[:, 2]
    step, both = np.zeros(len(z)), np.zeros(len(z))
    for here, there in (joined.T, joined.T[::-1]):
        np.add.at(step, here, z[there] - z[here])
        np.add.at(both, here, 1.0)
    off = np.where(both > 1.0, np.abs(step) / 8.0, 0.0)
    return np.asarray(np.maximum(radius - off, 0.5 * radius))


#: pitches of the piece around the plates
AROUND = 1
#: largest difference of the forces on both plates over their mean, where the thickness is read
UNEVEN_TOLERANCE = 5.0
#: largest share [%] of the way of the plates that they sink into the yarns
SUNK_TOLERANCE = 5.0


class Compaction(Test[CompactionRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    ends_at_failure = False

    def prepare(self, run: CompactionRun, specimen: int = 0, observer: Observer = SILENT) -> Prepared:
        """The piece between its plates, which begin a little off its faces."""
        start = clock.perf_counter()
        pitches = _pitches(run)
        pressed = _pressed(run)
        whole = (pressed + 2.0 * AROUND) * pitches
        n_wales, n_courses = (int(n) + 2 * AROUND for n in pressed)
        piece = cut(run, n_wales, n_courses, specimen, observer)
        paths = [replace(path, points=path.points - 0.5 * np.append(whole, 0.0)) for path in piece.paths]
        model = build_meso(run, paths, piece.draws, run.rig.membrane_share)
        position, size = model.position(), pressed * pitches
        radius = touching_radius(position, model.mesh.cells, model.group.radius)
        under = (np.abs(position[:, :2]) <= 0.5 * size).all(axis=1)
        z = position[:, 2]
        faces = float((z - radius)[under].min()), float((z + radius)[under].max())
        rim = on_needles(np.abs(position[:, 1]) - 0.5 * float(whole[1]), model.group.chain)
        mount = CompactionTest(run, faces, size, radius, rim)
        facts = {"area_mm2": float(np.prod(size)), "thickness_at_start_mm": faces[1] - faces[0]}
        facts |= {"lower_plate_mm": mount.faces[0], "upper_plate_mm": mount.faces[1]}
        return Prepared(model, mount, clock.perf_counter() - start, piece.table, facts)

    def solve(self, prepared: Prepared, run: CompactionRun, observer: Observer) -> tuple[History, SimulationCost]:
        """Let the square come to rest, then close the plates until the pressure is reached."""
        history, cost = simulate(prepared.model, prepared.rig, run.solver, run.output, observer)
        return self.finish(run, prepared, history), cost

    def finish(self, run: CompactionRun, prepared: Prepared, history: History) -> History:
        """Leave out what comes before the square is at rest."""
        return after_rest(history, REST)

    def results(self, run: CompactionRun, prepared: Prepared, history: History) -> dict[str, float]:
        """Thickness at the pressures up to the largest, work, and the fitted law."""
        curve = history.curve
        t, p = curve["thickness_mm"], curve["pressure_kpa"]
        found = {
            f"thickness_mm_at_kpa.{at:g}": thickness_at(t, p, at) for at in PRESSURES if at <= run.rig.max_pressure
        }
        law = fit(t, p)
        return found | {
            "compaction_work_j_per_m2": work(t, p),
            "compaction_exponent": law.exponent if law is not None and law.follows else float("nan"),
            "law_scatter_pct": float("nan") if law is None else 100.0 * law.scatter,
            "largest_pressure_kpa": float(p.max()),
            "plate_difference_pct": uneven(history, min(PRESSURES)),
            "plate_sunk_pct": sunk(history),
        }

    def assess(self, run: CompactionRun, prepared: Prepared, history: History, cost: SimulationCost) -> Quality:
        """The gates of every run, plates that press alike and hardly sink in, and the pressure, which is reached."""
        quality = assess(run, prepared, history, cost, self.span(history))
        found = self.results(run, prepared, history)
        if found["plate_difference_pct"] > UNEVEN_TOLERANCE:
            quality = quality.refusing(
                f"the plates press unlike by {found['plate_difference_pct']:.1f} % at {min(PRESSURES):g} kPa or more: "
                f"expected at most {UNEVEN_TOLERANCE:g} %; a lower solver.speed makes them alike"
            )
        if found["plate_sunk_pct"] > SUNK_TOLERANCE:
            quality = quality.refusing(f"the plates sink in by {found['plate_sunk_pct']:.1f} % of their way")
        if found["largest_pressure_kpa"] < run.rig.max_pressure:
            quality = quality.refusing(
                f"the plates closed by half the thickness at {found['largest_pressure_kpa']:.3g} kPa: "
                f"rig.max_pressure = {run.rig.max_pressure:g} kPa was not reached"
            )
        if not np.isfinite(found["compaction_exponent"]):
            quality = quality.warning(
                f"the pressure scatters by {found['law_scatter_pct']:.0f} % about p ~ 1/t^n - 1/t0^n: no exponent"
            )
        return quality

    def span(self, history: History) -> Span:
        """The whole way, from the first thickness that is read."""
        pressed = history.curve["pressure_kpa"] >= min(PRESSURES)
        times = history.curve["time_ms"]
        return Span(reported_from=float(times[np.argmax(pressed)]) if pressed.any() else np.inf)


def uneven(history: History, least: float) -> float:
    """Largest difference of the plates' forces over their mean [%] from the pressure ``least`` [kPa] on, as means over
    a fifth of a decade.
    """
    curve = history.curve
    pressed = curve["pressure_kpa"] >= least
    if not pressed.any():
        return float("nan")
    decade = np.floor(5.0 * np.log10(curve["pressure_kpa"][pressed] / least)).astype(int)
    lower, upper = (np.bincount(decade, curve[name][pressed]) for name in ("lower_force_n", "upper_force_n"))
    full = np.bincount(decade) > 0
    return float(200.0 * np.max(np.abs(upper - lower)[full] / (upper + lower)[full]))


def sunk(history: History) -> float:
    """Share [%] of the way of the plates that the deepest node has sunk into both of them."""
    deepest = 1e-3 * float(history.contacts["tool_penetration_max_um"].max())
    return 200.0 * deepest / max(float(history.curve["compaction_mm"][-1]), 1e-9)


def pressed_size(run: CompactionRun) -> np.ndarray:
    """Size (2,) [mm] of the square between the plates, in whole pitches."""
    return np.asarray(_pressed(run) * _pitches(run))


def _pressed(run: CompactionRun) -> np.ndarray:
    """Whole pitches (2,) along both sides of the square."""
    return np.asarray(np.maximum(np.round(run.rig.side_mm / _pitches(run)), 2.0))


def _pitches(run: CompactionRun) -> np.ndarray:
    return np.array([run.fabric.wale_spacing, run.fabric.course_spacing])
