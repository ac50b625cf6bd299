"""``knittest warmup``."""

import click


@click.command()
def warmup() -> None:
    """Compile the kernels of both scales now, also for self-contact of shells, so that no run has to.

    Example: knittest warmup
    """
    from knittest.config.loading import resolve
    from knittest.solve.warmup import compile_all, warm

    click.echo(f"compiled, both scales side by side: {compile_all():.1f} s")
    for name, scale in (("shells", "macro"), ("yarns", "meso")):
        click.echo(f"{name}: loaded in {warm(resolve(variant='1', scale=scale)):.1f} s")
