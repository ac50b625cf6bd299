"""The calibrated fabric and rig, as files that the other commands read."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from knittest.base.atomic import write_atomic
from knittest.config.base import Quantity
from knittest.config.dumping import dump_mapping
from knittest.config.fields import place
from knittest.config.run import Run
from knittest.config.yaml_loader import KeyPath
from knittest.export.own_data import kept_beside
from knittest.studies.calibrate.outcome import Outcome
from knittest.studies.calibrate.parameters import Parameter

FABRIC, EXPERIMENT = "fabric.yaml", "experiment"


def rig_file(kind: str) -> str:
    """Name of the rig file of a test of ``kind``."""
    return f"rig-{kind}.yaml"


def write_configs(outcome: Outcome, folder: Path) -> list[Path]:
    """Write the calibrated fabric, and a rig file for each kind of test that has a calibrated field, to ``folder``.

    Raises :class:`ResourceError`.
    """
    if outcome.best is None:
        raise ValueError("nothing was found")
    problem, values = outcome.problem, outcome.best.values
    written = []
    if any(path[0] == "fabric" for parameter in problem.parameters for path in parameter.paths):
        run = problem.run(problem.cases[0], values)
        text = f"# Fabric {run.fabric.name}, {_headline(outcome)}\n" + dump_mapping(
            _fabric(outcome, run, folder), ("fabric",)
        )
        write_atomic(folder / FABRIC, text)
        written.append(folder / FABRIC)
    for kind in dict.fromkeys(case.kind for case in problem.cases):
        fields = _rig_fields(outcome, kind)
        if fields:
            head = [f"# Rig of knittest {kind}, {_headline(outcome)}"]
            head += [f"# {name}: {_story(outcome, k)}" for name, (_, k) in fields.items()]
            rig = {"kind": kind} | {name: value for name, (value, _) in fields.items()}
            write_atomic(folder / rig_file(kind), "\n".join(head) + "\n" + dump_mapping({"rig": rig}))
            written.append(folder / rig_file(kind))
    return written


def _headline(outcome: Outcome) -> str:
    return f"calibrated by knittest calibrate with {outcome.problem.name}.yaml; calibration.json has the record."


def _fabric(outcome: Outcome, run: Run, folder: Path) -> dict[str, Any]:
    """Fields of the fabric of ``run`` with the tuned quantities and their provenance."""
    data: dict[str, Any] = run.fabric.model_dump(mode="json", exclude_none=True)
    here = outcome.problem.cases[0].run().fabric
    for k, parameter in enumerate(outcome.problem.parameters):
        for path in (p for p in parameter.paths if p[0] == "fabric"):
            field = place(path)
            if field is not None and field.is_quantity:
                _put(data, path[1:], _tuned(outcome, k, _at(here, path[1:])))
    for name, text in run.fabric.macro.curve_files.items():
        part, _, direction = name.partition(".")
        data["macro"][part][direction or "curve"] = kept_beside(text, folder, f"{name.replace('.', '-')}.csv")
    if data.get("experiment"):
        data["experiment"] = kept_beside(data["experiment"], folder, EXPERIMENT)
    return data


def _tuned(outcome: Outcome, k: int, before: Quantity) -> dict[str, Any]:
    """A quantity with its new value; its scatter stays, which is that of the yarns or specimens."""
    scatter = {} if before.sd is None else {"sd": before.sd}
    value = outcome.best.values[k] if outcome.best else before.value
    rows = [target.label for target in outcome.problem.targets]
    ref = f"{_story(outcome, k)}; before: {before.value:g} ({before.source})"
    return {"value": value, **scatter, "source": "tuned", "tuned_on": rows, "ref": ref}


def _story(outcome: Outcome, k: int) -> str:
    """Method, residual, interval and runs of parameter ``k``."""
    case = outcome.problem.cases[0].run().model
    found = outcome.judgement.found[k] if outcome.judgement else None
    interval = f", 95 % interval {found.interval[0]:.4g} to {found.interval[1]:.4g}" if found else ""
    rows = ", ".join(target.label for target in outcome.problem.targets)
    return (
        f"tuned by knittest calibrate {outcome.problem.name} on {rows} ({case.scale}, {case.preset}, "
        f"{outcome.problem.method}, {outcome.runs} runs): residual {outcome.rms:.2g} sd{interval}"
    )


def _rig_fields(outcome: Outcome, kind: str) -> dict[str, tuple[float, int]]:
    """Value and number of the parameter, by field of the rig of ``kind``."""
    parameters: Sequence[Parameter] = outcome.problem.parameters
    values = outcome.best.values if outcome.best else ()
    return {
        str(path[1]): (values[k], k)
        for k, parameter in enumerate(parameters)
        for path in parameter.paths
        if path[0] == "rig" and place(path, kind) is not None
    }


def _at(model: Any, path: KeyPath) -> Quantity:
    for part in path:
        model = getattr(model, str(part))
    quantity: Quantity = model
    return quantity


def _put(data: dict[str, Any], path: KeyPath, value: object) -> None:
    for part in path[:-1]:
        data = data[str(part)]
    data[str(path[-1])] = value
