"""Command ``knittest batch``: run a sweep, write table, pictures and page; or write a job array of Slurm."""

import math
import shlex
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from filelock import lock_descriptor

from knittest.base.errors import InputError, NumericalError
from knittest.base.figure import Stamp, use_stamp
from knittest.base.files import resource_error, write_atomic
from knittest.config.yaml_loader import load_yaml
from knittest.export.lock import slug
from knittest.report_page.page import FILE, write_if_possible
from knittest.runs.options import RunOptions
from knittest.studies.batch.page import PAGE, SWEEP, results_table, write_table
from knittest.studies.batch.picture import CHOICES, overview_picture
from knittest.studies.batch.plan import Plan, Row, plan_of
from knittest.studies.trials.page import TABLE
from knittest.studies.trials.pool import LocalPool, Pool
from knittest.studies.trials.runner import (
    LEDGER,
    StudyOptions,
    StudyResult,
    handle_signals,
    run_with_overview,
    study_folder,
)
from knittest.studies.trials.trial import MEANING, Record, Trial, read_ledgers

SCRIPT = "batch.slurm"
#: seconds of a share apart from its runs: start, kernels, table
UPDATE_INTERVAL = 300.0
#: seconds before the end of the job at which Slurm asks the runs to save checkpoints
WARNING_SECONDS = 120
#: larger sweeps need a confirmation
LARGE_SWEEP = 10_000
TEMPLATE = """#!/bin/bash
#SBATCH --job-name={name}
#SBATCH --array=1-{shares}
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task={cores}
#SBATCH --time={time}
#SBATCH --signal=B:TERM@{warned}
#SBATCH --output={log}
# {runs} runs in {shares} shares, at most {limit:g} s a run. Submit it again to resume: finished runs are not repeated.
set -eu
cd {here}
exec {command} --shard "${{SLURM_ARRAY_TASK_ID}}/{shares}"
"""


def write_script(sweep: Path, folder: Path, shares: int, runs: int, limit: float, each: tuple[int, int]) -> Path:
    """Write a job array of ``shares``, ``each`` of processes and threads; raises :class:`InputError` for too many."""
    if shares > runs:
        raise InputError(f"--slurm {shares}: {sweep} has only {runs} runs; expected at most {runs} shares")
    workers, threads = each
    command = [
        str(Path(sys.executable).with_name("knittest")), "batch", str(sweep.resolve()), "--out", str(folder.resolve()),
        "--workers", str(workers), "--threads", str(threads), "--quiet", "--yes",
    ]  # fmt: skip
    time = math.ceil(math.ceil(math.ceil(runs / shares) / workers) * limit + UPDATE_INTERVAL)
    text = TEMPLATE.format(
        name=folder.name, shares=shares, runs=runs, limit=limit, cores=workers * threads, warned=WARNING_SECONDS,
        time=f"{time // 3600}:{time // 60 % 60:02d}:{time % 60:02d}", log=folder.resolve() / "slurm-%a.log",
        here=shlex.quote(str(Path.cwd())), command=shlex.join(command),
    )  # fmt: skip
    path = folder / SCRIPT
    write_atomic(path, text)
    return path


@dataclass(frozen=True, kw_only=True)
class BatchOptions(StudyOptions):
    """Options of a batch: ``shard`` (i, n) runs the i-th of n shares, from 1; ``slurm`` n writes a script for n shares
    instead of running any.
    """

    dask: str | None = None
    shard: tuple[int, int] | None = None
    slurm: int | None = None
    parquet: bool = False


def run_batch(path: Path, options: BatchOptions, agree: Callable[[str], bool]) -> StudyResult:
    """Run or resume the sweep in ``path``, a large one if ``agree`` confirms; raises :class:`InputError` first."""
    if options.parquet and find_spec("pyarrow") is None:
        raise InputError("--parquet: pyarrow is not installed: pip install 'knittest[parquet]'")
    plan = plan_of(load_yaml(path), options.accept_limits)
    if plan.count > LARGE_SWEEP and not agree(f"{path}: {plan.count:,} runs, more than {LARGE_SWEEP:,}"):
        raise InputError(
            f"{path}: {plan.count:,} runs, more than {LARGE_SWEEP:,}: confirm with --yes or reduce the sweep"
        )
    rows, limit = plan.rows(), plan.sweep.time_limit
    distinct = {row.trial.key: row.trial for row in rows if row.trial}
    mine = list(distinct.values())
    if options.shard is not None:  # every n-th by key, which spreads long runs evenly
        number, of = options.shard
        mine = [distinct[key] for key in sorted(distinct)[number - 1 :: of]]
    pool = None if options.slurm is not None else _pool(options)
    out = options.out or Path("runs") / f"batch-{slug(path.stem)}"
    folder = study_folder(out, SWEEP, path.read_bytes(), "batch")
    if pool is None:
        each = (options.workers or 1, options.threads or 1)
        script = write_script(path, folder, options.slurm or 1, len(mine), limit, each)
        print(shlex.join(["sbatch", str(script)]))
        return StudyResult(folder, 0)
    ledger = LEDGER if options.shard is None else "ledger-{}-of-{}.jsonl".format(*options.shard)
    keep = RunOptions(quiet=True, frames=plan.sweep.keep == "frames", pictures=plan.sweep.keep != "tables")
    with handle_signals(lambda: _write(plan, rows, folder, options)):
        run_with_overview(mine, folder, pool, limit=limit, quiet=options.quiet, ledger=ledger, options=keep)
        records = _write(plan, rows, folder, options)
    return StudyResult(folder, _report(rows, records, mine, folder, options))


def _pool(options: BatchOptions) -> Pool:
    if options.dask is None:
        return LocalPool(options.workers, options.threads)
    from knittest.studies.trials.pool import DaskPool

    return DaskPool(options.dask, options.threads)


def _write(plan: Plan, rows: Sequence[Row], folder: Path, options: BatchOptions) -> Mapping[str, Record]:
    """Write table, pictures and page of all known runs, of any process; one process at a time."""
    with _hold_lock(folder / ".results.lock"):
        records = read_ledgers(folder, lambda text: None)
        table = results_table(plan, rows, records)
        write_table(table, folder, options.parquet)
        tests = list(dict.fromkeys(table["test"]))
        for test in tests:
            part = table[table["test"] == test]
            facts = [", ".join(dict.fromkeys(map(str, part[name].dropna()))) for name in CHOICES if name in part]
            bad = int((part["status"] == "refused").sum())
            verdict = f"{bad} of {len(part)} runs failed a quality check" if bad else "no run failed a quality check"
            name = "overview.png" if len(tests) == 1 else f"overview-{test}.png"
            with use_stamp(Stamp(facts, verdict, bad=bad > 0)):
                overview_picture(folder / name, part, plan.swept_fields, f"{folder.name}: {test}, {len(part)} runs")
        write_if_possible(folder, PAGE.write)
    return records


def _report(
    rows: Sequence[Row], records: Mapping[str, Record], mine: Sequence[Trial], folder: Path, options: BatchOptions
) -> int:
    """Print the number of runs by status; the exit code is 3 when a run of this share has no valid result."""
    counts = Counter(records[trial.key].status for trial in mine)
    counts["invalid"] += sum(row.trial is None for row in rows)
    if not options.quiet:
        for status, meaning in MEANING.items():
            if counts[status]:
                print(f"{counts[status]:6d} {status}: {meaning}")
        print(f"table, pictures and page: {folder / TABLE}, overview*.png, {FILE}")
    return 0 if counts["completed"] == counts.total() else NumericalError.exit_code


@contextmanager
def _hold_lock(path: Path) -> Iterator[None]:
    """Wait until no other process holds the lock file ``path``, and hold it in the block."""
    try:
        with path.open("w") as stream:
            lock_descriptor(stream.fileno())
            yield
    except OSError as error:
        raise resource_error(path, error) from error
