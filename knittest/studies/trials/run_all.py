"""Runs a list of trials with an overview: those that are finished from the ledger of the folder."""

from collections.abc import Sequence
from pathlib import Path

from knittest.base.interrupts import Interrupted, Interrupts
from knittest.studies.trials.live import Overview
from knittest.studies.trials.pool import Pool
from knittest.studies.trials.record import Record
from knittest.studies.trials.runner import TrialRunner
from knittest.studies.trials.trial import Trial


def run_all(trials: Sequence[Trial], folder: Path, pool: Pool, *, limit: float, quiet: bool) -> dict[str, Record]:
    """Records of ``trials`` by key, each run in ``folder`` in at most ``limit`` [s] unless it is finished there.

    Raises :class:`Interrupted`, saying how to go on.
    """
    by_key = {trial.key: trial for trial in trials}
    records: dict[str, Record] = {}
    try:
        with (
            Interrupts() as interrupts,
            interrupts.deciding(),
            Overview(len(by_key), quiet=quiet) as view,
            TrialRunner(folder, pool, limit=limit, watch=view.watch) as runner,
        ):
            known = runner.finished(trials)
            view.begin(len(known))
            for record in runner.run(trials):
                records[record.key] = record
                if record.key not in known:
                    view.ended(by_key[record.key], record)
    except Interrupted as error:
        raise Interrupted(f"{error}; what is finished is kept: go on with the same command") from None
    return records
