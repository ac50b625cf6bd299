"""Commands that run tests: start or resume a list of runs, one folder each, and print one table."""

import shlex
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numba

from knittest.base.errors import InputError, NumericalError, ResourceError
from knittest.base.files import make_folder, write_atomic
from knittest.base.interrupts import Interrupted, Interrupts
from knittest.base.progress import Progress
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.config.yaml_writer import dump
from knittest.export.identity import cell_of
from knittest.export.lock import ended_by_input_error, make_new_folder, run_name
from knittest.kernels.threading import limit_threads
from knittest.laboratory.report_base import TESTS, with_estimates
from knittest.report_page.page import FILE, page_of, write_if_possible, write_reports
from knittest.runs.checkpoints import PATTERN
from knittest.runs.execute import EXIT_REJECTED, Outcome, execute
from knittest.runs.opened_run import NewFolder, RunPlace, StoppedRun, clean_completed_run, manifest_of
from knittest.runs.options import RunOptions
from knittest.runs.run_files import references_of
from knittest.runs.terminal_output import open_page, print_json, print_rejected, print_results
from knittest.solve.compilation import compile_run_in_background
from knittest.solve.threads import use_threads
from knittest.studies.homogenise.derived_card import complete_cards
from knittest.studies.trials.parallel import ParallelRuns, run_specimens_in_parallel
from knittest.studies.verify import REPEATS, needs_verification, read_outcome, verify_outcome

#: a run with its new place, or with its folder if it is completed and only has to be verified
Job = tuple[Run, RunPlace | Path]


def run_command(runs: list[Run], options: RunOptions) -> int:
    """Run every direction in its own folder and print one table; returns the exit code."""
    return _report(run_all(runs, options), options)


def run_all(runs: list[Run], options: RunOptions) -> list[Outcome]:
    """Run each of ``runs`` in its own folder, several of them below one parent folder."""
    use_threads(options.threads)
    runs = with_estimates(runs, options.quiet)
    for run in runs:  # before there is a folder, which the corrected command would find
        references_of(run, options.against)
        TESTS[run.rig.kind].check_run(run)
    runs = complete_cards(runs, options.quiet)
    if len(runs) == 1:
        return _run_jobs([(runs[0], NewFolder(options.out))], options, None)
    parent = options.out or make_new_folder(Path("runs") / run_name(runs[0], direction="both", at=datetime.now()))
    _write_plan(parent, runs)
    try:
        outcomes = _run_jobs([(run, NewFolder(parent / _part_name(run, runs))) for run in runs], options, parent)
    except NumericalError:
        _write_page(parent, options)
        raise
    _write_page(parent, options)
    return outcomes


def resume_command(folder: Path, options: RunOptions, force: bool = False) -> int:
    """Resume all runs in ``folder`` as :func:`resume_all` does; returns the exit code, which completed runs keep."""
    outcomes, codes = resume_all(folder, options, force)
    return max([*codes, _report(outcomes, options) if outcomes else 0])


def resume_all(folder: Path, options: RunOptions, force: bool = False) -> tuple[list[Outcome], list[int]]:
    """Resume all runs in ``folder``; outcomes, and codes of completed runs. Raises :class:`InputError` on a change."""
    plans = [(folder / "config.yaml", folder)]
    if not plans[0][0].is_file():
        plans = [(plan, _planned_folder(plan)) for plan in sorted(folder.glob("config-*.yaml"))]
    if not plans:
        raise InputError(f"{folder}: not a run folder: it has no config.yaml")
    left_out: set[object] = set()  # kinds of files that the runs were started without
    for _, place in plans:
        names = manifest_of(place).get("left_out") if (place / "manifest.json").exists() else None
        left_out |= {*names} if isinstance(names, list) else set()
    frames, pictures = ("frames" not in left_out, "pictures" not in left_out)
    options = replace(options, frames=options.frames and frames, pictures=options.pictures and pictures)
    use_threads(options.threads)
    jobs, codes = [], []
    for plan, place in plans:
        left = _remaining_job(plan, place, options, force)
        if isinstance(left, int):
            codes.append(left)
        else:
            jobs.append(left)
    outcomes = _run_jobs(jobs, options, folder) if jobs else []
    if len(plans) > 1 and (jobs or not (folder / FILE).exists()):
        _write_page(folder, options)
    return outcomes, codes


def _write_page(parent: Path, options: RunOptions) -> None:
    """Write the page of all runs in ``parent`` into it, unless pictures are switched off."""
    if options.pictures:
        write_if_possible(parent, lambda folder: write_reports([folder], None, explained=options.explained))


def _planned_folder(plan: Path) -> Path:
    """Folder of the run in the file ``plan``."""
    return plan.parent / plan.stem.removeprefix("config-")


def _remaining_job(plan: Path, folder: Path, options: RunOptions, force: bool) -> Job | int:
    """Remaining job of the run in ``folder``, planned in ``plan``; the exit code of a completed run."""
    config = folder / "config.yaml"
    if not config.is_file():
        return resolve(config=plan, accept_limits=None), NewFolder(folder)
    manifest = manifest_of(folder)
    if manifest["status"] != "completed":
        return resolve(config=config, accept_limits=None), StoppedRun(folder, force)
    clean_completed_run(folder, options.pictures)
    run = resolve(config=config, accept_limits=None)
    if needs_verification(folder, run):
        return run, folder
    reason = f": {manifest['message']}" if manifest.get("message") else ""
    text = f"{folder}: completed on {manifest.get('ended')}{reason}; nothing to resume"
    print(text, file=sys.stderr if options.json else sys.stdout)
    code = manifest.get("exit_code")
    return code if isinstance(code, int) else 0


def _write_plan(parent: Path, runs: Sequence[Run]) -> None:
    """Write the configs of ``runs``, so that all can be resumed; replaces a plan that ended with invalid input.

    Raises :class:`InputError` for a folder of a run, and for one that holds something else.
    """
    make_folder(parent)
    plans = list(parent.glob("config-*.yaml"))
    begun = [folder for folder in map(_planned_folder, plans) if folder.exists()]
    if plans and not (begun and all(map(ended_by_input_error, begun))):
        remedy = f"continue it with: knittest resume {parent}, or choose a new folder"
        raise InputError(f"--out {parent}: holds a run; {remedy}")
    own = {file.name for file in (*plans, *begun)}
    if others := sorted(
        file.name for file in parent.iterdir() if not file.name.startswith(".") and file.name not in own
    ):
        raise InputError(f"--out {parent}: holds {others[0]}, which is no file of this run; choose a new folder")
    for run in runs:
        write_atomic(parent / f"config-{_part_name(run, runs)}.yaml", dump(run))


def _part_name(run: Run, runs: Sequence[Run]) -> str:
    """Name of ``run`` below the folder of all ``runs`` of a command: its direction, or its scale if that differs."""
    return run.direction if len({one.model.scale for one in runs}) == 1 else run.model.scale


def _run_jobs(jobs: Sequence[Job], options: RunOptions, parent: Path | None) -> list[Outcome]:
    """Run the jobs, in parallel if this is faster; ``parent`` is the folder to resume, if not that of a run."""
    completed = [place for _, place in jobs if isinstance(place, Path)]
    if completed and options.against:
        raise InputError(f"--against: only --verify remains for {completed[0]}; use knittest compare after it")
    outcomes: list[Outcome] = []
    with (
        Interrupts() as interrupts,
        Progress(quiet=options.quiet) as progress,
        _append_resume_hint(parent),
        interrupts.translate_errors(),
        compile_run_in_background(*(run for run, _ in jobs)),
    ):
        others, threads = _parallel_runs(jobs, progress)
        with ParallelRuns(others, options, threads) as parallel, limit_threads(threads):
            for run, place in jobs:
                if not isinstance(place, Path) and place.path in others:
                    place = parallel.wait(place.path, progress)
                if isinstance(place, Path):
                    outcome = read_outcome(run, place, options.against)
                else:
                    outcome = execute(run, place, interrupts, options, progress, run_specimens_in_parallel)
                outcomes.append(verify_outcome(outcome, options, interrupts) if run.output.verify else outcome)
    return outcomes


def _report(outcomes: Sequence[Outcome], options: RunOptions) -> int:
    pages = {o.folder: str(page) if (page := page_of(o.folder)) else None for o in outcomes}
    if options.json:
        more = [{"folder": str(o.folder), "page": pages[o.folder], "curves": list(o.curves)} for o in outcomes]
        summaries = [one.summary | places for one, places in zip(outcomes, more, strict=True)]
        print_json(summaries[0] if len(summaries) == 1 else {"runs": summaries})
    elif not options.quiet:
        print_results(outcomes, details=options.details, explained=options.explained)
    if options.quiet:
        print_rejected(outcomes)
    first = next(filter(None, pages.values()), None)
    if options.open_page and first:
        open_page(Path(first))
    return EXIT_REJECTED if any(o.quality.failures for o in outcomes) else 0


def _parallel_runs(jobs: Sequence[Job], progress: Progress) -> tuple[dict[Path, tuple[Run, RunPlace]], int]:
    """Meso runs in parallel to the first one, by folder, and the threads of each, after their cell is relaxed.

    One thread a run takes the least processor time. A macro run ends before a process has started. Ensembles run their
    specimens in parallel instead.
    """
    threads = numba.get_num_threads()
    single = all(run.model.scale == "meso" and run.variability.specimens == 1 for run, _ in jobs)
    folders = {place.path: (run, place) for run, place in jobs if not isinstance(place, Path) and place.path}
    if not single or len(folders) < len(jobs) or min(len(jobs), threads) < 2:
        return {}, threads
    cell_of(jobs[0][0], lambda: progress.phase("relaxing geometry"))
    return dict(list(folders.items())[1:threads]), max(threads // len(jobs), 1)


@contextmanager
def _append_resume_hint(parent: Path | None) -> Iterator[None]:
    """Add the resume command to the message of a signal, and to that of a full disk if there is a checkpoint."""
    try:
        yield
    except Interrupted as error:
        raise Interrupted(f"{error}{_resume_hint(parent or error.folder)}") from None
    except ResourceError as error:
        path = parent or getattr(error, "folder", None)
        kept = path is not None and any(found for name in (PATTERN, REPEATS) for found in path.rglob(name))
        raise ResourceError(f"{error}{_resume_hint(path if kept else None)}") from error


def _resume_hint(path: Path | None) -> str:
    return f"; continue with: knittest resume {shlex.quote(str(path))}" if path else ""
