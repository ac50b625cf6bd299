"""What a run would do, and whether its speed matters."""

import numpy as np

from knittest.config.run import Run
from knittest.specimen import Prepared, prepare, run_specimen

#: change of the peak on halving the speed that still counts as converged [-]
CONVERGED = 0.01
#: bytes a node takes in all arrays, about
BYTES_PER_NODE = 900


def preflight(run: Run) -> list[str]:
    """Lines for a user: model, masses, time step, steps, memory, initial overlap."""
    prepared = prepare(run)
    model = prepared.model
    overlap = model.prepare()
    step = run.solver.safety * model.critical_step
    lines = [
        f"{run.fabric.name} ({run.parameters}), tensile {run.rig.direction}, {run.model.scale}, {run.model.preset}",
        f"  gauge length           {prepared.rig.gauge:.2f} mm, {prepared.n_yarns} yarns across {run.rig.width:g} mm",
        f"  elements, nodes        {len(model.mesh.cells)}, {model.n_nodes}",
        f"  mass                   {_mass(run, prepared)}",
        f"  time step              {1e3 * step:.4f} us, added mass {100.0 * model.added_mass:.2f} %",
        f"  steps, at most         {int(prepared.rig.duration / step)} ({prepared.rig.duration:.2f} ms of test)",
        f"  arrays                 {model.n_nodes * BYTES_PER_NODE / 1e6:.0f} MB, about",
    ]
    if run.model.scale == "meso":
        lines.append(f"  overlap at the start   {100.0 * overlap:.2f} % of a radius")
    return lines


def _mass(run: Run, prepared: Prepared) -> str:
    """Area mass of the model beside that of the fabric file, with where the latter comes from."""
    model = prepared.model
    span = np.ptp(model.position(), axis=0)
    area = span[prepared.rig.axis] * run.rig.kernel("width")
    modelled = 1e6 * float(model.mass.sum()) / area
    stated = run.fabric.area_mass
    return f"{model.mass.sum():.3f} g, {modelled:.0f} g/m2 ({stated.source} {stated.value:g} g/m2)"


def speed_study(run: Run) -> tuple[list[str], bool]:
    """Peak and fracture strain at the speed of ``run`` and at half of it; whether the peak holds within 1 %."""
    half = run.model_copy(update={"solver": run.solver.model_copy(update={"speed": 0.5 * run.solver.speed})})
    results = [run_specimen(r).results for r in (run, half)]
    change = results[0]["peak_force_n"] / results[1]["peak_force_n"] - 1.0
    lines = ["  speed [m/s]   peak force [N]   fracture strain [%]"]
    lines += [
        f"  {r.solver.speed:11.3g}   {v['peak_force_n']:14.0f}   {v['fracture_strain_pct']:19.3f}"
        for r, v in zip((run, half), results, strict=True)
    ]
    passed = abs(change) < CONVERGED
    lines.append(f"  change of the peak {100.0 * change:+.2f} %: {'within' if passed else 'NOT within'} 1 %")
    return lines, passed
