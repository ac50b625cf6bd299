"""``knittest data``: laboratory files in, specimens and corridor out."""

from pathlib import Path
from typing import Any

import click

from knittest.base.kinds import test_names
from knittest.cli.options import PATH, add_options


@click.group()
def data() -> None:
    """Import and summarise files of testing machines: text or workbooks (xlsx, xls).

    A file has a force (N, kN, daN, cN, mN, kgf, lbf; default N) and a travel (mm, cm, m, um, inch; default mm), a
    strain (%, mm/mm, um/m) or a shear angle (deg, rad). The unit is in the name of the column or in the row below.
    Other tests: overhang lengths (cantilever); thickness and a force or a pressure in kPa, MPa, Pa, bar, psi, ...
    (compaction); pull force or coefficient of friction (friction); also the travel of the free end, with all units
    stated (pull-out).
    """


#: option, unit and meaning of numbers that files may state themselves
NUMBERS = (
    ("--width", "mm", "Width of the strips or of the biaxial specimen (not for picture-frame, friction)"),
    ("--gauge-length", "mm", "Distance between the clamps (tensile, biaxial, bias-extension)"),
    ("--frame-side", "mm", "Side of the frame, hinge to hinge (picture-frame)"),
    ("--fabric-side", "mm", "Side of the sheared square of fabric (picture-frame)"),
    ("--area-mass", "g/m2", "Mass per area of the strips (cantilever)"),
    ("--plane-angle", "deg", "Angle of the inclined plane, default 41.5 (cantilever)"),
    ("--normal-force", "N", "Force that presses the plates together (friction)"),
    ("--plate-length", "mm", "Length of the plates (friction)"),
    ("--plate-width", "mm", "Width of the plates (friction)"),
    ("--plate-diameter", "mm", "Diameter of the pressing plate, for files with a force (compaction)"),
    ("--ratio", "1", "Strain of the other yarn system over that of the direction (biaxial)"),
    ("--embedded-length", "mm", "Embedded length of the inlay (pull-out)"),
    ("--crossing-density", "yarn/100 mm", "Density of the yarns that cross the inlay (pull-out)"),
)


def _choice_option(name: str, choices: list[str], text: str) -> Any:
    return click.option(name, type=click.Choice(choices), help=text)


_reading_options = add_options(
    _choice_option(
        "--test", test_names("laboratory"), "Kind of test; default tensile, unless a file looks like another one."
    ),
    *(
        click.option(name, type=float, help=f"{text} [{unit}], if the files do not state it.")
        for name, unit, text in NUMBERS
    ),
    _choice_option("--sign", ["positive", "negative"], "Sign of a pull in the files; default positive."),
    click.option(
        "--zero", type=float,
        help="Origin, in the column's unit: travel or shear angle of the square frame (picture-frame); travel at which "
        "the free end begins to move (pull-out).",
    ),
    _choice_option("--clamped", ["sides", "far"], "Clamped edges: both along the inlay, or the far one (pull-out)."),
    _choice_option(
        "--loading", ["first", "cycles"],
        "Evaluate the first loading only, or whole cycles; default: cycles if the files have any (picture-frame).",
    ),
    _choice_option(
        "--preload", ["subtract", "keep"], "Treatment of a force at the start (picture-frame, friction, pull-out)."
    ),
    click.option(
        "--faces", type=click.IntRange(1, 2), help="Strip faces in contact; default 2, between plates (friction)."
    ),
    _choice_option("--decimal", [",", "."], "Decimal mark, if it cannot be detected."),
    click.option("--delimiter", help="Delimiter, if not ';', tab, ',' or blanks."),
    click.option("--columns", help="Meaning of each column in order, such as time,travel,force; - for none."),
    click.option(
        "--column", multiple=True, metavar="ROLE=NAME", help='Meaning of the column NAME, such as force="Kraft A".'
    ),
    click.argument("files", nargs=-1, required=True, type=PATH),
)  # fmt: skip


@data.command("import")
@_reading_options
@_choice_option("--direction", ["warp", "weft"], "Yarn system along the strips (not for picture-frame).")
@click.option("--trust-direction", is_flag=True, help="Use --direction where a file names the other direction.")
@click.option("--out", type=PATH, required=True, help="Folder of the experiment, for all tests.")
def import_(
    test: str | None, files: tuple[Path, ...], direction: str | None, trust_direction: bool, out: Path, **reading: Any
) -> None:
    """Read files of a testing machine; write an experiment that a fabric file can name.

    OUT gets a table of the results with their conditions, SOURCE.md, and fabric.yaml, the part of a fabric file that
    follows from all imports into OUT. A folder in OUT gets specimens, corridor (mean and sd), statistics and a plot.
    Tensile curves are forces per width, picture-frame curves normalised shear forces. A cantilever test gives the
    bending stiffness, a friction test the coefficient of friction, a pull-out test the friction of a crossing.

    Example: knittest data import warp-*.csv --width 50 --gauge-length 200 --direction warp --out data/mine

    Example: knittest data import frame-*.csv --test picture-frame --frame-side 200 --fabric-side 180 --out data/mine
    """
    from knittest.config.templates import FABRIC
    from knittest.experiment.lab_tests import LAB_TESTS, choose_test, read_files

    test = choose_test(test, files, reading["delimiter"])
    specimens = read_files(test, files, reading)
    lines = LAB_TESTS[test].lines(specimens)
    LAB_TESTS[test].write(specimens, out, direction, [f.name for f in files], trust_direction)
    click.echo("\n".join([*lines, f"wrote {out}; copy these fields into a fabric file ({out / FABRIC}):"]))
    fields = (out / FABRIC).read_text(encoding="utf-8").splitlines()
    click.echo("\n".join(f"  {line}" for line in fields if not line.startswith("#")))


@data.command()
@_reading_options
def stats(test: str | None, files: tuple[Path, ...], **reading: Any) -> None:
    """Print the results of every specimen with mean and sd, such as the tensile peak force and its strain.

    Files without a width, such as those of yarns, are evaluated by force. Other tests need the same options as
    knittest data import.

    Example: knittest data stats warp-*.csv --gauge-length 200
    """
    from knittest.experiment.lab_tests import LAB_TESTS, choose_test, read_files
    from knittest.runs.terminal_output import print_text

    test = choose_test(test, files, reading["delimiter"])
    print_text(LAB_TESTS[test].lines(read_files(test, files, reading)))


@data.command("shear-law")
@click.argument("run", type=PATH)
@click.option("--out", type=PATH, required=True, help="CSV to write, for the field macro.shear.curve.")
def shear_law(run: Path, out: Path) -> None:
    """Write the force of a meso picture-frame run as a shear law for the macro model.

    Example: knittest data shear-law runs/picture-frame-1-meso --out data/law/shear.csv
    """
    from knittest.laboratory.picture_frame.shear_law import write_law

    angle, force = write_law(run, out)
    named = Path(*out.parts[1:]) if out.parts[:1] == ("data",) else out
    click.echo(f"{len(angle)} points up to {angle[-1]:.1f} deg and {force[-1]:.4g} N/mm; wrote {out}")
    click.echo(f"  macro: {{shear: {{kind: table, curve: {named}, source: predicted, ref: meso picture frame}}}}")
