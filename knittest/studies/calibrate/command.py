"""Command ``knittest calibrate``: read the problem, search, evaluate, write."""

import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from knittest.base.errors import InputError, NumericalError
from knittest.base.files import write_atomic
from knittest.config.run import RUNS
from knittest.config.yaml_loader import load_yaml
from knittest.export.files import json_text
from knittest.export.lock import slug
from knittest.report_page.page import FILE, write_if_possible
from knittest.studies.calibrate import optuna_search as database
from knittest.studies.calibrate.fit import best_of, find_root, fit, search_and_fit
from knittest.studies.calibrate.outcome import Calibration, Outcome, calibration_of, estimate_parameters, report_lines
from knittest.studies.calibrate.page import CALIBRATION, COPY, FABRIC, PAGE, PICTURE, rig_file, write_configs
from knittest.studies.calibrate.picture import convergence_picture
from knittest.studies.calibrate.problem import (
    Evaluation,
    Evaluator,
    Problem,
    RunLimitReached,
    describe_point,
    problem_of,
)
from knittest.studies.calibrate.targets import NumberTarget
from knittest.studies.trials.overview import Overview
from knittest.studies.trials.pool import LocalPool, Pool
from knittest.studies.trials.runner import StudyOptions, StudyResult, TrialRunner, handle_signals, study_folder

if TYPE_CHECKING:
    from optuna.storages import RDBStorage

Search = Callable[[Evaluator], None]
#: searches by method; that of Optuna needs its study
SEARCHES: dict[str, Search] = {"root": find_root, "least-squares": fit, "differential-evolution": search_and_fit}


@dataclass(frozen=True, kw_only=True)
class CalibrateOptions(StudyOptions):
    """Options of a calibration; ``storage`` overrides that of the file."""

    storage: str | None = None


def run_calibration(path: Path, options: CalibrateOptions) -> StudyResult:
    """Run or resume the calibration in ``path``; exit code 3 without convergence. Raises :class:`InputError` first."""
    problem = problem_of(load_yaml(path), options.accept_limits)
    storage = _storage(problem, options)
    pool = LocalPool(options.workers, options.threads)
    copy = database.hide_storage_password(path.read_bytes().decode(), problem.calibration.storage)
    out = options.out or Path("runs") / f"calibrate-{slug(path.stem)}"
    folder = study_folder(out, COPY, copy, "calibration")
    if problem.method == "optuna":
        own = folder / database.DATABASE
        storage = storage or database.open_storage(f"sqlite:///{own}", str(own))
        study, name = database.open_study(problem, storage, folder), database.url_without_password(storage)
        search: Search = partial(database.search_with_optuna, study=study, database=name)
    else:
        search = SEARCHES[problem.method]
    with handle_signals():
        outcome = _search(problem, search, pool, folder, options)
        found = calibration_of(outcome)
        written = _write(outcome, found, folder)
    if not options.quiet:
        for line in [*report_lines(found), f"written: {', '.join(map(str, written))}"]:
            print(line)
    return StudyResult(folder, 0 if outcome.converged else NumericalError.exit_code)


def _storage(problem: Problem, options: CalibrateOptions) -> "RDBStorage | None":
    """Open the database that the user names; raises before anything is written."""
    url = options.storage or problem.calibration.storage
    if problem.method != "optuna":
        if options.storage:
            raise InputError(f"--storage: only method = optuna uses a database, not {problem.method}")
        return None
    if find_spec("optuna") is None:
        raise InputError("method = optuna: Optuna is not installed: pip install 'knittest[calibrate]'")
    where = "--storage" if options.storage else f"{problem.name}.yaml: storage"
    return database.open_storage(url, where) if url else None


def _search(problem: Problem, search: Search, pool: Pool, folder: Path, options: CalibrateOptions) -> Outcome:
    """Search and evaluate; an error of the search is in the outcome, with the best point so far."""
    limit, most = problem.calibration.time_limit, problem.calibration.max_runs

    def tell(evaluation: Evaluation) -> None:
        if not options.quiet:
            with suppress(OSError):
                print(_line(problem, evaluation), file=sys.stderr, flush=True)

    with (
        Overview(most, at_most=True, quiet=options.quiet or not sys.stderr.isatty()) as view,
        TrialRunner(folder, pool, limit=limit, watch=view.watch) as runner,
    ):
        evaluator = Evaluator(problem, runner, tell, view.ended)
        failure, estimates = "", None
        try:
            search(evaluator)
        except (NumericalError, RunLimitReached) as error:
            failure = str(error)
        best = best_of(problem.parameters, evaluator.history)
        if best is not None and not failure:
            try:
                estimates = estimate_parameters(evaluator, best)
            except (NumericalError, RunLimitReached) as error:
                failure = f"the uncertainty of the parameters could not be estimated: {error}"
        return Outcome(problem, evaluator.history, best, estimates, failure)


def _line(problem: Problem, evaluation: Evaluation) -> str:
    head = f"point {evaluation.number}: {describe_point(evaluation.values, problem.parameters)}:"
    if not evaluation.good:
        return f"{head} {evaluation.reason}"
    pairs = zip(problem.targets, evaluation.simulated, strict=True)
    texts = [
        f"{t.label} " + (f"{v:.5g} ({(v - t.mean) / t.sd:+.3f} sd)" if isinstance(t, NumberTarget) else f"{v:.3f} sd")
        for t, v in pairs
    ]
    return f"{head} {', '.join(texts)}"


def _write(outcome: Outcome, found: Calibration, folder: Path) -> list[Path]:
    """Write all files; remove the configs of an earlier calibration if this one did not converge."""
    for name in (FABRIC, *map(rig_file, RUNS)):
        (folder / name).unlink(missing_ok=True)
    configs = write_configs(outcome, folder) if outcome.converged else []
    write_atomic(folder / CALIBRATION, json_text(found.model_dump(exclude_unset=True)))
    convergence_picture(outcome, folder / PICTURE)
    write_if_possible(folder, PAGE.write)
    return [*configs, folder / CALIBRATION, folder / PICTURE, folder / FILE]
