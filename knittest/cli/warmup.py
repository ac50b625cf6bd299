"""``knittest warmup``."""

import click


@click.command()
def warmup() -> None:
    """Compile the kernels of both scales now, also for self-contact of shells, so that no run has to.

    Example: knittest warmup
    """
    from knittest.config.loading import resolve
    from knittest.solve.warmup import compile_all, kernels_of, warm

    click.echo(f"compiled, both scales side by side: {compile_all():.1f} s")
    runs = [resolve(variant="1", scale="macro", sets=sets) for sets in ([], ["model.macro.self_contact=true"])]
    for run in [*runs, resolve(variant="1", scale="meso")]:
        seconds = warm(run)
        click.echo(f"{kernels_of(run)} loaded: {seconds:.1f} s")
