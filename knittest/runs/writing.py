"""Files of a run folder: tables, frames, pictures, comparison and summary."""

from knittest.base.history import Specimen
from knittest.base.kinds import kinds
from knittest.base.printing import printed
from knittest.base.stamp import stamped
from knittest.config.run import Run
from knittest.export import vtu
from knittest.export.folder import RunFolder
from knittest.laboratory.registry import REPORTS
from knittest.laboratory.report_base import References
from knittest.laboratory.run_stamp import run_stamp
from knittest.runs.judgement import Judgement
from knittest.runs.options import RunOptions


def write_incomplete(
    run: Run, specimens: list[Specimen], references: References, reason: str, folder: RunFolder, options: RunOptions
) -> None:
    """Write what a run has that ended early for ``reason``: tables, frames, pictures; no results.

    From the first picture on that needs the end of the test they are left out, and the log says so.
    """
    _write_tables(run, specimens, folder)
    if options.frames:
        _write_frames(run, specimens[0], folder)
    if not options.pictures:
        return
    report, drawn = REPORTS[run.rig.kind], kinds()[run.rig.kind].pictures
    try:
        with stamped(run_stamp(run, (f"incomplete: {reason}",))), printed(options.printing):
            report.pictures(run, specimens, references, folder.path)
    except Exception as error:  # one that needs the end of the test
        folder.log("pictures left out", reason=str(error))
    folder.mark_incomplete(drawn)


def write_files(
    run: Run,
    specimens: list[Specimen],
    references: References,
    judgement: Judgement,
    folder: RunFolder,
    options: RunOptions,
) -> None:
    """Write everything of the run folder; pictures and frames show the first specimen."""
    report = REPORTS[run.rig.kind]
    _write_tables(run, specimens, folder)
    for name, columns in report.tables(run, specimens).items():
        folder.write_table(name, columns)
    if options.frames:
        _write_frames(run, specimens[0], folder)
    if options.pictures:
        with stamped(run_stamp(run, judgement.summary["refused"])), printed(options.printing):
            report.pictures(run, specimens, references, folder.path)
    folder.write_comparison(judgement.comparison)
    folder.write_summary(judgement.summary)


def _write_tables(run: Run, specimens: list[Specimen], folder: RunFolder) -> None:
    """Write the tables that every test has."""
    first = specimens[0]
    folder.write_curve(REPORTS[run.rig.kind].curve(specimens))
    folder.write_energies(first.history.energies)
    if first.history.contacts:
        folder.write_contacts(first.history.contacts)
    if first.yarns:
        folder.write_yarns(first.yarns)


def _write_frames(run: Run, specimen: Specimen, folder: RunFolder) -> None:
    vtu.write_frames(folder.path, specimen.history, REPORTS[run.rig.kind].bodies(run, specimen))
