"""``knittest schema``."""

import click


@click.command()
def schema() -> None:
    """Print the JSON schema of a run, with units, bounds and descriptions.

    Example: knittest schema > knittest-run.schema.json
    """
    import json

    from knittest.config.schema import run_schema

    click.echo(json.dumps(run_schema(), indent=2))
