"""``knittest bench``."""

from pathlib import Path

import click
from click.core import ParameterSource


@click.command()
@click.option("--variant", default="2", show_default=True, help="Shipped fabric.")
@click.option("--preset", type=click.Choice(["quick", "standard", "paper"]), default="quick", show_default=True)
@click.option(
    "--against", type=click.Path(path_type=Path), help="Another checkout: time small runs of both by turns instead."
)
@click.option("--pairs", type=click.IntRange(1, 1000), default=5, show_default=True, help="Turns with --against.")
def bench(variant: str, preset: str, against: Path | None, pairs: int) -> None:
    """Measure kernel throughput at 1 and all threads, and the share of each part of a real run.

    Shells are the 27,225 of forming, with its tools.

    Example: knittest bench --preset paper
    """
    if against is not None:
        from knittest.base.errors import InputError
        from knittest.runs.bench_against import paired_lines

        if any(_given(name) for name in ("variant", "preset")):
            raise InputError("--against: times its own small runs; leave out --variant and --preset")
        for line in paired_lines(against, pairs):
            click.echo(line)
        return
    from knittest.config.loading import resolve
    from knittest.runs.bench import kernel_lines, run_lines

    run = resolve(variant=variant, scale="meso", preset=preset, direction="warp")
    loops = resolve(variant=variant, scale="meso", preset=preset, test="picture-frame")
    shells = resolve(variant=variant, scale="macro", preset="paper", test="forming")
    for line in (*kernel_lines(run, loops, shells), *run_lines(run)):
        click.echo(line)


def _given(parameter: str) -> bool:
    """Tell whether the user stated ``parameter``."""
    return click.get_current_context().get_parameter_source(parameter) is not ParameterSource.DEFAULT
