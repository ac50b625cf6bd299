"""Command ``knittest uncertainty``: read the problem, run the design, evaluate, write."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from knittest.base.errors import InputError, NumericalError
from knittest.base.files import write_atomic
from knittest.config.studies import Uncertainty as Study
from knittest.config.studies import parse_uncertainty
from knittest.config.yaml_loader import Document, load_yaml
from knittest.export.files import json_text
from knittest.export.lock import slug
from knittest.report_page.page import FILE, write_if_possible
from knittest.studies.trials.page import TABLE
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.runner import StudyOptions, StudyResult, handle_signals, run_with_overview, study_folder
from knittest.studies.trials.trial import Record, read_ledgers
from knittest.studies.uncertainty.outcome import Uncertainty, outcome_of
from knittest.studies.uncertainty.page import COPY, PAGE, RESULT, report_lines, write_table
from knittest.studies.uncertainty.picture import draw_pictures
from knittest.studies.uncertainty.problem import Problem, problem_of
from knittest.studies.uncertainty.runs import PlannedRun, add_shorter_attempts, check_first_run, numbers_of, plan_runs

#: fields that may change between two calls in one folder: runs to the full end stay the same, and the shorter runs
#: that count follow from all that the folder has
CHANGEABLE_FIELDS = ("workers", "time_limit", "quantities", "statements", "shorter_ends")


def run_uncertainty(path: Path, options: StudyOptions) -> StudyResult:
    """Run or resume the study in ``path``; exit code 3 if runs have no result. Raises :class:`InputError` first."""
    document = load_yaml(path)
    problem = problem_of(document, options.accept_limits)
    folder = options.out or Path("runs") / f"uncertainty-{slug(path.stem)}"
    _check_unchanged(document, problem.study, folder / COPY)
    runs = plan_runs(problem)
    study_folder(folder, COPY, path.read_bytes(), "study of uncertainty")
    with handle_signals(lambda: _write(problem, runs, folder)):
        asked = set[str]()  # first runs to their full ends, then failed ones to shorter ends
        check: Callable[[Record], None] | None = partial(check_first_run, problem)
        while trials := [one.last.trial for one in runs if one.last.trial and one.last.key not in asked]:
            pool = LocalPool(options.workers or problem.study.workers, 1)
            run_with_overview(trials, folder, pool, limit=problem.study.time_limit, quiet=options.quiet, check=check)
            asked |= {trial.key for trial in trials}
            runs, check = add_shorter_attempts(problem, runs, read_ledgers(folder, lambda text: None)), None
        found = _write(problem, runs, folder)
    if not options.quiet:
        for line in [*report_lines(found), f"table, pictures and page: {folder / TABLE}, *.png, {FILE}"]:
            print(line)
    return StudyResult(folder, NumericalError.exit_code if found.lost else 0)


def _check_unchanged(document: Document, study: Study, before: Path) -> None:
    """Raise :class:`InputError` if the folder's file ``before`` has another design; more samples are allowed."""
    if not before.is_file():
        return
    changed = ""
    try:
        now, then = (one.model_dump(exclude={"parameters": {"__all__": {"reason"}}})
                     for one in (study, parse_uncertainty(load_yaml(before))))  # fmt: skip
        for name in Study.model_fields:
            more = name == "samples" and now[name] > then[name]
            if name not in CHANGEABLE_FIELDS and not more and now[name] != then[name]:
                changed = name
                break
    except InputError:
        changed = "the whole file"
    if changed:
        raise InputError(
            f"{document.source}: {changed} differs from {before}: a folder has runs of one design only; choose a new "
            "folder with --out, or undo the change"
        )


def _write(problem: Problem, runs: Sequence[PlannedRun], folder: Path) -> Uncertainty:
    """Write table, result, pictures and page of all known runs."""
    records = read_ledgers(folder, lambda text: None)
    runs = add_shorter_attempts(problem, runs, records)
    numbers = numbers_of(problem, runs, records)
    write_table(problem, runs, records, numbers, folder)
    found = outcome_of(problem, runs, records, numbers)
    write_atomic(folder / RESULT, json_text(found.model_dump()))
    draw_pictures(found, folder)
    write_if_possible(folder, PAGE.write)
    return found
