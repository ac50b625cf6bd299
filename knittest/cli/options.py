"""Options that several commands share."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from knittest.base.kinds import TestKind, kinds

if TYPE_CHECKING:
    from knittest.base.figure import Printing

Command = TypeVar("Command", bound=Callable[..., object])
Decorator = Callable[[Command], Command]

PATH = click.Path(path_type=Path)
FILE = click.Path(path_type=Path, dir_okay=False)
FOLDER = click.Path(path_type=Path, file_okay=False)
PRESETS = click.Choice(["quick", "standard", "paper"])
#: option of all commands that run tests
ACCEPT_LIMITS = click.option(
    "--accept-limits", is_flag=True,
    help="Accept limits of quality checks that are looser than the preset's; the run folder records it.",
)  # fmt: skip
OPEN = click.option("--open", "open_page", is_flag=True, help="Open the page in a browser.")
JSON = click.option("--json", "as_json", is_flag=True, help="Print one JSON object on stdout and nothing else there.")
QUIET = click.option("--quiet", is_flag=True, help="No progress, no table.")
VARIANT = click.option("--variant", metavar="NAME", help="Shipped fabric 1 or 2, or the name of configs/NAME.yaml.")
FABRIC = click.option("--fabric", type=PATH, metavar="FILE", help="Fabric file.")
PARAMETERS = click.option(
    "--parameters", metavar="SET", help="Parameter set of the fabric: calibrated (default), as-measured, spin-friction."
)
PRESET = click.option("--preset", type=PRESETS, default="quick", show_default=True, help="Size of the models.")
SEED = click.option("--seed", type=int, help="Seed of all random draws.  [default: 1]")
WORKERS = click.option("--workers", type=click.IntRange(1), help="Parallel processes.  [default: cores / threads]")
THREADS = click.option("--threads", type=click.IntRange(1), help="Threads per process.  [default: cores / workers]")
#: options of pictures
PRINTS = (
    click.option(
        "--format", "formats", metavar="LIST", help="Picture formats in addition to PNG: svg, pdf or svg,pdf."
    ),
    click.option("--dpi", type=int, help="Resolution of pictures in pixels per inch, 50 to 1200.  [default: 150]"),
)


def add_options(*options: Decorator) -> Decorator:
    """Return a decorator that adds ``options`` to a command, in the order of its help."""

    def add(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return add


def read_printing_options(
    formats: str | None, dpi: int | None, no_pictures: bool = False, open_page: bool = False
) -> "Printing":
    """Read the options of pictures; raises :class:`InputError`, also if pictures are switched off."""
    from knittest.base.figure import parse_printing

    if no_pictures and open_page:
        raise click.UsageError("--open needs the page, which --no-pictures switches off: leave out one of them")
    if no_pictures and (formats or dpi):
        raise click.UsageError("--format and --dpi need pictures: leave out --no-pictures")
    return parse_printing(formats, dpi)


#: options that choose fabric, scale, preset and settings
with_run_options = add_options(
    VARIANT,
    FABRIC,
    click.option("--config", type=PATH, help="Rig file, or config.yaml of a run folder."),
    PARAMETERS,
    click.option(
        "--scale", type=click.Choice(["macro", "meso"]),
        help="macro: shell elements; meso: beam elements.  [default: meso; cantilever, forming: macro]",
    ),
    click.option("--preset", type=PRESETS, help="Size of the model.  [default: standard]"),
    click.option("--set", "sets", multiple=True, metavar="KEY=VALUE", help="Change any field: rig.width=25."),
    click.option("--specimens", type=int, help="Number of specimens with random yarn properties (an ensemble)."),
    SEED,
)  # fmt: skip

#: options on how a run computes and reports
with_report_options = add_options(
    click.option("--threads", type=click.IntRange(1), help="Largest number of threads.  [default: all cores]"),
    JSON,
    QUIET,
    click.option("--details", is_flag=True, help="Print all notes below the table."),
    click.option("--no-frames", is_flag=True, help="No VTU frames."),
    click.option("--no-pictures", is_flag=True, help="No pictures and no page."),
    OPEN,
    *PRINTS,
    click.option(
        "--against", multiple=True, type=PATH, metavar="CSV",
        help="Compare with a measured curve, your own or of the shipped data (see knittest compare); repeatable.",
    ),
)  # fmt: skip


def add_test_options(*tests: TestKind) -> Decorator:
    """Return a decorator that adds the options that only ``tests`` have; with several, their help names the test."""
    options = {
        name: click.option(f"--{name}", type=value, help=f"{kind.name}: {text}" if len(tests) > 1 else text)
        for kind in tests
        for own, value in ((kind.shortcuts, float), (kind.texts, str))
        for name, (_, text) in own.items()
    }
    return add_options(*options.values())


def take_test_settings(kind: TestKind, chosen: dict[str, Any]) -> tuple[str, ...]:
    """Take the options of :func:`add_test_options` out of ``chosen`` and return them as settings.

    Raises ``click.UsageError`` for an option that tests of ``kind`` do not have.
    """
    given = {name: chosen.pop(name, None) for one in kinds().values() for name in one.own_fields}
    for name in [name for name, value in given.items() if value is not None and name not in kind.own_fields]:
        raise click.UsageError(f"--{name.replace('_', '-')}: {kind.name} has no such option")
    return tuple(f"{field}={given[name]!r}" for name, field in kind.own_fields.items() if given[name] is not None)


def resolve_runs(test: str, direction: str | None, chosen: dict[str, Any]) -> list[Any]:
    """Resolve the runs of ``test`` that the options describe, one for each direction."""
    from knittest.config.loading import resolve_test_runs

    if not any(chosen.get(name) for name in ("variant", "fabric", "config")):
        raise click.UsageError("which fabric? Give --variant 1, --variant 2 or --fabric FILE")
    return resolve_test_runs(test, direction, chosen)
