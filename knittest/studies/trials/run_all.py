"""Runs a list of trials with an overview: those that are finished from the ledger of the folder."""

from collections.abc import Callable, Sequence
from pathlib import Path

from knittest.base.interrupts import Interrupted, Interrupts
from knittest.runs.options import RunOptions
from knittest.studies.trials.live import Overview
from knittest.studies.trials.pool import Pool
from knittest.studies.trials.record import Record
from knittest.studies.trials.runner import LEDGER, TrialRunner
from knittest.studies.trials.trial import Trial


def run_all(trials: Sequence[Trial], folder: Path, pool: Pool, *, limit: float, quiet: bool) -> dict[str, Record]:
    """Records of ``trials`` by key, each run in ``folder`` in at most ``limit`` [s] unless it is finished there.

    Raises :class:`Interrupted`, saying how to go on.
    """
    try:
        with Interrupts() as interrupts, interrupts.deciding():
            return run_shown(trials, folder, pool, limit=limit, quiet=quiet)
    except Interrupted as error:
        raise Interrupted(f"{error}; what is finished is kept: go on with the same command") from None


def run_shown(
    trials: Sequence[Trial],
    folder: Path,
    pool: Pool,
    *,
    limit: float,
    quiet: bool,
    ledger: str = LEDGER,
    options: RunOptions | None = None,
    check: Callable[[Record], None] | None = None,
) -> dict[str, Record]:
    """Run ``trials`` as :class:`TrialRunner` does, with an overview unless ``quiet``; records by key.

    ``check`` hears of every record as it comes, and ends the study by raising.
    """
    by_key = {trial.key: trial for trial in trials}
    records: dict[str, Record] = {}
    with (
        Overview(len(by_key), quiet=quiet) as view,
        TrialRunner(folder, pool, limit=limit, ledger=ledger, options=options, watch=view.watch) as runner,
    ):
        known = runner.finished(trials)
        view.begin(len(known))
        for record in runner.run(trials):
            records[record.key] = record
            if check is not None:
                check(record)
            if record.key not in known:
                view.ended(by_key[record.key], record)
    return records
