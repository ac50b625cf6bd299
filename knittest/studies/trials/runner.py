"""Lists of trials, run as far as the ledger has not finished them, and the folder in which a study goes on."""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

from knittest.base.errors import InputError
from knittest.base.files import make_folder, resource_error, write_atomic
from knittest.base.interrupts import Interrupted, Interrupts
from knittest.base.progress import tell as say
from knittest.runs.options import RunOptions
from knittest.studies.trials.live import Overview
from knittest.studies.trials.pool import Pool, Watch
from knittest.studies.trials.trial import Ledger, Record, Trial, read_ledgers, recovered

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


class Studied(NamedTuple):
    """Folder of a study that went to its end, and the exit code of its command."""

    folder: Path
    exit_code: int


def study_folder(folder: Path, marker: str, content: bytes | str, what: str) -> Path:
    """Make ``folder`` that of a study, with the file ``marker`` that says what it is; returns it.

    Raises :class:`InputError` where it is a file or holds something else than ``what``, :class:`ResourceError` where
    it cannot be written.
    """
    if os.path.lexists(folder) and not folder.is_dir():
        raise InputError(f"--out {folder}: is a file, expected a folder")
    make_folder(folder)
    try:
        names = [entry.name for entry in folder.iterdir() if not entry.name.startswith(".")]
    except OSError as error:
        raise resource_error(folder, error) from error
    if names and marker not in names:
        raise InputError(f"--out {folder}: holds {names[0]}, but no {what}: choose a new folder")
    write_atomic(folder / marker, content)
    return folder


@contextmanager
def says_how_to_go_on() -> Iterator[None]:
    """Let an interruption say that the same command goes on."""
    try:
        yield
    except Interrupted as error:
        raise Interrupted(f"{error}; what is finished is kept: go on with the same command") from None
