"""Biaxial test: a square of fabric pulled along warp and weft at once."""

import time as clock
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import History, Quality
from knittest.laboratory.base import Prepared, Test, fabric_laminate
from knittest.laboratory.biaxial.config import BiaxialRun
from knittest.laboratory.biaxial.rig import BiaxialTest
from knittest.laboratory.judging import assess
from knittest.laboratory.needles import on_needles
from knittest.laboratory.span import Span
from knittest.laboratory.strips import AXIS, cut
from knittest.models.macro import ALONG, rectangle, self_contact, strengths
from knittest.models.meso import build_meso
from knittest.models.sheet import build_sheet
from knittest.solve.observer import SILENT, Observer
from knittest.solve.simulate import simulate
from knittest.solve.state import SimulationCost

Array = NDArray[np.float64]

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
