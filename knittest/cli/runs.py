"""``knittest runs``."""

import re
from datetime import datetime, timedelta
from pathlib import Path

import click

RUNS = Path("runs")
UNITS = {"h": "hours", "d": "days", "w": "weeks"}


class _Age(click.ParamType):
    """``7d`` as a duration."""

    name = "AGE"

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> timedelta:
        """See :class:`click.ParamType`."""
        found = re.fullmatch(r"(\d{1,5})([hdw])", value)
        if found is None:
            self.fail(f"{value}: expected a number of hours, days or weeks, such as 12h, 7d or 4w", param, ctx)
        return timedelta(**{UNITS[found[2]]: int(found[1])})


@click.command()
@click.argument("names", metavar="[RUN]...", nargs=-1)
@click.option("--failed", is_flag=True, help="Only runs that failed, or did not pass a quality check.")
@click.option("--older-than", type=_Age(), help="Only runs that ended longer ago, such as 12h, 7d or 4w.")
@click.option("--remove", is_flag=True, help="Remove these runs from the disk, after a question.")
@click.option("--yes", is_flag=True, help="With --remove: do not ask.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout and nothing else there.")
def runs(
    names: tuple[str, ...], failed: bool, older_than: timedelta | None, remove: bool, yes: bool, as_json: bool
) -> int:
    """List run folders: test, fabric, scale, first result, size, whether they passed, date; or remove some.

    RUN is a run folder, or a folder that holds some, here or in runs; all of runs if none is given. A sweep or another
    study is one line. Only run folders are removed: no links, no studies, no run that a process uses, and none with
    files that knittest did not write.

    Example: knittest runs

    Example: knittest runs --remove --failed --older-than 7d
    """
    from knittest.report_page.folders import list_runs
    from knittest.runs.show import print_json, print_runs

    if remove and not (names or failed or older_than is not None):
        raise click.UsageError("--remove: name the runs, or choose them by --failed or --older-than")
    if yes and not remove:
        raise click.UsageError("--yes goes with --remove")
    paths = [path if (path := Path(name)).exists() else RUNS / name for name in names]
    found = list_runs(paths or [RUNS]) if names or RUNS.is_dir() else []
    before = None if older_than is None else datetime.now().astimezone() - older_than
    found = [one for one in found if (one.failed or not failed) and (before is None or one.date < before)]
    if remove and not names:
        found = [one for one in found if one.removable]
    if as_json and not remove:
        print_json({"runs": [vars(one) | {"path": str(one.path), "date": one.date.isoformat()} for one in found]})
        return 0
    print_runs(found, RUNS)
    if not (remove and found):
        return 0
    size = sum(one.bytes for one in found) / 1e6
    if not yes and not click.confirm(f"remove {len(found)} of them, {size:.1f} MB?", err=True):
        return 0
    return _remove([one.path for one in found])


def _remove(paths: list[Path]) -> int:
    """Remove the run folders ``paths``; says of each that cannot be why, and returns the worst exit code."""
    from knittest.base.errors import KnittestError
    from knittest.export.place import remove_run

    code = 0
    for path in paths:
        try:
            remove_run(path)
            click.echo(f"removed {path}")
        except KnittestError as error:
            click.echo(f"knittest: error: {error}", err=True)
            code = max(code, error.exit_code)
    return code
