"""Command ``knittest batch``: plan, run what is left, write table and picture; or a job array of Slurm."""

import fcntl
import math
import shlex
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from knittest.base.errors import InputError, NumericalError
from knittest.base.figure import Stamp, stamped
from knittest.base.files import resource_error, write_atomic
from knittest.base.interrupts import Interrupts
from knittest.config.yaml_loader import load_yaml
from knittest.export.lock import slug
from knittest.report_page.page import FILE, write_if_possible
from knittest.runs.options import RunOptions
from knittest.studies.batch.page import SWEEP, check_parquet, results_table, write_sweep_page, write_table
from knittest.studies.batch.picture import CHOICES, overview_picture
from knittest.studies.batch.plan import Plan, Row, plan_of
from knittest.studies.trials.pool import LocalPool, Pool
from knittest.studies.trials.runner import LEDGER, Studied, run_shown, says_how_to_go_on, study_folder
from knittest.studies.trials.trial import MEANING, Record, Trial, read_ledgers

if TYPE_CHECKING:
    from pandas import DataFrame


SCRIPT = "batch.slurm"
#: seconds beside the runs of a share: start, kernels, table
UPKEEP = 300.0
#: seconds before the end of the time at which Slurm asks the runs to save themselves
WARNED = 120
TEMPLATE = """#!/bin/bash
#SBATCH --job-name={name}
#SBATCH --array=1-{shares}
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task={cores}
#SBATCH --time={time}
#SBATCH --signal=B:TERM@{warned}
#SBATCH --output={log}
# {runs} runs in {shares} shares, {limit:g} s a run at most. Submit it again to go on: finished runs are not repeated.
set -eu
cd {here}
exec {command} --shard "${{SLURM_ARRAY_TASK_ID}}/{shares}"
"""


def write_script(sweep: Path, folder: Path, shares: int, runs: int, limit: float, each: tuple[int, int]) -> Path:
    """Write the script for ``shares`` of ``runs`` of at most ``limit`` seconds into ``folder``; returns its path.

    ``each``: processes of a share, and threads of each of them. Raises :class:`InputError` for more shares than runs.
    """
    if shares > runs:
        raise InputError(f"--slurm {shares}: more shares than the {runs} runs of {sweep}; expected at most {runs}")
    workers, threads = each
    command = [
        str(Path(sys.executable).with_name("knittest")), "batch", str(sweep.resolve()), "--out", str(folder.resolve()),
        "--workers", str(workers), "--threads", str(threads), "--quiet", "--yes",
    ]  # fmt: skip
    text = TEMPLATE.format(
        name=folder.name, shares=shares, runs=runs, limit=limit, cores=workers * threads, warned=WARNED,
        time=_clock(math.ceil(math.ceil(runs / shares) / workers) * limit + UPKEEP),
        log=folder.resolve() / "slurm-%a.log", here=shlex.quote(str(Path.cwd())), command=shlex.join(command),
    )  # fmt: skip
    path = folder / SCRIPT
    write_atomic(path, text)
    return path


def _clock(seconds: float) -> str:
    """``seconds`` as hours:minutes:seconds."""
    whole = math.ceil(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


#: more runs than this are asked for
MANY = 10_000


@dataclass(frozen=True)
class BatchOptions:
    """Place of a batch and the files it leaves; ``shard`` (i, n) takes the i-th of n shares, from 1, ``slurm`` n writes
    a script for n shares instead of running any.
    """

    out: Path | None = None
    workers: int | None = None
    threads: int | None = None
    dask: str | None = None
    shard: tuple[int, int] | None = None
    slurm: int | None = None
    parquet: bool = False
    quiet: bool = False
    accept_limits: bool = False


def batch_command(path: Path, options: BatchOptions, agree: Callable[[str], bool]) -> int:
    """Run the sweep in the file ``path``, or what is left of it; returns the exit code. Raises as :func:`run_batch`."""
    return run_batch(path, options, agree).exit_code


def run_batch(path: Path, options: BatchOptions, agree: Callable[[str], bool]) -> Studied:
    """Run the sweep in the file ``path``, or what is left of it.

    ``agree`` is asked before very many runs. Raises :class:`InputError` before anything runs.
    """
    if options.parquet:
        check_parquet()
    plan = plan_of(load_yaml(path), options.accept_limits)
    if plan.count > MANY and not agree(f"{path}: {plan.count:,} runs, more than {MANY:,}"):
        raise InputError(f"{path}: {plan.count:,} runs, more than {MANY:,}: run them with --yes, or sweep less")
    rows = plan.rows()
    mine = _share([row.trial for row in rows if row.trial], options.shard)
    if options.slurm is not None:
        folder = _folder(path, options.out)
        each = (options.workers or 1, options.threads or 1)
        script = write_script(path, folder, options.slurm, len(mine), plan.sweep.time_limit, each)
        print(shlex.join(["sbatch", str(script)]))
        return Studied(folder, 0)
    pool = _pool(options)
    folder = _folder(path, options.out)
    with says_how_to_go_on(), Interrupts() as interrupts, interrupts.deciding():
        try:
            _run(plan, mine, pool, folder, options)
        except BaseException:
            with suppress(Exception):  # the first error is the one to report
                _write(plan, rows, folder, options)
            raise
        records = _write(plan, rows, folder, options)
    return Studied(folder, _say(rows, records, mine, folder, options))


def _folder(path: Path, out: Path | None) -> Path:
    """The folder of the batch, with a copy of the sweep; refuses one that holds something else."""
    return study_folder(out or Path("runs") / f"batch-{slug(path.stem)}", SWEEP, path.read_bytes(), "batch")


def _share(trials: Sequence[Trial], shard: tuple[int, int] | None) -> list[Trial]:
    """Distinct trials of the shard: every n-th by key, which spreads expensive ones evenly."""
    distinct = {trial.key: trial for trial in trials}
    if shard is None:
        return list(distinct.values())
    number, of = shard
    return [distinct[key] for key in sorted(distinct)[number - 1 :: of]]


def _run(plan: Plan, trials: list[Trial], pool: Pool, folder: Path, options: BatchOptions) -> None:
    ledger = LEDGER if options.shard is None else "ledger-{}-of-{}.jsonl".format(*options.shard)
    keep = RunOptions(quiet=True, frames=plan.sweep.keep == "frames", pictures=plan.sweep.keep != "tables")
    limit = plan.sweep.time_limit
    run_shown(trials, folder, pool, limit=limit, quiet=options.quiet, ledger=ledger, options=keep)


def _stamp(part: "DataFrame") -> Stamp:
    """Fabrics, scales, directions and presets of the runs, and how many of them may be compared."""
    said = [", ".join(dict.fromkeys(map(str, part[name].dropna()))) for name in CHOICES if name in part]
    refused = int((part["status"] == "refused").sum())
    verdict = f"comparison refused in {refused} of {len(part)} runs" if refused else "no run refused by its gates"
    return Stamp(said, verdict, bad=refused > 0)


def _pool(options: BatchOptions) -> Pool:
    if options.dask is None:
        return LocalPool(options.workers, options.threads)
    from knittest.studies.trials.pool import DaskPool

    return DaskPool(options.dask, options.threads)


def _write(plan: Plan, rows: Sequence[Row], folder: Path, options: BatchOptions) -> Mapping[str, Record]:
    """Table, pictures and page of all that is known of the plan, whoever ran it; one process at a time."""
    with _alone(folder / ".results.lock"):
        records = read_ledgers(folder, lambda text: None)
        table = results_table(plan, rows, records)
        write_table(table, folder, options.parquet)
        tests = list(dict.fromkeys(table["test"]))
        for test in tests:
            name = "overview.png" if len(tests) == 1 else f"overview-{test}.png"
            part = table[table["test"] == test]
            title = f"{folder.name}: {test}, {len(part)} runs"
            with stamped(_stamp(part)):
                overview_picture(folder / name, part, plan.swept, title)
        write_if_possible(folder, write_sweep_page)
    return records


def _say(
    rows: Sequence[Row], records: Mapping[str, Record], mine: Sequence[Trial], folder: Path, options: BatchOptions
) -> int:
    """Say how it ended on standard output; the exit code is 3 when a run of this share has no good result."""
    counts = Counter(records[trial.key].status for trial in mine)
    counts["invalid"] += sum(row.trial is None for row in rows)
    if not options.quiet:
        for status, meaning in MEANING.items():
            if counts[status]:
                print(f"{counts[status]:6d} {status}: {meaning}")
        print(f"table, picture and page: {folder / 'results.csv'}, overview*.png, {FILE}")
    return 0 if counts["completed"] == counts.total() else NumericalError.exit_code


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Wait until no other process is in this block of the same ``path``."""
    try:
        with path.open("w") as stream:
            fcntl.flock(stream.fileno(), fcntl.LOCK_EX)
            yield
    except OSError as error:
        raise resource_error(path, error) from error
