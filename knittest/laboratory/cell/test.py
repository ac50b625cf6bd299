"""Cell test: one periodic cell of yarns under a given mean deformation, its motion, and what is recorded of it."""

from dataclasses import replace
from math import ceil
from typing import Any, cast

import numpy as np

from knittest.base.errors import InputError, NumericalError
from knittest.base.history import Array, History, Quality
from knittest.base.units import round_down
from knittest.config.structure import DIRECTIONS, KNIT
from knittest.fabric.relaxation import relaxed_cell
from knittest.laboratory.base import PreparedSpecimen
from knittest.laboratory.cell.config import TENSION_PATHS, CellRun
from knittest.laboratory.cell.path import ANGLES, LARGE, NEAR, CellPath, path_of, time_path
from knittest.laboratory.fabric_test import FabricTest, TestRig
from knittest.laboratory.quality_checks import LEAST_WORK, Span, assess, locking_warning
from knittest.models.boundary import Boundary, Readings
from knittest.models.crossings import Crossings, crossings, surfaces
from knittest.models.meso import build_meso_cell, lattice_of
from knittest.models.periodic_model import NUMBERS, PeriodicModel
from knittest.models.tool import Table, constant, plane
from knittest.solve.periodic_body import PeriodicBody
from knittest.solve.relaxed_cell import Curl
from knittest.solve.simulation import simulate
from knittest.solve.state import Observer, SimulationCost

#: least number of rows at which a cell of soft loops is relaxed, and largest strain from one to the next [-]
FEWEST_RELAXED, ROW_STRAIN = 100, 0.004
#: least number of rows of a path along inlays alone
FEWEST_ALONG_INLAYS = 40
#: least number of rows and largest strain of yarns with a soft shell, which do not jump: where the fabric is free to
#: contract, and on other paths, which lock early
FEWEST_SOFT, SOFT_STRAIN, SOFT_STRAINS = 40, 0.03, 0.01
#: residual [% of the contact forces] up to which a row is at rest, and share of rows that may be on their way: loops
#: that jump from one state to the next have contacts without force
LARGEST_RESIDUAL, FEW_ROWS = 5.0, 0.1
#: gap between plates and yarns at the start [mm], and travel over the thickness after which no fabric is left
GAP, MOST_CLOSED = 0.002, 0.9


class CellTest(TestRig):
    """Drives the lattice of ``model`` along its path; between plates until they press hard enough."""

    coordinate, force = "path_pct", "conjugate_force"
    #: whether a yarn has reached its fracture strain, a direction without inlays its largest force, the run its end
    torn = is_loaded = has_arrived = False

    def __init__(self, run: CellRun, model: PeriodicModel) -> None:
        self.model, self.pressed = model, run.rig.path == "compaction"
        self.own = np.flatnonzero(model.owned)
        self.ring_length = float(np.linalg.norm(self.model.reference, axis=1).max())
        low, high = surfaces(model, self.own)
        self.thickness = high - low + 2.0 * GAP
        path = path_of(run, model.reference)
        if self.pressed:
            path = CellPath(path.name, MOST_CLOSED * self.thickness, 1.0, path.at)
        self.path, self.progress = time_path(run, path)
        self.duration, self.most = self.path.duration, 1e-3 * run.rig.max_pressure
        self.relaxed_rows = relaxed_rows(run, self.path) if run.is_relaxed else 0
        # slack loops, whose contacts bear hardly any force, resist bending by about this
        self.rest_force = run.fabric.knitting.bending_stiffness_n_mm2 / run.fabric.loop_length_mm**2
        self.bent, self.locks = run.rig.about, run.rig.path == "shear"
        self.ends_at = np.inf if run.rig.end_angle is None else run.rig.end_angle / run.rig.max_angle
        ends = run.rig.path in TENSION_PATHS and run.rig.max_force is not None
        self.loaded = [d for d in DIRECTIONS if ends and not run.fabric.inlays_along(d)]
        self.max_force = run.rig.max_force or np.inf

    def constrain(self, boundary: Boundary) -> None:
        """Move, free or hold all numbers of the lattice; put the plates where the yarns are."""
        model = cast(PeriodicModel, boundary.model)
        model.images.group[:] = -1  # others were set while it came to rest
        if self.bent:
            model.bend_along(model.reference[1 if self.bent == "warp" else 0])
        rates = {} if self.pressed else self.path.rates(self.progress)
        for name in NUMBERS:
            if name in self.path.free:
                model.free(boundary, name)
            else:
                model.drive(boundary, name, rates.get(name, constant(0.0)))
        if self.pressed:
            boundary.radius[self.own] = model.group.radius[self.own]
            z, radius = model.nodes.position[2, self.own], model.group.radius[self.own]
            boundary.add_tool(plane((0.0, 0.0, float((z - radius).min()) - GAP), (0.0, 0.0, 1.0)))
            boundary.add_tool(plane((0.0, 0.0, float((z + radius).max()) + GAP), (0.0, 0.0, -1.0)))
            speed = Table(self.progress.time, tuple(-self.path.end * v for v in self.progress.value))
            boundary.move_tool(1, "z", speed)

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Share of the path, its coordinate, the force conjugate to that over the area, nominal mean stresses."""
        s = self.share(time)
        pull, area = readings.reaction[self.model.images.group], self.model.area
        nominal = pull[:6].reshape(2, 3).T @ self.model.reference / area
        pressure = 0.5 * float(readings.tool_force[1, 2] - readings.tool_force[0, 2]) / area if self.pressed else 0.0
        force = {"weft": float(nominal[0, 0]), "warp": float(nominal[1, 1])}
        self.is_loaded = any(abs(force[direction]) >= self.max_force for direction in self.loaded)
        return {
            "path_pct": 100.0 * s,
            self.path.name: self.path.shown * self.path.end * s,
            "conjugate_force": pressure if self.pressed else self.path.conjugate(pull, s) / area,
            "weft_n_per_mm": force["weft"],
            "warp_n_per_mm": force["warp"],
            "shear_xy_n_per_mm": float(nominal[0, 1]),
            "shear_yx_n_per_mm": float(nominal[1, 0]),
            "moment_n": float(pull[6]) / area,
            "pressure_kpa": 1e3 * pressure,
        }

    def share(self, time: float) -> float:
        """Share of the path at ``time`` [ms]."""
        return min(self.progress.integral(time), 1.0)

    def is_finished(self, force: float, peak: float, broken: bool) -> bool:
        """End at the largest pressure or force, when a yarn is torn, or at the end of the run on its path."""
        return self.torn or self.is_loaded or self.has_arrived or (self.pressed and force >= self.most)


def relaxed_rows(run: CellRun, path: CellPath) -> int:
    """Number of rows at which the cell of ``run`` is relaxed on its ``path``."""
    if run.fabric.has_soft_yarns:
        contracts = run.rig.path in ("warp", "weft") and run.rig.transverse == "free"
        strain = SOFT_STRAIN if contracts else SOFT_STRAINS
        return max(FEWEST_SOFT, ceil(path.stretch / strain))
    along_inlays = run.rig.path in TENSION_PATHS and not run.pulls_loops
    return max(FEWEST_ALONG_INLAYS if along_inlays else FEWEST_RELAXED, ceil(path.stretch / ROW_STRAIN))


#: share of the strain at fracture to which a path is recommended
RECOMMENDED_SHARE = 0.9
NO_CROSSINGS = Crossings(0.0, 0.0, 0.0, 0.0, 0.0)


class Recorder:
    """Record a row of the model in ``mount`` at every sample, and pass all else to ``observer``."""

    def __init__(self, run: CellRun, mount: CellTest, observer: Observer) -> None:
        self.run, self.mount, self.model, self.observer = run, mount, mount.model, observer
        self.fracture = {one.name: one.yarn.fracture_strain_fraction for one in run.fabric.inlays}
        self.fracture[KNIT] = run.fabric.knitting.fracture_strain_fraction
        self.reached = 0.0

    def __getattr__(self, name: str) -> Any:
        return getattr(self.observer, name)

    def progress(self, fraction: float, time_ms: float, step_us: float, kinetic_ratio: float) -> None:
        """Keep a row, see whether the run ends here; where a yarn is torn end, or raise :class:`InputError`."""
        self.model.record.append(record_row(self.model))
        self.mount.has_arrived = self.mount.share(time_ms) >= self.mount.ends_at
        if self.run.rig.path in TENSION_PATHS:
            self._check_tearing(fraction)
        self.reached = fraction
        self.observer.progress(fraction, time_ms, step_us, kinetic_ratio)

    def _check_tearing(self, fraction: float) -> None:
        strain, names = self.model.fields()["axial_strain"], self.model.mesh.part_names
        for k, name in enumerate(names):
            of = self.model.mesh.part == k
            if of.any() and (largest := float(strain[of].max())) > self.fracture[name]:
                self.mount.torn = True
                if self.run.rig.at_fracture == "ends":
                    return
                # yarns grow stiffer: a path of this share of the present one strains them by less than to fracture
                would_do = max(self.reached, RECOMMENDED_SHARE * fraction * self.fracture[name] / largest)
                raise InputError(torn_message(self.run, name, self.fracture[name], would_do))


def torn_message(run: CellRun, system: str, fracture: float, share: float) -> str:
    """Say that the path tears the yarns of ``system``, and which ``share`` of it does not."""
    rig = run.rig
    remedy = f"use --set rig.max_strain={round_down(share * rig.max_strain):g}"
    if rig.path == "steps":
        remedy = f"end the steps at {100.0 * share:.0f} % of the path"
    return (
        f"rig.path = {rig.path} tears the {system} yarns, whose fracture strain is {100.0 * fracture:.2f} %; {remedy}"
    )


def record_row(model: PeriodicModel) -> dict[str, float]:
    """Elastic energies [mJ] by system and mechanism, crossings by kind, thickness [mm] and mean strains [%]."""
    names, energies = model.mesh.part_names, model.beam_energies()
    row = {f"{m}_{part}_mj": float(v[k]) for m, v in energies.items() for k, part in enumerate(names)}
    found = crossings(model)
    for k, one in enumerate(names):
        for other in names[k:]:
            of, label = found.get(f"{one}-{other}", NO_CROSSINGS), f"{one}_{other}"
            row |= {
                f"{label}_contacts": of.count, f"{label}_normal_force_n": of.normal_force,
                f"{label}_largest_force_n": of.largest_force, f"{label}_angle_deg": of.angle,
            }  # fmt: skip
    low, high = surfaces(model, np.flatnonzero(model.owned))
    stretch = np.linalg.norm(model.lattice, axis=1) / np.linalg.norm(model.reference, axis=1)
    return row | {
        "thickness_mm": high - low, "weft_strain_pct": 100.0 * (stretch[0] - 1.0),
        "warp_strain_pct": 100.0 * (stretch[1] - 1.0),
    }  # fmt: skip


class Cell(FabricTest[CellRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    lowers_speed = True

    def check_run(self, run: CellRun) -> None:
        """Raise :class:`InputError` for a strain at which even straight yarns are torn."""
        rig = run.rig
        for system in ("warp", "weft"):
            share = {"warp": 1.0, "weft": rig.ratio}[system] / max(1.0, rig.ratio) if rig.path == "biaxial" else 1.0
            if rig.at_fracture == "ends" or rig.path not in (system, "biaxial") or share == 0.0:
                continue
            most = run.fabric.straight_failure_strain(system)
            if rig.max_strain_fraction * share > most:
                raise InputError(
                    f"rig.max_strain = {rig.max_strain:g} % tears the {system} yarns, even straight ones, at "
                    f"{100.0 * most:.2f} %; use --set rig.max_strain={round_down(100.0 * most / share):g}"
                )

    def mount_yarns(self, run: CellRun, specimen: int, observer: Observer) -> PreparedSpecimen:
        """Make the cell, warp along y; all specimens are alike."""
        observer.phase("generating the yarns")
        cell, rig = relaxed_cell(run.fabric), run.rig
        path, slip = path_of(run, lattice_of(cell, rig.wales, rig.courses)), rig.max_slip
        if path.stretch > LARGE:  # loops give yarn to each other
            slip = max(slip, path.stretch * max(cell.spec.wale, cell.spec.course) / max(cell.spec.radius.values()))
        model = build_meso_cell(run, cell, rig.wales, rig.courses, rig.axial_share, path.shrink, rig.about, slip)
        return PreparedSpecimen(model, CellTest(run, model), facts={"area_mm2": model.area})

    def solve(self, prepared: PreparedSpecimen, run: CellRun, observer: Observer) -> tuple[History, SimulationCost]:
        """Follow the path, and record energies by mechanism and crossings."""
        mount = prepared.mount
        assert isinstance(mount, CellTest)
        if mount.path.free and observer.resume_from() is None:
            body = PeriodicBody(mount.model, safety=run.solver.safety, threads=1)
            body.free(*mount.path.free)
            rest = body.settle()  # to no mean stress of the free numbers of the lattice
            if not rest.converged:
                raise NumericalError(
                    f"no equilibrium of the cell with free lattice numbers {' and '.join(mount.path.free)}: residual "
                    f"{rest.residual:.2g} after {rest.steps} steps; use --set rig.transverse=held"
                )
        recorder = cast(Observer, Recorder(run, mount, observer))
        history, cost = simulate(mount.model, mount, run.solver, run.output, recorder)
        return self.finish(run, prepared, history), cost

    def finish(self, run: CellRun, prepared: PreparedSpecimen, history: History) -> History:
        """Add energies by mechanism and crossings."""
        assert isinstance(prepared.mount, CellTest)
        record = prepared.mount.model.record[: len(history.energies["time_ms"])]
        columns = {name: np.array([row[name] for row in record]) for name in record[0]}
        energies = {name: values for name, values in columns.items() if name.endswith("_mj")}
        contacts = {name: values for name, values in columns.items() if name not in energies}
        return replace(history, energies=history.energies | energies, contacts=history.contacts | contacts)

    def results(self, run: CellRun, prepared: PreparedSpecimen, history: History) -> dict[str, float]:
        """Mean stress of the path, the share of friction, thickness and the forces of crossings at its end."""
        curve, energies, contacts = history.curve, history.energies, history.contacts
        thickness = contacts["thickness_mm"]
        found = {"cell_thickness_at_rest_mm": float(thickness[0]), "cell_thickness_mm": float(thickness[-1])}
        friction, work = (float(energies[name][-1]) for name in ("friction_mj", "external_mj"))
        found["cell_friction_share"] = friction / work if work > 0.0 else np.nan
        if run.rig.path == "shear":
            angle, force = curve["shear_angle_deg"], curve["conjugate_force"]
            for a in ANGLES:
                if run.rig.evaluated_from_fraction * run.rig.max_angle <= a <= min(run.rig.last_angle, angle.max()):
                    found[f"cell_shear_n_per_mm_at_deg.{a:g}"] = float(force[np.abs(angle - a) < NEAR].mean())
        elif run.rig.path == "bending":
            found["cell_moment_n"] = float(curve["moment_n"][-1])
            stiffness = tangent if run.is_relaxed else secant
            found["cell_bending_stiffness_n_mm"] = stiffness(curve["curvature_per_mm"], curve["moment_n"])
            found["cell_curl_per_mm"] = curl(curve["curvature_per_mm"], curve["moment_n"])
        elif run.rig.path == "compaction":
            found["cell_pressure_kpa"] = float(curve["pressure_kpa"][-1])
        else:
            found |= {f"cell_{s}_n_per_mm": float(curve[f"{s}_n_per_mm"][-1]) for s in ("warp", "weft")}
            if isinstance(prepared.mount, CellTest) and prepared.mount.torn and "strain_pct" in curve:
                found["cell_fracture_strain_pct"] = float(curve["strain_pct"][-1])
        return found

    def assess(self, run: CellRun, prepared: PreparedSpecimen, history: History, cost: SimulationCost) -> Quality:
        """Evaluate the standard checks, locking, and whether relaxed rows are at rest.

        Bending starts under the energy of the loops: its kinetic energy is over the largest work so far, whatever its
        sign.
        """
        if run.rig.path == "bending":
            energies = history.energies
            work = np.maximum.accumulate(np.abs(energies["external_mj"]))
            ratio = energies["kinetic_mj"] / np.maximum(work, 1e-9)
            history = replace(history, energies=energies | {"kinetic_ratio": ratio})
        if run.is_relaxed:  # energies verify the whole path: the first loops that move do so under hardly any work
            energies = history.energies
            all_of_it = max(float(energies["energy_input_mj"][-1]), LEAST_WORK)
            evaluated = {
                "energy_input_mj": np.full_like(energies["energy_input_mj"], all_of_it),
                "energy_error": np.abs(energies["balance_error_mj"]) / all_of_it,
            }
            history = replace(history, energies=energies | evaluated)
        quality = assess(run, prepared, history, cost, checked_span(run, history))
        if fault := unsettled_rows(run, history):
            quality = quality.with_failed_check(fault)
        return (
            quality.with_warnings(*locking_warning(history, run.rig.last_angle)) if run.rig.path == "shear" else quality
        )


def unsettled_rows(run: CellRun, history: History) -> str:
    """Reason why the rows that count are no states of rest; empty if they are, or if rows are not relaxed.

    The bending stiffness is read from the second half of the path.
    """
    residual = history.contacts.get("residual_pct", np.zeros(1))
    residual = residual[len(residual) // 2 if run.rig.path == "bending" else 0 :]
    share = float((residual > LARGEST_RESIDUAL).mean())
    if share <= FEW_ROWS and residual[-1] <= LARGEST_RESIDUAL:
        return ""
    return (
        f"{100.0 * share:.0f} % of the rows, the last one with a residual of {residual[-1]:.3g} %, are not in "
        f"equilibrium: expected at most {100.0 * FEW_ROWS:g} %, and a residual of at most {LARGEST_RESIDUAL:g} % at "
        "the end; lower solver.speed"
    )


def checked_span(run: CellRun, history: History) -> Span:
    """Return the span of the path without its beginning; of bending from start-up on."""
    if run.rig.path == "bending":
        return Span()
    return Span.from_value(history, "path_pct", 100.0 * run.rig.evaluated_from_fraction)


def secant(x: Array, y: Array) -> float:
    """Slope of the line through the first row with least squares over the second half: free of the moment at rest."""
    end = x >= 0.5 * x[-1]
    return float(x[end] @ (y[end] - y[0])) / float(x[end] @ x[end])


def tangent(x: Array, y: Array) -> float:
    """Slope with least squares over the second half: soft loops jump about the flat state, which the bending rigidity
    leaves out (Kawabata 1980, The standardization and analysis of hand evaluation).
    """
    end = x >= 0.5 * x[-1]
    return float(np.polyfit(x[end], y[end], 1)[0])


def curl(curvature: Array, moment: Array) -> float:
    """Curvature [1/mm] without ``moment``, on a line through the first and the last row: that of free fabric."""
    return Curl(float(moment[0]), float(moment[-1] - moment[0]) / float(curvature[-1])).curvature
