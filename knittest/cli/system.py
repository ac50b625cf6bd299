"""Commands on the installation and on files to start from: ``knittest doctor``, ``warmup``, ``bench``, ``schema`` and
``new``.
"""

from pathlib import Path

import click
from click.core import ParameterSource

from knittest.base.files import structures
from knittest.cli.options import PATH, PRESET


@click.command()
@click.option("--clear-cache", is_flag=True, help="Empty the cache of compiled kernels and relaxed cells.")
def doctor(clear_cache: bool) -> None:
    """Report versions, cores, threading layer and cache folder; or empty the cache.

    After --clear-cache kernels are compiled and cells relaxed again when they are needed, which takes minutes.

    Example: knittest doctor

    Example: knittest doctor --clear-cache
    """
    if clear_cache:
        from knittest.base.cache import cache_root, remove_cache

        root = cache_root()
        click.echo(f"{root}: {remove_cache(root) / 1e6:.1f} MB removed" if root else "there is no cache folder")
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
    slow = " (slow, so only one thread is used: install libgomp or tbb)"
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
    """Compile all kernels of both scales now, so that no run has to wait for it.

    Example: knittest warmup
    """
    from knittest.config.loading import resolve
    from knittest.solve.compilation import compile_all, load_kernels

    click.echo(f"both scales compiled in {compile_all():.1f} s")
    for scale in ("macro", "meso"):
        click.echo(f"{scale}: loaded in {load_kernels(resolve(variant='1', scale=scale)):.1f} s")


@click.command()
@click.option("--variant", default="2", show_default=True, help="Shipped fabric.")
@PRESET
@click.option("--against", type=PATH, help="Folder of another checkout: time small runs of both in turn instead.")
@click.option("--pairs", type=click.IntRange(1, 1000), default=5, show_default=True, help="Repeats with --against.")
def bench(variant: str, preset: str, against: Path | None, pairs: int) -> None:
    """Measure the speed of the kernels with 1 and all threads, of each sweep of a step, and of each part of a run.

    Shell elements are those of forming at its paper size (27,225), with its tools.

    Example: knittest bench --preset paper
    """
    if against is not None:
        from knittest.base.errors import InputError
        from knittest.runs.bench_comparison import paired_lines

        given = click.get_current_context().get_parameter_source
        if any(given(name) is not ParameterSource.DEFAULT for name in ("variant", "preset")):
            raise InputError("--against has its own small runs: leave out --variant and --preset")
        for line in paired_lines(against, pairs):
            click.echo(line)
        return
    from knittest.config.loading import resolve
    from knittest.runs.bench import kernel_lines, run_lines, sweep_lines

    run = resolve(variant=variant, scale="meso", preset=preset, direction="warp")
    loops = resolve(variant=variant, scale="meso", preset=preset, test="picture-frame")
    shells = resolve(variant=variant, scale="macro", preset="paper", test="forming")
    for line in (*kernel_lines(run, loops, shells), *sweep_lines(loops), *run_lines(run)):
        click.echo(line)


def _complete(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Paths of fields that begin with ``incomplete``."""
    from knittest.base.kinds import test_names
    from knittest.config.fields import all_paths

    return sorted({path for kind in test_names() for path in all_paths(kind) if path.startswith(incomplete)})


@click.command()
@click.argument("field", required=False, shell_complete=_complete)
def schema(field: str | None) -> None:
    """Print the JSON schema of a run, with units, bounds and descriptions; or explain one FIELD.

    A field is explained by unit, default, bounds, the tests and the scale that use it, and values of presets; a group
    of fields, such as solver, by the list of its fields.

    Example: knittest schema > knittest-run.schema.json

    Example: knittest schema rig.width
    """
    import json
    import sys

    from knittest.base.layout import width_of, wrap_line
    from knittest.config.schema import field_lines, run_schema

    if field is None:
        click.echo(json.dumps(run_schema(), indent=2))
        return
    for line in field_lines(field):
        click.echo("\n".join(wrap_line(line, width_of(sys.stdout))))


@click.command()
@click.argument("name")
@click.option(
    "--structure",
    metavar="STRUCTURE",
    help=f"Start from the stitches and layers of a shipped structure: {', '.join(structures())}.",
)
@click.option(
    "--from", "folder", type=PATH, metavar="DIR", help="Use the tests that knittest data import put into DIR."
)
@click.option(
    "--reinforcing",
    metavar="YARN",
    help='Fibre and linear density of the inlays: "E-glass 600 tex", "carbon HT 4 x 200".',
)
@click.option(
    "--knitting", metavar="YARN", help='The same of the knitting yarn, or a yarn card: "{fibre: polyester, ...}".'
)
def new(name: str, structure: str | None, folder: Path | None, reinforcing: str | None, knitting: str | None) -> None:
    """Write configs/NAME.yaml, a commented fabric file to edit, and configs/NAME-tensile.yaml, a rig file.

    All numbers are those of the shipped variant 1, marked as assumed; with --structure, those of a shipped structure:
    docs/structures.md shows them. With --from, imported curves, fracture strains
    and other measured numbers replace them, with their sources. With --reinforcing and --knitting, the numbers of the
    yarns are derived from their data sheets. The contact stiffness is derived from the knitting yarn. A run at the
    macro scale derives the macro material card from the yarns, unless it was imported.

    Example: knittest new my-fabric --from data/my-fabric && knittest check tensile --variant my-fabric --scale macro
    """  # fmt: skip
    from knittest.base.errors import InputError, ResourceError
    from knittest.base.files import configs_dir, write_atomic
    from knittest.config.loading import resolve
    from knittest.config.sources import NAME, NUMBERED
    from knittest.config.structure_template import new_structure_text
    from knittest.config.templates import YarnSystem, new_fabric_text, rig_template

    if not NAME.match(name):
        raise InputError(f"NAME {name!r}: expected letters, digits, '.', '_', '-', at most 40, first a letter or digit")
    if name in NUMBERED or (configs_dir() / "fabrics" / f"{name}.yaml").exists():
        raise InputError(f"NAME {name}: a shipped fabric has this name: choose another one")
    stated: dict[YarnSystem, str | None] = {"reinforcing": reinforcing, "knitting": knitting}
    yarns: dict[YarnSystem, str] = {system: text for system, text in stated.items() if text is not None}
    if structure is not None:
        text = new_structure_text(name, structure, folder, yarns)
    else:
        text = new_fabric_text(name, resolve(variant="1", parameters="as-measured").fabric, folder, yarns)
    files = {
        Path("configs") / f"{name}.yaml": text,
        Path("configs") / f"{name}-tensile.yaml": rig_template(
            f"--variant {name} --config configs/{name}-tensile.yaml"
        ),
    }
    for path in files:
        if path.exists():
            raise InputError(f"{path} exists already: choose another name or move the file")
    try:
        Path("configs").mkdir(exist_ok=True)
    except OSError as error:
        raise ResourceError(f"the folder configs cannot be made here: {error}") from None
    for path, text in files.items():
        write_atomic(path, text)
        click.echo(f"wrote {path}")
