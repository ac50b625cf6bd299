"""What a run would do, and whether its speed matters."""

from knittest.config.run import Run
from knittest.history import OVERLAP_COUNTS
from knittest.specimen import Prepared, prepare, run_specimen

#: change of the first result on halving the speed that still counts as converged [-]; 2 % where it is not named
CONVERGED = {"tensile": 0.01}
#: bytes a node takes in all arrays, about
BYTES_PER_NODE = 900


def preflight(run: Run) -> list[str]:
    """Lines for a user: model, masses, time step, steps, memory, initial overlap."""
    prepared = prepare(run)
    model = prepared.model
    overlaps = model.prepare()
    step = run.solver.safety * model.critical_step
    what = " ".join(part for part in (run.rig.kind, run.direction) if part)
    facts = ", ".join(f"{name.replace('_', ' ')} {value:g}" for name, value in prepared.facts.items())
    lines = [
        f"{run.fabric.name} ({run.parameters}), {what}, {run.model.scale}, {run.model.preset}",
        f"  specimen               {facts}",
        f"  elements, nodes        {len(model.mesh.cells)}, {model.n_nodes}",
        f"  mass                   {_mass(run, prepared)}",
        f"  time step              {1e3 * step:.4f} us, added mass {100.0 * model.added_mass:.2f} %",
        f"  steps, at most         {int(prepared.rig.duration / step)} ({prepared.rig.duration:.2f} ms of test)",
        f"  arrays                 {model.n_nodes * BYTES_PER_NODE / 1e6:.0f} MB, about",
    ]
    if run.model.scale == "meso":
        lines.append(
            f"  overlap at the start   {100.0 * overlaps.largest:.2f} % of a radius; {overlaps.count} contacts above "
            f"{100.0 * OVERLAP_COUNTS:g} %"
        )
        lines += [f"    {pair}" for pair in overlaps.worst]
    return lines


def _mass(run: Run, prepared: Prepared) -> str:
    """Area mass of the model beside that of the fabric."""
    mass, given = float(prepared.model.mass.sum()), run.fabric.area_mass
    modelled = 1e6 * mass / prepared.facts["area_mm2"]
    return f"{mass:.3f} g, {modelled:.0f} g/m2 ({given.source} {given.value:g} g/m2)"


def speed_study(run: Run) -> tuple[list[str], bool]:
    """All results at the speed of ``run`` and at half of it; whether the first of them holds within its tolerance."""
    half = run.model_copy(update={"solver": run.solver.model_copy(update={"speed": 0.5 * run.solver.speed})})
    results = [run_specimen(r).results for r in (run, half)]
    lines = [f"  {'':<28}{run.solver.speed:>10g} m/s{half.solver.speed:>10g} m/s    change"]
    changes = {}
    for name, fast in results[0].items():
        slow = results[1][name]
        changes[name] = fast / slow - 1.0 if slow else 0.0
        lines.append(f"  {name:<28}{fast:>14.5g}{slow:>14.5g}{100.0 * changes[name]:>+9.2f} %")
    first, limit = next(iter(changes)), CONVERGED.get(run.rig.kind, 0.02)
    passed = abs(changes[first]) < limit
    lines.append(f"  {first}: {'within' if passed else 'NOT within'} {100.0 * limit:g} %")
    return lines, passed
