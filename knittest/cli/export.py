"""``knittest export``: files of the models of a run."""

from pathlib import Path
from typing import Any

import click

from knittest.base.kinds import kinds
from knittest.cli.options import FILE, FOLDER, PATH, resolve_runs, with_run_options

SHAPES = {"t": "T-shape", "hemisphere": "hemisphere", "stl": "STL files"}


@click.group()
def export() -> None:
    """Export solver decks, workbooks, yarns and tools of a run."""


@export.command()
@with_run_options
@click.option(
    "--out", type=FOLDER, default=Path("tools"), show_default=True,
    help="Folder for stamp.stl, die.stl, holder.stl and tools.png.",
)  # fmt: skip
def stl(out: Path, **chosen: Any) -> None:
    """Write stamp, die and holder of a forming run (binary STL, mm) and a picture of them.

    The tools are at their initial positions. The holder is written if a blank-holder force is given.

    Example: knittest export stl --variant 1 --set rig.stamp.t.bar_length=140 --set rig.blank_holder_force=100
    """
    from knittest.base.figure import Stamp, use_stamp
    from knittest.laboratory.forming.pictures import tools_picture
    from knittest.laboratory.forming.tool_check import measured_tools, stroke_of, write_tools
    from knittest.laboratory.report_base import size_of

    (run,) = resolve_runs("forming", None, chosen)
    rig, thickness = run.rig, run.fabric.thickness_mm
    found = measured_tools(run, thickness)
    tools = found.tools
    paths = write_tools(tools, out)
    title = f"tools of forming, {SHAPES[rig.stamp.kind]}"
    facts = (f"for {run.fabric.name}, {thickness:g} mm thick", *size_of(run))
    with use_stamp(Stamp(facts)):
        tools_picture(out / "tools.png", tools, found.fit, stroke_of(run, thickness), title=title)
    for line in (*tools.notes, *found.lines, *paths, out / "tools.png"):
        click.echo(str(line))
    for problem in found.fit.problems:
        click.echo(f"warning: {problem}", err=True)


@export.command()
@click.argument("test", type=click.Choice([name for name, kind in kinds().items() if kind.deck_force]))
@click.option(
    "--direction",
    type=click.Choice(["warp", "weft", "both"]),
    default=None,
    help="Direction of a strip.  [default: both]",
)
@with_run_options
@click.option(
    "--format", "form", type=click.Choice(["ls-dyna", "openradioss", "abaqus"]), default="ls-dyna", show_default=True,
    help="ls-dyna, openradioss: the whole model; abaqus: the mesh only.",
)  # fmt: skip
@click.option(
    "--out", type=FOLDER, default=Path("deck"), show_default=True,
    help="Folder for TEST.k, TEST_0000.rad and TEST_0001.rad, or TEST.inp, with the direction of a strip in the name.",
)  # fmt: skip
def deck(test: str, direction: str | None, form: str, out: Path, **chosen: Any) -> None:
    """Write the model of TEST as a deck for another solver.

    The deck has nodes, elements, sections, materials, contact, motion and output. Its head states whether such decks
    were run in the other solver, and lists what it leaves out. OpenRadioss: tensile and picture-frame only.

    Example: knittest export deck tensile --variant 1 --scale macro --direction warp
    """
    from knittest.base.files import make_folder
    from knittest.export.meshes import write_abaqus
    from knittest.runs.deck.deck_file import check_test, write_deck
    from knittest.runs.deck.radioss_file import write_radioss
    from knittest.runs.specimen import prepare
    from knittest.studies.homogenise.derived_card import complete_cards

    runs = complete_cards(resolve_runs(test, direction, chosen))
    make_folder(out)
    for run in runs:
        if form != "abaqus":
            check_test(run, form)  # type: ignore[arg-type]
        prepared, missing = prepare(run), list[str]()
        name = "-".join(filter(None, (test, run.direction)))
        paths = [out / f"{name}{'.inp' if form == 'abaqus' else '.k'}"]
        if form == "abaqus":
            write_abaqus(paths[0], prepared.model.mesh, prepared.model.position())
        elif form == "openradioss":
            paths, missing = write_radioss(out, name, run, prepared)
        else:
            missing = write_deck(paths[0], run, prepared)
        for path in paths:
            click.echo(str(path))
        for line in missing:
            click.echo(f"  differs from knittest: {line}")


@export.command()
@click.argument("run", metavar="RUN", type=PATH)
@click.option("--frame", type=int, default=-1, show_default=True, help="Number of the frame from 0; -1: the last.")
@click.option(
    "--sides", type=click.IntRange(3, 64), default=12, show_default=True, help="Corners of a tube's cross-section."
)
@click.option(
    "--out", type=FILE, default=Path("yarns.stl"), show_default=True,
    help="File: .stl (binary, mm), or .vtp with yarn system, force and strain.",
)  # fmt: skip
def tubes(run: Path, frame: int, sides: int, out: Path) -> None:
    """Write the yarns of a frame of RUN, a run folder, as closed tubes, without failed elements.

    Example: knittest export tubes runs/tensile-.../warp --out broken.vtp
    """
    from knittest.base.errors import InputError
    from knittest.export.meshes import tube_surface, write_tubes
    from knittest.report_page.moving.recording import read_recording

    found = read_recording(run)
    if found.kind != "beams":
        raise InputError(f"{run}: a run at the macro scale has no yarns: expected a run with --scale meso")
    if not -len(found.time) <= frame < len(found.time):
        raise InputError(f"--frame {frame}: expected 0 to {len(found.time) - 1}, the frames of {run}")
    fields = {name: values[frame] for name, values in found.fields.items()}
    alive = fields.pop("alive") > 0.0
    surface = tube_surface(found.position[frame], found.cells, found.radius, alive, sides)
    write_tubes(out, surface, {"system": found.part.astype(float), **fields})
    click.echo(str(out))
    click.echo(f"{len(surface.triangles)} triangles at {found.time[frame]:.4g} ms", err=True)


@export.command()
@click.argument("folder", metavar="RUN", type=click.Path(path_type=Path, exists=True, file_okay=False))
@click.option("--out", type=PATH, help="File to write.  [default: tables.xlsx in RUN]")
def xlsx(folder: Path, out: Path | None) -> None:
    """Write the tables of RUN as one workbook (xlsx): one sheet per table and one of the results.

    RUN is the folder of a run, of both directions, of a study or of a data import. Needs openpyxl: pip install
    'knittest[xlsx]'.

    Example: knittest export xlsx runs/tensile-...
    """
    from knittest.report_page.files import write_workbook

    target = out or folder / "tables.xlsx"
    sheets = write_workbook(folder, target)
    click.echo(str(target))
    click.echo(f"sheets: {', '.join(sheets)}", err=True)
