"""``knittest tensile``."""

from pathlib import Path
from typing import Any

import click

from knittest.cli.options import describes_run, reports, resolve_runs


@click.command()
@describes_run
@click.option("--direction", type=click.Choice(["warp", "weft", "both"]), default=None, help="[default: both]")
@click.option("--out", type=click.Path(path_type=Path), help="Run folder.  [default: runs/<name>-<time>]")
@click.option("--resume", type=click.Path(path_type=Path), metavar="DIR", help="Go on with the run in DIR.")
@click.option("--force", is_flag=True, help="With --resume: go on although config, version or processor changed.")
@reports
def tensile(
    direction: str | None,
    out: Path | None,
    resume: Path | None,
    force: bool,
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

    options = RunOptions(out, threads, as_json, quiet, not no_frames)
    if resume is not None:
        if direction or out or any(chosen.values()):
            raise click.UsageError("--resume takes everything from the run folder: leave out what describes a run")
        from knittest.jobs import resume_command

        return resume_command(resume, options, force)
    if force:
        raise click.UsageError("--force goes with --resume")
    runs = resolve_runs(direction or "default", chosen)
    from knittest.jobs import tensile_command

    return tensile_command(runs, options)
