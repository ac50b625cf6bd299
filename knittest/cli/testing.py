"""Commands of tests: one for each test of the laboratory, ``knittest resume`` and ``knittest check``."""

from pathlib import Path
from typing import Any

import click

from knittest.base.kinds import DEFAULT, TestKind, kinds, names
from knittest.cli.options import (
    ACCEPT_LIMITS,
    describes_run,
    own_options,
    own_settings,
    printing_asked,
    reports,
    resolve_runs,
)

_DIRECTION = click.option(
    "--direction", type=click.Choice(["warp", "weft", "both"]), default=None, help="[default: both]"
)
_FOLDER = (
    click.option("--out", type=click.Path(path_type=Path), help="Run folder.  [default: runs/<name>-<time>]"),
    click.option("--resume", type=click.Path(path_type=Path), metavar="DIR", help="Go on with the run in DIR."),
    click.option("--force", is_flag=True, help="With --resume: go on although config, version or processor changed."),
    click.option(
        "--verify",
        is_flag=True,
        help="Repeat the run at half its speed and on another mesh: results with their numerical error.",
    ),
)


def test_command(kind: TestKind) -> click.Command:
    """The command of the tests of ``kind``."""

    def command(
        out: Path | None, resume: Path | None, force: bool, verify: bool, direction: str | None = None, **chosen: Any
    ) -> int:
        from knittest.runs.options import RunOptions

        chosen["sets"] = (*chosen["sets"], *own_settings(kind, chosen))
        reported = {name: chosen.pop(name) for name in ("threads", "quiet", "details", "against", "open_page")}
        asked = (chosen.pop("formats"), chosen.pop("dpi"), chosen["no_pictures"], reported["open_page"])
        printing = printing_asked(*asked)
        frames, pictures = (not chosen.pop(f"no_{what}") for what in ("frames", "pictures"))
        options = RunOptions(
            out, json=chosen.pop("as_json"), frames=frames, pictures=pictures, printing=printing, **reported
        )
        if resume is not None:
            if direction or out or verify or any(chosen.values()):
                raise click.UsageError("--resume takes everything from the run folder: leave out what describes a run")
            from knittest.studies.command import resume_command

            return resume_command(resume, options, force)
        if force:
            raise click.UsageError("--force goes with --resume")
        chosen["sets"] = (*chosen["sets"], *(["output.verify=true"] if verify else []))
        runs = resolve_runs(kind.name, direction, chosen)
        from knittest.studies.command import run_command

        return run_command(runs, options)

    command.__doc__ = kind.usage
    wrapped: Any = reports(command)
    wrapped = own_options(kind)(wrapped)
    for option in reversed((*_FOLDER, ACCEPT_LIMITS)):
        wrapped = option(wrapped)
    if kind.directional:
        wrapped = _DIRECTION(wrapped)
    return click.command(name=kind.name)(describes_run(wrapped))


@click.command()
@click.argument("run", type=click.Path(path_type=Path))
@click.option("--force", is_flag=True, help="Go on although config, version or processor changed.")
@reports
def resume(
    run: Path,
    force: bool,
    threads: int | None,
    as_json: bool,
    quiet: bool,
    details: bool,
    no_frames: bool,
    no_pictures: bool,
    against: tuple[Path, ...],
    open_page: bool,
    formats: str | None,
    dpi: int | None,
) -> int:
    """Go on with a run that was interrupted, killed or ran out of disk, to the bits it would have had.

    RUN is the run folder, or the folder of both directions.

    Example: knittest resume runs/tensile-...
    """
    from knittest.runs.options import RunOptions
    from knittest.studies.command import resume_command

    printing = printing_asked(formats, dpi, no_pictures, open_page)
    options = RunOptions(
        None, threads, as_json, quiet, not no_frames, not no_pictures, against, printing, open_page, details
    )
    return resume_command(run, options, force)


@click.command()
@describes_run
@click.argument("test", type=click.Choice(names()), default=DEFAULT)
@click.option("--direction", type=click.Choice(["warp", "weft", "both"]), default=None, help="[default: both]")
@own_options(*kinds().values())
@click.option("--convergence", is_flag=True, help="Run the test at its speed and at half of it, and compare.")
@click.option(
    "--no-time", is_flag=True, help="No estimate of the time, for which kernels are compiled and steps timed."
)
@click.option("--threads", type=click.IntRange(1), help="Threads.  [default: all cores]")
@click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), default=Path("check"),
    help="Folder for the picture of the tools (forming).  [default: check]",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout and nothing else there.")
def check(
    test: str,
    direction: str | None,
    convergence: bool,
    no_time: bool,
    threads: int | None,
    out: Path,
    as_json: bool,
    **chosen: Any,
) -> int:
    """Show what a run would be, and compare the fabric's numbers with all that is known of them; run nothing.

    Sizes, masses, time step, steps, initial overlap; the time, by a hundred steps or more of the real model; and each
    number of the fabric beside its counterpart in the fabric's tests, in its curves, in its yarns and in the relaxed
    cell: agrees, differs or no counterpart. With --convergence the test is run twice. Of forming: depth and clearance
    of the tools, and a picture of their section. Where the material card of the shells is yet to be derived from the
    yarns, how long that takes. TEST is tensile if not given.

    Example: knittest check tensile --variant 2 --scale meso --preset paper
    """
    chosen["sets"] = (*chosen["sets"], *own_settings(kinds()[test], chosen))
    from knittest.laboratory.report_base import completed
    from knittest.runs.preflight.command import CheckOptions, check_command
    from knittest.studies.homogenise.yarn_card import paths_to_run, with_cards

    runs = completed(resolve_runs(test, direction, chosen))
    options = CheckOptions(threads, as_json, not no_time, convergence, out)
    cells = paths_to_run(runs[0])
    return check_command(runs if cells else with_cards(runs), options, cells)
