"""Options that several commands share."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from knittest.base.kinds import TestKind, kinds

if TYPE_CHECKING:
    from knittest.base.figure import Printing

Command = TypeVar("Command", bound=Callable[..., object])

#: option of all commands that run tests
ACCEPT_LIMITS = click.option(
    "--accept-limits",
    is_flag=True,
    help="Let results count although limits of gates are looser than the preset's; it is recorded.",
)


#: option of all commands that leave a page
OPEN = click.option("--open", "open_page", is_flag=True, help="Open the page in a browser.")
#: options of all commands that leave pictures
PRINTS = (
    click.option("--format", "formats", metavar="LIST", help="Formats of pictures beside PNG: svg, pdf or svg,pdf."),
    click.option("--dpi", type=int, help="Pixels an inch of pictures, 50 to 1200.  [default: 150]"),
)


def prints(command: Command) -> Command:
    """Add the options of pictures."""
    for option in reversed(PRINTS):
        command = option(command)
    return command


def printing_asked(
    formats: str | None, dpi: int | None, no_pictures: bool = False, open_page: bool = False
) -> "Printing":
    """Read both options; raises :class:`InputError`, also where no pictures are wanted."""
    from knittest.base.figure import printing_of

    if no_pictures and open_page:
        raise click.UsageError("--open: --no-pictures leaves no page to open")
    if no_pictures and (formats or dpi):
        raise click.UsageError("--format and --dpi are of pictures: leave out --no-pictures")
    return printing_of(formats, dpi)


def describes_run(command: Command) -> Command:
    """Add the options that choose fabric, scale, preset and settings."""
    for option in reversed(
        (
            click.option("--variant", help="Shipped fabric: 1, 2, or a name of configs/NAME.yaml."),
            click.option("--fabric", type=click.Path(path_type=Path), help="A fabric file of your own."),
            click.option(
                "--config", type=click.Path(path_type=Path), help="A rig file, or config.yaml of a run folder."
            ),
            click.option(
                "--parameters", help="Parameter set of the fabric: calibrated (default), as-measured, gripping."
            ),
            click.option(
                "--scale",
                type=click.Choice(["macro", "meso"]),
                help="Shells or yarns.  [default: meso; cantilever, forming: macro]",
            ),
            click.option(
                "--preset", type=click.Choice(["quick", "standard", "paper"]), help="Size.  [default: standard]"
            ),
            click.option("--set", "sets", multiple=True, metavar="KEY=VALUE", help="Any field, such as rig.width=25."),
            click.option("--specimens", type=int, help="An ensemble of this many specimens with random yarns."),
            click.option("--seed", type=int, help="Seed of all draws.  [default: 1]"),
        )
    ):
        command = option(command)
    return command


def reports(command: Command) -> Command:
    """Add the options on how a run computes and reports."""
    for option in reversed(
        (
            click.option(
                "--threads",
                type=click.IntRange(1),
                help="Threads at most; fewer where they are faster.  [default: all cores]",
            ),
            click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout and nothing else there."),
            click.option("--quiet", is_flag=True, help="No progress, no table."),
            click.option("--details", is_flag=True, help="All notes below the table."),
            click.option("--no-frames", is_flag=True, help="No VTU frames."),
            click.option("--no-pictures", is_flag=True, help="No pictures and no page."),
            OPEN,
            *PRINTS,
            click.option(
                "--against",
                multiple=True,
                type=click.Path(path_type=Path),
                metavar="CSV",
                help="Compare with a curve of your own or of the shipped data, as knittest compare does; repeatable.",
            ),
        )
    ):
        command = option(command)
    return command


def own_options(*tests: TestKind) -> Callable[[Command], Command]:
    """Add the options that only ``tests`` have; with several, which of them has each."""

    def add(command: Command) -> Command:
        added = set[str]()
        for kind in reversed(tests):
            for names, value in ((kind.shortcuts, float), (kind.texts, str)):
                for name in names.keys() - added:
                    of = f"Of {kind.name}: " if len(tests) > 1 else ""
                    command = click.option(f"--{name}", type=value, help=of + names[name][1])(command)
                    added.add(name)
        return command

    return add


def own_settings(kind: TestKind, chosen: dict[str, Any]) -> tuple[str, ...]:
    """Settings of the options of :func:`own_options`, which ``chosen`` loses; raises for one that ``kind`` has not."""
    given = {name: chosen.pop(name, None) for one in kinds().values() for name in one.own_fields}
    for name in [name for name, value in given.items() if value is not None and name not in kind.own_fields]:
        raise click.UsageError(f"--{name.replace('_', '-')}: {kind.name} has no such option")
    return tuple(f"{field}={given[name]!r}" for name, field in kind.own_fields.items() if given[name] is not None)


def resolve_runs(test: str, direction: str | None, chosen: dict[str, Any]) -> list[Any]:
    """The runs of ``test`` that the options describe, one a direction; both unless one is asked for."""
    from knittest.config.loading import planned_runs

    if not any(chosen.get(name) for name in ("variant", "fabric", "config")):
        raise click.UsageError("which fabric? Give --variant 1, --variant 2 or --fabric FILE")
    return planned_runs(test, direction, chosen)
