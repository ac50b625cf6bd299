"""``knittest new``."""

from pathlib import Path

import click


@click.command()
@click.argument("name")
@click.option(
    "--from",
    "folder",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Start from the tests that knittest data import put into DIR.",
)
@click.option(
    "--reinforcing",
    metavar="YARN",
    help='Fibre and linear density of the inlays: "E-glass 600 tex", "carbon HT 4 x 200".',
)
@click.option("--knitting", metavar="YARN", help='The same of the loops, or a card: "{fibre: polyester, ...}".')
def new(name: str, folder: Path | None, reinforcing: str | None, knitting: str | None) -> None:
    """Write configs/NAME.yaml, a commented fabric to edit, and configs/NAME-tensile.yaml, a rig.

    All numbers are those of the shipped variant 1 and marked assumed. The contact stiffness is derived from the yarn of
    the loops. With --from, curves, fracture strains and what else was imported are your own, with their
    sources. With --reinforcing and --knitting the numbers of the yarns are
    derived from their data sheets. The material card of the shells is left out where it was not imported: a run at the
    macro scale derives it from the yarns.

    Example: knittest new my-fabric --from data/my-fabric && knittest check tensile --variant my-fabric --scale macro
    """
    from knittest.base.atomic import write_atomic
    from knittest.base.errors import InputError, ResourceError
    from knittest.base.resources import configs_dir
    from knittest.config.loading import resolve
    from knittest.config.sources import NAME, NUMBERED
    from knittest.config.starting import YarnSystem, starting_text
    from knittest.config.templates import rig_template

    if not NAME.match(name):
        raise InputError(f"NAME {name!r}: expected letters, digits, '.', '_', '-', at most 40, first a letter or digit")
    if name in NUMBERED or (configs_dir() / "fabrics" / f"{name}.yaml").exists():
        raise InputError(f"NAME {name}: a shipped fabric is called so; choose another name")
    stated: dict[YarnSystem, str | None] = {"reinforcing": reinforcing, "knitting": knitting}
    yarns: dict[YarnSystem, str] = {system: text for system, text in stated.items() if text is not None}
    like = resolve(variant="1", parameters="as-measured").fabric
    files = {
        Path("configs") / f"{name}.yaml": starting_text(name, like, folder, yarns),
        Path("configs") / f"{name}-tensile.yaml": rig_template(
            f"--variant {name} --config configs/{name}-tensile.yaml"
        ),
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
