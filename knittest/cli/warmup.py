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
    touching = resolve(variant="1", scale="macro", sets=["model.macro.self_contact=true"])
    for name, run in {"shells": touching, "yarns": resolve(variant="1", scale="meso")}.items():
        click.echo(f"{name}: loaded in {warm(run):.1f} s")
