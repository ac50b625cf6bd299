"""Runs trials that were never finished, and keeps what became of them."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

from knittest.base.notes import tell as say
from knittest.runs.options import RunOptions
from knittest.studies.trials.ledger import Ledger, read_ledgers
from knittest.studies.trials.pool import Pool, Watch
from knittest.studies.trials.record import Record, recovered
from knittest.studies.trials.trial import Trial

TRIALS, LEDGER = "trials", "ledger.jsonl"


def _unwatched(trial: Trial, share: float | None) -> None:
    pass


class TrialRunner:
    """Trials in ``folder``: a run folder ``trials/KEY`` each, and the ``ledger``; a context manager.

    Each trial runs once: what a ledger of the folder, or a completed run folder, knows is not run again, unless it
    timed out under a shorter limit, or crashed. Entering raises :class:`ResourceError` when another process writes
    the ledger.
    """

    def __init__(
        self,
        folder: Path,
        pool: Pool,
        *,
        limit: float,
        ledger: str = LEDGER,
        options: RunOptions | None = None,
        watch: Watch = _unwatched,
        tell: Callable[[str], None] = say,
    ) -> None:
        """``limit`` [s] of wall time is what a trial may take; ``options`` say what its run folder keeps."""
        self._folder, self._pool, self._limit, self._watch, self._tell = folder, pool, limit, watch, tell
        self._options = options or RunOptions(quiet=True, frames=False, pictures=False)
        self._name = ledger

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            stack.callback(self._pool.close)
            self._ledger = stack.enter_context(Ledger(self._folder / self._name))
            self._known = read_ledgers(self._folder, self._tell)
            (self._folder / TRIALS).mkdir(exist_ok=True)
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def place(self, trial: Trial) -> Path:
        """Run folder of ``trial``."""
        return self._folder / TRIALS / trial.key

    def finished(self, trials: Sequence[Trial]) -> dict[str, Record]:
        """Records, by key, of those ``trials`` that need not run again."""
        done: dict[str, Record] = {}
        for trial in trials:
            record = self._known.get(trial.key)
            if record is not None and record.settled_within(self._limit):
                done[trial.key] = record
            elif trial.key not in done and (found := recovered(trial.key, self.place(trial))) is not None:
                done[trial.key] = self._keep(found)
        return done

    def run(self, trials: Sequence[Trial]) -> Iterator[Record]:
        """One record for every key among ``trials``: at once where it is finished, else when it has run."""
        done = self.finished(trials)
        yield from done.values()
        left = {t.key: t for t in trials if t.key not in done}
        for record in self._pool.run(list(left.values()), self.place, self._limit, self._options, self._watch):
            yield self._keep(record)

    def _keep(self, record: Record) -> Record:
        self._ledger.add(record)
        self._known[record.key] = record
        return record
