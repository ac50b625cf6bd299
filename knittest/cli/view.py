"""``knittest view``."""

from pathlib import Path

import click


@click.command()
@click.argument("run", metavar="RUN", type=click.Path(path_type=Path))
@click.option("--frames", type=int, help="Most frames on the page.  [default: all that the run wrote]")
def view(run: Path, frames: int | None) -> None:
    """Write view.html into a run folder: a page on which the run can be turned, played and coloured.

    The page is one file that needs no network. RUN is a run folder with frames, or a folder that holds some, such as
    that of both directions.

    Example: knittest view runs/forming-...
    """
    from knittest.report_page.folders import find_runs
    from knittest.report_page.moving.page import view as write

    found, notes = find_runs([run])
    for one in found:
        page = write(one.path, frames)
        click.echo(str(page))
        click.echo(f"{page.stat().st_size / 1e6:.1f} MB", err=True)
    for note in notes:
        click.echo(note, err=True)
