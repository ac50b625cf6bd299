"""What a run would do, and whether its speed matters."""

from knittest.config.run import Run
from knittest.halving import CONVERGED, LIMIT, changes, halving
from knittest.history import OVERLAP_COUNTS
from knittest.specimen import Prepared, prepare, run_specimen

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
    """All results of ``run`` and of its half speed; whether the first of them holds within its tolerance."""
    study = halving(run)
    fast, slow = (run_specimen(r).results for r in (study.run, study.half))
    found = changes(fast, slow)
    heads = [f"{value:g} {study.unit}".removesuffix(" -") for value in (study.value, 0.5 * study.value)]
    lines = [f"  {study.setting:<34}{heads[0]:>14}{heads[1]:>14}    change"]
    lines += [f"  {n:<34}{fast[n]:>14.5g}{slow[n]:>14.5g}{100.0 * found[n]:>+9.2f} %" for n in fast]
    first, limit = next(iter(found)), CONVERGED.get(run.rig.kind, LIMIT)
    passed = abs(found[first]) < limit
    lines.append(f"  {first}: {'within' if passed else 'NOT within'} {100.0 * limit:g} %")
    return lines, passed
