"""Repeats a finished run at half its speed and on another mesh, side by side, and gives its results their error."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from knittest.base.errors import InputError, ResourceError
from knittest.base.files import write_atomic
from knittest.base.history import Quality
from knittest.base.interrupts import Interrupted, Interrupts
from knittest.base.result_rows import unfolded
from knittest.base.summary import NumericalError, RepeatBlock, Summary, Verification
from knittest.config.run import Run
from knittest.export.files import json_text
from knittest.export.identity import cores
from knittest.laboratory.after_rest import at_result_speed, kept_speed
from knittest.laboratory.halving import halving
from knittest.laboratory.numerical_error import CORRECTIONS, Numbers, Repeat, numerical_errors, remeshing
from knittest.report_page.page import write_if_possible, write_report
from knittest.runs.execute import Outcome
from knittest.runs.options import RunOptions
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.runner import TRIALS, run_shown
from knittest.studies.trials.trial import PATTERN, SETTLED, Record, Trial, trial_of

#: folder of the repeats in that of the run
FOLDER = "verify"
#: what tells that there are some, of a run that is completed itself
REPEATS = f"{FOLDER}/{PATTERN}"
#: wall seconds that a repeat may take: a multiple of those of the run, and never less than an hour
PATIENCE, HOUR = 30.0, 3600.0
#: ends of a repeat that stand: no other mesh fits, it would come to the same, or it takes too long
ENDED = ("none", "timeout", *SETTLED)


def unverified(folder: Path, run: Run) -> bool:
    """Tell whether the completed ``run`` in ``folder`` is still to be verified; one that was refused is not."""
    if not run.output.verify:
        return False
    summary = _summary(folder)
    told = summary.get("verification")
    repeats = [r for r in (told.get("half_speed"), told.get("mesh")) if r is not None] if told else []
    done = repeats and all(repeat.get("status") in ENDED for repeat in repeats)
    return not (summary["refused"] or done)


def finished(run: Run, folder: Path, against: Sequence[Path] = ()) -> Outcome:
    """The outcome of the completed ``run`` in ``folder``, compared with the curves ``against``.

    Raises :class:`InputError` where its summary is damaged.
    """
    summary = _summary(folder)
    quality, unknown = summary["quality"], float("nan")
    found = {name: quality.get(name) for name in Quality.__dataclass_fields__}
    gates = Quality(**{name: unknown if value is None else value for name, value in found.items()})  # type: ignore[arg-type]
    told = replace(gates, failures=tuple(summary["refused"]), warnings=tuple(summary["warnings"]))
    return Outcome(run, folder, summary, told, _own_curves(folder, len(against)))


def _own_curves(folder: Path, count: int) -> list[dict[str, object]]:
    """Metrics of the last ``count`` curves of comparison.json, the user's own."""
    if count == 0:
        return []
    curves: list[dict[str, object]] = json.loads((folder / "comparison.json").read_text(encoding="utf-8"))["curves"]
    return curves[-count:]


def verified(outcome: Outcome, options: RunOptions, interrupts: Interrupts) -> Outcome:
    """``outcome`` with its numerical errors, written to summary and page; as it is where its comparison is refused.

    Repeats that are finished in the folder are not run again. Raises :class:`Interrupted` and :class:`ResourceError`
    with the folder.
    """
    if outcome.quality.failures:
        return outcome
    repeats, notes = _repeats(_at_result_speed(outcome))
    try:
        records = _records(list(repeats.values()), outcome, options)
        interrupts.check()
        if _too_coarse(repeats, notes, records) and (finer := _finer(_at_result_speed(outcome))):
            told = records[repeats["mesh"].key]
            instead = f"{notes['mesh']['other_value']}: {told.status}: {told.reason}"
            repeats["mesh"], notes["mesh"] = finer[0], finer[1] | {"instead_of": instead}
            records |= _records([repeats["mesh"]], outcome, options)
            interrupts.check()
    except (Interrupted, ResourceError) as error:
        error.folder = outcome.folder
        raise
    summary = _judged(outcome, repeats, notes, records)
    write_atomic(outcome.folder / "summary.json", json_text(summary))
    if options.pictures:
        write_if_possible(outcome.folder, write_report)
    return replace(outcome, summary=json.loads(json_text(summary)))


def _at_result_speed(outcome: Outcome) -> Run:
    """Run of ``outcome`` at the speed of its first specimen."""
    return at_result_speed(outcome.run, _first(outcome))


def _first(outcome: Outcome) -> dict[str, float | None]:
    """Results of the first specimen of ``outcome``."""
    results = unfolded(outcome.summary["results"])
    return {k: v["values"][0] if isinstance(v, Mapping) else v for k, v in results.items()}


def first_alone(run: Run) -> Run:
    """The first specimen of ``run`` as a run of its own that is not verified."""
    update: dict[str, Any] = {"output": run.output.model_copy(update={"verify": False})}
    if run.variability.specimens > 1:  # those of an ensemble are drawn at random
        update["variability"] = run.variability.model_copy(update={"specimens": 1, "mode": "random"})
    return run.model_copy(update=update)


def _repeats(run: Run) -> tuple[dict[str, Trial], dict[str, RepeatBlock]]:
    """The repeats by name, those that there are, and what summary.json says of them."""
    alone = first_alone(run)
    half = halving(alone)
    value, other = (f"{number:g} {half.unit}".removesuffix(" -") for number in (half.value, 0.5 * half.value))
    trials = {"half_speed": trial_of(half.half, f"{_name(run)}, {half.setting} {other}")}
    notes: dict[str, RepeatBlock] = {"half_speed": {"setting": half.setting, "value": value, "other_value": other}}
    try:
        trials["mesh"], notes["mesh"] = _mesh(run, finer=False)
    except InputError as error:
        notes["mesh"] = {"status": "none", "reason": str(error)}
    return trials, notes


def _mesh(run: Run, finer: bool) -> tuple[Trial, RepeatBlock]:
    """The repeat on another mesh, and what summary.json says of it; raises :class:`InputError` where none fits."""
    mesh = remeshing(first_alone(run), finer)
    return trial_of(mesh.other, f"{_name(run)}, {mesh.setting} {mesh.other_value}"), {
        "setting": mesh.setting, "value": mesh.value, "other_value": mesh.other_value, "ratio": mesh.ratio,
        "finer": mesh.finer,
    }  # fmt: skip


def _finer(run: Run) -> tuple[Trial, RepeatBlock] | None:
    try:
        return _mesh(run, finer=True)
    except InputError:  # none fits: what became of the coarser one stands
        return None


def _too_coarse(trials: Mapping[str, Trial], notes: Mapping[str, RepeatBlock], records: Mapping[str, Record]) -> bool:
    """Tell whether a coarser mesh has no result of its own, and a finer one may take its place."""
    if "mesh" not in trials or notes["mesh"]["finer"]:
        return False
    return records[trials["mesh"].key].status in ("refused", "failed")


def _name(run: Run) -> str:
    return " ".join(part for part in (run.rig.kind, run.direction) if part)


def _records(trials: list[Trial], outcome: Outcome, options: RunOptions) -> dict[str, Record]:
    """Run what is not finished, side by side where there are cores; records by key."""
    threads = options.threads or cores()
    workers = min(len(trials), threads)
    pool = LocalPool(workers, max(threads // workers, 1))
    limit = max(PATIENCE * float(outcome.summary["cost"]["wall_s"] or 0.0), HOUR)
    return run_shown(trials, outcome.folder / FOLDER, pool, limit=limit, quiet=options.quiet)


def _judged(
    outcome: Outcome, trials: Mapping[str, Trial], notes: Mapping[str, RepeatBlock], records: Mapping[str, Record]
) -> Summary:
    """Summary of ``outcome`` with the blocks ``numerical_error`` and ``verification``."""
    values = _first(outcome)
    told: dict[str, RepeatBlock] = {name: {**note} for name, note in notes.items()}
    repeats = {name: Repeat({}, note.get("reason", "")) for name, note in notes.items()}
    for name, trial in trials.items():
        record = records[trial.key]
        cost = record.cost
        told[name] |= {
            "status": record.status, "reason": record.reason, "folder": f"{FOLDER}/{TRIALS}/{trial.key}",
            "wall_s": cost["wall_s"] if cost else None, "cpu_s": cost["cpu_s"] if cost else None,
        }  # fmt: skip
        at = f"{told[name]['setting']} {told[name]['other_value']}"
        reason = "" if record.status == "completed" else f"{at}: {record.status}: {record.reason}"
        if not reason and not kept_speed(trial.run, record.results):
            reason = f"{at}: restarted at a lower speed"
        repeats[name] = Repeat({} if reason else record.results, reason)
    errors = _errors(outcome.run, values, repeats, told["mesh"])
    repeated: Verification = {"specimen": 1, "half_speed": told["half_speed"], "mesh": told["mesh"]}
    return {**outcome.summary, "numerical_error": errors, "verification": repeated}


def _errors(run: Run, values: Numbers, repeats: Mapping[str, Repeat], mesh: RepeatBlock) -> dict[str, NumericalError]:
    """Numerical errors of ``values``, with what the test knows of them (:class:`Corrections`): a result is off by its
    correction as well, and changes as the corrected ones do.
    """
    known = CORRECTIONS[run.rig.kind]
    exact, rested = known.exact(run, values), known.rested(run, values)
    half, other = (
        replace(repeats[name], results=known.exact(run, repeats[name].results)) for name in ("half_speed", "mesh")
    )
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
    whole: Summary = summary
    return whole
