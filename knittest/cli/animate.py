"""``knittest animate``."""

from pathlib import Path
from typing import Any

import click


@click.command()
@click.argument("run", metavar="RUN", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Film, .mp4 or .gif.  [default: RUN/film.mp4]")
@click.option("--colour", default="", help="Field of the frames, or height.  [default: axial force or shear angle]")
@click.option("--look", type=click.Choice(["oblique", "top", "side"]), default="oblique", show_default=True)
@click.option("--seconds", type=float, default=5.0, show_default=True, help="Length, before the last image stands.")
@click.option("--fps", type=int, help="Images a second.  [default: 15; GIF: 10]")
@click.option("--width", type=int, help="Pixels.  [default: 960; GIF: 640]")
@click.option(
    "--tools/--no-tools", default=True, show_default=True, help="Stamp, die, holder, plates, board, jaws, bars."
)
def animate(run: Path, out: Path | None, **looks: Any) -> None:
    """Write a run as a film for slides: a run folder with frames as MP4 or GIF.

    MP4 needs an encoder: pip install 'knittest[animate]'; without it the default is a GIF. RUN is a run folder, or a
    folder that holds some, such as that of both directions: each gets a film, with --out one with its name in it.

    Example: knittest animate runs/forming-... --out forming.gif
    """
    from knittest.report_page.folders import find_runs
    from knittest.report_page.moving.film import Filmed, films
    from knittest.report_page.moving.film import animate as write

    found, notes = find_runs([run])
    planned, fallback = films(run, [one.path for one in found], out)
    if fallback:
        click.echo(fallback, err=True)
    for folder, film in planned.items():
        write(folder, film, Filmed(**looks))
        click.echo(str(film))
        click.echo(f"{film.stat().st_size / 1e6:.1f} MB", err=True)
    for note in notes:
        click.echo(note, err=True)
