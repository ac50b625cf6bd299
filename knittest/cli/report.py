"""``knittest report``."""

from pathlib import Path

import click


@click.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="File to write.  [default: report.html in RUN; knittest-report.html here for several]",
)
def report(runs: tuple[Path, ...], out: Path | None) -> int:
    """Write one HTML page on runs, with everything in it: it can be mailed, printed and read without a network.

    RUN is a run folder, or a folder that holds some, such as that of both directions. Several runs are compared.

    Example: knittest report runs/tensile-... runs/friction-... --out comparison.html
    """
    from knittest.report_page.page import write_reports

    path, count = write_reports(list(runs), out)
    click.echo(str(path))
    click.echo(f"{count} run{'s' if count > 1 else ''} on the page", err=True)
    return 0
