"""Files of a run folder: tables, frames, pictures, summary, and the comparison of the run with the experiment."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from knittest.base.figure import use_printing, use_stamp
from knittest.base.files import data_dir
from knittest.base.history import Cost, Quality, Specimen, peaks_after_failure
from knittest.base.kinds import kinds
from knittest.base.summary import Summary
from knittest.config.run import Run
from knittest.config.suspicious_values import find_suspicious_values
from knittest.experiment.comparison import compare_columns, compare_results
from knittest.experiment.origin import assumed_inputs, given_results, row_kind
from knittest.experiment.tables import published_rows
from knittest.export import meshes
from knittest.export.folder import RunFolder
from knittest.export.summary import build_summary, ensemble_results
from knittest.laboratory.reference_curves import own_curves
from knittest.laboratory.report_base import REPORTS, References, run_stamp
from knittest.runs.options import RunOptions


@dataclass(frozen=True)
class ComparedRun:
    """summary.json, comparison.json, quality of the worst specimen, and metrics of the user's ``own`` curves."""

    summary: Summary
    comparison: dict[str, object]
    quality: Quality
    own: Sequence[dict[str, object]] = ()


def references_of(run: Run, against: Sequence[Path]) -> References:
    """References of ``run``: published rows and curve of the fabric's experiment, and the user's curves ``against``."""
    fabric, report, references = run.fabric, REPORTS[run.rig.kind], References()
    if fabric.experiment is not None and fabric.experiment_variant is not None:
        quantities = kinds()[run.rig.kind].published
        rows = published_rows(data_dir() / fabric.experiment, fabric.experiment_variant, run.direction, quantities)
        references = References(report.scaled(run, rows), report.reference_curve(run), apart=report.apart(run, rows))
    return replace(references, own=own_curves(run, against))


def compare_run(run: Run, specimens: list[Specimen], references: References, forced: Sequence[str] = ()) -> ComparedRun:
    """Compare the mean of ``specimens`` with ``references`` unless a check fails; warn of ``forced`` changes."""
    quality, cost = _worst_quality([s.quality for s in specimens]), _total_cost([s.cost for s in specimens])
    quality = quality.with_warnings(*references.apart, *find_suspicious_values(run))
    if forced:
        quality = quality.with_warnings(f"resumed with --force although {'; '.join(forced)}")
    results = [s.results for s in specimens]
    means = ensemble_results(results)
    kind_of = {row.quantity: row_kind(run, row.quantity) for row in references.rows}
    guessed = list(assumed_inputs(run))
    rows = compare_results(means, references.rows, kind_of, given_results(run))
    for row in rows:
        row["assumed"] = guessed
    refused, curves = quality.failures, list[dict[str, object]]()
    report = REPORTS[run.rig.kind]
    axes = report.axes
    if not refused:
        columns = report.scale_to_nominal_size(run, report.curve(specimens))
        curves = [compare_columns(columns, curve, axes.reach) for curve in references.curves]
    comparison: dict[str, object] = {"refused": list(refused), "rows": [] if refused else rows, "curves": curves}
    alone = {q: row_kind(run, q) for q in kinds()[run.rig.kind].published if q in means and q not in kind_of}
    summary = build_summary(run, results, quality, cost, rows, alone, guessed, [s.rest for s in specimens])
    if axes.peak:  # quality checks of this test end at the first failure
        peaks = [s.results.get(axes.peak, np.nan) for s in specimens]  # none of loops that do not fail
        beyond = peaks_after_failure([s.history for s in specimens], axes.x, peaks)
        if beyond:
            summary["unjudged"] = beyond
    return ComparedRun(summary, comparison, quality, curves[len(curves) - len(references.own) :])


def _worst_quality(qualities: list[Quality]) -> Quality:
    """The largest of every measure, and all distinct failures and warnings."""
    measures = [one.name for one in fields(Quality) if one.type is float]
    # numpy's maximum keeps what is not a number
    worst = {name: float(np.max([getattr(q, name) for q in qualities])) for name in measures}
    return Quality(
        **worst,
        quasi_static=all(q.quasi_static for q in qualities),
        failures=tuple(dict.fromkeys(f for q in qualities for f in q.failures)),
        warnings=tuple(dict.fromkeys(w for q in qualities for w in q.warnings)),
    )


def _total_cost(costs: list[Cost]) -> Cost:
    seconds = sum(c.steps * c.elements / c.element_steps_per_s for c in costs)
    return replace(
        costs[0],
        **{n: sum(getattr(c, n) for c in costs) for n in ("wall_s", "cpu_s", "compile_s", "geometry_s", "steps")},
        element_steps_per_s=sum(c.steps * c.elements for c in costs) / max(seconds, 1e-9),
    )


def write_incomplete(
    run: Run, specimens: list[Specimen], references: References, reason: str, folder: RunFolder, options: RunOptions
) -> None:
    """Write tables, frames and the possible pictures, but no results, of a run that ended early for ``reason``."""
    _write_tables(run, specimens, folder, options)
    if not options.pictures:
        return
    report, drawn = REPORTS[run.rig.kind], kinds()[run.rig.kind].pictures
    try:
        with use_stamp(run_stamp(run, (f"incomplete: {reason}",))), use_printing(options.printing):
            report.pictures(run, specimens, references, folder.path)
    except Exception as error:  # one that needs the end of the test
        folder.log("pictures left out", reason=str(error))
    folder.mark_incomplete(drawn)


def write_files(
    run: Run,
    specimens: list[Specimen],
    references: References,
    compared: ComparedRun,
    folder: RunFolder,
    options: RunOptions,
) -> None:
    """Write everything of the run folder; pictures and frames show the first specimen."""
    report = REPORTS[run.rig.kind]
    _write_tables(run, specimens, folder, options)
    for name, columns in report.tables(run, specimens).items():
        folder.write_table(name, columns)
    if options.pictures:
        with use_stamp(run_stamp(run, compared.summary["refused"])), use_printing(options.printing):
            report.pictures(run, specimens, references, folder.path)
    folder.write_json("comparison.json", compared.comparison)
    folder.write_json("summary.json", compared.summary)


def _write_tables(run: Run, specimens: list[Specimen], folder: RunFolder, options: RunOptions) -> None:
    """Write the tables that every test has, and the frames of the first specimen."""
    first, report = specimens[0], REPORTS[run.rig.kind]
    folder.write_table("curve.csv", report.curve(specimens))
    folder.write_table("energies.csv", first.history.energies)
    if first.history.contacts:
        folder.write_table("contacts.csv", first.history.contacts)
    if first.yarns:
        folder.write_table("yarns.csv", first.yarns)
    if options.frames:
        meshes.write_frames(folder.path, first.history, report.bodies(run, first))
