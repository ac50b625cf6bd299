"""Compaction test: two smooth plates close on a square of yarns until a pressure is reached."""

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Array, History, Quality
from knittest.config.fabric import Fabric
from knittest.config.structure import DIRECTIONS
from knittest.laboratory.base import PreparedSpecimen
from knittest.laboratory.compaction.config import CompactionRun
from knittest.laboratory.compaction.van_wyk import PRESSURES, fit, thickness_at, work
from knittest.laboratory.fabric_test import FabricTest, TestRig
from knittest.laboratory.quality_checks import Span, check_limit
from knittest.laboratory.restart import history_from_time
from knittest.laboratory.strips import centre_paths, creep_speed, cut_piece, needle_nodes, whole_repeats
from knittest.models.boundary import TOOL_STIFFNESS, Boundary, Readings
from knittest.models.meso import build_meso
from knittest.models.tool import Table, plate, ramp
from knittest.solve.state import LOCKED, Observer, SimulationCost

# Two smooth plates close on a square of yarns, each at half the speed, until a pressure is reached. The fabric's middle
# stands still: its drag and inertia press on both plates alike. The plates are smaller than the piece, as a presser
# foot is, because loops at cut edges would carry the first pressure. The yarns' cut ends and the loops' arcs beyond the
# edge keep their place in the plane.

#: thickness of the plates, and radius of their edges, outside their nominal size [mm]
THICKNESS, EDGE = 10.0, 1.0
#: distance between fabric and plates at first, and travel of the plates at a share of the speed until they press [mm]
GAP, CREEP, CREEP_SHARE = 0.1, 0.3, 0.1
#: time of rest before the plates move [ms]. The plates close at most by a share of the thickness, or to a share of the
#: yarns piled up, whichever is more: ribs are thicker than their yarns
REST, MOST, PILED_SHARE = 12.0, 0.5, 0.6
#: thickness over that of the yarns piled up from which on the plates close at a share of the speed where loops carry a
#: direction alone: such a fabric has hardly any force until its yarns are piled up, and hits them
PILING, PILING_SHARE = 1.1, 0.1
#: stiffness of the plates against a node over m / dt^2 at the edge of stability, and largest factor on the usual one:
#: 1 MPa must not press the yarns into the plates
ROOM, STIFFEST = 3.6, 4.0


class CompactionTest(TestRig):
    """Plates of ``size`` (2,) at heights ``faces`` [mm]; contact ``radius`` [mm] of nodes; ``rim`` keeps its place."""

    coordinate, force = "compaction_mm", "plate_force_n"

    def __init__(
        self, run: CompactionRun, faces: tuple[float, float], size: Array, radius: Array, rim: NDArray[np.int64]
    ) -> None:
        self.rim, self.size, area = rim, size, float(np.prod(size))
        self.locks = not run.fabric.has_inlays_both_ways
        self.faces, self.area, self.radius = (faces[0] - GAP, faces[1] + GAP), area, radius
        self.stiffness = plate_stiffness(run.solver.safety)
        self.start = self.faces[1] - self.faces[0]
        self.ring_length = self.start
        self.most = run.rig.max_pressure_mpa * area
        speed, rise = run.solver.speed_mm_per_ms, run.solver.ramp_ms
        # a ramp takes 1e-9 ms at least
        full = REST + (max(rise, 1e-9) + max(CREEP / (CREEP_SHARE * speed) - rise, 0.0))
        self.closing = creep_speed(speed, CREEP_SHARE, rise, REST, full)
        if self.locks:
            self.closing = slowed(self.closing, self.start - PILING * piled_height(run.fabric), rise)
            speed *= PILING_SHARE
        end = self.closing.time[-1]
        self.duration = end + (largest_closing(run.fabric, self.start) - self.closing.integral(end)) / speed

    def constrain(self, boundary: Boundary) -> None:
        """Plates below and above the middle of the piece."""
        position = boundary.model.position()
        boundary.radius[:] = self.radius
        boundary.move(self.rim, ("x", "y"))
        centres, lengths = plates(position, self.faces, self.size)
        for centre, side in zip(centres, (-1.0, 1.0), strict=True):
            tool = plate(centre, lengths, EDGE)
            tool.stiffness = self.stiffness
            speed = Table(self.closing.time, tuple(-0.5 * side * v for v in self.closing.value))
            boundary.move_tool(boundary.add_tool(tool), "z", speed)

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Travel of the plates, thickness between them, force (mean of both), and pressure on the square."""
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

    def is_finished(self, force: float, peak: float, broken: bool) -> bool:
        """End at the pressure."""
        return force >= self.most


def largest_closing(fabric: Fabric, start: float) -> float:
    """Largest travel of the plates [mm] towards each other from their distance at the ``start`` [mm]."""
    return max(MOST * start, start - PILED_SHARE * piled_height(fabric))


def piled_height(fabric: Fabric) -> float:
    """Height [mm] of the layers of inlays between two loops."""
    return sum(one.section_mm[1] for one in fabric.inlays) + 2.0 * fabric.knitting.beam_diameter_mm


def slowed(closing: Table, travel: float, rise: float) -> Table:
    """``closing`` that falls to :data:`PILING_SHARE` of its last speed, within ``rise`` [ms] from ``travel`` [mm] on.

    Where it is not at its last speed there, it has the lower one throughout.
    """
    end, speed = closing.time[-1], closing.value[-1]
    begin = end + (travel - closing.integral(end)) / speed
    if begin < end:
        return creep_speed(PILING_SHARE * speed, 1.0, rise, REST, REST + rise)
    fall = ramp(rise, (1.0 - PILING_SHARE) * speed)
    time = (*closing.time, *(begin + t for t in fall.time))
    return Table(time, (*closing.value, *(speed - v for v in fall.value)))


def plates(position: Array, faces: tuple[float, float], size: Array) -> tuple[Array, Array]:
    """Centres (2, 3) and lengths (3,) [mm] of plates of ``size`` with ``faces`` on the middle of nodes (n, 3)."""
    centres = np.tile(0.5 * (position.min(axis=0) + position.max(axis=0)), (2, 1))
    centres[:, 2] = [faces[0] - 0.5 * THICKNESS, faces[1] + 0.5 * THICKNESS]
    return centres, np.append(size + 2.0 * EDGE, THICKNESS)


def whole_pitches(run: CompactionRun) -> tuple[Array, Array]:
    """Whole pitches and size [mm] of the square between the plates, (2,) each: along the weft and along the warp."""
    pitches = np.array([run.fabric.wale_spacing, run.fabric.course_spacing])
    pressed = np.array([whole_repeats(run.fabric, direction, run.rig.side_mm) for direction in DIRECTIONS], float)
    return pressed, pressed * pitches


def plate_stiffness(safety: float) -> float:
    """Factor on the usual stiffness of a tool at ``safety``: yarns take 4 safety^2 m / dt^2 of the 4 of a node."""
    return min(max((ROOM - 4.0 * safety**2) / TOOL_STIFFNESS, 1.0), STIFFEST)


def plate_contact_radius(position: Array, joined: NDArray[np.int64], radius: Array) -> Array:
    """Distance [mm] at which nodes (n, 3) touch a plate: ``radius`` (n,) less their offset from the centre line."""
    z = position[:, 2]
    step, both = np.zeros(len(z)), np.zeros(len(z))
    for here, there in (joined.T, joined.T[::-1]):
        np.add.at(step, here, z[there] - z[here])
        np.add.at(both, here, 1.0)
    off = np.where(both > 1.0, np.abs(step) / 8.0, 0.0)
    return np.asarray(np.maximum(radius - off, 0.5 * radius))


#: pitches of the piece around the plates
BORDER_PITCHES = 1
#: largest difference of the plates' forces over their mean, and largest penetration over their travel [%]
UNEVEN_TOLERANCE, SUNK_TOLERANCE = 5.0, 5.0


class Compaction(FabricTest[CompactionRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    lowers_speed = True

    def mount_yarns(self, run: CompactionRun, specimen: int, observer: Observer) -> PreparedSpecimen:
        """Make the piece of whole pitches, with the plates a little off its faces."""
        pressed, size = whole_pitches(run)
        whole = (pressed + 2.0 * BORDER_PITCHES) * np.array([run.fabric.wale_spacing, run.fabric.course_spacing])
        n_wales, n_courses = (int(n) + 2 * BORDER_PITCHES for n in pressed)
        piece = cut_piece(run, n_wales, n_courses, specimen, observer)
        model = build_meso(run, centre_paths(piece.paths, whole), piece.draws, run.rig.membrane_share)
        position = model.position()
        radius = plate_contact_radius(position, model.mesh.cells, model.group.radius)
        under = (np.abs(position[:, :2]) <= 0.5 * size).all(axis=1)
        z = position[:, 2]
        faces = float((z - radius)[under].min()), float((z + radius)[under].max())
        rim = needle_nodes(np.abs(position[:, 1]) - 0.5 * float(whole[1]), model.group.chain, run.fabric.course_spacing)
        mount = CompactionTest(run, faces, size, radius, rim)
        facts = {
            "area_mm2": float(np.prod(size)), "thickness_at_start_mm": faces[1] - faces[0],
            "lower_plate_mm": mount.faces[0], "upper_plate_mm": mount.faces[1],
        }  # fmt: skip
        return PreparedSpecimen(model, mount, yarns=piece.table, facts=facts)

    def finish(self, run: CompactionRun, prepared: PreparedSpecimen, history: History) -> History:
        """Return the closing alone, after the square has come to rest."""
        return history_from_time(history, REST)

    def results(self, run: CompactionRun, prepared: PreparedSpecimen, history: History) -> dict[str, float]:
        """Thickness at the pressures up to the largest, work, and the fitted law."""
        curve = history.curve
        t, p = curve["thickness_mm"], curve["pressure_kpa"]
        law, reached = fit(t, p), [at for at in PRESSURES if at <= min(run.rig.max_pressure, float(p.max()))]
        return {
            **{f"thickness_mm_at_kpa.{at:g}": thickness_at(t, p, at) for at in reached},
            "compaction_work_j_per_m2": work(t, p),
            "compaction_exponent": law.exponent if law is not None and law.follows else float("nan"),
            "law_scatter_pct": float("nan") if law is None else 100.0 * law.scatter,
            "largest_pressure_kpa": float(p.max()),
            "plate_difference_pct": plate_force_difference(history, min(PRESSURES)),
            "plate_sunk_pct": plate_penetration(history),
        }

    def assess(self, run: CompactionRun, prepared: PreparedSpecimen, history: History, cost: SimulationCost) -> Quality:
        """Evaluate the standard checks, those of the plates, and whether the pressure is reached."""
        quality = super().assess(run, prepared, history, cost)
        found = self.results(run, prepared, history)
        apart, depth = found["plate_difference_pct"], found["plate_sunk_pct"]
        text = f"the forces of the plates differ by {apart:.1f} % from {min(PRESSURES):g} kPa on"
        if quality.quasi_static:  # else a lower speed mends both
            quality = check_limit(quality, apart, UNEVEN_TOLERANCE, text, ": lower solver.speed")
        quality = check_limit(quality, depth, SUNK_TOLERANCE, f"plate penetration is {depth:.1f} % of the travel")
        if prepared.rig.locks and history.curve["time_ms"][-1] < prepared.duration:
            quality = quality.with_warnings(*pressure_locking_warning(run, found["largest_pressure_kpa"]))
        elif found["largest_pressure_kpa"] < run.rig.max_pressure:
            quality = quality.with_failed_check(
                f"the plates closed to {history.curve['thickness_mm'][-1]:.3g} mm at "
                f"{found['largest_pressure_kpa']:.3g} kPa, before rig.max_pressure = {run.rig.max_pressure:g} kPa: "
                "lower rig.max_pressure"
            )
        if not np.isfinite(found["compaction_exponent"]):
            quality = quality.with_warnings(
                f"no exponent of compaction: the pressure scatters by {found['law_scatter_pct']:.0f} % about "
                "p ~ 1/t^n - 1/t0^n"
            )
        return quality

    def span(self, history: History) -> Span:
        """Return the span from the first pressure of a result on."""
        return Span.from_value(history, "pressure_kpa", min(PRESSURES))


def pressure_locking_warning(run: CompactionRun, reached: float) -> tuple[str, ...]:
    """Say at which pressure [kPa] the test ended because its yarns locked; empty where it is the last one."""
    if reached >= run.rig.max_pressure:
        return ()
    return (
        f"the fabric locks at {reached:.3g} kPa: contacts of the yarns store {100.0 * LOCKED:g} % of the work. The "
        f"test ends there, before rig.max_pressure = {run.rig.max_pressure:g} kPa",
    )


def plate_force_difference(history: History, least: float) -> float:
    """Largest difference of the plates' forces over their mean [%] from ``least`` [kPa] on, by 0.2 decades."""
    curve = history.curve
    pressed = curve["pressure_kpa"] >= least
    if not pressed.any():
        return float("nan")
    decade = np.floor(5.0 * np.log10(curve["pressure_kpa"][pressed] / least)).astype(int)
    lower, upper = (np.bincount(decade, curve[name][pressed]) for name in ("lower_force_n", "upper_force_n"))
    full = np.bincount(decade) > 0
    return float(200.0 * np.max(np.abs(upper - lower)[full] / (upper + lower)[full]))


def plate_penetration(history: History) -> float:
    """Deepest penetration of both plates over their travel [%]."""
    deepest = 1e-3 * float(history.contacts["tool_penetration_max_um"].max())
    return 200.0 * deepest / max(float(history.curve["compaction_mm"][-1]), 1e-9)
