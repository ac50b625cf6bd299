"""Command ``knittest uncertainty``: pose the problem, run the design or what is left of it, judge, write."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from knittest.base.errors import InputError, NumericalError
from knittest.base.files import write_atomic
from knittest.base.interrupts import Interrupts
from knittest.config.studies import Uncertainty as Study
from knittest.config.studies import parse_uncertainty
from knittest.config.yaml_loader import Document, load_yaml
from knittest.export.files import json_text
from knittest.export.lock import slug
from knittest.report_page.page import FILE, write_if_possible
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.runner import Studied, run_shown, says_how_to_go_on, study_folder
from knittest.studies.trials.trial import Record, read_ledgers
from knittest.studies.uncertainty.outcome import Uncertainty, outcome_of
from knittest.studies.uncertainty.page import COPY, RESULT, TABLE, report_lines, write_table, write_uncertainty_page
from knittest.studies.uncertainty.picture import pictures
from knittest.studies.uncertainty.problem import Problem, problem_of
from knittest.studies.uncertainty.runs import Planned, check_first, gone_on, numbers_of, planned

#: fields that may change between two calls in one folder: runs to the full end are the same, and which of the shorter
#: ones count is found anew from all that are there
FREE = ("workers", "time_limit", "quantities", "statements", "shorter")


@dataclass(frozen=True)
class UncertaintyOptions:
    """Place of a study and what it reports; ``workers`` goes before that of the file."""

    out: Path | None = None
    workers: int | None = None
    quiet: bool = False
    accept_limits: bool = False


def uncertainty_command(path: Path, options: UncertaintyOptions) -> int:
    """Run the study in the file ``path``, or what is left of it; returns the exit code. Raises as
    :func:`run_uncertainty`.
    """
    return run_uncertainty(path, options).exit_code


def run_uncertainty(path: Path, options: UncertaintyOptions) -> Studied:
    """Run the study in the file ``path``, or what is left of it; the exit code is 3 where runs have no result.

    Raises :class:`InputError` before anything runs.
    """
    document = load_yaml(path)
    problem = problem_of(document, options.accept_limits)
    folder = options.out or Path("runs") / f"uncertainty-{slug(path.stem)}"
    _check_unchanged(document, problem.study, folder / COPY)
    runs = planned(problem)
    study_folder(folder, COPY, path.read_bytes(), "study of uncertainty")
    with says_how_to_go_on(), Interrupts() as interrupts, interrupts.deciding():
        try:
            runs = _run_all(problem, runs, folder, options)
        except BaseException:
            with suppress(Exception):  # the first error is the one to report
                _write(problem, runs, folder)
            raise
        found = _write(problem, runs, folder)
    if not options.quiet:
        for line in [*report_lines(found), f"table, pictures and page: {folder / TABLE}, *.png, {FILE}"]:
            print(line)
    return Studied(folder, NumericalError.exit_code if found.lost else 0)


def _run_all(problem: Problem, runs: list[Planned], folder: Path, options: UncertaintyOptions) -> list[Planned]:
    """``runs`` to their full ends, then those that were lost on their way to shorter ones, with all their attempts."""
    asked = set[str]()
    check: Callable[[Record], None] | None = partial(check_first, problem)
    while trials := [one.last.trial for one in runs if one.last.trial and one.last.trial.key not in asked]:
        pool = LocalPool(options.workers or problem.study.workers, 1)
        run_shown(trials, folder, pool, limit=problem.study.time_limit, quiet=options.quiet, check=check)
        asked |= {trial.key for trial in trials}
        runs, check = gone_on(problem, runs, read_ledgers(folder, lambda text: None)), None
    return runs


def _check_unchanged(document: Document, study: Study, before: Path) -> None:
    """Raise :class:`InputError` where ``before``, the file that a folder went by till now, is of another study."""
    if before.is_file() and (changed := _changed(study, before)):
        raise InputError(
            f"{document.source}: {changed} is not what {before} has: a design is one of all its runs; choose a new "
            "folder by --out, or take the change back"
        )


def _changed(study: Study, before: Path) -> str:
    """First field that differs from the study in the file ``before``; empty where none does.

    More samples are no change: the first points of the sequence stay the same.
    """
    try:
        old = parse_uncertainty(load_yaml(before))
    except InputError:
        return "the whole file"
    now, then = _design_of(study), _design_of(old)
    for name in Study.model_fields:
        new, was = now[name], then[name]
        more = name == "samples" and new > was
        if name not in FREE and not more and new != was:
            return name
    return ""


def _design_of(study: Study) -> dict[str, Any]:
    """Fields of ``study`` without what only tells a reader why."""
    return study.model_dump(exclude={"parameters": {"__all__": {"reason"}}})


def _write(problem: Problem, runs: Sequence[Planned], folder: Path) -> Uncertainty:
    """Table, result, pictures and page of all that is known."""
    records: Mapping[str, Record] = read_ledgers(folder, lambda text: None)
    runs = gone_on(problem, runs, records)
    numbers = numbers_of(problem, runs, records)
    write_table(problem, runs, records, numbers, folder)
    found = outcome_of(problem, runs, records, numbers)
    write_atomic(folder / RESULT, json_text(found.model_dump()))
    pictures(found, folder)
    write_if_possible(folder, write_uncertainty_page)
    return found
