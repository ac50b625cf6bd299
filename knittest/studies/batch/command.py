"""Command ``knittest batch``: plan, run what is left, write table and picture."""

import fcntl
import shlex
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from knittest.base.atomic import resource_error
from knittest.base.errors import InputError, NumericalError
from knittest.base.interrupts import Interrupts
from knittest.base.stamp import Stamp, stamped
from knittest.config.yaml_loader import load_yaml
from knittest.export.names import slug
from knittest.report_page.page import FILE, write_if_possible
from knittest.runs.options import RunOptions
from knittest.studies.batch.page import SWEEP, write_sweep_page
from knittest.studies.batch.picture import CHOICES, overview_picture
from knittest.studies.batch.plan import Plan, Row, plan_of
from knittest.studies.batch.slurm import write_script
from knittest.studies.batch.table import check_parquet, results_table, write_table
from knittest.studies.trials.ledger import read_ledgers
from knittest.studies.trials.pool import LocalPool, Pool
from knittest.studies.trials.record import MEANING, Record
from knittest.studies.trials.run_all import run_shown
from knittest.studies.trials.runner import LEDGER
from knittest.studies.trials.study import Studied, says_how_to_go_on, study_folder
from knittest.studies.trials.trial import Trial

#: more runs than this are asked for
MANY = 10_000

if TYPE_CHECKING:
    from pandas import DataFrame


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
    from knittest.studies.trials.dask_pool import DaskPool

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
