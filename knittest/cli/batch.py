"""``knittest batch``."""

import re
import sys
from pathlib import Path
from typing import Any

import click

from knittest.cli.options import ACCEPT_LIMITS


class _Shard(click.ParamType):
    """``i/n`` as two numbers."""

    name = "I/N"

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """See :class:`click.ParamType`."""
        found = re.fullmatch(r"(\d{1,6})/(\d{1,6})", value)
        shard = (int(found[1]), int(found[2])) if found else (0, 0)
        if not 1 <= shard[0] <= shard[1]:
            self.fail(f"{value}: expected the share and their number, from 1/n to n/n", param, ctx)
        return shard


@click.command()
@click.argument("sweep", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder of the batch.  [default: runs/batch-<sweep>]")
@click.option("--workers", type=click.IntRange(1), help="Processes.  [default: cores over threads]")
@click.option("--threads", type=click.IntRange(1), help="Threads of each.  [default: cores over workers; Dask: 1]")
@click.option("--dask", metavar="ADDRESS", help="Run on the Dask cluster with this scheduler, such as tcp://host:8786.")
@click.option("--shard", type=_Shard(), help="Run the I-th of N shares, as in a job array.")
@click.option(
    "--slurm",
    type=click.IntRange(1, 10_000),
    metavar="N",
    help="Write a job array of N shares for Slurm into the folder and run nothing; a share has --workers (1) processes "
    "with --threads (1) each.",
)
@click.option("--yes", is_flag=True, help="Do not ask before more than 10,000 runs.")
@click.option("--parquet", is_flag=True, help="Write results.parquet too (needs pyarrow).")
@ACCEPT_LIMITS
@click.option("--quiet", is_flag=True, help="No progress, no summary.")
def batch(sweep: Path, yes: bool, **chosen: Any) -> int:
    """Run a sweep: grids, ranges and samples of any field, on this machine or a cluster.

    The same command goes on where it was stopped; finished runs are not repeated.

    Example: knittest batch configs/sweeps/blank-holder.yaml --workers 2
    """
    if chosen["dask"] is not None and chosen["workers"] is not None:
        raise click.UsageError("--workers are processes of this machine; with --dask the cluster has its own")
    if chosen["slurm"] is not None and (chosen["dask"] is not None or chosen["shard"] is not None):
        raise click.UsageError("--slurm writes a script with shares of its own: leave out --dask and --shard")
    from knittest.studies.batch.command import BatchOptions, batch_command

    def agree(question: str) -> bool:
        return yes or (sys.stdin.isatty() and click.confirm(f"{question}: run them?", err=True))

    return batch_command(sweep, BatchOptions(**chosen), agree)
