"""Commands of studies: ``knittest batch``, ``calibrate``, ``uncertainty``, ``homogenise``, ``regress`` and
``speed-study``.
"""

import re
import sys
from pathlib import Path
from typing import Any

import click

from knittest.base.kinds import names
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
    from knittest.studies.batch.command import BatchOptions, run_batch

    def agree(question: str) -> bool:
        return yes or (sys.stdin.isatty() and click.confirm(f"{question}: run them?", err=True))

    return run_batch(sweep, BatchOptions(**chosen), agree).exit_code


@click.command()
@click.argument("calibration", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder.  [default: runs/calibrate-<calibration>]")
@click.option("--workers", type=click.IntRange(1), help="Processes.  [default: cores over threads]")
@click.option("--threads", type=click.IntRange(1), help="Threads of each.  [default: cores over workers]")
@click.option("--storage", metavar="URL", help="Database of method optuna.  [default: SQLite in the folder]")
@ACCEPT_LIMITS
@click.option("--quiet", is_flag=True, help="No progress, no summary.")
def calibrate(calibration: Path, **chosen: Any) -> int:
    """Find parameters of a fabric or a rig from measured results.

    The same command goes on where it was stopped; finished runs are not repeated.

    Example: knittest calibrate configs/calibrations/v1-warp-bending.yaml
    """
    from knittest.studies.calibrate.command import CalibrateOptions, run_calibration

    return run_calibration(calibration, CalibrateOptions(**chosen)).exit_code


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder.  [default: runs/uncertainty-<study>]")
@click.option("--workers", type=click.IntRange(1), help="Processes, one thread each.  [default: the file's; cores]")
@ACCEPT_LIMITS
@click.option("--quiet", is_flag=True, help="No progress, no summary.")
def uncertainty(study: Path, **chosen: Any) -> int:
    """Show what results are worth whose parameters are assumed: bands over the priors, and what they hang on.

    The same command goes on where it was stopped; finished runs are not repeated.

    Example: knittest uncertainty configs/uncertainty/shear-order.yaml --workers 4
    """
    from knittest.studies.trials.runner import StudyOptions
    from knittest.studies.uncertainty.command import run_uncertainty

    return run_uncertainty(study, StudyOptions(**chosen)).exit_code


#: options whose name is no name of Python
NAMES = {"sets": "set", "source": "from"}


@click.command()
@click.option("--variant", help="Shipped fabric: 1, 2, or a name of configs/NAME.yaml.")
@click.option("--fabric", type=click.Path(path_type=Path), help="A fabric file of your own.")
@click.option("--parameters", help="Parameter set of the fabric: calibrated (default), as-measured, gripping.")
@click.option("--preset", type=click.Choice(["quick", "standard", "paper"]), default="quick", show_default=True)
@click.option(
    "--from", "source", type=click.Choice(["tests", "cell"]), default="tests", show_default=True,
    help="Yarns: tests of specimens, or paths of one cell without an edge.",
)  # fmt: skip
@click.option("--seed", type=int, help="Seed of all draws.  [default: 1]")
@click.option(
    "--set", "sets", multiple=True, metavar="[TEST.]KEY=VALUE",
    help="Any field of all tests of yarns, or of one kind: picture-frame.rig.side=40.",
)  # fmt: skip
@ACCEPT_LIMITS
@click.option("--out", type=click.Path(path_type=Path), help="Folder.  [default: runs/homogenise-<fabric>-...]")
@click.option("--workers", type=click.IntRange(1), help="Processes.  [default: cores over threads]")
@click.option("--threads", type=click.IntRange(1), help="Threads of each.  [default: cores over workers]")
@click.option("--time-limit", type=click.FloatRange(1.0), default=7200.0, show_default=True, help="Of a test [s].")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout and nothing else there.")
@click.option("--quiet", is_flag=True, help="No progress, no table.")
def homogenise(
    out: Path | None,
    workers: int | None,
    threads: int | None,
    time_limit: float,
    as_json: bool,
    quiet: bool,
    **chosen: Any,
) -> int:
    """Make a material card of the shells from tests or a cell of yarns, and hold shells with it against them.

    The same command goes on where it was stopped; finished runs are not repeated.

    Example: knittest homogenise --variant 1
    """
    from knittest.studies.homogenise.command import HomogeniseOptions, run_homogenisation
    from knittest.studies.homogenise.plan import Request

    if not (chosen["variant"] or chosen["fabric"]):
        raise click.UsageError("which fabric? Give --variant 1, --variant 2 or --fabric FILE")
    words = [
        f"--{NAMES.get(name, name)} {one}"
        for name, value in chosen.items()
        for one in (value if isinstance(value, tuple) else [value])
        if one is not None and name != "accept_limits" and (name, one) != ("source", "tests")
    ]
    words += ["--accept-limits"] if chosen["accept_limits"] else []
    options = HomogeniseOptions(
        out=out, workers=workers, threads=threads, time_limit=time_limit, json=as_json, quiet=quiet
    )  # fmt: skip
    return run_homogenisation(Request(**chosen), options, " ".join(["knittest homogenise", *words])).exit_code


@click.command()
@click.option("--table", type=click.Choice(["3", "4"]), help="Only this table of the paper.  [default: both]")
@click.option("--scale", type=click.Choice(["macro", "meso", "both"]), default="both", show_default=True)
@click.option(
    "--level",
    type=click.Choice(["quick", "full"]),
    default="quick",
    show_default=True,
    help="quick: for every push; full: all rows, most at the size of the paper.",
)
@click.option(
    "--sd",
    "limit_sd",
    type=click.FloatRange(0.0, 100.0, min_open=True),
    default=1.0,
    show_default=True,
    help="Standard deviations of the experiment that predicted and tuned rows may deviate.",
)
@click.option(
    "--baseline", type=click.Path(path_type=Path), help="The code's own numbers.  [default: the shipped ones]"
)
@click.option("--update-baseline", "update", is_flag=True, help="Write the numbers of these runs to the baseline.")
@click.option(
    "--accept-wider",
    multiple=True,
    metavar="RUN",
    help="With --update-baseline: store this run though its limits grow by more than 30 %, or a number is gone.",
)
@click.option("--out", type=click.Path(path_type=Path), default=Path("runs/regress"), show_default=True)
@click.option("--junit", type=click.Path(path_type=Path), metavar="FILE", help="Write JUnit XML for a CI server.")
@click.option("--workers", type=click.IntRange(1), help="Processes.  [default: cores over threads; with --table 4: 2]")
@click.option(
    "--threads", type=click.IntRange(1), help="Threads of each.  [default: cores over workers; with --table 4: 1]"
)
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout and nothing else there.")
@click.option("--quiet", is_flag=True, help="No progress, no table.")
def regress(table: str | None, as_json: bool, **chosen: Any) -> int:
    """Judge the code by Table 3 of the paper, row by row, and by its own stored numbers; exit code 5 if it fails.

    Finished runs in the folder are not repeated as long as code and data are the same.

    Example: knittest regress --level quick --junit regress.xml
    """
    from knittest.studies.regress.command import RegressOptions, regress_command

    number: Any = None if table is None else int(table)
    return regress_command(RegressOptions(table=number, json=as_json, **chosen))


@click.command("speed-study")
@click.option("--variant", help="Shipped fabric.  [default: 1]")
@click.option("--fabric", type=click.Path(path_type=Path), help="A fabric file of your own.")
@click.option(
    "--test",
    "tests",
    multiple=True,
    type=click.Choice(names("studied")),
    help="Only this test; repeatable.  [default: all]",
)
@click.option(
    "--scale", type=click.Choice(["macro", "meso", "both"]), default="both", show_default=True, help="Shells or yarns."
)
@click.option("--direction", type=click.Choice(["warp", "weft"]), default="warp", show_default=True)
@click.option("--preset", type=click.Choice(["quick", "standard", "paper"]), default="quick", show_default=True)
@click.option("--out", type=click.Path(path_type=Path), default=Path("runs/speed-study"), show_default=True)
@click.option("--workers", type=click.IntRange(1), help="Processes.  [default: cores over threads]")
@click.option("--threads", type=click.IntRange(1), help="Threads of each.  [default: cores over workers]")
@click.option("--quiet", is_flag=True, help="No progress, no table.")
def speed_study(variant: str | None, fabric: Path | None, tests: tuple[str, ...], scale: str, **chosen: Any) -> int:
    """Run each test at its speed and at half of it, and write how much every result changes.

    The cantilever is at rest: there, what decides when it is at rest is halved. Finished runs in the folder are not
    repeated as long as code and data are the same. Tables: speed-study.csv and speed-study.md in OUT.

    Example: knittest speed-study --variant 2 --test friction --scale macro
    """
    from knittest.studies.speed_study import SCALES, SpeedOptions, study_command

    if variant is None and fabric is None:
        variant = "1"
    scales = SCALES if scale == "both" else (scale,)
    return study_command(
        SpeedOptions(variant=variant, fabric=fabric, tests=tests or names("studied"), scales=scales, **chosen)
    )
