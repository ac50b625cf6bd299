"""``knittest check``."""

from typing import Any

import click

from knittest.cli.options import describes_run, resolve_runs


@click.command()
@describes_run
@click.argument(
    "test", type=click.Choice(["tensile", "picture-frame", "cantilever", "friction", "forming"]), default="tensile"
)
@click.option("--direction", type=click.Choice(["warp", "weft", "both"]), default=None, help="[default: both]")
@click.option("--convergence", is_flag=True, help="Run the test at its speed and at half of it, and compare.")
def check(test: str, direction: str | None, convergence: bool, **chosen: Any) -> int:
    """Show sizes, masses, time step, steps and initial overlap; run nothing, unless --convergence is given.

    TEST is tensile if not given.

    Example: knittest check tensile --variant 2 --scale meso --preset paper
    """
    runs = resolve_runs(test, None if test in ("picture-frame", "forming") else direction or "default", chosen)
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
