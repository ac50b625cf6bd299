"""Command ``knittest calibrate``: pose the problem, search, judge, write."""

import json
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from knittest.base.errors import InputError, NumericalError
from knittest.base.files import write_atomic
from knittest.base.interrupts import Interrupts
from knittest.config.run import RUNS
from knittest.config.yaml_loader import load_yaml
from knittest.export.files import json_ready
from knittest.export.lock import slug
from knittest.report_page.page import FILE, write_if_possible
from knittest.runs.options import RunOptions
from knittest.studies.calibrate.fit import best_of, find_root, fit, search_and_fit
from knittest.studies.calibrate.optuna_search import (
    DATABASE,
    check_installed,
    open_storage,
    open_study,
    search_with_optuna,
    shown_url,
    without_password_of_storage,
)
from knittest.studies.calibrate.outcome import Judgement, Outcome, as_data, judge, report_lines
from knittest.studies.calibrate.page import (
    CALIBRATION,
    COPY,
    FABRIC,
    PICTURE,
    rig_file,
    write_calibration_page,
    write_configs,
)
from knittest.studies.calibrate.picture import convergence_picture
from knittest.studies.calibrate.problem import (
    Evaluation,
    Evaluator,
    Exhausted,
    Problem,
    TrialEvaluator,
    described,
    problem_of,
)
from knittest.studies.calibrate.targets import Number
from knittest.studies.trials.live import Overview
from knittest.studies.trials.pool import LocalPool, Pool
from knittest.studies.trials.runner import Studied, TrialRunner, says_how_to_go_on, study_folder

if TYPE_CHECKING:
    from optuna.storages import RDBStorage

Search = Callable[[Evaluator], None]
#: by method; that of Optuna needs its study
SEARCHES: dict[str, Search] = {
    "root": find_root,
    "least-squares": fit,
    "differential-evolution": search_and_fit,
}


@dataclass(frozen=True)
class CalibrateOptions:
    """Place of a calibration and what it reports; ``storage`` goes before that of the file."""

    out: Path | None = None
    workers: int | None = None
    threads: int | None = None
    quiet: bool = False
    storage: str | None = None
    accept_limits: bool = False


def calibrate_command(path: Path, options: CalibrateOptions) -> int:
    """Calibrate as the file ``path`` says, or go on with it; returns the exit code. Raises as
    :func:`run_calibration`.
    """
    return run_calibration(path, options).exit_code


def run_calibration(path: Path, options: CalibrateOptions) -> Studied:
    """Calibrate as the file ``path`` says, or go on with it; the exit code is 3 when it did not converge.

    Raises :class:`InputError` before anything runs.
    """
    problem = problem_of(load_yaml(path), options.accept_limits)
    storage = _storage(problem, options)
    pool = LocalPool(options.workers, options.threads)
    folder = _folder(path, options.out, problem.calibration.storage)
    search = _search_of(problem, storage, folder)
    with says_how_to_go_on(), Interrupts() as interrupts, interrupts.deciding():
        outcome = _search(problem, search, pool, folder, options)
        written = _write(outcome, folder)
    if not options.quiet:
        for line in [*report_lines(outcome), f"written: {', '.join(map(str, written))}"]:
            print(line)
    return Studied(folder, 0 if outcome.converged else NumericalError.exit_code)


def _storage(problem: Problem, options: CalibrateOptions) -> "RDBStorage | None":
    """The database that a user names; raises before anything is written."""
    url = options.storage or problem.calibration.storage
    if problem.method != "optuna":
        if options.storage:
            raise InputError(f"--storage: only method = optuna has a database, this is {problem.method}")
        return None
    check_installed()
    return open_storage(url, "--storage" if options.storage else f"{problem.name}.yaml: storage") if url else None


def _search_of(problem: Problem, storage: "RDBStorage | None", folder: Path) -> Search:
    if problem.method != "optuna":
        return SEARCHES[problem.method]
    own = folder / DATABASE
    storage = storage or open_storage(f"sqlite:///{own}", str(own))
    return partial(search_with_optuna, study=open_study(problem, storage, folder), database=shown_url(storage))


def _folder(path: Path, out: Path | None, storage: str | None) -> Path:
    """The folder of the calibration, with its file but for passwords; refuses one that holds something else."""
    copy = without_password_of_storage(path.read_bytes().decode(), storage)
    return study_folder(out or Path("runs") / f"calibrate-{slug(path.stem)}", COPY, copy, "calibration")


def _search(problem: Problem, search: Search, pool: Pool, folder: Path, options: CalibrateOptions) -> Outcome:
    """Search and judge; what went wrong with the search is in the outcome, with the best point so far."""
    limit, most = problem.calibration.time_limit, problem.calibration.max_runs
    keep = RunOptions(quiet=True, frames=False, pictures=False)

    def tell(evaluation: Evaluation) -> None:
        if not options.quiet:
            with suppress(OSError):
                print(_line(problem, evaluation), file=sys.stderr, flush=True)

    with (
        Overview(most, at_most=True, quiet=options.quiet or not sys.stderr.isatty()) as view,
        TrialRunner(folder, pool, limit=limit, options=keep, watch=view.watch) as runner,
    ):
        evaluator = TrialEvaluator(problem, runner, tell, view.ended)
        failure, judgement = "", None
        try:
            search(evaluator)
        except (NumericalError, Exhausted) as error:
            failure = str(error)
        best = best_of(problem.parameters, evaluator.history)
        if best is not None and not failure:
            failure, judgement = _judged(evaluator, best)
        return Outcome(problem, evaluator.history, best, judgement, failure)


def _judged(evaluator: Evaluator, best: Evaluation) -> tuple[str, Judgement | None]:
    try:
        return "", judge(evaluator, best)
    except (NumericalError, Exhausted) as error:
        return f"how well it is determined could not be found: {error}", None


def _line(problem: Problem, evaluation: Evaluation) -> str:
    head = f"point {evaluation.number}: {described(evaluation.values, problem.parameters)}:"
    if not evaluation.good:
        return f"{head} {evaluation.reason}"
    pairs = zip(problem.targets, evaluation.simulated, strict=True)
    texts = [
        f"{t.label} {value:.5g} ({(value - t.mean) / t.sd:+.3f} sd)"
        if isinstance(t, Number)
        else f"{t.label} {value:.3f} sd"
        for t, value in pairs
    ]
    return f"{head} {', '.join(texts)}"


def _write(outcome: Outcome, folder: Path) -> list[Path]:
    """All files; configs of an earlier calibration go when this one did not converge."""
    for name in (FABRIC, *map(rig_file, RUNS)):
        (folder / name).unlink(missing_ok=True)
    configs = write_configs(outcome, folder) if outcome.converged else []
    write_atomic(folder / CALIBRATION, json.dumps(json_ready(as_data(outcome)), indent=2) + "\n")
    convergence_picture(outcome, folder / PICTURE)
    write_if_possible(folder, write_calibration_page)
    return [*configs, folder / CALIBRATION, folder / PICTURE, folder / FILE]
