"""Numerical error of a finished run from repeats at half its speed and on another mesh, in parallel."""

import json
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from knittest.base.errors import InputError, ResourceError
from knittest.base.files import write_atomic
from knittest.base.history import Quality
from knittest.base.interrupts import Interrupted, Interrupts
from knittest.base.machine import available_cores
from knittest.base.result_rows import unfold_results
from knittest.base.summary import NumericalError, RepeatBlock, Summary, Verification
from knittest.config.run import Run
from knittest.export.files import json_text
from knittest.laboratory.halved_setting import halve_setting
from knittest.laboratory.numerical_error import CORRECTIONS, Numbers, Repeat, numerical_errors, remesh
from knittest.laboratory.restart import has_configured_speed, with_result_speed
from knittest.report_page.page import write_if_possible, write_report
from knittest.runs.execute import Outcome
from knittest.runs.options import RunOptions
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.runner import TRIALS, run_with_overview
from knittest.studies.trials.trial import FINAL_STATUSES, PATTERN, Record, Trial, trial_of

#: folder of the repeats in that of the run
FOLDER = "verify"
#: pattern of the ledger of the repeats
REPEATS = f"{FOLDER}/{PATTERN}"
#: time limit of a repeat: a multiple of the wall time of the run, and at least an hour [s]
PATIENCE, HOUR = 30.0, 3600.0
#: final statuses of a repeat: no other mesh fits, it would end the same way again, or it takes too long
ENDED_STATUSES = ("none", "timeout", *FINAL_STATUSES)


def needs_verification(folder: Path, run: Run) -> bool:
    """Tell whether the completed ``run`` in ``folder`` has to be verified; one that failed a quality check has not."""
    if not run.output.verify:
        return False
    summary = _summary(folder)
    known = summary.get("verification")
    repeats = [r for r in (known.get("half_speed"), known.get("mesh")) if r is not None] if known else []
    done = repeats and all(repeat.get("status") in ENDED_STATUSES for repeat in repeats)
    return not (summary["refused"] or done)


def read_outcome(run: Run, folder: Path, against: Sequence[Path] = ()) -> Outcome:
    """Outcome of the completed ``run``, compared with ``against``; raises :class:`InputError` for a damaged summary."""
    summary, curves = _summary(folder), []
    found = {name: summary["quality"].get(name) for name in Quality.__dataclass_fields__}
    quality = Quality(**{name: math.nan if value is None else value for name, value in found.items()})  # type: ignore[arg-type]
    quality = replace(quality, failures=tuple(summary["refused"]), warnings=tuple(summary["warnings"]))
    if against:  # the last curves of the comparison are those of the user
        curves = json.loads((folder / "comparison.json").read_text(encoding="utf-8"))["curves"][-len(against) :]
    return Outcome(run, folder, summary, quality, curves)


def verify_outcome(outcome: Outcome, options: RunOptions, interrupts: Interrupts) -> Outcome:
    """Add numerical errors to ``outcome``, its summary and page; a signal or a full disk raises with the folder."""
    if outcome.quality.failures:
        return outcome
    run = with_result_speed(outcome.run, _first_results(outcome))
    repeats, notes = _repeats(run)
    try:
        records = _records(list(repeats.values()), outcome, options)
        interrupts.check()
        coarse = records[repeats["mesh"].key] if "mesh" in repeats and not notes["mesh"]["finer"] else None
        if coarse is not None and coarse.status in ("refused", "failed"):  # a finer mesh replaces a mesh too coarse
            with suppress(InputError):  # no finer mesh fits
                trial, note = _mesh_repeat(run, finer=True)
                instead = f"{notes['mesh']['other_value']}: {coarse.status}: {coarse.reason}"
                repeats["mesh"], notes["mesh"] = trial, note | {"instead_of": instead}
            if "instead_of" in notes["mesh"]:
                records |= _records([repeats["mesh"]], outcome, options)
                interrupts.check()
    except (Interrupted, ResourceError) as error:
        error.folder = outcome.folder
        raise
    summary = _with_errors(outcome, repeats, notes, records)
    write_atomic(outcome.folder / "summary.json", json_text(summary))
    if options.pictures:
        write_if_possible(outcome.folder, write_report)
    return replace(outcome, summary=json.loads(json_text(summary)))


def _first_results(outcome: Outcome) -> dict[str, float | None]:
    """Results of the first specimen of ``outcome``."""
    results = unfold_results(outcome.summary["results"])
    return {k: v["values"][0] if isinstance(v, Mapping) else v for k, v in results.items()}


def first_specimen_run(run: Run) -> Run:
    """First specimen of ``run`` as a run of its own that is not verified."""
    update: dict[str, Any] = {"output": run.output.model_copy(update={"verify": False})}
    if run.variability.specimens > 1:  # an ensemble draws its specimens at random
        update["variability"] = run.variability.model_copy(update={"specimens": 1, "mode": "random"})
    return run.model_copy(update=update)


def _repeats(run: Run) -> tuple[dict[str, Trial], dict[str, RepeatBlock]]:
    """Possible repeats by name, and their blocks in summary.json."""
    half, name = halve_setting(first_specimen_run(run)), f"{run.rig.kind} {run.direction}".strip()
    value, other = (f"{number:g} {half.unit}".removesuffix(" -") for number in (half.value, 0.5 * half.value))
    trials = {"half_speed": trial_of(half.half, f"{name}, {half.setting} {other}")}
    notes: dict[str, RepeatBlock] = {"half_speed": {"setting": half.setting, "value": value, "other_value": other}}
    try:
        trials["mesh"], notes["mesh"] = _mesh_repeat(run, finer=False)
    except InputError as error:
        notes["mesh"] = {"status": "none", "reason": str(error)}
    return trials, notes


def _mesh_repeat(run: Run, finer: bool) -> tuple[Trial, RepeatBlock]:
    """Repeat on another mesh, and its block in summary.json; raises :class:`InputError` if no mesh fits."""
    mesh = remesh(first_specimen_run(run), finer)
    return trial_of(mesh.other, f"{run.rig.kind} {run.direction}".strip() + f", {mesh.setting} {mesh.other_value}"), {
        "setting": mesh.setting, "value": mesh.value, "other_value": mesh.other_value, "ratio": mesh.ratio,
        "finer": mesh.finer,
    }  # fmt: skip


def _records(trials: list[Trial], outcome: Outcome, options: RunOptions) -> dict[str, Record]:
    """Run unfinished trials, in parallel if there are cores; records by key."""
    threads = options.threads or available_cores()
    workers = min(len(trials), threads)
    pool = LocalPool(workers, max(threads // workers, 1))
    limit = max(PATIENCE * float(outcome.summary["cost"]["wall_s"] or 0.0), HOUR)
    return run_with_overview(trials, outcome.folder / FOLDER, pool, limit=limit, quiet=options.quiet)


def _with_errors(
    outcome: Outcome, trials: Mapping[str, Trial], notes: Mapping[str, RepeatBlock], records: Mapping[str, Record]
) -> Summary:
    """Summary of ``outcome`` with the blocks ``numerical_error`` and ``verification``."""
    blocks: dict[str, RepeatBlock] = {name: {**note} for name, note in notes.items()}
    repeats = {name: Repeat({}, note.get("reason", "")) for name, note in notes.items()}
    for name, trial in trials.items():
        record = records[trial.key]
        cost = record.cost
        blocks[name] |= {
            "status": record.status, "reason": record.reason, "folder": f"{FOLDER}/{TRIALS}/{trial.key}",
            "wall_s": cost["wall_s"] if cost else None, "cpu_s": cost["cpu_s"] if cost else None,
        }  # fmt: skip
        at = f"{blocks[name]['setting']} {blocks[name]['other_value']}"
        reason = "" if record.status == "completed" else f"{at}: {record.status}: {record.reason}"
        if not reason and not has_configured_speed(trial.run, record.results):
            reason = f"{at}: restarted at a lower speed"
        repeats[name] = Repeat({} if reason else record.results, reason)
    errors = _errors(outcome.run, _first_results(outcome), repeats, blocks["mesh"])
    repeated: Verification = {"specimen": 1, "half_speed": blocks["half_speed"], "mesh": blocks["mesh"]}
    return {**outcome.summary, "numerical_error": errors, "verification": repeated}


def _errors(run: Run, values: Numbers, repeats: Mapping[str, Repeat], mesh: RepeatBlock) -> dict[str, NumericalError]:
    """Numerical errors of ``values`` with the corrections that the test knows (:class:`Corrections`): the error
    contains the correction, and the changes are those of corrected results.
    """
    known = CORRECTIONS[run.rig.kind]
    exact, rested = known.exact(run, values), known.correct_to_equilibrium(run, values)
    pair = (repeats["half_speed"], repeats["mesh"])
    half, other = (replace(one, results=known.exact(run, one.results)) for one in pair)
    errors = numerical_errors(exact, half, other, mesh.get("ratio", 2.0), mesh.get("finer", False))
    for quantity, row in errors.items():
        value, there, later = values[quantity], exact[quantity], rested[quantity]
        if row["error"] is not None and value is not None and there is not None and later is not None:
            row["error"] += abs(there - value) + abs(later - there)
    return errors


def _summary(folder: Path) -> Summary:
    path = folder / "summary.json"
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
        missing = {"results", "quality", "cost", "refused", "warnings"} - set(summary)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"{path}: not the summary of a completed run: {error}") from None
    if missing:
        raise InputError(f"{path}: not the summary of a completed run: no {', '.join(sorted(missing))}")
    return cast(Summary, summary)
