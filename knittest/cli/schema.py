"""``knittest schema``."""

import click


@click.command()
def schema() -> None:
    """Print the JSON schema of a run, with units, bounds and descriptions.

    Example: knittest schema > knittest-run.schema.json
    """
    import json

    from knittest.config.run import Run

    click.echo(json.dumps(Run.model_json_schema(), indent=2))
