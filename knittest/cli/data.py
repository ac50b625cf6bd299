"""``knittest data``: laboratory files in, specimens and corridor out."""

from pathlib import Path
from typing import Any

import click


@click.group()
def data() -> None:
    """Import and summarise the CSV files of a testing machine.

    They hold a force (N, kN, daN, cN, mN, kgf, lbf; N if not stated) over a travel (mm, cm, m, um, inch; mm if not
    stated) or a strain (%, mm/mm), the unit in the column's name or in the row below it.
    """


def _reading(command: Any) -> Any:
    for option in (
        click.option("--width", type=float, help="Width of the strips [mm], if the files do not state it."),
        click.option("--gauge-length", type=float, help="Distance of the clamps [mm], if the files do not state it."),
        click.option(
            "--sign",
            type=click.Choice(["positive", "negative"]),
            default="positive",
            show_default=True,
            help="How the files count a pull.",
        ),
        click.option("--decimal", type=click.Choice([",", "."]), help="Decimal mark, if it cannot be told."),
        click.option("--delimiter", help="Delimiter, if not ';', tab or ','."),
        click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path)),
    ):
        command = option(command)
    return command


@data.command("import")
@_reading
@click.option("--direction", type=click.Choice(["warp", "weft"]), required=True, help="Yarn system along the strips.")
@click.option("--trust-direction", is_flag=True, help="Go by --direction where a file names the other one.")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder of the experiment, for both.")
def import_(files: tuple[Path, ...], direction: str, trust_direction: bool, out: Path, **reading: Any) -> None:
    """Read testing-machine exports; write an experiment that a fabric file can name.

    Into OUT go a table of the peaks and the strips' size, a SOURCE.md, and fabric.yaml, which a fabric file starts
    from; into OUT/<direction> specimens, corridor (mean and sd), mean curve, per width, statistics and a plot.

    Example: knittest data import warp-*.csv --width 50 --gauge-length 200 --direction warp --out data/mine
    """
    from knittest.experiment.lab_folder import FABRIC, named
    from knittest.experiment.lab_report import summary_lines, write_import

    specimens = _read(files, **reading)
    variant = write_import(specimens, out, direction, [f.name for f in files], trust_direction)  # type: ignore[arg-type]
    click.echo("\n".join([*summary_lines(specimens), f"wrote {out}; a fabric file names it so ({out / FABRIC}):"]))
    click.echo(f'  experiment: {named(out)}\n  experiment_variant: "{variant}"')
    click.echo(f"  macro: {{tension: {{{direction}: {named(out) / direction / 'tension.csv'}}}}}")


@data.command()
@_reading
def stats(files: tuple[Path, ...], **reading: Any) -> None:
    """Print maximum force and strain at maximum force of every specimen, mean and sd.

    Strips or yarns: what has no width is judged by its force alone.

    Example: knittest data stats warp-*.csv --gauge-length 200
    """
    from knittest.experiment.lab_checks import plausible_strips
    from knittest.experiment.lab_report import summary_lines

    specimens = _read(files, **reading)
    plausible_strips(specimens)
    click.echo("\n".join(summary_lines(specimens)))


@data.command("shear-law")
@click.argument("run", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), required=True, help="CSV to write, named by macro.shear.curve.")
def shear_law(run: Path, out: Path) -> None:
    """Homogenise a picture frame of yarns: write its force as a shear law of the shells.

    Example: knittest data shear-law runs/picture-frame-1-meso --out data/mine/shear.csv
    """
    from knittest.experiment.shear_law import write_law

    angle, force = write_law(run, out)
    named = Path(*out.parts[1:]) if out.parts[:1] == ("data",) else out
    click.echo(f"{len(angle)} points up to {angle[-1]:.1f} deg and {force[-1]:.4g} N/mm; wrote {out}")
    click.echo(f"  macro: {{shear: {{kind: table, curve: {named}, source: predicted, ref: meso picture frame}}}}")


def _read(files: tuple[Path, ...], **reading: Any) -> list[Any]:
    from knittest.experiment.lab_csv import read_lab

    return [s for path in files for s in read_lab(path, **reading)]
