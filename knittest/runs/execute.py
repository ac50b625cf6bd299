"""A run end to end: specimens of one direction, their folder, comparison and report."""

import time as clock
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np

from knittest.base.errors import NumericalError, ResourceError
from knittest.base.history import Cost, Overlaps, Quality, Specimen
from knittest.base.interrupts import Interrupted, Interrupts
from knittest.base.kinds import kinds
from knittest.base.progress import Progress
from knittest.base.resources import data_dir
from knittest.base.stamp import stamped
from knittest.config.run import Run
from knittest.experiment.compare import compare_columns, compare_results
from knittest.experiment.row_kind import assumed_inputs, given_results, row_kind
from knittest.experiment.tables import published
from knittest.export import vtu
from knittest.export.folder import RunFolder
from knittest.export.identity import cell_of, data_files
from knittest.export.summary import ComparisonRow, build_summary, ensemble_results
from knittest.laboratory.against import own_curves
from knittest.laboratory.registry import REPORTS, TESTS
from knittest.laboratory.report_base import References
from knittest.laboratory.run_stamp import run_stamp
from knittest.report_page.page import write_if_possible, write_report
from knittest.runs.opening import Opened, Opener
from knittest.runs.options import RunOptions
from knittest.runs.specimen import run_specimen
from knittest.runs.specimen_store import specimen_of, specimen_state

EXIT_REFUSED = NumericalError.exit_code


@dataclass(frozen=True)
class Outcome:
    """A finished run: folder, summary as written, quality of its worst specimen, metrics of the user's curves."""

    run: Run
    folder: Path
    summary: dict[str, Any]
    quality: Quality
    curves: Sequence[dict[str, Any]] = ()


def execute(run: Run, opener: Opener, interrupts: Interrupts, options: RunOptions, progress: Progress) -> Outcome:
    """Run all specimens of ``run``, or those that are left, and write its folder."""
    references = references_of(run, options.against)
    if run.model.scale == "meso":  # before there is a folder, whose manifest names the cell
        progress.phase(f"{run.direction or run.rig.kind}: relaxing geometry")
        cell_of(run)
    with interrupts.held(when=lambda: True):  # so that none comes between the first manifest and the last
        opened = opener(run, data_files(run), interrupts)
        folder = opened.folder
        try:
            with folder, interrupts.deciding():
                with interrupts.heard():
                    specimens = _specimens(run, progress, opened)
                    summary, comparison, quality = _judge(run, specimens, references)
                    _write(run, specimens, references, summary, comparison, folder, options)
                if quality.failures:
                    folder.finish("completed", EXIT_REFUSED, "comparison refused: " + "; ".join(quality.failures))
            interrupts.check()
        except (Interrupted, ResourceError) as error:
            error.folder = folder.path
            raise
    if options.pictures:
        write_if_possible(folder.path, write_report)
    judged = comparison["curves"][len(comparison["curves"]) - len(references.own) :]
    return Outcome(run, folder.path, summary, quality, [] if quality.failures else judged)


def references_of(run: Run, against: Sequence[Path]) -> References:
    """References of ``run``: published rows, the reference curve, curves of the user's."""
    return replace(_references(run), own=own_curves(run, against))


def _specimens(run: Run, progress: Progress, opened: Opened) -> list[Specimen]:
    count = run.variability.specimens
    if count > 1:
        run = run.model_copy(update={"variability": run.variability.model_copy(update={"mode": "random"})})
    done = []
    for k in range(count):
        kept = opened.checkpoints.finished(k)
        if kept is not None:
            done.append(specimen_of(kept))
            continue
        name = run.direction or run.rig.kind
        label = f"{name} {k + 1}/{count}" if count > 1 else name
        start = clock.perf_counter()
        phase = partial(_announce, progress, label, TESTS[run.rig.kind].ends_at_failure)
        with opened.checkpoints.keeping(k) as keeper:
            found = partial(_log_overlaps, opened.folder, k)
            done.append(run_specimen(run, k, phase=phase, update=progress.update, keeper=keeper, found=found))
            keeper.finish(specimen_state(done[-1], frames=k == 0))  # pictures show the first specimen
        opened.folder.log("specimen", number=k, seconds=round(clock.perf_counter() - start, 3), **done[-1].results)
    progress.done()
    return done


def _log_overlaps(folder: RunFolder, specimen: int, overlaps: Overlaps) -> None:
    """Log the yarns that overlap before the run."""
    if overlaps.largest > 0.0:
        largest = round(100.0 * overlaps.largest, 3)
        folder.log("overlap", number=specimen, contacts=overlaps.count, largest_pct=largest, worst=overlaps.worst)


def _announce(progress: Progress, label: str, until_failure: bool, text: str) -> None:
    progress.phase(f"{label}: {text}", until_failure=until_failure)


def _references(run: Run) -> References:
    """Published rows and the reference curve of the fabric's experiment, if it names one."""
    fabric = run.fabric
    if fabric.experiment is None or fabric.experiment_variant is None:
        return References()
    quantities = kinds()[run.rig.kind].published
    report = REPORTS[run.rig.kind]
    rows = published(data_dir() / fabric.experiment, fabric.experiment_variant, run.direction, quantities)
    return References(report.scaled(run, rows), report.reference_curve(run))


def _judge(
    run: Run, specimens: list[Specimen], references: References
) -> tuple[dict[str, Any], dict[str, Any], Quality]:
    """Summary, comparison and the quality of the worst specimen."""
    quality, cost = _worst([s.quality for s in specimens]), _total([s.cost for s in specimens])
    results = [s.results for s in specimens]
    means = {k: v["mean"] for k, v in ensemble_results(results).items()}
    kinds = {row.quantity: row_kind(run, row.quantity) for row in references.rows}
    guessed = list(assumed_inputs(run)) if references.rows else []
    rows = compare_results(means, references.rows, kinds, given_results(run))
    compared = [row | {"assumed": guessed} for row in rows]
    comparison: dict[str, Any] = {"refused": list(quality.failures), "rows": [], "curves": []}
    if not quality.failures:
        comparison["rows"] = compared
        columns = REPORTS[run.rig.kind].curve(specimens)
        comparison["curves"] = [compare_columns(columns, curve) for curve in references.curves]
    return build_summary(run, results, quality, cost, cast("list[ComparisonRow]", compared)), comparison, quality


def _worst(qualities: list[Quality]) -> Quality:
    """The largest of every measure, and all distinct failures and warnings."""
    measures = [one.name for one in fields(Quality) if one.type is float]
    # numpy's maximum keeps what is not a number
    worst: dict[str, Any] = {name: float(np.max([getattr(q, name) for q in qualities])) for name in measures}
    return Quality(
        **worst,
        quasi_static=all(q.quasi_static for q in qualities),
        failures=tuple(dict.fromkeys(f for q in qualities for f in q.failures)),
        warnings=tuple(dict.fromkeys(w for q in qualities for w in q.warnings)),
    )


def _total(costs: list[Cost]) -> Cost:
    """Sums of times and steps over the specimens."""
    seconds = sum(c.steps * c.elements / c.element_steps_per_s for c in costs)
    return replace(
        costs[0],
        **{n: sum(getattr(c, n) for c in costs) for n in ("wall_s", "cpu_s", "compile_s", "geometry_s", "steps")},
        element_steps_per_s=sum(c.steps * c.elements for c in costs) / max(seconds, 1e-9),
    )


def _write(
    run: Run,
    specimens: list[Specimen],
    references: References,
    summary: dict[str, Any],
    comparison: dict[str, Any],
    folder: RunFolder,
    options: RunOptions,
) -> None:
    """Write all files of the run folder; pictures and frames show the first specimen."""
    first, report = specimens[0], REPORTS[run.rig.kind]
    folder.write_curve(report.curve(specimens))
    folder.write_energies(first.history.energies)
    if first.history.contacts:
        folder.write_contacts(first.history.contacts)
    if first.yarns:
        folder.write_yarns(first.yarns)
    for name, columns in report.tables(run, specimens).items():
        folder.write_table(name, columns)
    if options.frames:
        vtu.write_frames(folder.path, first.history)
    if options.pictures:
        with stamped(run_stamp(run, summary["refused"])):
            report.pictures(run, specimens, references, folder.path)
    folder.write_comparison(comparison)
    folder.write_summary(summary)
