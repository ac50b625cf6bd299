"""Command ``knittest regress``: run, evaluate, compare with the baseline, write."""

from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Literal

from knittest.base.errors import InputError
from knittest.base.files import write_atomic
from knittest.export.files import json_text
from knittest.runs.terminal_output import print_json, print_text
from knittest.studies.regress import baseline as stored
from knittest.studies.regress.cases import LIMITS, Case, Level, Table, all_names, select_cases
from knittest.studies.regress.drift import Drift, drift_of, rounding_trials
from knittest.studies.regress.outcome import Outcome, report_lines, write_junit
from knittest.studies.regress.published_tables import table3_rows, table4_rows
from knittest.studies.regress.update import Update, update_of
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.runner import LEDGER, TRIALS, StudyOptions, check_study_folder, run_all
from knittest.studies.trials.trial import Trial

RESULT = "regress.json"
#: default number of processes for Table 4
SIDE_BY_SIDE = 2


@dataclass(frozen=True, kw_only=True)
class RegressOptions(StudyOptions):
    """Options of a regression: ``table`` None is both, ``limit_sd`` the largest deviation of predicted and tuned rows,
    ``baseline`` None the shipped file, ``accept_wider`` runs whose limits an update may widen.
    """

    out: Path = Path("runs/regress")
    table: Table | None = None
    scale: Literal["macro", "meso", "both"] = "both"
    level: Level = "quick"
    limit_sd: float = 1.0
    baseline: Path | None = None
    update: bool = False
    accept_wider: tuple[str, ...] = ()
    junit: Path | None = None
    json: bool = False


def regress_command(options: RegressOptions) -> int:
    """Run the regression; returns the exit code. Raises :class:`InputError` before anything runs."""
    cases = select_cases(options.level, options.scale, options.table)
    names = [case.name for case in cases] if options.update else []
    if unknown := [name for name in options.accept_wider if name not in names]:
        remedy = f"expected one of {', '.join(names)}" if names else "needs --update-baseline"
        raise InputError(f"--accept-wider {unknown[0]}: {remedy}")
    path = options.baseline or stored.shipped_path()
    before = stored.Baseline() if options.update and not path.exists() else stored.load(path)
    for file in (options.junit, path if options.update else None):
        if file is not None and (file.is_dir() or not file.parent.is_dir()):
            raise InputError(f"{file}: expected a file in an existing folder")
    check_study_folder(options.out, LEDGER, "regression")
    trials = {case: case.trial() for case in cases}
    others = {c: rounding_trials(c, trial) if options.update else [] for c, trial in trials.items()}
    workers, threads = options.workers, options.threads
    if options.table == 4:  # its CPU hours increase with the threads
        workers, threads = workers or SIDE_BY_SIDE, threads or 1
    runs = [*trials.values(), *chain.from_iterable(others.values())]
    pool = LocalPool(workers, threads)
    records = run_all(runs, options.out, pool, limit=LIMITS[options.level], quiet=options.quiet)

    def place(trial: Trial) -> Path:
        return options.out / TRIALS / trial.key

    lost, update = sorted({*before.entries} - all_names()), Update()
    if options.update:
        update = update_of(trials, others, records, place, before.entries, options.accept_wider)
        stored.save(path, stored.update_entries(before, update.entries, lost))
    entries = stored.update_entries(before, update.entries).entries
    done = {case: records[trial.key] for case, trial in trials.items()}

    def drift(case: Case) -> Drift:
        found = update.problems.get(case.name)
        return found or drift_of(case, trials[case].run, done[case], place(trials[case]), entries.get(case.name))

    rows = (row for c, t in trials.items() for row in table3_rows(c, t.run, done[c], options.limit_sd))
    outcome = Outcome(
        level=options.level, records=done, rows=tuple(rows) if options.table in (3, None) else (),
        costs=tuple(table4_rows(done)) if options.table in (4, None) else (), drifts=tuple(map(drift, trials)),
        baseline=path, updated=tuple(update.lines), lost=() if options.update else tuple(lost),
        dropped=tuple(lost) if options.update else (),
    )  # fmt: skip
    write_atomic(options.out / RESULT, json_text(outcome.to_dict()))
    if options.junit is not None:
        write_junit(options.junit, outcome)
    if options.json:
        print_json(outcome.to_dict())
    elif not options.quiet:
        print_text(report_lines(outcome))
    return outcome.exit_code
