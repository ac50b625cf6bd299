"""Cell test: one periodic cell of yarns under a given mean deformation."""

import time as clock
from dataclasses import replace

import numpy as np

from knittest.base.errors import InputError, NumericalError
from knittest.base.history import Array, History, Quality
from knittest.base.rounding import rounded_down
from knittest.fabric.relax import relaxed_cell
from knittest.laboratory.base import Prepared, Test
from knittest.laboratory.cell.config import CellRun
from knittest.laboratory.cell.ends import ANGLES, NEAR
from knittest.laboratory.cell.path import path_of
from knittest.laboratory.cell.record import Recorder, split
from knittest.laboratory.cell.rig import CellTest
from knittest.laboratory.judging import assess, locking
from knittest.laboratory.span import Span
from knittest.models.meso_cell import build_meso_cell, lattice_of
from knittest.models.periodic_model import PeriodicModel
from knittest.solve.curl import Curl
from knittest.solve.observer import SILENT, Observer
from knittest.solve.periodic_body import PeriodicBody
from knittest.solve.simulate import simulate
from knittest.solve.state import SimulationCost


class Cell(Test[CellRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    ends_at_failure = False
    lowers_speed = True

    def refuse(self, run: CellRun) -> None:
        """Raise :class:`InputError` for a strain at which even straight yarns are torn."""
        rig, yarn = run.rig, run.fabric.reinforcing
        for system in ("warp", "weft"):
            share = {"warp": 1.0, "weft": rig.ratio}[system] / max(1.0, rig.ratio) if rig.path == "biaxial" else 1.0
            if rig.torn == "ends" or rig.path not in (system, "biaxial") or share == 0.0:
                continue
            most = (1.0 + yarn.crimp_fraction.of(system)) * (1.0 + yarn.fracture_strain_fraction) - 1.0
            if rig.max_strain_fraction * share > most:
                raise InputError(
                    f"rig.max_strain = {rig.max_strain:g} %: it tears the {system} yarns, which break at "
                    f"{100.0 * most:.2f} % when they are straight; rig.max_strain="
                    f"{rounded_down(100.0 * most / share):g} would do"
                )

    def prepare(self, run: CellRun, specimen: int = 0, observer: Observer = SILENT) -> Prepared:
        """The cell, warp along y; all specimens are alike."""
        self.refuse(run)
        start, rig = clock.perf_counter(), run.rig
        observer.phase("laying out the yarns")
        cell = relaxed_cell(run.fabric)
        shrink = path_of(run, lattice_of(cell, rig.wales, rig.courses)).shrink
        model = build_meso_cell(run, cell, rig.wales, rig.courses, rig.axial_share, shrink, rig.about, rig.slide)
        facts = {"area_mm2": model.area}
        return Prepared(model, CellTest(run, model), clock.perf_counter() - start, {}, facts)

    def solve(self, prepared: Prepared, run: CellRun, observer: Observer) -> tuple[History, SimulationCost]:
        """Follow the path, and put energies by mechanism and crossings beside those of all tests."""
        mount = prepared.mount
        assert isinstance(mount, CellTest)
        model, free = mount.model, mount.path.free
        if free and observer.resume_from() is None:
            _draw_in(model, free, run)
        history, cost = simulate(model, mount, run.solver, run.output, Recorder(run, mount, observer))
        return self.finish(run, prepared, history), cost

    def finish(self, run: CellRun, prepared: Prepared, history: History) -> History:
        """Energies by mechanism and crossings beside those of all tests."""
        assert isinstance(prepared.mount, CellTest)
        energies, contacts = split(prepared.mount.model.record[: len(history.energies["time_ms"])])
        return replace(history, energies=history.energies | energies, contacts=history.contacts | contacts)

    def results(self, run: CellRun, prepared: Prepared, history: History) -> dict[str, float]:
        """Mean stress of the path, the share of friction, thickness and the forces of crossings at its end."""
        curve, energies, contacts = history.curve, history.energies, history.contacts
        thickness = contacts["thickness_mm"]
        found = {"cell_thickness_at_rest_mm": float(thickness[0]), "cell_thickness_mm": float(thickness[-1])}
        friction, work = (float(energies[name][-1]) for name in ("friction_mj", "external_mj"))
        found["cell_friction_share"] = friction / work if work > 0.0 else np.nan
        if run.rig.path == "shear":
            angle, force = curve["shear_angle_deg"], curve["conjugate_force"]
            for a in ANGLES:
                if run.rig.judged_from_fraction * run.rig.max_angle <= a <= min(run.rig.last_angle, angle.max()):
                    found[f"cell_shear_n_per_mm_at_deg.{a:g}"] = float(force[np.abs(angle - a) < NEAR].mean())
        elif run.rig.path == "bending":
            found["cell_moment_n"] = float(curve["moment_n"][-1])
            found["cell_bending_stiffness_n_mm"] = secant(curve["curvature_per_mm"], curve["moment_n"])
            found["cell_curl_per_mm"] = curl(curve["curvature_per_mm"], curve["moment_n"])
        elif run.rig.path == "compaction":
            found["cell_pressure_kpa"] = float(curve["pressure_kpa"][-1])
        else:
            found |= {f"cell_{s}_n_per_mm": float(curve[f"{s}_n_per_mm"][-1]) for s in ("warp", "weft")}
            if isinstance(prepared.mount, CellTest) and prepared.mount.torn and "strain_pct" in curve:
                found["cell_fracture_strain_pct"] = float(curve["strain_pct"][-1])
        return found

    def assess(self, run: CellRun, prepared: Prepared, history: History, cost: SimulationCost) -> Quality:
        """The gates of every run, from the first degree on.

        A cell that curls by itself gives energy as it is bent flat. The kinetic energy is compared with the largest
        work so far, whatever its sign.
        """
        if run.rig.path == "bending":
            energies = history.energies
            work = np.maximum.accumulate(np.abs(energies["external_mj"]))
            ratio = energies["kinetic_mj"] / np.maximum(work, 1e-9)
            history = replace(history, energies=energies | {"kinetic_ratio": ratio})
        quality = assess(run, prepared, history, cost, judged_span(run, history))
        return quality.warning(*locking(history, run.rig.last_angle)) if run.rig.path == "shear" else quality


def judged_span(run: CellRun, history: History) -> Span:
    """The whole path but for its beginning; of bending, whose work goes with the square, from 5 % of the work."""
    if run.rig.path == "bending":
        return Span()
    first = history.curve["path_pct"] >= 100.0 * run.rig.judged_from_fraction
    times = history.curve["time_ms"]
    return Span(reported_from=float(times[np.argmax(first)]) if first.any() else np.inf)


def secant(x: Array, y: Array) -> float:
    """Slope of the line through the first row that is nearest to the second half of a curve (least squares); the moment
    of a flat cell, which is the curl of the free fabric, does not change it.
    """
    end = x >= 0.5 * x[-1]
    return float(x[end] @ (y[end] - y[0])) / float(x[end] @ x[end])


def curl(curvature: Array, moment: Array) -> float:
    """Curvature [1/mm] at which a line through the first and the last row has no ``moment``: that of free fabric."""
    return Curl(float(moment[0]), float(moment[-1] - moment[0]) / float(curvature[-1])).curvature


def _draw_in(model: PeriodicModel, free: tuple[str, ...], run: CellRun) -> None:
    """Let the ``free`` numbers of the lattice go to where they carry no mean stress, before the path begins.

    Raises :class:`NumericalError` where they come to no rest.
    """
    body = PeriodicBody(model, safety=run.solver.safety, threads=1)
    body.free(*free)
    found = body.settle()
    if not found.converged:
        raise NumericalError(
            f"the cell comes to no rest with {' and '.join(free)} of its lattice free: residual {found.residual:.2g} "
            f"after {found.steps} steps; rig.across=held does without"
        )
