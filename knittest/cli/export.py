"""``knittest export``: files from the models of a run, without running it."""

from pathlib import Path
from typing import Any

import click

from knittest.cli.options import describes_run, resolve_runs

SHAPES = {"t": "T-shape", "hemisphere": "hemisphere", "stl": "STL files"}


@click.group()
def export() -> None:
    """Write the models of a run to files."""


@export.command()
@describes_run
@click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), default=Path("tools"), show_default=True,
    help="Folder for stamp.stl, die.stl, holder.stl and tools.png.",
)  # fmt: skip
def stl(out: Path, **chosen: Any) -> None:
    """Write stamp, die and holder of a forming run (binary STL, mm) and a picture of them.

    Each lies where the run starts. There is a holder if a force is on it.

    Example: knittest export stl --variant 1 --set rig.stamp.t.bar_length=140 --set rig.blank_holder_force=100
    """
    from knittest.base.stamp import Stamp, stamped
    from knittest.laboratory.forming.test import tools_of
    from knittest.laboratory.forming.tool_files import write_tools
    from knittest.laboratory.forming.tools_picture import tools_picture
    from knittest.laboratory.run_stamp import size_of

    (run,) = resolve_runs("forming", None, chosen)
    rig, thickness = run.rig, run.fabric.thickness_mm
    tools = tools_of(run, thickness)
    paths = write_tools(tools, out)
    blank = (rig.blank_width_mm, rig.blank_length_mm)
    title = f"tools of forming, {SHAPES[rig.stamp.kind]}"
    facts = (f"for {run.fabric.name}, {thickness:g} mm thick", *size_of(run))
    with stamped(Stamp(facts)):
        tools_picture(out / "tools.png", tools, depth=rig.depth_mm, thickness=thickness, blank=blank, title=title)
    for line in (*tools.notes, *paths, out / "tools.png"):
        click.echo(str(line))
