"""Commands on the installation and on files to start from: ``knittest doctor``, ``warmup``, ``bench``, ``schema`` and
``new``.
"""

from pathlib import Path

import click
from click.core import ParameterSource


@click.command()
@click.option("--clear-cache", is_flag=True, help="Empty the cache of compiled kernels and relaxed cells.")
def doctor(clear_cache: bool) -> None:
    """Report versions, cores, threading layer and cache folder; or empty the cache.

    Compiled kernels and relaxed cells are made anew when they are needed, which takes minutes.

    Example: knittest doctor

    Example: knittest doctor --clear-cache
    """
    if clear_cache:
        from knittest.base.cache import cache_root, clear

        root = cache_root()
        click.echo(f"{root}: {clear(root) / 1e6:.1f} MB removed" if root else "there is no cache folder")
        return
    import os
    import sys

    from knittest import __version__
    from knittest.base.cache import cache_root
    from knittest.base.files import configs_dir, data_dir
    from knittest.export.identity import cpu_model, library_versions
    from knittest.kernels.threading import threading_layer
    from knittest.solve.threads import use_threads

    threads = use_threads(None)
    layer = threading_layer()
    slow = " (slow: a fork costs 55 us; install libgomp or tbb, one thread is used until then)"
    rows = {
        "knittest": __version__,
        "python": sys.version.split()[0],
        **library_versions(),
        "processor": cpu_model(),
        "cores": str(os.cpu_count()),
        "threads used": str(threads),
        "threading layer": layer + (slow if layer == "workqueue" else ""),
        "cache folder": str(cache_root() or "none: nothing is cached"),
        "configs": str(configs_dir()),
        "data": str(data_dir()),
    }
    width = max(map(len, rows))
    for name, value in rows.items():
        click.echo(f"{name:<{width}}  {value}")


@click.command()
def warmup() -> None:
    """Compile the kernels of both scales now, also for self-contact of shells, so that no run has to.

    Example: knittest warmup
    """
    from knittest.config.loading import resolve
    from knittest.solve.compiling import compile_all, warm

    click.echo(f"compiled, both scales side by side: {compile_all():.1f} s")
    for name, scale in (("shells", "macro"), ("yarns", "meso")):
        click.echo(f"{name}: loaded in {warm(resolve(variant='1', scale=scale)):.1f} s")


@click.command()
@click.option("--variant", default="2", show_default=True, help="Shipped fabric.")
@click.option("--preset", type=click.Choice(["quick", "standard", "paper"]), default="quick", show_default=True)
@click.option(
    "--against", type=click.Path(path_type=Path), help="Another checkout: time small runs of both by turns instead."
)
@click.option("--pairs", type=click.IntRange(1, 1000), default=5, show_default=True, help="Turns with --against.")
def bench(variant: str, preset: str, against: Path | None, pairs: int) -> None:
    """Measure kernel throughput at 1 and all threads, and the share of each part of a real run.

    Shells are the 27,225 of forming, with its tools.

    Example: knittest bench --preset paper
    """
    if against is not None:
        from knittest.base.errors import InputError
        from knittest.runs.bench_against import paired_lines

        if any(_given(name) for name in ("variant", "preset")):
            raise InputError("--against: times its own small runs; leave out --variant and --preset")
        for line in paired_lines(against, pairs):
            click.echo(line)
        return
    from knittest.config.loading import resolve
    from knittest.runs.bench import kernel_lines, run_lines

    run = resolve(variant=variant, scale="meso", preset=preset, direction="warp")
    loops = resolve(variant=variant, scale="meso", preset=preset, test="picture-frame")
    shells = resolve(variant=variant, scale="macro", preset="paper", test="forming")
    for line in (*kernel_lines(run, loops, shells), *run_lines(run)):
        click.echo(line)


def _given(parameter: str) -> bool:
    """Tell whether the user stated ``parameter``."""
    return click.get_current_context().get_parameter_source(parameter) is not ParameterSource.DEFAULT


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
    from knittest.base.errors import InputError, ResourceError
    from knittest.base.files import configs_dir, write_atomic
    from knittest.config.loading import resolve
    from knittest.config.sources import NAME, NUMBERED
    from knittest.config.starting import YarnSystem, rig_template, starting_text

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
