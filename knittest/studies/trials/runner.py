"""Runs of a list of trials that no ledger has finished, and the folder in which a study is resumed."""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Self

from knittest.base.errors import InputError
from knittest.base.files import make_folder, resource_error, write_atomic
from knittest.base.interrupts import Interrupted, Interrupts
from knittest.base.progress import tell as say
from knittest.runs.options import RunOptions
from knittest.studies.trials.overview import Overview
from knittest.studies.trials.pool import Pool, Watch
from knittest.studies.trials.trial import Ledger, Record, Trial, read_ledgers, recover_record

TRIALS, LEDGER = "trials", "ledger.jsonl"
#: remedy after an interruption
RESUME_HINT = "finished runs are kept; run the same command again to resume"


class TrialRunner:
    """Runner of trials in ``folder``: a run folder ``trials/KEY`` each, and the ``ledger``; a context manager.

    Each trial runs once. A run that a ledger or a completed run folder has is not repeated, unless it crashed or timed
    out under a shorter limit. Entering raises :class:`ResourceError` if another process writes the ledger.
    """

    def __init__(
        self, folder: Path, pool: Pool, *, limit: float, ledger: str = LEDGER, options: RunOptions | None = None,
        watch: Watch = lambda *_: None, tell: Callable[[str], None] = say,
    ) -> None:  # fmt: skip
        """``limit`` [s] is the wall time of a trial; ``options`` say which files its run folder keeps."""
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

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def place(self, trial: Trial) -> Path:
        """Run folder of ``trial``."""
        return self._folder / TRIALS / trial.key

    def finished_records(self, trials: Sequence[Trial]) -> dict[str, Record]:
        """Records, by key, of those ``trials`` that need not run again."""
        done: dict[str, Record] = {}
        for trial in trials:
            record = self._known.get(trial.key)
            if record is not None and record.settled_within(self._limit):
                done[trial.key] = record
            elif trial.key not in done and (found := recover_record(trial.key, self.place(trial))) is not None:
                done[trial.key] = self._keep(found)
        return done

    def run(self, trials: Sequence[Trial]) -> Iterator[Record]:
        """Yield one record for every key among ``trials``: finished ones at once, the others as they end."""
        done = self.finished_records(trials)
        yield from done.values()
        left = {t.key: t for t in trials if t.key not in done}
        for record in self._pool.run(list(left.values()), self.place, self._limit, self._options, self._watch):
            yield self._keep(record)

    def _keep(self, record: Record) -> Record:
        self._ledger.add(record)
        self._known[record.key] = record
        return record


def run_all(trials: Sequence[Trial], folder: Path, pool: Pool, *, limit: float, quiet: bool) -> dict[str, Record]:
    """Run ``trials`` as :func:`run_with_overview` does; an :class:`Interrupted` says how to resume."""
    with handle_signals():
        return run_with_overview(trials, folder, pool, limit=limit, quiet=quiet)


def run_with_overview(
    trials: Sequence[Trial], folder: Path, pool: Pool, *, limit: float, quiet: bool, ledger: str = LEDGER,
    options: RunOptions | None = None, check: Callable[[Record], None] | None = None,
) -> dict[str, Record]:  # fmt: skip
    """Run ``trials`` by a :class:`TrialRunner` with an overview; records by key. ``check`` may end it by an error."""
    by_key = {trial.key: trial for trial in trials}
    records: dict[str, Record] = {}
    with (
        Overview(len(by_key), quiet=quiet) as view,
        TrialRunner(folder, pool, limit=limit, ledger=ledger, options=options, watch=view.watch) as runner,
    ):
        known = runner.finished_records(trials)
        view.begin(len(known))
        for record in runner.run(trials):
            records[record.key] = record
            if check is not None:
                check(record)
            if record.key not in known:
                view.ended(by_key[record.key], record)
    return records


@dataclass(frozen=True, kw_only=True)
class StudyOptions:
    """Options that all studies have: the folder, parallel processes and the threads of each, and the output."""

    out: Path | None = None
    workers: int | None = None
    threads: int | None = None
    quiet: bool = False
    accept_limits: bool = False


class StudyResult(NamedTuple):
    """Folder of a finished study, and the exit code of its command."""

    folder: Path
    exit_code: int


def study_folder(folder: Path, marker: str, content: bytes | str, what: str) -> Path:
    """Make ``folder`` that of a study with the file ``marker``; raises as :func:`check_study_folder`. Returns it."""
    check_study_folder(folder, marker, what)
    make_folder(folder)
    write_atomic(folder / marker, content)
    return folder


def check_study_folder(folder: Path, marker: str, what: str) -> None:
    """Raise :class:`InputError` if ``folder`` is a file, or holds files but no ``marker`` of ``what``."""
    if os.path.lexists(folder) and not folder.is_dir():
        raise InputError(f"--out {folder}: is a file, expected a folder")
    try:
        names = [one.name for one in folder.iterdir() if not one.name.startswith(".")] if folder.exists() else []
    except OSError as error:
        raise resource_error(folder, error) from error
    if names and marker not in names:
        raise InputError(f"--out {folder}: holds {names[0]}, but no {what}: choose a new folder")


@contextmanager
def handle_signals(write_partial: Callable[[], object] | None = None) -> Iterator[None]:
    """Handle signals while a study runs; an :class:`Interrupted` says how to resume.

    ``write_partial`` writes the results so far when the study ends with an error.
    """
    try:
        with Interrupts() as interrupts, interrupts.translate_errors():
            try:
                yield
            except BaseException:
                if write_partial is not None:
                    with suppress(Exception):  # the first error is the one to report
                        write_partial()
                raise
    except Interrupted as error:
        raise Interrupted(f"{error}; {RESUME_HINT}") from None
