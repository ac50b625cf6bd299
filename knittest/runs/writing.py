"""Files of a run folder: tables, frames, pictures, comparison and summary."""

from knittest.base.history import Specimen
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


def write_files(
    run: Run,
    specimens: list[Specimen],
    references: References,
    judgement: Judgement,
    folder: RunFolder,
    options: RunOptions,
) -> None:
    """Write everything of the run folder; pictures and frames show the first specimen."""
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
        vtu.write_frames(folder.path, first.history, report.bodies(run, first))
    if options.pictures:
        with stamped(run_stamp(run, judgement.summary["refused"])), printed(options.printing):
            report.pictures(run, specimens, references, folder.path)
    folder.write_comparison(judgement.comparison)
    folder.write_summary(judgement.summary)
