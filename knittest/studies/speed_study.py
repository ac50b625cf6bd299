"""Command ``knittest speed-study``: every test at its speed and at half of it, as rows, CSV and Markdown."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from knittest import __version__
from knittest.base.errors import NumericalError
from knittest.base.files import write_atomic
from knittest.base.kinds import kinds, test_names
from knittest.base.result_rows import LABELS
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.laboratory.halved_setting import LIMIT, HalvedRun, change, diagnostic_results, halve_setting
from knittest.laboratory.restart import has_configured_speed, with_result_speed
from knittest.runs.terminal_output import print_text
from knittest.studies.homogenise.derived_card import complete_cards
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.runner import LEDGER, StudyOptions, check_study_folder, run_all
from knittest.studies.trials.trial import Trial, trial_of

COLUMNS = (
    "test", "scale", "variant", "direction", "preset", "setting", "unit", "value", "quantity", "result", "result_half",
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One result at the setting of ``study`` and at half of it, NaN for a missing one."""

    study: HalvedRun
    quantity: str
    result: float
    half: float

    @property
    def change(self) -> float:
        """Relative change of the result at half the setting."""
        return change(self.result, self.half)

    @property
    def is_within_tolerance(self) -> bool | None:
        """Tell whether the change is within :data:`LIMIT`; None without a change."""
        return None if math.isnan(self.change) else abs(self.change) < LIMIT


def rows_of(study: HalvedRun, fast: Mapping[str, float], slow: Mapping[str, float]) -> Iterator[Row]:
    """Rows of the results except diagnostic ones."""
    for quantity, result in fast.items():
        if quantity not in diagnostic_results():
            yield Row(study, quantity, float(result), float(slow.get(quantity, math.nan)))


def csv_text(rows: Iterable[Row], variant: str) -> str:
    """Table as CSV, with its source in the head."""
    lines = [
        "# kind: simulated",
        f"# source: knittest speed-study, variant {variant}, version {__version__}; the halved setting in its unit",
        ",".join(COLUMNS),
    ]
    for row in rows:
        run = row.study.run
        cells = (
            run.rig.kind, run.model.scale, variant, run.direction, run.model.preset, row.study.setting, row.study.unit,
            f"{row.study.value:g}", row.quantity, f"{row.result:.6g}", f"{row.half:.6g}",
        )  # fmt: skip
        lines.append(",".join(cells))
    return "\n".join(lines) + "\n"


def markdown(rows: Sequence[Row]) -> list[str]:
    """Lines of the table; a change above :data:`LIMIT` is in bold."""
    lines = ["| test | scale | halved | result | as set | at half | change |", "|---|---|---|---|---|---|---|"]
    for row in rows:
        study = row.study
        unit = "" if study.unit == "-" else f" {study.unit}"
        halved = f"{study.setting} {study.value:g}{unit}"
        label, form = LABELS.get(row.quantity, (row.quantity.replace("_", " "), "{:.4g}"))
        result, half = (form.format(v) if math.isfinite(v) else "-" for v in (row.result, row.half))
        bold = f"**{100.0 * row.change:+.1f} %**" if math.isfinite(row.change) else "**from 0**"
        moved = (
            "-"
            if row.is_within_tolerance is None
            else f"{100.0 * row.change:+.2f} %"
            if row.is_within_tolerance
            else bold
        )
        cells = (study.run.rig.kind, study.run.model.scale, halved, label, result, half, moved)
        lines.append(f"| {' | '.join(cells)} |")
    return lines


CSV, MARKDOWN = "speed-study.csv", "speed-study.md"
#: time limit of a run [s]
TIME_LIMIT = 14400.0
SCALES = ("macro", "meso")


@dataclass(frozen=True, kw_only=True)
class SpeedOptions(StudyOptions):
    """Options of the study: ``tests`` (all with a speed study by default) and ``scales``."""

    out: Path = Path("runs/speed-study")
    variant: str | None = None
    fabric: Path | None = None
    tests: Sequence[str] = field(default_factory=lambda: test_names("studied"))
    scales: Sequence[str] = SCALES
    direction: str = "warp"
    preset: str = "quick"


def study_command(options: SpeedOptions) -> int:
    """Run or resume the study, write CSV and Markdown; raises :class:`NumericalError` if a run has no result."""
    runs = [
        resolve(
            test=test, variant=options.variant, fabric=options.fabric, scale=scale, preset=options.preset,
            direction=options.direction if kinds()[test].directional else None,
        )
        for test in options.tests
        for scale in options.scales
    ]  # fmt: skip
    runs = [completed for run in runs for completed in complete_cards([run], options.quiet)]
    fast = _all_results([trial_of(run, _trial_label(run)) for run in runs], options)
    studies = [halve_setting(with_result_speed(run, results)) for run, results in zip(runs, fast, strict=True)]
    half = [trial_of(s.half, f"{_trial_label(s.half)}, {s.setting} halved") for s in studies]
    slow = _all_results(half, options)
    for trial, found in zip(half, slow, strict=True):
        if not has_configured_speed(trial.run, found):
            raise NumericalError(f"{trial.label}: restarted at a lower speed, so the study has no result")
    rows = [row for study, *results in zip(studies, fast, slow, strict=True) for row in rows_of(study, *results)]
    lines = markdown(rows)
    write_atomic(options.out / CSV, csv_text(rows, options.variant or str(options.fabric)))
    write_atomic(options.out / MARKDOWN, "\n".join(lines) + "\n")
    if not options.quiet:
        moved = [row for row in rows if row.is_within_tolerance is False]
        print_text([*lines, f"{len(rows)} results, {len(moved)} of them change by {100.0 * LIMIT:g} % or more"])
    return 0


def _trial_label(run: Run) -> str:
    return f"{run.rig.kind} {run.model.scale}"


def _all_results(trials: list[Trial], options: SpeedOptions) -> list[dict[str, float]]:
    """Results of ``trials``, which run unless they are finished; raises :class:`NumericalError`."""
    check_study_folder(options.out, LEDGER, "speed study")
    pool = LocalPool(options.workers, options.threads)
    records = run_all(trials, options.out, pool, limit=TIME_LIMIT, quiet=options.quiet)
    for trial in trials:
        record = records[trial.key]
        if record.status != "completed":
            raise NumericalError(f"{trial.label}: {record.status}: {record.reason}; the study needs its result")
    return [records[trial.key].results for trial in trials]
