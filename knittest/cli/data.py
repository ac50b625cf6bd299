"""``knittest data``: laboratory files in, specimens and corridor out."""

from pathlib import Path
from typing import Any

import click

from knittest.base.kinds import names
from knittest.cli.options import Command


@click.group()
def data() -> None:
    """Import and summarise the files of a testing machine: text or workbooks (xlsx, xls).

    They hold a force (N, kN, daN, cN, mN, kgf, lbf; N if not stated) over a travel (mm, cm, m, um, inch; mm if not
    stated), a strain (%, mm/mm, um/m) or a shear angle (deg, rad), the unit in the column's name or in the row below
    it; of a cantilever, overhang lengths; of a compaction test a thickness and a pressure (kPa, MPa, Pa, bar, psi, ...)
    or a force; of a friction test a pull force or a coefficient; of a pull-out also the way of the free end, and all
    units must be stated.
    """


#: option, unit and what it says, of numbers that files may state themselves
NUMBERS = (
    ("--width", "mm", "Width of the strips, or that the force of a biaxial test is of (no frame, no friction)"),
    ("--gauge-length", "mm", "Distance of the clamps (tensile, biaxial, bias-extension)"),
    ("--frame-side", "mm", "Side of the frame, hinge to hinge (picture-frame)"),
    ("--fabric-side", "mm", "Side of the sheared square of fabric (picture-frame)"),
    ("--area-mass", "g/m2", "Mass per area of the strips (cantilever)"),
    ("--plane-angle", "deg", "Angle of the plane, 41.5 if not stated (cantilever)"),
    ("--normal-force", "N", "Force that presses the plates (friction)"),
    ("--plate-length", "mm", "Length of the plates (friction)"),
    ("--plate-width", "mm", "Width of the plates (friction)"),
    ("--plate-diameter", "mm", "Diameter of the plate on which a force presses (compaction)"),
    ("--ratio", "1", "Strain of the other system over that of the direction (biaxial)"),
    ("--embedded-length", "mm", "Length of the inlay in the piece (pull-out)"),
    ("--crossing-density", "yarn/100 mm", "Yarns that cross the inlay (pull-out)"),
)


def _reading(command: Command) -> Command:
    for option in (
        click.option(
            "--test",
            type=click.Choice(names("laboratory")),
            help="What was tested; tensile if not given, unless a file looks like another test.",
        ),
        *(
            click.option(name, type=float, help=f"{text} [{unit}], if the files do not state it.")
            for name, unit, text in NUMBERS
        ),
        click.option(
            "--sign",
            type=click.Choice(["positive", "negative"]),
            help="How the files count a pull; positive if not given.",
        ),
        click.option(
            "--zero",
            type=float,
            help="Travel or shear angle at which the frame is square, or travel of the clamp at which an inlay's free "
            "end begins to move, in the column's unit.",
        ),
        click.option(
            "--clamped",
            type=click.Choice(["sides", "far"]),
            help="Edges of the piece that were clamped: both along the inlay, or the far one (pull-out).",
        ),
        click.option(
            "--loading",
            type=click.Choice(["first", "cycles"]),
            help="What counts: the first loading alone, or whole cycles, which must then be there; cycles if there are "
            "any, unless stated (picture-frame).",
        ),
        click.option(
            "--preload",
            type=click.Choice(["subtract", "keep"]),
            help="Whether to subtract or keep a force at the start (picture-frame, friction, pull-out).",
        ),
        click.option(
            "--faces",
            type=click.IntRange(1, 2),
            help="Faces of the strip that rub: 2 between plates, if not given (friction).",
        ),
        click.option("--decimal", type=click.Choice([",", "."]), help="Decimal mark, if it cannot be told."),
        click.option("--delimiter", help="Delimiter, if not ';', tab, ',' or blanks."),
        click.option("--columns", help="What each column is, in their order, such as time,travel,force; - for none."),
        click.option(
            "--column", multiple=True, metavar="ROLE=NAME", help='What the column NAME is, such as force="Kraft A".'
        ),
        click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path)),
    ):
        command = option(command)
    return command


@data.command("import")
@_reading
@click.option(
    "--direction", type=click.Choice(["warp", "weft"]), help="Yarn system along the strips; a frame has none."
)
@click.option("--trust-direction", is_flag=True, help="Go by --direction where a file names the other one.")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder of the experiment, for all tests.")
def import_(
    test: str | None, files: tuple[Path, ...], direction: str | None, trust_direction: bool, out: Path, **reading: Any
) -> None:  # fmt: skip
    """Read testing-machine exports; write an experiment that a fabric file can name.

    Into OUT go a table of the results and the conditions that they hang on, a SOURCE.md, and fabric.yaml, the part of a
    fabric file that all imports into OUT give; into a folder in it specimens, corridor (mean and sd), statistics and a
    plot. Tensile curves are forces per width, a frame's are normalised shear forces; an overhang gives the bending
    stiffness; a pull between plates a coefficient of friction, a pull-out the friction of a crossing.

    Example: knittest data import warp-*.csv --width 50 --gauge-length 200 --direction warp --out data/mine

    Example: knittest data import frame-*.csv --test picture-frame --frame-side 200 --fabric-side 180 --out data/mine
    """
    from knittest.config.starting import FABRIC
    from knittest.experiment.lab_tests import LAB_TESTS, read_files, stated_test

    test = stated_test(test, files, reading["delimiter"])
    specimens = read_files(test, files, reading)
    lines = LAB_TESTS[test].lines(specimens)
    LAB_TESTS[test].write(specimens, out, direction, [f.name for f in files], trust_direction)
    click.echo("\n".join([*lines, f"wrote {out}; a fabric file takes from it ({out / FABRIC}):"]))
    fields = (out / FABRIC).read_text(encoding="utf-8").splitlines()
    click.echo("\n".join(f"  {line}" for line in fields if not line.startswith("#")))


@data.command()
@_reading
def stats(test: str | None, files: tuple[Path, ...], **reading: Any) -> None:
    """Print the results of every specimen, mean and sd: of a tensile test maximum force and strain at it.

    Strips or yarns: what has no width is judged by its force alone. Other tests need the conditions that data import
    needs.

    Example: knittest data stats warp-*.csv --gauge-length 200
    """
    from knittest.experiment.lab_tests import LAB_TESTS, read_files, stated_test
    from knittest.runs.show import print_text

    test = stated_test(test, files, reading["delimiter"])
    print_text(LAB_TESTS[test].lines(read_files(test, files, reading)))


@data.command("shear-law")
@click.argument("run", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), required=True, help="CSV to write, named by macro.shear.curve.")
def shear_law(run: Path, out: Path) -> None:
    """Homogenise a picture frame of yarns: write its force as a shear law of the shells.

    Example: knittest data shear-law runs/picture-frame-1-meso --out data/law/shear.csv
    """
    from knittest.laboratory.picture_frame.shear_law import write_law

    angle, force = write_law(run, out)
    named = Path(*out.parts[1:]) if out.parts[:1] == ("data",) else out
    click.echo(f"{len(angle)} points up to {angle[-1]:.1f} deg and {force[-1]:.4g} N/mm; wrote {out}")
    click.echo(f"  macro: {{shear: {{kind: table, curve: {named}, source: predicted, ref: meso picture frame}}}}")
