"""``knittest new``."""

from pathlib import Path

import click


@click.command()
@click.argument("name")
def new(name: str) -> None:
    """Write configs/NAME.yaml, a commented fabric to edit, and configs/NAME-tensile.yaml, a rig.

    Example: knittest new my-fabric && knittest tensile --variant my-fabric --config configs/my-fabric-tensile.yaml
    """
    from knittest.errors import InputError, ResourceError
    from knittest.export.atomic import write_atomic
    from knittest.export.folder import slug
    from knittest.resources import configs_dir

    if slug(name) != name or len(name) > 40:
        raise InputError(f"NAME {name!r}: expected up to 40 letters, digits, '.', '_', '-', such as {slug(name)}")
    shipped = configs_dir()
    fabric = (shipped / "fabrics" / "pham2019-v1.yaml").read_text(encoding="utf-8")
    fabric = fabric.replace("name: pham2019-v1", f"name: {name}", 1)
    note = f"# {name}: a copy of the shipped variant 1. Replace the values; state for each where it comes from.\n"
    files = {
        Path("configs") / f"{name}.yaml": note + fabric,
        Path("configs") / f"{name}-tensile.yaml": (shipped / "rigs" / "tensile.yaml").read_text(encoding="utf-8"),
    }
    for path in files:
        if path.exists():
            raise InputError(f"{path} exists already; choose another name or move it away")
    try:
        Path("configs").mkdir(exist_ok=True)
    except OSError as error:
        raise ResourceError(f"configs: cannot be made here: {error}") from None
    for path, text in files.items():
        write_atomic(path, text)
        click.echo(f"wrote {path}")
