"""Biaxial test: a square of fabric is pulled along warp and weft at once, at a constant ratio of the strains."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Array, History, Quality
from knittest.config.fabric import Direction
from knittest.config.structure import DIRECTIONS
from knittest.laboratory.base import PreparedSpecimen, sheet_model
from knittest.laboratory.biaxial.config import BiaxialRun
from knittest.laboratory.fabric_test import FabricTest, TestRig
from knittest.laboratory.quality_checks import Span, locking_warning
from knittest.laboratory.restart import make_row_check
from knittest.laboratory.strips import AXIS, centre_paths, cut_piece, needle_nodes, random_offsets, whole_repeats
from knittest.models.boundary import ALL, Boundary, Readings
from knittest.models.macro import rectangle, strengths
from knittest.models.meso import build_meso
from knittest.models.tool import ramp
from knittest.solve.state import Observer, Simulation, SimulationCost

# Sides that move apart both ways at a constant ratio of the strains. The needles slide along the sides, so every held
# point moves as in evenly strained fabric: x (1 + e_x), y (1 + e_y). Their work along one axis is the force per width
# times the area, N L_x L_y de.


#: energy of contacts over work from which on loops are taut: soon afterwards they slip off their cut ends at needles.
#: Jersey, garter and rib get there at 15.4 to 17 % strain and 0.26 to 0.3 N/mm; jersey slips at 16.5 % and 0.43 N/mm
TAUT_SHARE = 0.03


class BiaxialTest(TestRig):
    """Strain the points ``held`` along ``axis`` (0: x, 1: y) and across it; ``size`` (2,) [mm] of the rectangle."""

    coordinate, force = "strain_pct", "force_n"

    def __init__(self, run: BiaxialRun, held: NDArray[np.int64], axis: int, size: Array) -> None:
        rig, most = run.rig, max(1.0, run.rig.ratio)
        self.held, self.axis, self.size, self.ratio = held, axis, size, rig.ratio
        self.ring_length = float(self.size.max())
        self.stop_ratio = rig.stop_force_ratio
        self.locks, self.locked_share = run.pulls_loops, TAUT_SHARE
        fails = run.fabric.macro.deletion_strain  # shells may fail across the direction first
        self.ends_at_break = run.model.scale == "macro" and (
            rig.ratio * fails(rig.direction) > fails(cross_direction(rig.direction))
        )
        rate = run.solver.speed_mm_per_ms / float(size[axis])  # of the system that is strained more
        self.strain, self.cross = (ramp(run.solver.ramp_ms, share * rate / most) for share in (1.0, rig.ratio))
        self.duration = 0.5 * run.solver.ramp_ms + rig.max_strain_fraction / rate

    def constrain(self, boundary: Boundary) -> None:
        """Move the needles with their sides; the yarns may turn on them."""
        position = boundary.model.position()[self.held]
        for axis, strain in ((self.axis, self.strain), (1 - self.axis, self.cross)):
            boundary.move(self.held, ALL[axis], strain, position[:, axis])
        boundary.move(self.held, "z")

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Strain and force of the direction, [N] and per width, and of the other system."""
        strain, area = self.strain.integral(time), float(np.prod(self.size))
        own, other = (float(r) / area for r in readings.reaction[:2])
        return {
            "strain_pct": 100.0 * strain,
            "cross_strain_pct": 100.0 * self.ratio * strain,
            "force_n": own * float(self.size[1 - self.axis]),
            "force_n_per_mm": own,
            "cross_force_n_per_mm": other,
        }

    def is_finished(self, force: float, peak: float, broken: bool) -> bool:
        """End after a failure, when the force has fallen to a share of its peak or the shells failed across it."""
        return broken and (self.ends_at_break or force < self.stop_ratio * peak)


def cross_direction(direction: Direction) -> Direction:
    """The other yarn system."""
    return "weft" if direction == "warp" else "warp"


#: facts of the square: its sides along x and y
SIDES = ("weft_side_mm", "warp_side_mm")
#: share of the strain from which on a run restarts at a lower speed
CHECKED_FROM = 0.25
#: share of the yarns' length at each end without their weakest place: needles hold them there
AT_NEEDLES = 0.1


class Biaxial(FabricTest[BiaxialRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    lowers_speed = True
    ends_at_failure = True

    def mount_shells(self, run: BiaxialRun, specimen: int) -> PreparedSpecimen:
        """Make the square of shells about the origin, warp along y."""
        side, macro = run.rig.side_mm, run.model.macro
        seed = run.variability.seed + specimen
        rows = np.linspace(-0.5 * side, 0.5 * side, max(round(side / macro.element_size_mm), 1) + 1)
        points, cells = rectangle(rows, side, macro.element_size_mm)
        edge = np.abs(points[:, :2]).max(axis=1) > 0.5 * side * (1.0 - 1e-9)
        points[~edge, 2] = random_offsets(macro.imperfection_mm, seed, int((~edge).sum()))
        model = sheet_model(run, points, cells, strength=strengths(points, cells, 0.5 * side, seed))
        size = np.full(2, side)
        rig = BiaxialTest(run, np.flatnonzero(edge), AXIS[run.rig.direction], size)
        return PreparedSpecimen(model, rig, facts=_facts(size))

    def mount_yarns(self, run: BiaxialRun, specimen: int, observer: Observer) -> PreparedSpecimen:
        """Make the square of whole pitches."""
        pitches = np.array([run.fabric.wale_spacing, run.fabric.course_spacing])
        n_wales, n_courses = (whole_repeats(run.fabric, direction, run.rig.side_mm) for direction in DIRECTIONS)
        piece = cut_piece(run, n_wales, n_courses, specimen, observer, (run.rig.direction, AT_NEEDLES))
        size = np.array([n_wales, n_courses]) * pitches
        model = build_meso(run, centre_paths(piece.paths, size), piece.draws)
        held = needle_nodes(
            np.abs(model.position()[:, 1]) - 0.5 * float(size[1]), model.group.chain, run.fabric.course_spacing
        )
        rig = BiaxialTest(run, held, AXIS[run.rig.direction], size)
        return PreparedSpecimen(model, rig, yarns=piece.table, facts=_facts(size))

    def make_row_check(self, run: BiaxialRun, prepared: PreparedSpecimen) -> Callable[[Simulation], None]:
        """Check the energy ratios up to the first failure, not at the smallest strains."""
        check = make_row_check(
            run, prepared.restarts, "strain_pct", CHECKED_FROM * run.rig.max_strain / max(1.0, run.rig.ratio)
        )

        def check_unbroken(state: Simulation) -> None:
            if not any(value for name, value in state.rows[-1].items() if name.startswith("failed_")):
                check(state)

        return check_unbroken

    def results(self, run: BiaxialRun, prepared: PreparedSpecimen, history: History) -> dict[str, float]:
        """Largest force per width [N/mm] of both systems, each with its strain [%]; of shells before they break."""
        end = rows_before_break(history.curve) if run.model.scale == "macro" else None
        found = {}
        for system, force in (("biaxial", "force_n_per_mm"), ("cross", "cross_force_n_per_mm")):
            top, strain = int(np.argmax(history.curve[force][:end])), force.replace("force_n_per_mm", "strain_pct")
            found[f"{system}_force_n_per_mm"] = float(history.curve[force][top])
            found[f"{system}_strain_pct"] = float(history.curve[strain][top])
        return found

    def assess(self, run: BiaxialRun, prepared: PreparedSpecimen, history: History, cost: SimulationCost) -> Quality:
        """Evaluate the standard checks, and warn of loops that lock."""
        quality = super().assess(run, prepared, history, cost)
        if not prepared.rig.locks or history.first_failure is not None:
            return quality
        larger = "cross_strain_pct" if run.rig.ratio > 1.0 else "strain_pct"
        return quality.with_warnings(*locking_warning(history, run.rig.max_strain, larger, "% strain", TAUT_SHARE))

    def span(self, history: History) -> Span:
        """Return the span up to the first failure, or to the end where nothing failed."""
        return Span(to_failure=history.first_failure is not None)


def rows_before_break(curve: dict[str, Array]) -> int | None:
    """Rows of ``curve`` before the break, whose waves pull the other system: until a count of failures, or None."""
    failed = curve["failed_fabric"] > 0.0
    if not failed.any():
        return None
    end, forces = int(np.argmax(failed)), np.stack([curve["force_n_per_mm"], curve["cross_force_n_per_mm"]])
    while 0 < end < forces.shape[1] and (forces[:, end] >= forces[:, end - 1]).all():
        end += 1
    return end


def _facts(size: Array) -> dict[str, float]:
    return dict(zip(SIDES, size.tolist(), strict=True)) | {"area_mm2": float(np.prod(size))}
