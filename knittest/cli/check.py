"""``knittest check``."""

from typing import Any

import click

from knittest.cli.options import describes_run, resolve_runs


@click.command()
@describes_run
@click.option("--direction", type=click.Choice(["warp", "weft", "both"]), default=None, help="[default: both]")
@click.option("--convergence", is_flag=True, help="Run the test at its speed and at half of it, and compare.")
def check(direction: str | None, convergence: bool, **chosen: Any) -> int:
    """Show sizes, masses, time step, steps and initial overlap; run nothing, unless --convergence is given.

    Example: knittest check --variant 2 --scale meso --preset paper
    """
    runs = resolve_runs(direction or "default", chosen)
    from knittest.preflight import preflight, speed_study

    code = 0
    for run in runs:
        for line in preflight(run):
            click.echo(line)
        if convergence:
            lines, passed = speed_study(run)
            click.echo("\n".join(lines))
            code = code if passed else 5
    return code
