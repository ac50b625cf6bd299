"""``knittest schema``."""

import click


def _complete(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Paths of fields that begin with ``incomplete``."""
    from knittest.base.kinds import names
    from knittest.config.fields import all_paths

    return sorted({path for kind in names() for path in all_paths(kind) if path.startswith(incomplete)})


@click.command()
@click.argument("field", required=False, shell_complete=_complete)
def schema(field: str | None) -> None:
    """Print the JSON schema of a run, with units, bounds and descriptions; or explain one FIELD.

    Of a field: unit, default, bounds, the tests and the scale that it counts for, and what presets set. Of a group of
    fields, such as solver: what they are.

    Example: knittest schema > knittest-run.schema.json

    Example: knittest schema rig.width
    """
    import json
    import sys

    from knittest.base.layout import width_of, wrapped
    from knittest.config.schema import field_lines, run_schema

    if field is None:
        click.echo(json.dumps(run_schema(), indent=2))
        return
    for line in field_lines(field):
        click.echo("\n".join(wrapped(line, width_of(sys.stdout))))
