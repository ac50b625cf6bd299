"""Makes the command of a test: the same options for all, a direction where the specimen is a strip."""

from pathlib import Path
from typing import Any

import click

from knittest.base.kinds import TestKind
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
