"""Page of a calibration, and the calibrated fabric and rig as files for the other commands."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from knittest.base.files import write_atomic
from knittest.base.kinds import DEFAULT
from knittest.base.result_rows import LABELS, result_rows
from knittest.config.base import Quantity
from knittest.config.fields import field_at
from knittest.config.quality_checks import field_value
from knittest.config.run import RUNS, Run
from knittest.config.yaml_writer import dump_mapping
from knittest.export.lock import copy_into_run
from knittest.report_page.blocks import Block, Cell, Code, Table, Text, Tone
from knittest.report_page.files import Number, Reader, Summary
from knittest.report_page.pictures import picture
from knittest.report_page.studies import Column, file_to_save, link, provenance, split_table
from knittest.studies.calibrate.outcome import Calibration, Outcome, TargetRow
from knittest.studies.trials import page as parts
from knittest.studies.trials.runner import TRIALS

FABRIC, EXPERIMENT = "fabric.yaml", "experiment"


def rig_file(kind: str) -> str:
    """Name of the rig file of a test of ``kind``."""
    return f"rig-{kind}.yaml"


def write_configs(outcome: Outcome, folder: Path) -> list[Path]:
    """Write the calibrated fabric and the rig file of each calibrated kind of test; raises :class:`ResourceError`."""
    if outcome.best is None:
        raise ValueError("no point has a result")
    problem, values = outcome.problem, outcome.best.values
    origin = f"calibrated by knittest calibrate with {problem.name}.yaml; see calibration.json."
    written = []
    if any(path[0] == "fabric" for parameter in problem.parameters for path in parameter.paths):
        run = problem.run(problem.cases[0], values)
        text = dump_mapping(_fabric(outcome, run, folder), ("fabric",))
        write_atomic(folder / FABRIC, f"# Fabric {run.fabric.name}, {origin}\n{text}")
        written.append(folder / FABRIC)
    for kind in dict.fromkeys(case.kind for case in problem.cases):
        fields = _rig_fields(outcome, kind)
        if fields:
            head = [f"# Rig of knittest {kind}, {origin}"]
            head += [f"# {name}: {_provenance(outcome, k)}" for name, (_, k) in fields.items()]
            rig = {"kind": kind} | {name: value for name, (value, _) in fields.items()}
            write_atomic(folder / rig_file(kind), "\n".join(head) + "\n" + dump_mapping({"rig": rig}))
            written.append(folder / rig_file(kind))
    return written


def _fabric(outcome: Outcome, run: Run, folder: Path) -> dict[str, Any]:
    data: dict[str, Any] = run.fabric.model_dump(mode="json", exclude_none=True)
    before = outcome.problem.cases[0].run().fabric
    for k, parameter in enumerate(outcome.problem.parameters):
        for path in (p for p in parameter.paths if p[0] == "fabric"):
            field = field_at(path)
            if field is not None and field.is_quantity:
                keys = [str(part) for part in path[1:]]
                holder: Any = data
                for key in keys[:-1]:
                    holder = holder[int(key) if isinstance(holder, list) else key]
                quantity: Any = field_value(before, ".".join(keys))
                holder[keys[-1]] = _tuned_quantity(outcome, k, quantity)
    for name, text in run.fabric.macro.curve_files.items():
        part, _, direction = name.partition(".")
        data["macro"][part][direction or "curve"] = copy_into_run(text, folder, f"{name.replace('.', '-')}.csv")
    if data.get("experiment"):
        data["experiment"] = copy_into_run(data["experiment"], folder, EXPERIMENT)
    return data


def _tuned_quantity(outcome: Outcome, k: int, before: Quantity) -> dict[str, Any]:
    """Quantity with its new value; it keeps its scatter, which is that of the yarns or specimens."""
    scatter = {} if before.sd is None else {"sd": before.sd}
    value = outcome.best.values[k] if outcome.best else before.value
    rows = [target.label for target in outcome.problem.targets]
    ref = f"{_provenance(outcome, k)}; before: {before.value:g} ({before.source})"
    return {"value": value, **scatter, "source": "tuned", "tuned_on": rows, "ref": ref}


def _provenance(outcome: Outcome, k: int) -> str:
    """Method, residual, interval and runs of parameter ``k``."""
    case = outcome.problem.cases[0].run().model
    found = outcome.estimates.found[k] if outcome.estimates else None
    interval = f", 95 % interval {found.interval[0]:.4g} to {found.interval[1]:.4g}" if found else ""
    rows = ", ".join(target.label for target in outcome.problem.targets)
    return (
        f"tuned by knittest calibrate {outcome.problem.name} on {rows} ({case.scale}, {case.preset}, "
        f"{outcome.problem.method}, {outcome.runs} runs): residual {outcome.rms:.2g} sd{interval}"
    )


def _rig_fields(outcome: Outcome, kind: str) -> dict[str, tuple[float, int]]:
    """Value and number of the parameter, by field of the rig of ``kind``."""
    values = outcome.best.values if outcome.best else ()
    return {
        str(path[1]): (values[k], k)
        for k, parameter in enumerate(outcome.problem.parameters)
        for path in parameter.paths
        if path[0] == "rig" and field_at(path, kind) is not None
    }


CALIBRATION, PICTURE, COPY = "calibration.json", "convergence.png", "calibration.yaml"
INTERVAL_NOTE = (
    "The interval is that of single specimens, linearised, from the scatter of the targets, without modelling errors. "
    "Sensitivity is the change of all targets over the whole bounds."
)
KIND_NOTE = "Kinds are those of the fabric before: a row that follows from a target is no prediction either."


def _contents(reader: Reader, at: Path) -> parts.Contents:
    found = reader.model(CALIBRATION, Calibration)
    notes = parts.warning_texts(found.warnings)
    if found.status != "converged":
        reason = found.reason or "no reason is recorded"
        notes.insert(0, Text(f"Not converged: {reason}. This page shows no calibrated fabric.", "bad"))
    rms = found.rms_deviation_sd
    facts = {
        "state": found.status,
        "method": found.method,
        "runs": parts.runs_text(found.runs, found.runs_by_status),
        "residual, root mean square": "" if rms is None else f"{rms:.3g} sd",
        "knittest": found.version,
        "digest of the code": found.code,
        "written": found.written,
    }
    return parts.Contents(
        found.calibration, found.status, notes, [parts.facts_table("The calibration", facts)],
        [
            ("parameters", "Parameters", _parameters(found)),
            ("targets", "Targets", [*_targets(found), *_other_results(reader, found)]),
            ("convergence", "Convergence", [picture(reader.folder / PICTURE, "Course of the search")]),
            ("points", "Points of the search", _points(reader.folder, at, found)),
            ("repeat", "How to use and to repeat it", _repeat_blocks(reader, found)),
        ],
    )  # fmt: skip


PAGE = parts.StudyPage("Calibration", (CALIBRATION,), _contents)


def _parameters(found: Calibration) -> list[Block]:
    rows = found.parameters
    also = [f"and {', '.join(row.fields[1:])}" if len(row.fields) > 1 else "" for row in rows]
    named = [Cell(row.fields[0] if row.fields else "-", note=note) for row, note in zip(rows, also, strict=True)]
    columns = {
        "found (tuned)": [parts.number_cell(row.value, row.unit) for row in rows],
        "95 % interval": [Cell(_interval_text(row.interval_95)) for row in rows],
        "before": [parts.number_cell(row.before, note=row.before_source) for row in rows],
        "bounds": [Cell(_interval_text((row.low, row.high))) for row in rows],
        "prior": [Cell(_mean_sd_text(row.prior_mean, row.prior_sd)) for row in rows],
        "sensitivity [sd]": [parts.number_cell(row.sensitivity_sd, form="{:.3g}") for row in rows],
    }
    if all(row.prior_mean is None for row in rows):
        del columns["prior"]
    numeric = [Column(name, cells, numeric=True) for name, cells in columns.items()]
    tables = split_table("Parameters, fitted to the targets below", [Column("parameter", named)], numeric)
    return [*tables, Text(INTERVAL_NOTE)]


def _targets(found: Calibration) -> list[Block]:
    rows = []
    for row in found.targets:
        simulated = Cell("curve") if row.mean is None else parts.number_cell(row.simulated, form=_number_format(row))
        off, weight = row.deviation_sd, "" if row.weight == 1.0 else f", weight {row.weight:g}"
        tone: Tone = "" if off is None else "good" if abs(off) <= 1.0 else "bad"
        target = Cell(row.target, note=f"test {row.test}{weight}: {row.source}")
        deviation = Cell("-") if off is None else Cell(f"{off:+.3f} sd", tone=tone)
        rows.append((target, simulated, Cell(_mean_sd_text(row.mean, row.sd)), deviation, Cell("tuned")))
    header = ("target", "simulated", "wanted", "deviation", "kind")
    return [Table("Targets, at the values that were found", header, rows, (1, 2, 3))]


def _number_format(row: TargetRow) -> str:
    return LABELS.get(row.quantity, ("", "{:.5g}"))[1]


def _other_results(reader: Reader, found: Calibration) -> list[Block]:
    """Results of the same tests that were no targets, with the experiment."""
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
    return [Table("Other rows of the experiment that these tests have", header, rows, (1, 2, 3)), Text(KIND_NOTE)]


def _points(folder: Path, at: Path, found: Calibration) -> list[Block]:
    points = found.evaluations
    states = [
        Cell("no result", note=one.reason, tone="bad") if one.simulated is None
        else Cell("found", tone="good") if one is found.best else Cell("ran")
        for one in points
    ]  # fmt: skip
    naming = [Column("point", [Cell(str(one.number)) for one in points]), Column("state", states)]
    columns = [
        Column(
            row.fields[0].split(".", 1)[-1],
            [parts.number_cell(_value_at(one.values, k)) for one in points],
            numeric=True,
        )
        for k, row in enumerate(found.parameters)
    ]
    columns += [
        Column(row.target, [_simulated_cell(_value_at(one.simulated or (), k), row) for one in points], numeric=True)
        for k, row in enumerate(found.targets)
    ]
    for test in dict.fromkeys(test for one in points for test in one.trials):
        keys = [one.trials.get(test) for one in points]
        cells = [Cell(key[:6], href=link(folder, f"{TRIALS}/{key}", at)) if key else Cell("-") for key in keys]
        columns.append(Column(f"run {test}", cells))
    return split_table("All points that were tried; for curves the deviation", naming, columns)


def _value_at(values: Sequence[Number], k: int) -> Number:
    """``values[k]``; None if a damaged file has fewer."""
    return values[k] if k < len(values) else None


def _simulated_cell(value: Number, row: TargetRow) -> Cell:
    if value is None:
        return Cell("-")
    if row.mean is None or not row.sd:
        return Cell(f"{value:.3f} sd", value)
    return Cell(_number_format(row).format(value), value, note=f"{(value - row.mean) / row.sd:+.3f} sd")


def _repeat_blocks(reader: Reader, found: Calibration) -> list[Block]:
    blocks = parts.repeat_blocks("calibrate", COPY, "The calibration; paths in it start at its own folder", reader)
    if (reader.folder / FABRIC).exists():
        blocks.append(Code(f"knittest {DEFAULT} --fabric {FABRIC}", "A test with the calibrated fabric"))
        blocks += file_to_save(reader, FABRIC, "The calibrated fabric; your own files that it names are in its folder")
    for name in map(rig_file, RUNS):
        if (reader.folder / name).exists():
            blocks += file_to_save(reader, name, "A calibrated rig, for --config")
    keys = dict.fromkeys(key for one in found.evaluations for key in one.trials.values())
    return [*blocks, *provenance(reader.folder, [f"{TRIALS}/{key}" for key in keys])]


def _interval_text(ends: Any) -> str:
    low, high = ends if ends and len(ends) == 2 else (None, None)
    return "-" if low is None or high is None else f"{low:.4g} to {high:.4g}"


def _mean_sd_text(mean: Number, sd: Number) -> str:
    return "-" if mean is None or sd is None else f"{mean:.5g} ± {sd:.4g}"
