"""The model of a run before it starts: sizes, masses, time step, steps, memory, initial overlap."""

from typing import NotRequired, TypedDict

from knittest.base.history import OVERLAP_COUNTS
from knittest.config.doubtful import doubts
from knittest.config.run import Run
from knittest.config.sources import numbers_of
from knittest.laboratory.base import Prepared

#: bytes a node takes in all arrays, about
BYTES_PER_NODE = 900


class ModelFacts(TypedDict):
    """Numbers of a model, with their units in the names; overlaps are of yarns."""

    fabric: str
    parameters: str
    test: str
    direction: str
    scale: str
    preset: str
    specimen: dict[str, float]
    elements: int
    nodes: int
    mass_g: float
    area_mass_g_m2: float
    time_step_us: float
    added_mass_pct: float
    steps_at_most: int
    duration_ms: float
    arrays_mb: float
    notes: list[str]
    overlap_pct: NotRequired[float]
    overlapping_contacts: NotRequired[int]
    worst_overlaps: NotRequired[list[str]]
    tools: NotRequired[dict[str, object]]
    estimate: NotRequired[dict[str, object] | None]
    converged: NotRequired[bool]


def model_facts(run: Run, prepared: Prepared) -> ModelFacts:
    """Numbers of the ``prepared`` model of ``run``, with their units in the names."""
    model = prepared.model
    overlaps = model.prepare()
    step = run.solver.safety * model.critical_step
    mass = float(model.mass.sum())
    facts: ModelFacts = {
        "fabric": run.fabric.name,
        "parameters": run.parameters,
        "test": run.rig.kind,
        "direction": run.direction,
        "scale": run.model.scale,
        "preset": run.model.preset,
        "specimen": prepared.facts,
        "elements": len(model.mesh.cells),
        "nodes": model.n_nodes,
        "mass_g": mass,
        "area_mass_g_m2": 1e6 * mass / prepared.facts["area_mm2"],
        "time_step_us": 1e3 * step,
        "added_mass_pct": 100.0 * model.added_mass,
        "steps_at_most": int(prepared.duration / step),
        "duration_ms": prepared.duration,
        "arrays_mb": model.n_nodes * BYTES_PER_NODE / 1e6,
        "notes": [*prepared.notes, *doubts(run)],
    }
    if run.model.scale == "meso":
        facts |= {
            "overlap_pct": 100.0 * overlaps.largest, "overlapping_contacts": overlaps.count,
            "worst_overlaps": list(overlaps.worst),
        }  # fmt: skip
    return facts


def model_lines(run: Run, facts: ModelFacts) -> list[str]:
    """:func:`model_facts` as lines for a user."""
    what = " ".join(part for part in (facts["test"], facts["direction"]) if part)
    specimen = ", ".join(f"{name.replace('_', ' ')} {value:g}" for name, value in facts["specimen"].items())
    given = run.fabric.area_mass
    lines = [
        f"{facts['fabric']} ({numbers_of(facts['parameters'])}), {what}, {facts['scale']}, {facts['preset']}",
        f"  specimen               {specimen}",
        f"  elements, nodes        {facts['elements']}, {facts['nodes']}",
        f"  mass                   {facts['mass_g']:.3f} g, {facts['area_mass_g_m2']:.0f} g/m2 ({given.source} "
        f"{given.value:g} g/m2)",
        f"  time step              {facts['time_step_us']:.4f} us, added mass {facts['added_mass_pct']:.2f} %",
        f"  steps, at most         {facts['steps_at_most']} ({facts['duration_ms']:.2f} ms of test)",
        f"  arrays                 {facts['arrays_mb']:.0f} MB, about",
    ]
    if "overlap_pct" in facts:
        lines.append(
            f"  overlap at the start   {facts['overlap_pct']:.2f} % of a radius; {facts['overlapping_contacts']} "
            f"contacts above {100.0 * OVERLAP_COUNTS:g} %"
        )
        lines += [f"    {pair}" for pair in facts["worst_overlaps"]]
    return [*lines, *(f"  note                   {note}" for note in facts["notes"])]
