"""``knittest compare``."""

from pathlib import Path
from typing import Any

import click

from knittest.cli.options import printing_asked, prints


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

    from knittest.base.layout import nearest, width_of
    from knittest.base.printing import printed
    from knittest.config.looser import loosened
    from knittest.experiment.compare import compare_columns
    from knittest.experiment.conditions import Conditions
    from knittest.laboratory.against import draw_against, identity_of, own_curves
    from knittest.laboratory.registry import REPORTS
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
