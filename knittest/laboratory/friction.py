"""Friction test: a strip between two plates."""

import time as clock

import numpy as np

from knittest.config.run import FrictionRun
from knittest.errors import InputError
from knittest.history import History, Quality
from knittest.laboratory.base import Phase, Prepared, Update, fabric_laminate
from knittest.laboratory.strips import AXIS, cut, pitch, yarns_across
from knittest.measure import assess
from knittest.models.macro import build_strip
from knittest.models.meso import build_meso
from knittest.rigs.friction import FrictionTest
from knittest.simulate import simulate
from knittest.simulation import Keeper, SimulationCost

#: share of the travel, at its end, over which the kinetic level is the mean; the peak before is the static one
KINETIC_SHARE = 0.5
#: largest deviation of the normal force while the strip is pulled
FORCE_TOLERANCE = 0.01


class Friction:
    """See :class:`knittest.laboratory.base.Test`."""

    quantities = ("mu_paper",)

    def prepare(self, run: FrictionRun, specimen: int = 0, phase: Phase | None = None) -> Prepared:
        """The strip between its plates; raises InputError for plates that do not cover it."""
        rig = run.rig
        if rig.plate_width < rig.width:
            raise InputError(
                f"rig.plate_width = {rig.plate_width:g} mm: smaller than the strip, expected at least rig.width = "
                f"{rig.width:g} mm"
            )
        if rig.plate_length + rig.travel >= rig.length:
            raise InputError(
                f"rig.plate_length = {rig.plate_length:g} mm and rig.travel = {rig.travel:g} mm: expected their sum "
                f"below rig.length = {rig.length:g} mm, so that the pulled end sticks out"
            )
        meso = run.model.scale == "meso"
        return self._yarns(run, specimen, phase) if meso else self._shells(run, specimen)

    def _shells(self, run: FrictionRun, specimen: int) -> Prepared:
        rig, size = run.rig, run.model.macro.kernel("element_size")
        # the model of the tensile strip, its clamps being its first and last row
        model = build_strip(
            run.fabric, fabric_laminate(run), rig.direction, rig.kernel("length") - 2.0 * size, rig.kernel("width"),
            size, size, 0.0, run.variability.seed + specimen,
        )  # fmt: skip
        half = 0.5 * run.fabric.kernel("thickness")
        test = FrictionTest(run, 1, (-half, half), np.full(model.n_nodes, half))
        return Prepared(model, test, facts={"area_mm2": rig.kernel("length") * rig.kernel("width")})

    def _yarns(self, run: FrictionRun, specimen: int, phase: Phase | None) -> Prepared:
        start = clock.perf_counter()
        direction, period = run.rig.direction, pitch(run, run.rig.direction)
        across, along = yarns_across(run, direction, specimen), round(run.rig.kernel("length") / period)
        n_wales, n_courses = (across, along) if direction == "warp" else (along, across)
        piece = cut(run, n_wales, n_courses, specimen, phase)
        model = build_meso(run, piece.paths, piece.draws)
        z, radius = model.position()[:, 2], model.group.radius
        faces = (float((z - radius).min()), float((z + radius).max()))
        test = FrictionTest(run, AXIS[direction], faces, radius)
        facts = {"yarns_across": float(across), "area_mm2": along * period * run.rig.kernel("width")}
        return Prepared(model, test, clock.perf_counter() - start, piece.table, facts)

    def solve(
        self, prepared: Prepared, run: FrictionRun, update: Update | None, keeper: Keeper | None
    ) -> tuple[History, SimulationCost]:
        """Press, settle, pull."""
        return simulate(prepared.model, prepared.rig, run.solver, run.output, update, keeper)

    def results(self, run: FrictionRun, prepared: Prepared, history: History) -> dict[str, float]:
        """Static and kinetic level, the paper's coefficient of two faces and that of one."""
        curve, normal = history.curve, run.rig.kernel("normal_force")
        late = curve["displacement_mm"] > (1.0 - KINETIC_SHARE) * run.rig.kernel("travel")
        early = (curve["displacement_mm"] > 0.0) & ~late
        kinetic = float(curve["pull_force_n"][late].mean())
        return {
            "pull_force_kinetic_n": kinetic,
            "pull_force_static_n": float(_smooth(curve["pull_force_n"][early]).max()),
            "mu_paper": kinetic / normal,
            "mu_per_face": kinetic / (2.0 * normal),
            "normal_force_n": float(curve["normal_force_n"][late].mean()),
            "normal_force_error_pct": 100.0
            * float(np.abs(_smooth(curve["normal_force_n"][late]) / normal - 1.0).max()),
            "compression_mm": -float(curve["plate_travel_mm"][late].mean()),
        }

    def assess(self, run: FrictionRun, prepared: Prepared, history: History, cost: SimulationCost) -> Quality:
        """The gates of every run, and the normal force within 1 %."""
        quality = assess(history, run.solver, cost.penetration_max, cost.penetration_mean, prepared.model.added_mass)
        error = self.results(run, prepared, history)["normal_force_error_pct"]
        if error <= 100.0 * FORCE_TOLERANCE:
            return quality
        return quality.refusing(f"normal force is off by {error:.1f} % while the strip is pulled")


def _smooth(values: np.ndarray, width: int = 5) -> np.ndarray:
    """Moving mean: single chunks hold the ringing of the contact."""
    return np.convolve(values, np.full(width, 1.0 / width), "valid") if len(values) >= width else values
