"""``knittest report``."""

from pathlib import Path

import click

from knittest.cli.options import OPEN, printing_asked, prints


@click.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="File to write.  [default: report.html in RUN; knittest-report.html here for several]",
)
@OPEN
@prints
def report(runs: tuple[Path, ...], out: Path | None, open_page: bool, formats: str | None, dpi: int | None) -> int:
    """Write one HTML page on runs, with everything in it: it can be mailed, printed and read without a network.

    RUN is a run folder, or a folder that holds some, such as that of both directions; several are compared. The folder
    of a sweep, of a calibration or of a study of uncertainty, alone, gets the page of that. With --format or --dpi the
    curves of the runs, and the fields of formed blanks, are written beside the page too.

    Example: knittest report runs/tensile-... runs/friction-... --out comparison.html
    """
    from knittest.report_page.page import write_reports
    from knittest.runs.show import open_page as show_page
    from knittest.studies.batch.page import is_sweep, write_sweep_page
    from knittest.studies.calibrate.page import is_calibration, write_calibration_page
    from knittest.studies.uncertainty.page import is_uncertainty, write_uncertainty_page

    pages = (
        (is_sweep, write_sweep_page),
        (is_calibration, write_calibration_page),
        (is_uncertainty, write_uncertainty_page),
    )
    asked = printing_asked(formats, dpi) if formats or dpi else None
    write = next((write for is_one, write in pages if len(runs) == 1 and is_one(runs[0])), None)
    if write and asked:
        raise click.UsageError("--format and --dpi are for pages on runs: leave them out here")
    path, count = (write(runs[0], out), 0) if write else write_reports(list(runs), out, asked)
    click.echo(str(path))
    if count:
        click.echo(f"{count} run{'s' if count > 1 else ''} on the page", err=True)
    if open_page:
        show_page(path)
    return 0
