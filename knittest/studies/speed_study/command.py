"""Command ``knittest speed-study``: run each test at its speed and at half of it, write the table."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from knittest.base.atomic import write_atomic
from knittest.base.errors import NumericalError
from knittest.base.kinds import kinds, names
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.laboratory.halving import LIMIT, halving
from knittest.laboratory.lowered_speed import at_result_speed, kept_speed
from knittest.runs.show import print_text
from knittest.studies.homogenise.yarn_card import with_cards
from knittest.studies.speed_study.table import Row, csv_text, markdown, rows_of
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.run_all import run_all
from knittest.studies.trials.trial import Trial, trial_of

CSV, MARKDOWN = "speed-study.csv", "speed-study.md"
#: wall seconds that one run may take
TIME_LIMIT = 14400.0
SCALES = ("macro", "meso")


@dataclass(frozen=True)
class StudyOptions:
    """Tests to run and their folder; ``tests`` are any, by default those of a study, ``scales`` of :data:`SCALES`."""

    out: Path
    variant: str | None = None
    fabric: Path | None = None
    tests: Sequence[str] = field(default_factory=lambda: names("studied"))
    scales: Sequence[str] = SCALES
    direction: str = "warp"
    preset: str = "quick"
    workers: int | None = None
    threads: int | None = None
    quiet: bool = False


def study_command(options: StudyOptions) -> int:
    """Run what is not finished in the folder, write CSV and Markdown there, print; returns the exit code.

    Raises :class:`NumericalError` when a run gave no result.
    """
    runs = [_run(options, test, scale) for test in options.tests for scale in options.scales]
    fast = _all_results([trial_of(run, _label(run)) for run in runs], options)
    studies = [halving(at_result_speed(run, results)) for run, results in zip(runs, fast, strict=True)]
    half = [trial_of(s.half, f"{_label(s.half)}, {s.setting} halved") for s in studies]
    rows: list[Row] = []
    slow = _all_results(half, options)
    for trial, found in zip(half, slow, strict=True):
        if not kept_speed(trial.run, found):
            raise NumericalError(f"{trial.label}: restarted at a lower speed; no study without its result")
    for study, *results in zip(studies, fast, slow, strict=True):
        rows += rows_of(study, *results)
    lines = markdown(rows)
    write_atomic(options.out / CSV, csv_text(rows, options.variant or str(options.fabric)))
    write_atomic(options.out / MARKDOWN, "\n".join(lines) + "\n")
    if not options.quiet:
        moved = [row for row in rows if row.within is False]
        print_text([*lines, f"{len(rows)} results, {len(moved)} of them move by {100.0 * LIMIT:g} % or more"])
    return 0


def _run(options: StudyOptions, test: str, scale: str) -> Run:
    run = resolve(
        test=test, variant=options.variant, fabric=options.fabric, scale=scale, preset=options.preset,
        direction=options.direction if kinds()[test].directional else None,
    )  # fmt: skip
    return with_cards([run], options.quiet)[0]


def _label(run: Run) -> str:
    return f"{run.rig.kind} {run.model.scale}"


def _all_results(trials: list[Trial], options: StudyOptions) -> list[dict[str, float]]:
    """Results of ``trials``, run where they are not finished in the folder; raises :class:`NumericalError`."""
    pool = LocalPool(options.workers, options.threads)
    records = run_all(trials, options.out, pool, limit=TIME_LIMIT, quiet=options.quiet)
    for trial in trials:
        record = records[trial.key]
        if record.status != "completed":
            raise NumericalError(f"{trial.label}: {record.status}: {record.reason}; no study without its result")
    return [records[trial.key].results for trial in trials]
