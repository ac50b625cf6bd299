"""``knittest calibrate``."""

from pathlib import Path

import click

from knittest.cli.options import ACCEPT_LIMITS


@click.command()
@click.argument("calibration", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder.  [default: runs/calibrate-<calibration>]")
@click.option("--workers", type=click.IntRange(1), help="Processes.  [default: cores over threads]")
@click.option("--threads", type=click.IntRange(1), help="Threads of each.  [default: cores over workers]")
@click.option("--storage", metavar="URL", help="Database of method optuna.  [default: SQLite in the folder]")
@ACCEPT_LIMITS
@click.option("--quiet", is_flag=True, help="No progress, no summary.")
def calibrate(
    calibration: Path,
    out: Path | None,
    workers: int | None,
    threads: int | None,
    storage: str | None,
    accept_limits: bool,
    quiet: bool,
) -> int:
    """Find parameters of a fabric or a rig from measured results.

    The same command goes on where it was stopped; finished runs are not repeated.

    Example: knittest calibrate configs/calibrations/v1-warp-bending.yaml
    """
    from knittest.studies.calibrate.command import CalibrateOptions, calibrate_command

    return calibrate_command(calibration, CalibrateOptions(out, workers, threads, quiet, storage, accept_limits))
