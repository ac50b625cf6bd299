"""``knittest warmup``."""

import click


@click.command()
def warmup() -> None:
    """Compile the kernels of both scales now, so that no run has to.

    Example: knittest warmup
    """
    from knittest.config.loading import resolve
    from knittest.warmup import warm

    for scale in ("macro", "meso"):
        seconds = warm(resolve(variant="1", scale=scale))
        click.echo(f"{scale}: {seconds:.1f} s")
