"""The page of a calibration, and the calibrated fabric and rig as files that the other commands read."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from knittest.base.files import write_atomic
from knittest.base.kinds import DEFAULT
from knittest.base.result_rows import LABELS, result_rows
from knittest.config.base import Quantity
from knittest.config.dumping import dump_mapping
from knittest.config.fields import place
from knittest.config.run import RUNS, Run
from knittest.config.yaml_loader import KeyPath
from knittest.export.lock import kept_beside
from knittest.report_page.blocks import Block, Cell, Code, Page, Section, Table, Text, Tone
from knittest.report_page.files import Number, Reader, Summary
from knittest.report_page.page import target_file, write_page
from knittest.report_page.pictures import picture
from knittest.report_page.studies import Column, file_to_save, link, problems, provenance, wide
from knittest.studies.calibrate.outcome import Calibration, Outcome, Point, StoredParameter, StoredTarget
from knittest.studies.calibrate.problem import Parameter
from knittest.studies.trials.runner import TRIALS

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
                _put(data, path[1:], _tuned(outcome, k, _quantity_at(here, path[1:])))
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


def _quantity_at(model: Any, path: KeyPath) -> Quantity:
    for part in path:
        model = getattr(model, str(part))
    quantity: Quantity = model
    return quantity


def _put(data: dict[str, Any], path: KeyPath, value: object) -> None:
    for part in path[:-1]:
        data = data[str(part)]
    data[str(path[-1])] = value


CALIBRATION, PICTURE, COPY = "calibration.json", "convergence.png", "calibration.yaml"


def is_calibration(folder: Path) -> bool:
    """Tell whether ``folder`` is that of a calibration that came to an end."""
    return (folder / CALIBRATION).is_file()


def write_calibration_page(folder: Path, out: Path | None = None) -> Path:
    """Write the page of the calibration in ``folder`` into it, or to ``out``; raises as ``write_reports`` does."""
    target = target_file([folder], out)
    return write_page(target, calibration_page(folder, target.parent))


def calibration_page(folder: Path, at: Path) -> Page:
    """The page of the calibration in ``folder``, to lie in the folder ``at``.

    What is missing or damaged is named on it and costs its own part only.
    """
    reader = Reader(folder)
    found = reader.model(CALIBRATION, Calibration)
    parts = [
        Section("parameters", "Parameters", _parameters(found), 2),
        Section("targets", "Targets", [*_targets(found), *_others(reader, found)], 2),
        Section("convergence", "Convergence", [picture(folder / PICTURE, "How the search went")], 2),
        Section("points", "Points of the search", _points(folder, at, found), 2),
        Section("repeat", "How to use and to repeat it", _repeat(reader, found), 2),
    ]
    head = Section("summary", "Calibration", [*_ending(found), *problems(reader), _facts(found)], 2)
    return Page(f"Calibration {found.calibration or folder.resolve().name}", found.status, [head, *parts])


def _ending(found: Calibration) -> list[Block]:
    blocks: list[Block] = []
    if found.status != "converged":
        reason = found.reason or "no reason is recorded"
        blocks.append(Text(f"Not converged: {reason}. What stands here is no calibrated fabric.", "bad"))
    return [*blocks, *(Text(f"Warning: {text}.", "warn") for text in found.warnings)]


def _facts(found: Calibration) -> Block:
    states = ", ".join(f"{count} {status}" for status, count in found.runs_by_status.items())
    rms = found.rms_deviation_sd
    facts = {
        "state": found.status,
        "method": found.method,
        "runs": f"{found.runs}" + (f" ({states})" if states else ""),
        "residual, root mean square": "" if rms is None else f"{rms:.3g} sd",
        "knittest": found.version,
        "digest of the code": found.code,
        "written": found.written,
    }
    return Table("The calibration", (), [(Cell(name), Cell(value)) for name, value in facts.items() if value])


def _parameters(found: Calibration) -> list[Block]:
    rows = found.parameters
    named = [Cell(row.fields[0] if row.fields else "-", note=_also(row)) for row in rows]
    columns = [
        Column("found (tuned)", [_cell(row.value, row.unit) for row in rows], numeric=True),
        Column("95 % interval", [Cell(_between(row.interval_95)) for row in rows], numeric=True),
        Column("before", [_cell(row.before, "", row.before_source) for row in rows], numeric=True),
        Column("bounds", [Cell(_between((row.low, row.high))) for row in rows], numeric=True),
        Column("prior", [Cell(_spread(row.prior_mean, row.prior_sd)) for row in rows], numeric=True),
        Column("sensitivity [sd]", [_cell(row.sensitivity_sd, "", form="{:.3g}") for row in rows], numeric=True),
    ]
    if all(row.prior_mean is None for row in rows):
        del columns[4]
    told = (
        "The interval is that of single specimens, linearised, from the scatter of the targets; modelling errors are "
        "not in it. Sensitivity is the change of all targets over the whole bounds."
    )
    return [*wide("Parameters, fitted to the targets below", [Column("parameter", named)], columns), Text(told)]


def _also(row: StoredParameter) -> str:
    return f"and {', '.join(row.fields[1:])}" if len(row.fields) > 1 else ""


def _targets(found: Calibration) -> list[Block]:
    header = ("target", "simulated", "wanted", "deviation", "kind")
    caption = "Targets, at the values that were found"
    return [Table(caption, header, [_target(row) for row in found.targets], (1, 2, 3))]


def _target(row: StoredTarget) -> tuple[Cell, ...]:
    form = LABELS.get(row.quantity, ("", "{:.5g}"))[1]
    simulated = Cell("curve") if row.mean is None else _cell(row.simulated, "", form=form)
    off, weight = row.deviation_sd, "" if row.weight == 1.0 else f", counted {row.weight:g} times"
    tone: Tone = "" if off is None else "good" if abs(off) <= 1.0 else "bad"
    return (
        Cell(row.target, note=f"test {row.test}{weight}: {row.source}"), simulated, Cell(_spread(row.mean, row.sd)),
        Cell("-") if off is None else Cell(f"{off:+.3f} sd", tone=tone), Cell("tuned"),
    )  # fmt: skip


def _others(reader: Reader, found: Calibration) -> list[Block]:
    """Results of the same tests that were no targets, beside the experiment."""
    aims = {(row.test, row.quantity) for row in found.targets}
    rows = []
    for test, key in (found.best.trials if found.best else {}).items():
        summary = Reader(reader.folder / TRIALS / key).model("summary.json", Summary)
        others = result_rows(summary.plain(), refused=bool(summary.refused))
        rows += [
            (Cell(one.label, note=f"test {test}"), Cell(one.simulated, one.value), Cell(one.experiment),
             Cell(one.deviation), Cell(one.kind))
            for one in others if one.kind != "-" and (test, one.quantity) not in aims
        ]  # fmt: skip
    if not rows:
        return []
    header = ("quantity", "simulated", "experiment", "deviation", "kind")
    told = "Kinds are those of the fabric before: a row that follows from a target is no prediction either."
    return [Table("Other rows of the experiment that these tests gave there", header, rows, (1, 2, 3)), Text(told)]


def _points(folder: Path, at: Path, found: Calibration) -> list[Block]:
    points = found.evaluations
    naming = [
        Column("point", [Cell(str(one.number)) for one in points]),
        Column("state", [_state(one, found.best) for one in points]),
    ]
    columns = [
        Column(row.fields[0].split(".", 1)[-1], [_at(one.values, k) for one in points], numeric=True)
        for k, row in enumerate(found.parameters)
    ]
    columns += [
        Column(row.target, [_reached(one, k, row) for one in points], numeric=True)
        for k, row in enumerate(found.targets)
    ]
    tests = list(dict.fromkeys(test for one in points for test in one.trials))
    columns += [Column(f"run {test}", [_trial(folder, at, one.trials.get(test)) for one in points]) for test in tests]
    return wide("Every point that was tried; of curves the deviation", naming, columns)


def _state(one: Point, best: Point | None) -> Cell:
    if one.simulated is None:
        return Cell("no number", note=one.reason, tone="bad")
    return Cell("found", tone="good") if one is best else Cell("ran")


def _at(values: Sequence[float], k: int) -> Cell:
    return _cell(values[k] if k < len(values) else None, "")


def _reached(one: Point, k: int, row: StoredTarget) -> Cell:
    value = one.simulated[k] if one.simulated and k < len(one.simulated) else None
    if value is None:
        return Cell("-")
    if row.mean is None or not row.sd:
        return Cell(f"{value:.3f} sd", value)
    form = LABELS.get(row.quantity, ("", "{:.5g}"))[1]
    return Cell(form.format(value), value, note=f"{(value - row.mean) / row.sd:+.3f} sd")


def _trial(folder: Path, at: Path, key: str | None) -> Cell:
    return Cell(key[:6], href=link(folder, f"{TRIALS}/{key}", at)) if key else Cell("-")


def _repeat(reader: Reader, found: Calibration) -> list[Block]:
    blocks: list[Block] = [Code(f"knittest calibrate {COPY}", f"Command; {COPY} is the one below")]
    blocks += file_to_save(reader, COPY, "The calibration; its files are seen from its own folder")
    if (reader.folder / FABRIC).exists():
        blocks.append(Code(f"knittest {DEFAULT} --fabric {FABRIC}", "A test with the calibrated fabric"))
        blocks += file_to_save(reader, FABRIC, "The calibrated fabric; files of yours that it names lie in its folder")
    for name in (rig_file(kind) for kind in RUNS):
        if (reader.folder / name).exists():
            blocks += file_to_save(reader, name, "A calibrated rig, for --config")
    keys = dict.fromkeys(key for one in found.evaluations for key in one.trials.values())
    return [*blocks, *provenance(reader.folder, [f"{TRIALS}/{key}" for key in keys])]


def _cell(value: Number, unit: str, note: str = "", form: str = "{:.5g}") -> Cell:
    if value is None or not math.isfinite(value):
        return Cell("-", note=note)
    return Cell(form.format(value) + (f" {unit}" if unit not in ("", "1") else ""), value, note=note)


def _between(ends: Any) -> str:
    low, high = ends if ends and len(ends) == 2 else (None, None)
    return "-" if low is None or high is None else f"{low:.4g} to {high:.4g}"


def _spread(mean: Number, sd: Number) -> str:
    return "-" if mean is None or sd is None else f"{mean:.5g} ± {sd:.4g}"
