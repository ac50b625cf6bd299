"""``knittest compare``."""

from pathlib import Path

import click


@click.command()
@click.argument("run", type=click.Path(path_type=Path))
@click.option(
    "--against",
    type=click.Path(path_type=Path),
    required=True,
    help="CSV with a header: strain_pct,force_n, or a laboratory's 'Dehnung [%];Kraft [kN]' with decimal comma; of a "
    "picture frame shear_angle_deg and force_n or normalised_shear_force_n_per_mm. Also a file of the shipped data.",
)
def compare(run: Path, against: Path) -> int:
    """Compare the curve of a run folder with a curve of your own; prints JSON.

    The curve has a row of names and one of numbers a point, strain or shear angle rising; lines such as
    "# kind: measured" may stand above it. data import writes such curves (corridor.csv).

    Example: knittest compare runs/tensile-.../warp --against mean.csv
    """
    import json

    import pandas as pd

    from knittest.compare import compare_columns
    from knittest.errors import InputError
    from knittest.experiment.curves import find_curve

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
        raise InputError(f"{run}: comparison refused: {manifest.get('message') or manifest.get('status')}")
    columns = {str(name): table[name].to_numpy(float) for name in table}
    click.echo(json.dumps(compare_columns(columns, find_curve(against)), indent=2))
    return 0
