"""``knittest homogenise``."""

from pathlib import Path
from typing import Any

import click

from knittest.cli.options import ACCEPT_LIMITS

#: options whose name is no name of Python
NAMES = {"sets": "set", "source": "from"}


@click.command()
@click.option("--variant", help="Shipped fabric: 1, 2, or a name of configs/NAME.yaml.")
@click.option("--fabric", type=click.Path(path_type=Path), help="A fabric file of your own.")
@click.option("--parameters", help="Parameter set of the fabric: calibrated (default), as-measured, gripping.")
@click.option("--preset", type=click.Choice(["quick", "standard", "paper"]), default="quick", show_default=True)
@click.option(
    "--from", "source", type=click.Choice(["tests", "cell"]), default="tests", show_default=True,
    help="Yarns: tests of specimens, or paths of one cell without an edge.",
)  # fmt: skip
@click.option("--seed", type=int, help="Seed of all draws.  [default: 1]")
@click.option(
    "--set", "sets", multiple=True, metavar="[TEST.]KEY=VALUE",
    help="Any field of all tests of yarns, or of one kind: picture-frame.rig.side=40.",
)  # fmt: skip
@ACCEPT_LIMITS
@click.option("--out", type=click.Path(path_type=Path), help="Folder.  [default: runs/homogenise-<fabric>-...]")
@click.option("--workers", type=click.IntRange(1), help="Processes.  [default: cores over threads]")
@click.option("--threads", type=click.IntRange(1), help="Threads of each.  [default: cores over workers]")
@click.option("--time-limit", type=click.FloatRange(1.0), default=7200.0, show_default=True, help="Of a test [s].")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout and nothing else there.")
@click.option("--quiet", is_flag=True, help="No progress, no table.")
def homogenise(
    out: Path | None,
    workers: int | None,
    threads: int | None,
    time_limit: float,
    as_json: bool,
    quiet: bool,
    **chosen: Any,
) -> int:
    """Make a material card of the shells from tests or a cell of yarns, and hold shells with it against them.

    The same command goes on where it was stopped; finished runs are not repeated.

    Example: knittest homogenise --variant 1
    """
    from knittest.studies.homogenise.command import HomogeniseOptions, homogenise_command
    from knittest.studies.homogenise.plan import Request

    if not (chosen["variant"] or chosen["fabric"]):
        raise click.UsageError("which fabric? Give --variant 1, --variant 2 or --fabric FILE")
    words = [
        f"--{NAMES.get(name, name)} {one}"
        for name, value in chosen.items()
        for one in (value if isinstance(value, tuple) else [value])
        if one is not None and name != "accept_limits" and (name, one) != ("source", "tests")
    ]
    words += ["--accept-limits"] if chosen["accept_limits"] else []
    options = HomogeniseOptions(out, workers, threads, time_limit, as_json, quiet)
    return homogenise_command(Request(**chosen), options, " ".join(["knittest homogenise", *words]))
