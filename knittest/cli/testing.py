"""Commands of tests: one for each test, ``knittest resume`` and ``knittest check``."""

import os
from pathlib import Path
from typing import Any

import click

from knittest.base.kinds import DEFAULT, TestKind, kinds, test_names
from knittest.cli import options as opt

_DIRECTION = click.option("--direction", type=click.Choice(["warp", "weft", "both"]), help="[default: both]")
#: smallest strips that pass the quality checks, by scale
_DEMO_SIZES = {"macro": (), "meso": ("rig.width=20", "rig.gauge_length=20")}
_FORCE_HELP = "continue although config, version or processor changed."
_FOLDER = (
    click.option("--out", type=opt.PATH, help="Run folder.  [default: runs/<name>-<time>]"),
    click.option("--resume", type=opt.PATH, metavar="DIR", help="Resume the run in DIR."),
    click.option("--force", is_flag=True, help=f"With --resume: {_FORCE_HELP}"),
    click.option(
        "--verify", is_flag=True,
        help="Repeat the run at half its speed and on another mesh, to state the numerical error of the results.",
    ),
)  # fmt: skip


def _run_options(chosen: dict[str, Any], out: Path | None = None) -> Any:
    """Take the options of :data:`opt.with_report_options` out of ``chosen``."""
    from knittest.runs.options import RunOptions

    frames, pictures = (not chosen.pop(f"no_{what}") for what in ("frames", "pictures"))
    kept = {name: chosen.pop(name) for name in ("threads", "quiet", "details", "against", "open_page")}
    printing = opt.read_printing_options(chosen.pop("formats"), chosen.pop("dpi"), not pictures, kept["open_page"])
    return RunOptions(out, json=chosen.pop("as_json"), frames=frames, pictures=pictures, printing=printing, **kept)


def test_command(kind: TestKind) -> click.Command:
    """Make the command of the tests of ``kind``."""

    def command(
        out: Path | None, resume: Path | None, force: bool, verify: bool, direction: str | None = None, **chosen: Any
    ) -> int:
        chosen["sets"] = (*chosen["sets"], *opt.take_test_settings(kind, chosen))
        options = _run_options(chosen, out)
        if resume is not None:
            if direction or out or verify or any(chosen.values()):
                raise click.UsageError("--resume takes the run from its folder: leave out all options that describe it")
            from knittest.studies.command import resume_command

            return resume_command(resume, options, force)
        if force:
            raise click.UsageError("--force needs --resume")
        chosen["sets"] = (*chosen["sets"], *(["output.verify=true"] if verify else []))
        runs = opt.resolve_runs(kind.name, direction, chosen)
        from knittest.studies.command import run_command

        return run_command(runs, options)

    command.__doc__ = kind.usage
    direction = [_DIRECTION] if kind.directional else []
    add = opt.add_options(
        opt.with_run_options,
        *direction,
        *_FOLDER,
        opt.ACCEPT_LIMITS,
        opt.add_test_options(kind),
        opt.with_report_options,
    )
    return click.command(name=kind.name)(add(command))


@click.command()
@click.argument("run", type=opt.PATH)
@click.option("--force", is_flag=True, help=_FORCE_HELP.capitalize())
@opt.with_report_options
def resume(run: Path, force: bool, **chosen: Any) -> int:
    """Resume a run that was interrupted, killed or ran out of disk; its results stay bitwise identical.

    RUN is the run folder, or the folder of both directions.

    Example: knittest resume runs/tensile-...
    """
    from knittest.studies.command import resume_command

    return resume_command(run, _run_options(chosen), force)


@click.command()
@click.option("--variant", type=click.Choice(["1", "2"]), default="2", show_default=True, help="Shipped fabric.")
@click.option("--out", type=opt.PATH, help="Folder of both runs.  [default: runs/demo]")
@click.option("--no-open", is_flag=True, help="Do not open the report in a browser.")
def demo(variant: str, out: Path | None, no_open: bool) -> int:
    """Pull a small warp strip, as shells and yarn by yarn, and open a report that explains each part of itself.

    Where the variable CI is set, the report is only written.

    Example: knittest demo
    """
    from knittest.config.loading import resolve
    from knittest.export.lock import make_new_folder
    from knittest.runs.options import RunOptions
    from knittest.studies.command import run_command

    runs = [
        resolve(variant=variant, test=DEFAULT, scale=scale, preset="quick", direction="warp", sets=sets)
        for scale, sets in _DEMO_SIZES.items()
    ]
    out = out or make_new_folder(Path("runs/demo"))
    # one thread: kernels of several take longer to compile than these runs take
    options = RunOptions(out, threads=1, open_page=not no_open and "CI" not in os.environ, explained=True)
    return run_command(runs, options)


@click.command()
@opt.with_run_options
@click.argument("test", type=click.Choice(test_names()), default=DEFAULT)
@_DIRECTION
@opt.add_test_options(*kinds().values())
@click.option("--convergence", is_flag=True, help="Run the test at its speed and at half of it, and compare.")
@click.option("--no-time", is_flag=True, help="Skip the time estimate, which compiles kernels and runs some steps.")
@click.option("--threads", type=click.IntRange(1), help="Number of threads.  [default: all cores]")
@click.option(
    "--out", type=opt.FOLDER, default=Path("check"), help="Folder for the picture of forming tools.  [default: check]"
)
@opt.JSON
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
    """Check a run without running it: size, time and consistency of the fabric's numbers.

    Prints sizes, masses, time step, number of steps, initial yarn overlap and the expected time, from at least a
    hundred steps of the real model. Compares each number of the fabric with tests, curves, yarns and relaxed cell:
    agrees, differs or no counterpart. Forming: also depth and clearance of the tools, and a picture of their section.
    If the macro material card has to be derived from the yarns: how long that takes. TEST is tensile by default.

    Example: knittest check tensile --variant 2 --scale meso --preset paper
    """  # fmt: skip
    chosen["sets"] = (*chosen["sets"], *opt.take_test_settings(kinds()[test], chosen))
    from knittest.laboratory.report_base import with_estimates
    from knittest.runs.preflight.command import CheckOptions, check_command
    from knittest.studies.homogenise.derived_card import complete_cards, paths_to_run

    runs = with_estimates(opt.resolve_runs(test, direction, chosen))
    options = CheckOptions(threads, as_json, not no_time, convergence, out)
    cells = paths_to_run(runs[0])
    return check_command(runs if cells else complete_cards(runs), options, cells)
