"""Executes one run: the specimens of one direction, their folder, comparison and report."""

import time as clock
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from knittest.base.errors import KnittestError, NumericalError, ResourceError, report_memory_shortage
from knittest.base.history import Quality, Specimen
from knittest.base.interrupts import Interrupted, Interrupts
from knittest.base.progress import Progress
from knittest.base.summary import Summary
from knittest.config.run import Run
from knittest.export.identity import cell_of
from knittest.laboratory.report_base import TESTS, References
from knittest.report_page.folders import NOT_COMPARED
from knittest.report_page.page import write_if_possible, write_report
from knittest.runs.checkpoints import Checkpoints, specimen_of, specimen_state
from knittest.runs.opened_run import OpenedRun, RunPlace, open_checkpoints
from knittest.runs.options import RunOptions
from knittest.runs.run_files import compare_run, references_of, write_files, write_incomplete
from knittest.runs.specimen import Log, Watcher, run_specimen
from knittest.solve.compilation import compile_run_in_background

EXIT_REJECTED = NumericalError.exit_code


@dataclass(frozen=True)
class Outcome:
    """A finished run: its folder, summary.json, the quality of its worst specimen, metrics of the user's curves."""

    run: Run
    folder: Path
    summary: Summary
    quality: Quality
    curves: Sequence[dict[str, object]] = ()


#: runs specimens of an ensemble in other processes, which store them as checkpoints
ParallelRunner = Callable[[Run, OpenedRun, Progress], None]


def execute(
    run: Run,
    place: RunPlace,
    interrupts: Interrupts,
    options: RunOptions,
    progress: Progress,
    ahead: ParallelRunner | None = None,
) -> Outcome:
    """Run the missing specimens of ``run`` and write its folder; ``ahead`` runs specimens in parallel beforehand."""
    references = references_of(run, options.against)
    try:
        with compile_run_in_background(run), _open_folder(run, place, interrupts, progress) as opened:
            if left_out := options.left_out:
                opened.folder.note(left_out=left_out)
            with interrupts.allow_signals():
                with _write_partial_on_error(run, opened, references, options):
                    if ahead is not None:
                        ahead(run, opened, progress)
                    specimens = [_finished_specimen(run, k, opened, progress) for k in range(run.variability.specimens)]
                progress.finish()
                compared = compare_run(run, specimens, references, opened.folder.forced_changes)
                write_files(run, specimens, references, compared, opened.folder, options)
            refused = compared.quality.failures
            if refused:
                opened.folder.finish("completed", EXIT_REJECTED, f"{NOT_COMPARED}: {'; '.join(refused)}")
    except NumericalError as error:
        if isinstance(error.partial, Path) and options.pictures:
            write_if_possible(error.partial, write_report)
        raise
    if options.pictures:
        write_if_possible(opened.folder.path, write_report)
    return Outcome(run, opened.folder.path, compared.summary, compared.quality, compared.own)


def execute_specimen(run: Run, number: int, folder: Path, interrupts: Interrupts, log: Log, progress: Progress) -> None:
    """Run specimen ``number`` of ``run`` and store it in ``folder``, which another process has opened."""
    with compile_run_in_background(run), interrupts.translate_errors():
        _run_and_store(run, number, open_checkpoints(run, folder, interrupts), log, progress)


@contextmanager
def name_errors(run: Run, number: int) -> Iterator[None]:
    """Put the name of specimen ``number`` in front of its errors, where ``run`` has several."""
    try:
        yield
    except KnittestError as error:
        if run.variability.specimens > 1:
            error.args = (f"{specimen_name(run, number)}: {error}",)
        raise


def specimen_name(run: Run, number: int) -> str:
    """Name of specimen ``number`` of ``run`` in messages: ``specimen 1 of 3 (warp)``."""
    return f"specimen {number + 1} of {run.variability.specimens} ({run_label(run)})"


@contextmanager
def _open_folder(run: Run, place: RunPlace, interrupts: Interrupts, progress: Progress) -> Iterator[OpenedRun]:
    """Locked folder of ``run``, named by an interruption; signals are held except where the block lets them through."""
    if run.model.scale == "meso":  # before the folder is created: its manifest names the cell
        cell_of(run, lambda: progress.phase(f"{run_label(run)}: relaxing geometry"))
    with interrupts.hold_signals(when=lambda: True):
        opened = place.open(run, interrupts)
        try:
            with opened.folder, interrupts.translate_errors(), report_memory_shortage():
                yield opened
            interrupts.check()
        except (Interrupted, ResourceError) as error:
            error.folder = opened.folder.path
            raise


@contextmanager
def _write_partial_on_error(run: Run, opened: OpenedRun, references: References, options: RunOptions) -> Iterator[None]:
    """Write the finished specimens, else the unfinished one, of a run that a :class:`NumericalError` ends."""
    try:
        yield
    except NumericalError as error:
        partial, error.partial = error.partial, None
        stored = [opened.checkpoints.finished_state(number) for number in range(run.variability.specimens)]
        specimens = [specimen_of(state) for state in stored if state is not None]
        if not specimens and isinstance(partial, Specimen):
            specimens = [partial]
        if specimens:
            try:
                write_incomplete(run, specimens, references, str(error), opened.folder, options)
            except Exception as other:  # the first error is the one to report
                opened.folder.log("not kept", reason=str(other))
            else:
                error.partial = opened.folder.path
                part = "the curve up to then is" if specimens[0] is partial else "the finished specimens are"
                error.args = (f"{error}; {part} in {opened.folder.path}",)
        raise


def _finished_specimen(run: Run, number: int, opened: OpenedRun, progress: Progress) -> Specimen:
    stored = opened.checkpoints.finished_state(number)
    if stored is not None:
        return specimen_of(stored)
    with name_errors(run, number):
        return _run_and_store(run, number, opened.checkpoints, opened.folder.log, progress)


def _run_and_store(run: Run, number: int, checkpoints: Checkpoints, log: Log, progress: Progress) -> Specimen:
    """Run specimen ``number`` of ``run``, from its checkpoint if there is one, and store it."""
    count, label = run.variability.specimens, run_label(run)
    if count > 1:
        run = run.model_copy(update={"variability": run.variability.model_copy(update={"mode": "random"})})
        label = f"{label} {number + 1}/{count}"
    start = clock.perf_counter()
    watcher = Watcher(checkpoints, number, label, TESTS[run.rig.kind].ends_at_failure, progress, log)
    with checkpoints.hold_signals(number, watcher):
        specimen = run_specimen(run, number, watcher)
        watcher.finish(specimen_state(specimen, frames=number == 0))  # pictures show the first specimen
    log("specimen", number=number, seconds=round(clock.perf_counter() - start, 3), **specimen.results)
    return specimen


def run_label(run: Run) -> str:
    """Direction of ``run``; its test where it has none."""
    return run.direction or run.rig.kind
