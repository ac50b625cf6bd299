"""``knittest uncertainty``."""

from pathlib import Path

import click

from knittest.cli.options import ACCEPT_LIMITS


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder.  [default: runs/uncertainty-<study>]")
@click.option("--workers", type=click.IntRange(1), help="Processes, one thread each.  [default: the file's; cores]")
@ACCEPT_LIMITS
@click.option("--quiet", is_flag=True, help="No progress, no summary.")
def uncertainty(study: Path, out: Path | None, workers: int | None, accept_limits: bool, quiet: bool) -> int:
    """Show what results are worth whose parameters are assumed: bands over the priors, and what they hang on.

    The same command goes on where it was stopped; finished runs are not repeated.

    Example: knittest uncertainty configs/uncertainty/shear-order.yaml --workers 4
    """
    from knittest.studies.uncertainty.command import UncertaintyOptions, uncertainty_command

    return uncertainty_command(study, UncertaintyOptions(out, workers, quiet, accept_limits))
