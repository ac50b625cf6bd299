"""``knittest check``."""

from pathlib import Path
from typing import Any

import click

from knittest.base.kinds import DEFAULT, kinds, names
from knittest.cli.options import describes_run, own_options, own_settings, resolve_runs


@click.command()
@describes_run
@click.argument("test", type=click.Choice(names()), default=DEFAULT)
@click.option("--direction", type=click.Choice(["warp", "weft", "both"]), default=None, help="[default: both]")
@own_options(*kinds().values())
@click.option("--convergence", is_flag=True, help="Run the test at its speed and at half of it, and compare.")
@click.option(
    "--no-time", is_flag=True, help="No estimate of the time, for which kernels are compiled and steps timed."
)
@click.option("--threads", type=click.IntRange(1), help="Threads.  [default: all cores]")
@click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), default=Path("check"),
    help="Folder for the picture of the tools (forming).  [default: check]",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout and nothing else there.")
def check(
    test: str,
    direction: str | None,
    convergence: bool,
    no_time: bool,
    threads: int | None,
    out: Path,
    as_json: bool,
    **chosen: Any,
) -> int:
    """Show what a run would be, and compare the fabric's numbers with all that is known of them; run nothing.

    Sizes, masses, time step, steps, initial overlap; the time, by a hundred steps or more of the real model; and each
    number of the fabric beside its counterpart in the fabric's tests, in its curves, in its yarns and in the relaxed
    cell: agrees, differs or no counterpart. With --convergence the test is run twice. Of forming: depth and clearance
    of the tools, and a picture of their section. Where the material card of the shells is yet to be derived from the
    yarns, how long that takes. TEST is tensile if not given.

    Example: knittest check tensile --variant 2 --scale meso --preset paper
    """
    chosen["sets"] = (*chosen["sets"], *own_settings(kinds()[test], chosen))
    from knittest.laboratory.registry import completed
    from knittest.runs.preflight.command import CheckOptions, check_command
    from knittest.studies.homogenise.yarn_card import paths_to_run, with_cards

    runs = completed(resolve_runs(test, direction, chosen))
    options = CheckOptions(threads, as_json, not no_time, convergence, out)
    cells = paths_to_run(runs[0])
    return check_command(runs if cells else with_cards(runs), options, cells)
