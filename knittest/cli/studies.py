"""Commands of studies: ``knittest batch``, ``calibrate``, ``uncertainty``, ``homogenise``, ``regress`` and
``speed-study``.
"""

import re
import sys
from pathlib import Path
from typing import Any

import click

from knittest.base.kinds import test_names
from knittest.cli import options as opt


class _Shard(click.ParamType):
    """Share ``i/n`` as two numbers."""

    name = "I/N"

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """See :class:`click.ParamType`."""
        found = re.fullmatch(r"(\d{1,6})/(\d{1,6})", value)
        shard = (int(found[1]), int(found[2])) if found else (0, 0)
        if not 1 <= shard[0] <= shard[1]:
            self.fail(f"{value}: expected the number of the share and of all shares, from 1/n to n/n", param, ctx)
        return shard


@click.command()
@click.argument("sweep", type=opt.PATH)
@click.option("--out", type=opt.PATH, help="Folder of the batch.  [default: runs/batch-<sweep>]")
@opt.add_options(opt.WORKERS, opt.THREADS)
@click.option("--dask", metavar="ADDRESS", help="Run on the Dask cluster with this scheduler: tcp://host:8786.")
@click.option("--shard", type=_Shard(), help="Run only share I of N, as in a job array.")
@click.option(
    "--slurm", type=click.IntRange(1, 10_000), metavar="N",
    help="Run nothing; write a Slurm job array of N shares into the folder. Each share has --workers processes "
    "[default: 1] with --threads threads [default: 1].",
)  # fmt: skip
@click.option("--yes", is_flag=True, help="Do not ask before more than 10,000 runs.")
@click.option("--parquet", is_flag=True, help="Also write results.parquet (needs pyarrow).")
@opt.add_options(opt.ACCEPT_LIMITS, opt.QUIET)
def batch(sweep: Path, yes: bool, **chosen: Any) -> int:
    """Run a parameter sweep: grids, ranges and samples of any field, on this machine or a cluster.

    The same command resumes an interrupted sweep; finished runs are not repeated.

    Example: knittest batch configs/sweeps/blank-holder.yaml --workers 2
    """
    if chosen["dask"] is not None and chosen["workers"] is not None:
        raise click.UsageError("--workers sets processes of this machine; leave it out with --dask")
    if chosen["slurm"] is not None and (chosen["dask"] is not None or chosen["shard"] is not None):
        raise click.UsageError("--slurm writes a script with its own shares: leave out --dask and --shard")
    from knittest.studies.batch.command import BatchOptions, run_batch

    def agree(question: str) -> bool:
        return yes or (sys.stdin.isatty() and click.confirm(f"{question}: run them?", err=True))

    return run_batch(sweep, BatchOptions(**chosen), agree).exit_code


@click.command()
@click.argument("calibration", type=opt.PATH)
@click.option("--out", type=opt.PATH, help="Folder.  [default: runs/calibrate-<calibration>]")
@opt.add_options(opt.WORKERS, opt.THREADS)
@click.option("--storage", metavar="URL", help="Database of method optuna.  [default: SQLite in the folder]")
@opt.add_options(opt.ACCEPT_LIMITS, opt.QUIET)
def calibrate(calibration: Path, **chosen: Any) -> int:
    """Fit parameters of a fabric or a rig to measured results.

    The same command resumes an interrupted calibration; finished runs are not repeated.

    Example: knittest calibrate configs/calibrations/v1-warp-bending.yaml
    """
    from knittest.studies.calibrate.command import CalibrateOptions, run_calibration

    return run_calibration(calibration, CalibrateOptions(**chosen)).exit_code


@click.command()
@click.argument("study", type=opt.PATH)
@click.option("--out", type=opt.PATH, help="Folder.  [default: runs/uncertainty-<study>]")
@click.option(
    "--workers", type=click.IntRange(1), help="Parallel processes, one thread each.  [default: the file's; cores]"
)
@opt.add_options(opt.ACCEPT_LIMITS, opt.QUIET)
def uncertainty(study: Path, **chosen: Any) -> int:
    """Propagate the uncertainty of assumed parameters: bands of the results and sensitivity indices.

    The same command resumes an interrupted study; finished runs are not repeated.

    Example: knittest uncertainty configs/uncertainty/shear-order.yaml --workers 4
    """
    from knittest.studies.trials.runner import StudyOptions
    from knittest.studies.uncertainty.command import run_uncertainty

    return run_uncertainty(study, StudyOptions(**chosen)).exit_code


#: options whose name is no name of Python
NAMES = {"sets": "set", "source": "from"}


@click.command()
@opt.add_options(opt.VARIANT, opt.FABRIC, opt.PARAMETERS, opt.PRESET)
@click.option(
    "--from", "source", type=click.Choice(["tests", "cell"]), default="tests", show_default=True,
    help="Meso simulations: virtual tests of specimens, or load paths of one periodic cell.",
)  # fmt: skip
@click.option(
    "--coupled", is_flag=True,
    help="With --from cell: one law of both directions (macro.biaxial) in place of two tension curves.",
)  # fmt: skip
@opt.SEED
@click.option(
    "--set", "sets", multiple=True, metavar="[TEST.]KEY=VALUE",
    help="Change any field of all meso tests, or of one test: picture-frame.rig.side=40.",
)  # fmt: skip
@opt.ACCEPT_LIMITS
@click.option("--out", type=opt.PATH, help="Folder.  [default: runs/homogenise-<fabric>-...]")
@opt.add_options(opt.WORKERS, opt.THREADS)
@click.option(
    "--time-limit", type=click.FloatRange(1.0), default=7200.0, show_default=True, help="Time limit of a test [s]."
)
@opt.add_options(opt.JSON, opt.QUIET)
def homogenise(
    out: Path | None,
    workers: int | None,
    threads: int | None,
    time_limit: float,
    as_json: bool,
    quiet: bool,
    **chosen: Any,
) -> int:
    """Derive the macro material card from meso simulations, and compare macro simulations that use it with them.

    The same command resumes an interrupted study; finished runs are not repeated.

    Example: knittest homogenise --variant 1
    """  # fmt: skip
    from knittest.studies.homogenise.command import HomogeniseOptions, run_homogenisation
    from knittest.studies.homogenise.plan import Request

    if not (chosen["variant"] or chosen["fabric"]):
        raise click.UsageError("which fabric? Give --variant 1, --variant 2 or --fabric FILE")
    words = [
        f"--{NAMES.get(name, name)} {one}"
        for name, value in chosen.items()
        for one in (value if isinstance(value, tuple) else [value])
        if one is not None and name not in ("accept_limits", "coupled") and (name, one) != ("source", "tests")
    ]
    words += [f"--{name.replace('_', '-')}" for name in ("accept_limits", "coupled") if chosen[name]]
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
    help="Largest deviation of predicted and tuned rows, in standard deviations of the experiment.",
)
@click.option("--baseline", type=opt.PATH, help="Stored results of an earlier version.  [default: the shipped ones]")
@click.option("--update-baseline", "update", is_flag=True, help="Store the results of these runs in the baseline.")
@click.option(
    "--accept-wider",
    multiple=True,
    metavar="RUN",
    help="With --update-baseline: store this run although its limits grow by more than 30 %, or a number is missing.",
)
@click.option("--out", type=opt.PATH, default=Path("runs/regress"), show_default=True)
@click.option("--junit", type=opt.PATH, metavar="FILE", help="Write JUnit XML for a CI server.")
@click.option(
    "--workers", type=click.IntRange(1), help="Parallel processes.  [default: cores / threads; with --table 4: 2]"
)
@click.option(
    "--threads", type=click.IntRange(1), help="Threads per process.  [default: cores / workers; with --table 4: 1]"
)
@opt.add_options(opt.JSON, opt.QUIET)
def regress(table: str | None, as_json: bool, **chosen: Any) -> int:
    """Regression test for CI: compare with Table 3 of the paper and with a stored baseline; exit code 5 if it fails.

    Finished runs in the folder are not repeated while code and data are the same.

    Example: knittest regress --level quick --junit regress.xml
    """  # fmt: skip
    from knittest.studies.regress.command import RegressOptions, regress_command

    number: Any = None if table is None else int(table)
    return regress_command(RegressOptions(table=number, json=as_json, **chosen))


@click.command("speed-study")
@click.option("--variant", metavar="NAME", help="Shipped fabric or the name of configs/NAME.yaml.  [default: 1]")
@opt.FABRIC
@click.option(
    "--test", "tests", multiple=True, type=click.Choice(test_names("studied")),
    help="Only this test; repeatable.  [default: all]",
)  # fmt: skip
@click.option(
    "--scale", type=click.Choice(["macro", "meso", "both"]), default="both", show_default=True,
    help="macro: shell elements; meso: beam elements.",
)  # fmt: skip
@click.option("--direction", type=click.Choice(["warp", "weft"]), default="warp", show_default=True)
@opt.PRESET
@click.option("--out", type=opt.PATH, default=Path("runs/speed-study"), show_default=True)
@opt.add_options(opt.WORKERS, opt.THREADS, opt.QUIET)
def speed_study(variant: str | None, fabric: Path | None, tests: tuple[str, ...], scale: str, **chosen: Any) -> int:
    """Run each test at its speed and at half of it, and write how much every result changes.

    The cantilever is static: its criterion of rest is halved instead. Finished runs in the folder are not repeated
    while code and data are the same. Tables: speed-study.csv and speed-study.md in OUT.

    Example: knittest speed-study --variant 2 --test friction --scale macro
    """
    from knittest.studies.speed_study import SCALES, SpeedOptions, study_command

    if variant is None and fabric is None:
        variant = "1"
    scales = SCALES if scale == "both" else (scale,)
    return study_command(
        SpeedOptions(variant=variant, fabric=fabric, tests=tests or test_names("studied"), scales=scales, **chosen)
    )
