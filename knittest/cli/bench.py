"""``knittest bench``."""

import click


@click.command()
@click.option("--variant", default="2", show_default=True, help="Shipped fabric.")
@click.option("--preset", type=click.Choice(["quick", "standard", "paper"]), default="quick", show_default=True)
def bench(variant: str, preset: str) -> None:
    """Measure kernel throughput at 1 and all threads, and the share of each part of a real run.

    Example: knittest bench --preset paper
    """
    from knittest.bench import kernel_lines, run_lines
    from knittest.config.loading import resolve

    run = resolve(variant=variant, scale="meso", preset=preset, direction="warp")
    loops = resolve(variant=variant, scale="meso", preset=preset, test="picture-frame")
    shells = resolve(variant=variant, scale="macro", direction="warp")
    for line in (*kernel_lines(run, loops, shells), *run_lines(run)):
        click.echo(line)
