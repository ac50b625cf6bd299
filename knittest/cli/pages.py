"""Commands that show finished runs: ``knittest report``, ``runs``, ``view``, ``animate`` and ``compare``."""

import re
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import click

from knittest.cli.options import OPEN, printing_asked, prints


@click.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="File to write.  [default: report.html in RUN; knittest-report.html here for several]",
)
@OPEN
@prints
def report(runs: tuple[Path, ...], out: Path | None, open_page: bool, formats: str | None, dpi: int | None) -> int:
    """Write one HTML page on runs, with everything in it: it can be mailed, printed and read without a network.

    RUN is a run folder, or a folder that holds some, such as that of both directions; several are compared. The folder
    of a sweep, of a calibration or of a study of uncertainty, alone, gets the page of that. With --format or --dpi the
    curves of the runs, and the fields of formed blanks, are written beside the page too.

    Example: knittest report runs/tensile-... runs/friction-... --out comparison.html
    """
    from knittest.report_page.page import write_reports
    from knittest.runs.show import open_page as show_page
    from knittest.studies.batch.page import PAGE as SWEEP
    from knittest.studies.calibrate.page import PAGE as CALIBRATION
    from knittest.studies.uncertainty.page import PAGE as UNCERTAINTY

    pages = (SWEEP, CALIBRATION, UNCERTAINTY)
    asked = printing_asked(formats, dpi) if formats or dpi else None
    write = next((page.write for page in pages if len(runs) == 1 and page.is_in(runs[0])), None)
    if write and asked:
        raise click.UsageError("--format and --dpi are for pages on runs: leave them out here")
    path, count = (write(runs[0], out), 0) if write else write_reports(list(runs), out, asked)
    click.echo(str(path))
    if count:
        click.echo(f"{count} run{'s' if count > 1 else ''} on the page", err=True)
    if open_page:
        show_page(path)
    return 0


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
    from knittest.export.lock import remove_run

    code = 0
    for path in paths:
        try:
            remove_run(path)
            click.echo(f"removed {path}")
        except KnittestError as error:
            click.echo(f"knittest: error: {error}", err=True)
            code = max(code, error.exit_code)
    return code


@click.command()
@click.argument("run", metavar="RUN", type=click.Path(path_type=Path))
@click.option("--frames", type=int, help="Most frames on the page.  [default: all that the run wrote]")
def view(run: Path, frames: int | None) -> None:
    """Write view.html into a run folder: a page on which the run can be turned, played and coloured.

    The page is one file that needs no network. RUN is a run folder with frames, or a folder that holds some, such as
    that of both directions.

    Example: knittest view runs/forming-...
    """
    from knittest.report_page.folders import find_runs
    from knittest.report_page.moving.page import view as write

    found, notes = find_runs([run])
    for one in found:
        page = write(one.path, frames)
        click.echo(str(page))
        click.echo(f"{page.stat().st_size / 1e6:.1f} MB", err=True)
    for note in notes:
        click.echo(note, err=True)


@click.command()
@click.argument("run", metavar="RUN", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Film, .mp4 or .gif.  [default: RUN/film.mp4]")
@click.option("--colour", default="", help="Field of the frames, or height.  [default: axial force or shear angle]")
@click.option("--look", type=click.Choice(["oblique", "top", "side"]), default="oblique", show_default=True)
@click.option("--seconds", type=float, default=5.0, show_default=True, help="Length, before the last image stands.")
@click.option("--fps", type=int, help="Images a second.  [default: 15; GIF: 10]")
@click.option("--width", type=int, help="Pixels.  [default: 960; GIF: 640]")
@click.option(
    "--tools/--no-tools", default=True, show_default=True, help="Stamp, die, holder, plates, board, jaws, bars."
)
def animate(run: Path, out: Path | None, **looks: Any) -> None:
    """Write a run as a film for slides: a run folder with frames as MP4 or GIF.

    MP4 needs an encoder: pip install 'knittest[animate]'; without it the default is a GIF. RUN is a run folder, or a
    folder that holds some, such as that of both directions: each gets a film, with --out one with its name in it.

    Example: knittest animate runs/forming-... --out forming.gif
    """
    from knittest.report_page.folders import find_runs
    from knittest.report_page.moving.film import Filmed, films
    from knittest.report_page.moving.film import animate as write

    found, notes = find_runs([run])
    planned, fallback = films(run, [one.path for one in found], out)
    if fallback:
        click.echo(fallback, err=True)
    for folder, film in planned.items():
        write(folder, film, Filmed(**looks))
        click.echo(str(film))
        click.echo(f"{film.stat().st_size / 1e6:.1f} MB", err=True)
    for note in notes:
        click.echo(note, err=True)


@click.command()
@click.argument("run", type=click.Path(path_type=Path))
@click.option(
    "--against",
    type=click.Path(path_type=Path),
    required=True,
    help="CSV with a header: strain_pct,force_n, or a laboratory's 'Dehnung [%];Kraft [kN]' with decimal comma; of a "
    "picture frame shear_angle_deg and force_n or normalised_shear_force_n_per_mm. Also a file of the shipped data.",
)
@click.option(
    "--direction", type=click.Choice(["warp", "weft"]), help="Direction of the tested strip, where the CSV has none."
)
@click.option("--width", "strip_width_mm", type=float, help="Width of the tested strip [mm], where the CSV has none.")
@click.option("--gauge-length", "gauge_length_mm", type=float, help="Distance of its clamps [mm].")
@click.option("--frame-side", "frame_side_mm", type=float, help="Side of the tested frame, hinge to hinge [mm].")
@click.option("--fabric-side", "fabric_side_mm", type=float, help="Side of the square of fabric in it [mm].")
@click.option("--normal-force", "normal_force_n", type=float, help="Force that pressed its plates together [N].")
@click.option("--ratio", "strain_ratio", type=float, help="Ratio of its strains, of a biaxial test.")
@click.option(
    "--out", type=click.Path(path_type=Path), help="Picture of both curves (PNG).  [default: compare.png in the run]"
)
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout and nothing else there.")
@prints
def compare(
    run: Path,
    against: Path,
    out: Path | None,
    direction: str | None,
    as_json: bool,
    formats: str | None,
    dpi: int | None,
    **sizes: float | None,
) -> int:
    """Compare the curve of a run folder with a curve of your own: print a table, draw both.

    The curve has a row of names and one of numbers a point, strain or shear angle rising; lines such as
    "# strip_width_mm: 100" and "# direction: weft" may stand above it, as data import writes them (corridor.csv). A
    strip of another width is compared by its force per width, a frame of another side by the normalised force; another
    test or direction is refused. Nothing is rated against data that the shells were given, nor against a strip of
    unknown direction.

    Example: knittest compare runs/tensile-.../warp --against mean.csv --width 50 --direction warp
    """
    import sys

    from knittest.base.figure import printed
    from knittest.base.layout import nearest, width_of
    from knittest.config.gates import loosened
    from knittest.experiment.compare import compare_columns
    from knittest.experiment.conditions import Conditions
    from knittest.laboratory.given_data import draw_against, identity_of, own_curves
    from knittest.laboratory.report_base import REPORTS
    from knittest.runs.show import curve_line, curve_table, print_json, print_text

    given, columns, manifest = _run_of(run)
    (reference,) = own_curves(given, [against], Conditions(direction=direction or "", **sizes))  # type: ignore[arg-type]
    report = REPORTS[given.rig.kind]
    columns, reach = report.for_nominal_size(given, columns), report.axes.reach
    found, picture = compare_columns(columns, reference, reach), out or run / "compare.png"
    with printed(printing_asked(formats, dpi)):
        draw_against(given, columns, reference, picture, identity_of(given, run, manifest))
    looser = [one.stated for one in loosened(given)]
    accepted = [f"limits of the run that --accept-limits let pass: {'; '.join(looser)}"] if looser else []
    if as_json:
        print_json(found | {"picture": str(picture), "looser_limits": looser})
        print_text([curve_line(found), *accepted], sys.stderr)
    else:
        print_text([*curve_table(found, width_of(sys.stdout)), *accepted, f"picture: {nearest(picture)}"])
    return 0


def _run_of(run: Path) -> tuple[Any, dict[str, Any], dict[str, Any]]:
    """Config, columns of the curve and manifest of a completed run; raises :class:`InputError` for any other."""
    import json

    import pandas as pd

    from knittest.base.errors import InputError
    from knittest.config.loading import resolve

    runs = sorted(path.parent.name for path in run.glob("*/manifest.json"))
    if runs and not (run / "manifest.json").exists():
        raise InputError(
            f"{run}: holds the runs {' and '.join(runs)}: choose one of {', '.join(str(run / r) for r in runs)}"
        )
    try:
        manifest = json.loads((run / "manifest.json").read_text(encoding="utf-8"))
        table = pd.read_csv(run / "curve.csv")
    except (OSError, ValueError) as error:
        raise InputError(f"{run}: not a run folder with a curve: {error}") from None
    if manifest.get("status") != "completed" or manifest.get("exit_code"):
        reason = str(manifest.get("message") or manifest.get("status")).removeprefix("comparison refused: ")
        raise InputError(f"{run}: comparison refused: {reason}")
    return resolve(config=run / "config.yaml"), {str(n): table[n].to_numpy(float) for n in table}, manifest
