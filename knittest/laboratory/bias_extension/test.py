"""Bias extension test: a strip at 45 deg to its yarns between two clamps."""

import time as clock
from dataclasses import replace
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import History, Quality
from knittest.laboratory.base import Prepared, Test, fabric_laminate
from knittest.laboratory.bias_extension.config import BiasExtensionRun
from knittest.laboratory.bias_extension.material import material_of
from knittest.laboratory.bias_extension.mesh import bias_mesh
from knittest.laboratory.bias_extension.pin_jointed import BiasStrip, strip_of
from knittest.laboratory.bias_extension.rig import ANGLES, BiasExtensionTest
from knittest.laboratory.bias_extension.yarns import jaw_length, yarns_on_the_bias
from knittest.laboratory.bias_extension.zones import zone_table
from knittest.laboratory.judging import assess
from knittest.laboratory.law_end import refuse_beyond_law
from knittest.laboratory.lowered_speed import row_check
from knittest.laboratory.span import Span
from knittest.materials.trellis import ANGLE, NORMALISED
from knittest.models.macro import self_contact
from knittest.models.meso import build_meso
from knittest.models.sheet import build_sheet
from knittest.solve.observer import SILENT, Observer
from knittest.solve.simulate import simulate
from knittest.solve.state import SimulationCost

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: half the range of angles [deg] over which a force is averaged
NEAR = 0.5
#: warp in a strip along y
WARP = (-sqrt(0.5), sqrt(0.5), 0.0)


class BiasExtension(Test[BiasExtensionRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    ends_at_failure = False
    lowers_speed = True

    def prepare(self, run: BiasExtensionRun, specimen: int = 0, observer: Observer = SILENT) -> Prepared:
        """The strip between its clamps, along y."""
        meso = run.model.scale == "meso"
        return self._yarns(run, specimen, observer) if meso else self._shells(run, specimen)

    def _shells(self, run: BiasExtensionRun, specimen: int) -> Prepared:
        refuse_beyond_law(run, run.rig.max_angle)
        strip, macro, fabric = strip_of(run), run.model.macro, run.fabric
        points, cells = bias_mesh(strip.length, strip.width, macro.element_size_mm)
        ends, height = ends_of(points, strip), macro.imperfection_mm
        free = np.setdiff1d(np.arange(len(points)), np.concatenate(ends))
        points[free, 2] = np.random.default_rng(run.variability.seed + specimen).uniform(-height, height, len(free))
        model = build_sheet(
            points, cells, fabric_laminate(run), fabric.area_mass_g_per_mm2, fabric.thickness_mm, WARP,
            contact=self_contact(fabric, macro, run.solver.safety),
        )  # fmt: skip
        return Prepared(model, BiasExtensionTest(run, strip, *ends), facts=_facts(strip, strip.length))

    def _yarns(self, run: BiasExtensionRun, specimen: int, observer: Observer) -> Prepared:
        start, strip = clock.perf_counter(), strip_of(run)
        found = yarns_on_the_bias(run, strip, specimen, observer)
        model = build_meso(run, found.paths, found.piece.draws, run.rig.membrane_share)
        ends = ends_of(model.position(), strip)
        whole = strip.length + 2.0 * jaw_length(run.fabric)
        mount = BiasExtensionTest(run, strip, *ends)
        return Prepared(model, mount, clock.perf_counter() - start, found.piece.table, _facts(strip, whole))

    def solve(self, prepared: Prepared, run: BiasExtensionRun, observer: Observer) -> tuple[History, SimulationCost]:
        """Pull to the largest angle; raises :class:`TooFastError` by ``prepared.restarts``."""
        check = row_check(run, prepared.restarts, ANGLE, ANGLES[0] - NEAR)
        history, cost = simulate(prepared.model, prepared.rig, run.solver, run.output, observer, check)
        return self.finish(run, prepared, history), cost

    def finish(self, run: BiasExtensionRun, prepared: Prepared, history: History) -> History:
        """Add the normalised force, which hangs on that at all smaller angles."""
        found = strip_of(run).normalised(history.curve["force_n"], np.deg2rad(history.curve[ANGLE]))
        return replace(history, curve=history.curve | {NORMALISED: found})

    def results(self, run: BiasExtensionRun, prepared: Prepared, history: History) -> dict[str, float]:
        """Force, normalised force and the middle's own angle at angles of pin-jointed yarns."""
        most, table = run.rig.max_angle, zone_table(history, strip_of(run), material_of(run, history))
        return forces_at(history, most) | middle_at(table, most)

    def assess(self, run: BiasExtensionRun, prepared: Prepared, history: History, cost: SimulationCost) -> Quality:
        """The gates of every run."""
        return assess(run, prepared, history, cost, self.span(history))

    def span(self, history: History) -> Span:
        """The whole way, from the first angle at which a force is read."""
        first = history.curve[ANGLE] >= ANGLES[0] - NEAR
        times = history.curve["time_ms"]
        return Span(reported_from=float(times[np.argmax(first)]) if first.any() else np.inf)


def _facts(strip: BiasStrip, whole: float) -> dict[str, float]:
    """Sizes of ``strip``, which is ``whole`` [mm] long with what the jaws hold."""
    half = 0.5 * strip.length
    return {
        "width_mm": strip.width, "gauge_mm": strip.length, "area_mm2": whole * strip.width, "fixed_jaw_mm": -half,
        "moving_jaw_mm": half,
    }  # fmt: skip


def ends_of(points: Array, strip: BiasStrip) -> tuple[Index, Index]:
    """Nodes among ``points`` (n, 3) [mm] that the fixed clamp holds, and the pulled one."""
    end = 0.5 * strip.length * (1.0 - 1e-9)
    return np.flatnonzero(points[:, 1] <= -end), np.flatnonzero(points[:, 1] >= end)


def forces_at(history: History, most: float) -> dict[str, float]:
    """Force [N] and normalised force [N/mm] at each of :data:`~.rig.ANGLES` up to ``most`` [deg], means over a degree
    about it.
    """
    curve = history.curve
    around = {a: np.abs(curve[ANGLE] - a) < NEAR for a in ANGLES if a <= most}
    columns = {"bias_force_n": "force_n", "bias_normalised_force_n_per_mm": NORMALISED}
    return {
        f"{name}_at_deg.{a:g}": float(curve[column][near].mean())
        for name, column in columns.items()
        for a, near in around.items()
    }


def middle_at(table: dict[str, Array], most: float) -> dict[str, float]:
    """Mean shear angle [deg] in the inner half of the middle where pin-jointed yarns would have one of
    :data:`~.rig.ANGLES` up to ``most`` [deg], and of yarns their slip [mm] in the strip, on lines between the rows of
    zones.csv.
    """
    columns = {"middle_shear_angle_deg": "middle_mean_deg", "crossing_slip_mm": "slip_percentile_95_mm"}
    return {
        f"{name}_at_deg.{a:g}": float(np.interp(a, table[ANGLE], table[column]))
        for name, column in columns.items()
        if column in table
        for a in ANGLES
        if a <= most
    }
