"""Compaction test: a square of yarns between two plates."""

import time as clock
from dataclasses import replace

import numpy as np

from knittest.base.history import History, Quality
from knittest.laboratory.after_rest import after_rest
from knittest.laboratory.base import Prepared, Test
from knittest.laboratory.compaction.config import CompactionRun
from knittest.laboratory.compaction.rig import REST, CompactionTest, touching_radius
from knittest.laboratory.compaction.van_wyk import PRESSURES, fit, thickness_at, work
from knittest.laboratory.judging import assess
from knittest.laboratory.needles import on_needles
from knittest.laboratory.span import Span
from knittest.laboratory.strips import cut
from knittest.models.meso import build_meso
from knittest.solve.observer import SILENT, Observer
from knittest.solve.simulate import simulate
from knittest.solve.state import SimulationCost

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
