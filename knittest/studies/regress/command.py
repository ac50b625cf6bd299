"""Command ``knittest regress``: run what is left, judge, compare with the baseline, write."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Literal

from knittest.base.errors import InputError
from knittest.base.files import resource_error, write_atomic
from knittest.export.files import json_text
from knittest.runs.show import print_json, print_text
from knittest.studies.regress import baseline as stored
from knittest.studies.regress.cases import LIMITS, Case, Level, Table, all_names, chosen_cases
from knittest.studies.regress.drift import Drift, drift_of, otherwise_rounded
from knittest.studies.regress.judge import table3_rows, table4_rows
from knittest.studies.regress.outcome import Outcome, lines_of, write_junit
from knittest.studies.regress.update import Update, update_of
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.runner import LEDGER, run_all
from knittest.studies.trials.trial import Record, Trial

RESULT = "regress.json"
#: processes for Table 4, unless told
SIDE_BY_SIDE = 2


@dataclass(frozen=True)
class RegressOptions:
    """Runs of a regression, their place and the files to leave; ``table`` None is both, ``limit_sd`` what predicted and
    tuned rows may deviate, ``baseline`` None the shipped file, ``accept_wider`` runs whose limits an update may widen.
    """

    table: Table | None = None
    scale: Literal["macro", "meso", "both"] = "both"
    level: Level = "quick"
    limit_sd: float = 1.0
    baseline: Path | None = None
    update: bool = False
    accept_wider: tuple[str, ...] = ()
    out: Path = Path("runs/regress")
    junit: Path | None = None
    workers: int | None = None
    threads: int | None = None
    json: bool = False
    quiet: bool = False


def regress_command(options: RegressOptions) -> int:
    """Run the regression; returns the exit code. Raises :class:`InputError` before anything runs."""
    cases = chosen_cases(options.level, options.scale, options.table)
    _check_accepted(options, cases)
    path = _baseline(options)
    before = stored.Baseline() if options.update and not path.exists() else stored.load(path)
    for file in (options.junit, path if options.update else None):
        _check_writable(file)
    _check_folder(options.out)
    trials = {case: case.trial() for case in cases}
    others = {c: otherwise_rounded(c, trial) if options.update else [] for c, trial in trials.items()}
    pool = LocalPool(*_processes(options))
    runs = [*trials.values(), *chain.from_iterable(others.values())]
    records = run_all(runs, options.out, pool, limit=LIMITS[options.level], quiet=options.quiet)
    lost, update = sorted({*before.entries} - all_names()), Update()
    if options.update:
        place = partial(_place, options)
        update = update_of(trials, others, records, place, before.entries, options.accept_wider)
        stored.save(path, stored.renewed(before, update.entries, lost))
    outcome = _outcome(options, trials, {c: records[t.key] for c, t in trials.items()}, before, update, lost)
    write_atomic(options.out / RESULT, json_text(outcome.to_dict()))
    if options.junit is not None:
        write_junit(options.junit, outcome)
    if options.json:
        print_json(outcome.to_dict())
    elif not options.quiet:
        print_text(lines_of(outcome))
    return outcome.exit_code


def _processes(options: RegressOptions) -> tuple[int | None, int | None]:
    """Processes and threads of each: two of one thread for Table 4, whose CPU hours go up with the threads."""
    if options.table != 4:
        return options.workers, options.threads
    return options.workers or SIDE_BY_SIDE, options.threads or 1


def _outcome(
    options: RegressOptions,
    trials: Mapping[Case, Trial],
    records: Mapping[Case, Record],
    before: stored.Baseline,
    update: Update,
    lost: Sequence[str],
) -> Outcome:
    """Judge ``records`` by the baseline as it was ``before`` and its ``update``; ``lost`` are entries of no run."""
    entries = stored.renewed(before, update.entries).entries

    def drift(case: Case) -> Drift:
        trial, entry = trials[case], entries.get(case.name)
        if case.name in update.problems:
            problem = update.problems[case.name]
            return Drift(case, entry, problem=problem.text, no_room=problem.no_room)
        return drift_of(case, trial.run, records[case], _place(options, trial), entry)

    rows = (row for c, t in trials.items() for row in table3_rows(c, t.run, records[c], options.limit_sd))
    return Outcome(
        level=options.level,
        records=records,
        rows=tuple(rows) if options.table in (3, None) else (),
        costs=tuple(table4_rows(records)) if options.table in (4, None) else (),
        drifts=tuple(drift(case) for case in trials),
        baseline=_baseline(options),
        updated=tuple(update.lines),
        lost=() if options.update else tuple(lost),
        dropped=tuple(lost) if options.update else (),
    )


def _baseline(options: RegressOptions) -> Path:
    return options.baseline or stored.shipped()


def _place(options: RegressOptions, trial: Trial) -> Path:
    return options.out / "trials" / trial.key


def _check_accepted(options: RegressOptions, cases: Sequence[Case]) -> None:
    """Refuse to accept wider limits of a run that is not updated."""
    names = [case.name for case in cases] if options.update else []
    if unknown := [name for name in options.accept_wider if name not in names]:
        said = f"expected one of {', '.join(names)}" if names else "needs --update-baseline"
        raise InputError(f"--accept-wider {unknown[0]}: {said}")


def _check_writable(file: Path | None) -> None:
    """Refuse a file whose folder is not there before hours are spent."""
    if file is not None and (file.is_dir() or not file.parent.is_dir()):
        raise InputError(f"{file}: expected a file in a folder that is there")


def _check_folder(folder: Path) -> None:
    """Refuse a folder that holds something else."""
    try:
        names = [entry.name for entry in folder.iterdir()] if folder.exists() else []
    except NotADirectoryError:
        raise InputError(f"--out {folder}: is a file, expected a folder") from None
    except OSError as error:
        raise resource_error(folder, error) from error
    if names and LEDGER not in names:
        raise InputError(f"--out {folder}: holds {names[0]}, but no regression: choose a new folder")
