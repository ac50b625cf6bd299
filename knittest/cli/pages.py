"""Commands that show finished runs: ``knittest report``, ``runs``, ``view``, ``animate`` and ``compare``."""

import re
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import click

from knittest.cli.options import JSON, OPEN, PATH, PRINTS, add_options, read_printing_options


@click.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...", type=PATH)
@click.option(
    "--out", type=PATH, help="Page to write.  [default: report.html in RUN; of several runs knittest-report.html here]"
)
@OPEN
@add_options(*PRINTS)
def report(runs: tuple[Path, ...], out: Path | None, open_page: bool, formats: str | None, dpi: int | None) -> int:
    """Write one self-contained HTML page on runs: it can be mailed, printed and read without a network.

    RUN is a run folder, or a folder that holds some, such as that of both directions. Several runs are compared. The
    folder of a single sweep, calibration or uncertainty study gets the page of that study. With --format or --dpi the
    curves of the runs and the fields of formed blanks are also written as pictures into the folder of the page.

    Example: knittest report runs/tensile-... runs/friction-... --out comparison.html
    """
    from knittest.report_page.page import write_reports
    from knittest.runs.terminal_output import open_page as show_page
    from knittest.studies.batch.page import PAGE as SWEEP
    from knittest.studies.calibrate.page import PAGE as CALIBRATION
    from knittest.studies.uncertainty.page import PAGE as UNCERTAINTY

    pages = (SWEEP, CALIBRATION, UNCERTAINTY)
    asked = read_printing_options(formats, dpi) if formats or dpi else None
    write = next((page.write for page in pages if len(runs) == 1 and page.is_in(runs[0])), None)
    if write and asked:
        raise click.UsageError("--format and --dpi apply to pages on runs, not on studies: leave them out")
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
    """Duration such as ``7d``."""

    name = "AGE"

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> timedelta:
        """See :class:`click.ParamType`."""
        found = re.fullmatch(r"(\d{1,5})([hdw])", value)
        if found is None:
            self.fail(f"{value}: expected a number of hours, days or weeks, such as 12h, 7d or 4w", param, ctx)
        return timedelta(**{UNITS[found[2]]: int(found[1])})


@click.command()
@click.argument("names", metavar="[RUN]...", nargs=-1)
@click.option("--failed", is_flag=True, help="Only runs that failed or did not pass a quality check.")
@click.option("--older-than", type=_Age(), help="Only runs that ended longer ago than this, such as 12h, 7d or 4w.")
@click.option("--remove", is_flag=True, help="Remove these runs from the disk, after confirmation.")
@click.option("--yes", is_flag=True, help="With --remove: do not ask.")
@JSON
def runs(
    names: tuple[str, ...], failed: bool, older_than: timedelta | None, remove: bool, yes: bool, as_json: bool
) -> int:
    """List run folders: test, fabric, scale, first result, size, verdict and date; or remove some.

    RUN is a run folder, or a folder that holds some, here or in runs; without RUN, all of runs are listed. A study is
    one line. Only run folders are removed: no links, no studies, no run in use, and none with files that knittest did
    not write.

    Example: knittest runs

    Example: knittest runs --remove --failed --older-than 7d
    """
    from knittest.report_page.folders import list_runs
    from knittest.runs.terminal_output import print_json, print_runs

    if remove and not (names or failed or older_than is not None):
        raise click.UsageError("--remove: name the runs, or choose them by --failed or --older-than")
    if yes and not remove:
        raise click.UsageError("--yes needs --remove")
    paths = [path if (path := Path(name)).exists() else RUNS / name for name in names]
    found = list_runs(paths or [RUNS]) if names or RUNS.is_dir() else []
    before = None if older_than is None else datetime.now().astimezone() - older_than
    found = [one for one in found if (one.failed or not failed) and (before is None or one.date < before)]
    if remove and not names:
        found = [one for one in found if one.is_removable]
    if as_json and not remove:
        print_json({"runs": [vars(one) | {"path": str(one.path), "date": one.date.isoformat()} for one in found]})
        return 0
    print_runs(found, RUNS)
    if not (remove and found):
        return 0
    size = sum(one.bytes for one in found) / 1e6
    if not yes and not click.confirm(f"remove {len(found)} of them, {size:.1f} MB?", err=True):
        return 0
    return _remove_runs([one.path for one in found])


def _remove_runs(paths: list[Path]) -> int:
    """Remove the run folders ``paths``; print why one cannot be removed, and return the worst exit code."""
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
@click.argument("run", metavar="RUN", type=PATH)
@click.option("--frames", type=int, help="Largest number of frames on the page.  [default: all frames of the run]")
def view(run: Path, frames: int | None) -> None:
    """Write view.html into a run folder: a page that shows the run in 3D, to turn, play and colour.

    The page is one file that needs no network. RUN is a run folder with frames, or a folder that holds some, such as
    that of both directions.

    Example: knittest view runs/forming-...
    """
    from knittest.report_page.folders import find_runs
    from knittest.report_page.moving.page import write_view as write

    found, notes = find_runs([run])
    for one in found:
        _print_file(write(one.path, frames))
    for note in notes:
        click.echo(note, err=True)


def _print_file(path: Path) -> None:
    click.echo(str(path))
    click.echo(f"{path.stat().st_size / 1e6:.1f} MB", err=True)


@click.command()
@click.argument("run", metavar="RUN", type=PATH)
@click.option("--out", type=PATH, help="Film, .mp4 or .gif.  [default: RUN/film.mp4]")
@click.option("--colour", default="", help="Field of the frames, or height.  [default: axial force or shear angle]")
@click.option("--look", type=click.Choice(["oblique", "top", "side"]), default="oblique", show_default=True)
@click.option("--seconds", type=float, default=5.0, show_default=True, help="Length without the final still image.")
@click.option("--fps", type=int, help="Images per second.  [default: 15; GIF: 10]")
@click.option("--width", type=int, help="Width in pixels.  [default: 960; GIF: 640]")
@click.option(
    "--tools/--no-tools", default=True, show_default=True,
    help="Show the apparatus: stamp, die, holder, plates, board, jaws, bars.",
)  # fmt: skip
def animate(run: Path, out: Path | None, **looks: Any) -> None:
    """Write a film of a run with frames, as MP4 or GIF.

    MP4 needs an encoder: pip install 'knittest[animate]'; without it the default is a GIF. RUN is a run folder, or a
    folder that holds some, such as that of both directions: each run gets a film, with its name added to --out.

    Example: knittest animate runs/forming-... --out forming.gif
    """
    from knittest.report_page.folders import find_runs
    from knittest.report_page.moving.film import FilmOptions, film_paths
    from knittest.report_page.moving.film import animate as write

    found, notes = find_runs([run])
    planned, fallback = film_paths(run, [one.path for one in found], out)
    if fallback:
        click.echo(fallback, err=True)
    for folder, film in planned.items():
        write(folder, film, FilmOptions(**looks))
        _print_file(film)
    for note in notes:
        click.echo(note, err=True)


@click.command()
@click.argument("run", type=PATH)
@click.option(
    "--against",
    type=PATH,
    required=True,
    help="CSV with a header, your own or of the shipped data: strain_pct,force_n, or as a laboratory writes it "
    "'Dehnung [%];Kraft [kN]' with decimal comma; of a picture frame shear_angle_deg and force_n or "
    "normalised_shear_force_n_per_mm. Or the curve.csv of another run, or the time history (NAMET01) of its deck in "
    "OpenRadioss.",
)
@click.option("--direction", type=click.Choice(["warp", "weft"]), help="Direction of the tested strip.")
@click.option("--width", "strip_width_mm", type=float, help="Width of the tested strip [mm].")
@click.option("--gauge-length", "gauge_length_mm", type=float, help="Gauge length of the tested strip [mm].")
@click.option("--frame-side", "frame_side_mm", type=float, help="Side of the tested frame, hinge to hinge [mm].")
@click.option("--fabric-side", "fabric_side_mm", type=float, help="Side of the square of fabric in it [mm].")
@click.option("--normal-force", "normal_force_n", type=float, help="Normal force of the tested friction plates [N].")
@click.option("--ratio", "strain_ratio", type=float, help="Strain ratio of the biaxial test.")
@click.option("--out", type=PATH, help="Picture of both curves (PNG).  [default: compare.png in the run]")
@JSON
@add_options(*PRINTS)
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
    """Compare the curve of a run folder with a measured curve: print a table, draw both.

    The CSV has one line of column names and one line of numbers per point, strain or shear angle rising. Lines such as
    "# strip_width_mm: 100" and "# direction: weft" may precede it, as knittest data import writes them (corridor.csv);
    the options state what the CSV does not. Strips of different width are compared by force per width, frames of
    different side by normalised force. A curve of another test or direction is rejected. Nothing is rated against data
    that the macro model was given, nor against a strip of unknown direction.

    Example: knittest compare runs/tensile-.../warp --against mean.csv --width 50 --direction warp
    """  # fmt: skip
    import sys

    from knittest.base.figure import use_printing
    from knittest.base.layout import shorten_path, width_of
    from knittest.config.quality_checks import relaxed_limits
    from knittest.experiment.comparison import compare_columns
    from knittest.experiment.conditions import Conditions
    from knittest.laboratory.reference_curves import draw_comparison, own_curves, run_caption
    from knittest.laboratory.report_base import REPORTS
    from knittest.runs.terminal_output import curve_line, curve_table, print_json, print_text

    given, columns, manifest = _load_run(run)
    (reference,) = own_curves(given, [against], Conditions(direction=direction or "", **sizes))  # type: ignore[arg-type]
    report = REPORTS[given.rig.kind]
    columns, reach = report.scale_to_nominal_size(given, columns), report.axes.reach
    found, picture = compare_columns(columns, reference, reach), out or run / "compare.png"
    with use_printing(read_printing_options(formats, dpi)):
        draw_comparison(given, columns, reference, picture, run_caption(given, run, manifest))
    looser = [one.text for one in relaxed_limits(given)]
    accepted = [f"limits accepted by --accept-limits: {'; '.join(looser)}"] if looser else []
    if as_json:
        print_json(found | {"picture": str(picture), "looser_limits": looser})
        print_text([curve_line(found), *accepted], sys.stderr)
    else:
        print_text([*curve_table(found, width_of(sys.stdout)), *accepted, f"picture: {shorten_path(picture)}"])
    return 0


def _load_run(run: Path) -> tuple[Any, dict[str, Any], dict[str, Any]]:
    """Config, curve columns and manifest of a completed run; raises :class:`InputError` for any other."""
    import json

    import pandas as pd

    from knittest.base.errors import InputError
    from knittest.config.loading import resolve

    runs = sorted(path.parent.name for path in run.glob("*/manifest.json"))
    if runs and not (run / "manifest.json").exists():
        raise InputError(f"{run}: holds several runs: choose one of {', '.join(str(run / name) for name in runs)}")
    try:
        manifest = json.loads((run / "manifest.json").read_text(encoding="utf-8"))
        table = pd.read_csv(run / "curve.csv")
    except (OSError, ValueError) as error:
        raise InputError(f"{run}: not a run folder with a curve: {error}") from None
    if manifest.get("status") != "completed" or manifest.get("exit_code"):
        raise InputError(f"{run}: {manifest.get('message') or 'the run is ' + str(manifest.get('status'))}")
    return resolve(config=run / "config.yaml"), {str(n): table[n].to_numpy(float) for n in table}, manifest
