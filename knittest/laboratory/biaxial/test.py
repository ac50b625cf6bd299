"""Biaxial test: a square of fabric is pulled along warp and weft at once, at a constant ratio of the strains."""

import time as clock
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import History, Quality
from knittest.config.fabric import Direction
from knittest.laboratory.base import Prepared, Test, fabric_laminate
from knittest.laboratory.biaxial.config import BiaxialRun
from knittest.laboratory.judging import Span, assess
from knittest.laboratory.strips import AXIS, cut, on_needles
from knittest.models.boundary import ALL, Boundary, Readings
from knittest.models.macro import ALONG, build_sheet, rectangle, self_contact, strengths
from knittest.models.meso import build_meso
from knittest.models.tool import ramp
from knittest.solve.simulate import simulate
from knittest.solve.state import SILENT, Observer, SimulationCost

Array = NDArray[np.float64]

# Biaxial test: sides that move apart both ways at a constant ratio of the strains.
#
# The needles slide along the sides, so that every held point moves as the fabric would if it were strained evenly: x (1
# + e_x), y (1 + e_y). What they do along one axis is then the force per width times the area: N L_x L_y de.


class BiaxialTest:
    """Strains the points ``held`` along ``axis`` (0: x, 1: y) and across it; ``size`` (2,) is the rectangle's [mm]."""

    coordinate, force = "strain_pct", "force_n"
    marks: tuple[float, ...] = ()
    mounted_at, averaged_from, locks = 0.0, np.inf, False

    def __init__(self, run: BiaxialRun, held: NDArray[np.int64], axis: int, size: NDArray[np.float64]) -> None:
        rig, most = run.rig, max(1.0, run.rig.ratio)
        self.held, self.axis, self.size, self.ratio = held, axis, size, rig.ratio
        self.stop_ratio = rig.stop_force_ratio
        self.ends_at_break = run.model.scale == "macro" and _other_first(run)
        rate = run.solver.speed_mm_per_ms / float(size[axis])  # of the system that is strained more
        self.strain, self.cross = (ramp(run.solver.ramp_ms, share * rate / most) for share in (1.0, rig.ratio))
        self.duration = 0.5 * run.solver.ramp_ms + rig.max_strain_fraction / rate

    def constrain(self, boundary: Boundary) -> None:
        """Move the needles with their sides; the yarns may turn on them."""
        position = boundary.model.position()[self.held]
        for axis, strain in ((self.axis, self.strain), (1 - self.axis, self.cross)):
            boundary.move(self.held, ALL[axis], strain, position[:, axis])
        boundary.move(self.held, "z")

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs along a side."""
        return float(self.size.max()) / wave_speed

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

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Over when something has failed and the force of the direction has fallen to a share of its peak, or the
        shells have failed across it.
        """
        return broken and (self.ends_at_break or force < self.stop_ratio * peak)


def across(direction: Direction) -> Direction:
    """The other yarn system."""
    return "weft" if direction == "warp" else "warp"


def _other_first(run: BiaxialRun) -> bool:
    """Tell whether shells fail across the direction before they do along it."""
    fracture, direction = run.fabric.macro.fracture_strain, run.rig.direction
    return run.rig.ratio * fracture.of(direction).value > fracture.of(across(direction)).value


#: facts of the square: its sides along x and y
SIDES = ("weft_side_mm", "warp_side_mm")
#: share of the yarns' length at each end that their weakest place is not in: needles hold them there
AT_NEEDLES = 0.1


class Biaxial(Test[BiaxialRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    ends_at_failure = True

    def prepare(self, run: BiaxialRun, specimen: int = 0, observer: Observer = SILENT) -> Prepared:
        """The square about the origin, warp along y."""
        meso = run.model.scale == "meso"
        return self._yarns(run, specimen, observer) if meso else self._shells(run, specimen)

    def _shells(self, run: BiaxialRun, specimen: int) -> Prepared:
        side, macro, fabric = run.rig.side_mm, run.model.macro, run.fabric
        seed = run.variability.seed + specimen
        rows = np.linspace(-0.5 * side, 0.5 * side, max(round(side / macro.element_size_mm), 1) + 1)
        points, cells = rectangle(rows, side, macro.element_size_mm)
        edge = np.abs(points[:, :2]).max(axis=1) > 0.5 * side * (1.0 - 1e-9)
        height = macro.imperfection_mm
        points[~edge, 2] = np.random.default_rng(seed).uniform(-height, height, int((~edge).sum()))
        model = build_sheet(
            points, cells, fabric_laminate(run), fabric.area_mass_g_per_mm2, fabric.thickness_mm, ALONG,
            strengths(points, cells, 0.5 * side, seed), self_contact(fabric, macro, run.solver.safety),
        )  # fmt: skip
        size = np.full(2, side)
        return Prepared(model, self._rig(run, np.flatnonzero(edge), size), facts=_facts(size))

    def _yarns(self, run: BiaxialRun, specimen: int, observer: Observer) -> Prepared:
        start, fabric = clock.perf_counter(), run.fabric
        pitches = np.array([fabric.wale_spacing, fabric.course_spacing])
        n_wales, n_courses = (max(round(run.rig.side_mm / float(pitch)), 2) for pitch in pitches)
        piece = cut(run, n_wales, n_courses, specimen, observer, (run.rig.direction, AT_NEEDLES))
        size = np.array([n_wales, n_courses]) * pitches
        paths = [replace(p, points=p.points - 0.5 * np.append(size, 0.0)) for p in piece.paths]
        model = build_meso(run, paths, piece.draws)
        held = on_needles(np.abs(model.position()[:, 1]) - 0.5 * float(size[1]), model.group.chain)
        rig = self._rig(run, held, size)
        return Prepared(model, rig, clock.perf_counter() - start, piece.table, _facts(size))

    def _rig(self, run: BiaxialRun, held: NDArray[np.int64], size: Array) -> BiaxialTest:
        return BiaxialTest(run, held, AXIS[run.rig.direction], size)

    def solve(self, prepared: Prepared, run: BiaxialRun, observer: Observer) -> tuple[History, SimulationCost]:
        """Pull to the largest strain, or to failure."""
        return simulate(prepared.model, prepared.rig, run.solver, run.output, observer)

    def results(self, run: BiaxialRun, prepared: Prepared, history: History) -> dict[str, float]:
        """Largest force per width [N/mm] of both systems, each with its strain [%]; of shells before they break."""
        end = before_break(history.curve) if run.model.scale == "macro" else None
        return biaxial_results({name: values[:end] for name, values in history.curve.items()})

    def assess(self, run: BiaxialRun, prepared: Prepared, history: History, cost: SimulationCost) -> Quality:
        """The gates of every run."""
        return assess(run, prepared, history, cost, self.span(history))

    def span(self, history: History) -> Span:
        """Up to the first failure, or the end where nothing failed."""
        return Span(to_failure=history.first_failure is not None)


def before_break(curve: dict[str, Array]) -> int | None:
    """Rows of ``curve`` before shells break, as they do all at once: waves of that pull the other system, to twice what
    it bears at half the strain. None where nothing failed.

    Failures are counted at every other row or so: rows after the last count in which both forces still rise are whole.
    """
    failed = curve["failed_fabric"] > 0.0
    if not failed.any():
        return None
    end, forces = int(np.argmax(failed)), np.stack([curve["force_n_per_mm"], curve["cross_force_n_per_mm"]])
    while 0 < end < forces.shape[1] and (forces[:, end] >= forces[:, end - 1]).all():
        end += 1
    return end


def biaxial_results(curve: dict[str, Array]) -> dict[str, float]:
    """Largest force per width [N/mm] of both systems in ``curve``, each with its strain [%]."""
    own, other = (int(np.argmax(curve[name])) for name in ("force_n_per_mm", "cross_force_n_per_mm"))
    return {
        "biaxial_force_n_per_mm": float(curve["force_n_per_mm"][own]),
        "biaxial_strain_pct": float(curve["strain_pct"][own]),
        "cross_force_n_per_mm": float(curve["cross_force_n_per_mm"][other]),
        "cross_strain_pct": float(curve["cross_strain_pct"][other]),
    }


def _facts(size: Array) -> dict[str, float]:
    """Sides of the square along weft and warp, and its area."""
    return dict(zip(SIDES, size.tolist(), strict=True)) | {"area_mm2": float(np.prod(size))}
