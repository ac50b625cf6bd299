"""``knittest tensile``."""

from pathlib import Path
from typing import Any

import click

from knittest.cli.options import describes_run, resolve_runs


@click.command()
@describes_run
@click.option("--direction", type=click.Choice(["warp", "weft", "both"]), default=None, help="[default: both]")
@click.option("--out", type=click.Path(path_type=Path), help="Run folder.  [default: runs/<name>-<time>]")
@click.option("--threads", type=click.IntRange(1), help="Threads.  [default: all cores]")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout and nothing else there.")
@click.option("--quiet", is_flag=True, help="No progress, no table.")
@click.option("--no-frames", is_flag=True, help="No VTU frames.")
def tensile(
    direction: str | None,
    out: Path | None,
    threads: int | None,
    as_json: bool,
    quiet: bool,
    no_frames: bool,
    **chosen: Any,
) -> int:
    """Pull a strip (200 x 50 mm, DIN EN ISO 13934-1) to failure and compare with the experiment.

    Example: knittest tensile --variant 2 --scale meso --preset paper --direction weft
    """
    from knittest.options import RunOptions

    runs = resolve_runs(direction or "default", chosen)
    from knittest.run import tensile_command

    return tensile_command(runs, RunOptions(out, threads, as_json, quiet, not no_frames))
