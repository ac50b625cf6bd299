"""A trial: one run, known by a key of all that its result depends on; its folder, its record, and the ledger of all of
them.
"""

import fcntl
import hashlib
import json
import math
import os
import shutil
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import knittest
from knittest.base.errors import InputError, ResourceError
from knittest.base.files import PACKAGE, resource_error
from knittest.base.interrupts import Interrupts
from knittest.base.kinds import kinds, package_digest
from knittest.base.machine import host_name
from knittest.base.result_rows import number_of, unfolded
from knittest.base.summary import CostBlock, Summary, Value
from knittest.config.run import Run
from knittest.export.files import json_ready
from knittest.export.identity import FREE, data_files, sha256_files
from knittest.export.lock import RunLock
from knittest.export.summary import now
from knittest.runs.opening import NewFolder, Opened, Place, StoppedRun

#: sources that show, schedule or judge runs; a change of any other one makes all trials new
AROUND = (
    "cli", "studies", "report_page", "base/progress.py", "runs/show.py", "laboratory/numerical_error.py",
)  # fmt: skip
KEY_DIGITS = 16


@dataclass(frozen=True)
class Trial:
    """A run to do; ``label`` names it to a user, ``key`` to the folder it is kept in, which is opened as ``place`` says
    if it says anything. Of an ensemble it may be one ``specimen`` only, in the folder that the process which started it
    has opened.
    """

    run: Run
    key: str
    label: str = ""
    specimen: int | None = None
    place: Place | None = None


def trial_of(run: Run, label: str = "") -> Trial:
    """The trial of ``run`` with the code and data that are here now.

    Raises :class:`InputError` for unreadable data, and for a run to be verified: a trial is one run.
    """
    if run.output.verify:
        raise InputError(
            "output.verify: the runs of a sweep, calibration or regression are not repeated for their numerical error; "
            "leave it out, and verify single runs of the test's own command with --verify"
        )
    config = run.model_dump(mode="json")
    for path in FREE:
        *holders, name = path.split(".")
        holder = config
        for part in holders:
            holder = holder[part]
        del holder[name]
    content = {
        "config": config,
        "version": knittest.__version__,
        "code": code_digest(),
        **package_digest(kinds()[run.rig.kind]),
        "data": sha256_files(data_files(run)),
    }
    text = json.dumps(content, sort_keys=True)
    return Trial(run, hashlib.sha256(text.encode()).hexdigest()[:KEY_DIGITS], label)


@cache
def code_digest() -> str:
    """Digest of the sources that a result depends on, as they were when this process first asked."""
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE)
        if not any(name.is_relative_to(one) for one in AROUND):
            digest.update(name.as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:KEY_DIGITS]


Status = Literal["completed", "refused", "failed", "invalid", "error", "timeout", "crashed", "blocked"]

MEANING: dict[Status, str] = {
    "completed": "ran, and its quality gates passed",
    "refused": "ran, but a quality gate refused its result",
    "failed": "numbers went wrong",
    "invalid": "the input is refused",
    "error": "an error of the program",
    "timeout": "stopped at the time limit",
    "crashed": "its process died",
    "blocked": "disk, memory or a folder in use",
}
#: status of a run that has no record yet
OPEN = "open"
#: the same again if tried again; all others are
SETTLED = ("completed", "refused", "failed", "invalid", "error")


@dataclass(frozen=True)
class Record:
    """Outcome of a trial: ``summary`` is its summary.json, None where it has no result; ``reason`` says why not.

    ``seconds`` is the wall time of the last attempt, ``limit`` its time limit [s], ``earlier`` the reasons why the
    attempts before it came to nothing.
    """

    key: str
    status: Status
    reason: str = ""
    summary: Summary | None = None
    seconds: float = 0.0
    limit: float | None = None
    earlier: tuple[str, ...] = ()
    host: str = field(default_factory=host_name)
    ended: str = field(default_factory=now)

    @property
    def values(self) -> dict[str, Value]:
        """Results of a completed trial; empty for any other."""
        if self.status != "completed" or self.summary is None:
            return {}
        return unfolded(self.summary["results"])

    @property
    def results(self) -> dict[str, float]:
        """Numbers of a completed trial, of an ensemble the means, NaN where JSON has none; empty for any other."""
        found = {name: number_of(value) for name, value in self.values.items()}
        return {name: math.nan if value is None else value for name, value in found.items()}

    @property
    def cost(self) -> CostBlock | None:
        """Cost of a run that has a result."""
        return self.summary.get("cost") if self.summary else None

    @property
    def looser_limits(self) -> list[str]:
        """Limits of its gates that were looser than the preset's, as ``name=value``."""
        return [f"{one['name']}={one['value']}" for one in (self.summary.get("limits", []) if self.summary else [])]

    @property
    def settled(self) -> bool:
        """Tell whether the trial would come to the same if run again."""
        return self.status in SETTLED

    def settled_within(self, limit: float) -> bool:
        """Tell whether it would come to the same with ``limit`` seconds: what timed out may need more."""
        return self.settled or (self.status == "timeout" and limit <= (self.limit or 0.0))

    def to_dict(self) -> dict[str, object]:
        """Record as plain data."""
        return asdict(self) | {"summary": self.summary or {}}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """The record of :meth:`to_dict`; raises ``TypeError`` or ``ValueError`` for anything else."""
        if data.get("status") not in MEANING or not isinstance(data.get("summary"), dict):
            raise ValueError("not a record")
        return cls(**{**data, "summary": data["summary"] or None, "earlier": tuple(data["earlier"])})


def record_of(key: str, summary: Summary, seconds: float = 0.0) -> Record:
    """The record of a run that went to its end and left ``summary``."""
    if summary["refused"]:
        return Record(key, "refused", "; ".join(summary["refused"]), summary, seconds)
    return Record(key, "completed", "", summary, seconds)


def looser_note(records: Iterable[Record]) -> list[str]:
    """A line if limits of ``records`` were looser than the preset's, none otherwise."""
    names = dict.fromkeys(name for record in records for name in record.looser_limits)
    return [f"limits looser than the preset's, accepted by --accept-limits: {', '.join(names)}"] if names else []


def recovered(key: str, folder: Path) -> Record | None:
    """The record of a run that completed in ``folder`` although nobody was left to write it down."""
    try:
        manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        return record_of(key, summary) if manifest["status"] == "completed" else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


@dataclass(frozen=True)
class TrialFolder:
    """The folder of a trial: gone on in where that leads to the same result, else begun anew."""

    path: Path

    def open(self, run: Run, interrupts: Interrupts) -> Opened:
        """Open it; raises :class:`ResourceError` when another process is in it, or when it cannot be written."""
        if (self.path / "config.yaml").is_file():
            with suppress(InputError):  # another processor, another library, a damaged manifest
                return StoppedRun(self.path).open(run, interrupts)
        if self.path.exists():
            _clear(self.path)
        return NewFolder(self.path).open(run, interrupts)


def _clear(path: Path) -> None:
    lock = RunLock(path)
    try:
        for entry in path.iterdir():
            if entry == lock.path:
                continue
            if entry.is_dir():
                shutil.rmtree(entry)
            else:
                entry.unlink()
    except OSError as error:
        raise resource_error(path, error) from error
    finally:
        lock.release()


PATTERN = "ledger*.jsonl"
DIGEST = "sha256"
DIGITS = 16


class Ledger:
    """The file ``path``, open and locked for one process, which appends to it; a context manager.

    Raises :class:`ResourceError` when another process writes it, or when it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = path.open("ab+")
        except OSError as error:
            raise resource_error(path, error) from error
        try:
            fcntl.flock(self._stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._stream.close()
            raise ResourceError(f"{path}: another process is at work here; wait for it to end") from None

    def add(self, record: Record) -> None:
        """Append one line and see it on the disk; a line that was torn by a crash is ended before."""
        try:
            size = self._stream.seek(0, os.SEEK_END)
            torn = size > 0 and os.pread(self._stream.fileno(), 1, size - 1) != b"\n"
            self._stream.write(b"\n" * torn + _line(record))
            self._stream.flush()
            os.fsync(self._stream.fileno())
        except OSError as error:
            raise resource_error(self.path, error) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stream.close()


def read_ledgers(folder: Path, tell: Callable[[str], None]) -> dict[str, Record]:
    """The last record of every key in all ledgers of ``folder``, but a settled one before any other.

    ``tell`` hears of damaged lines, which are left out.
    """
    records: dict[str, Record] = {}
    for path in sorted(folder.glob(PATTERN)):
        try:
            lines = path.read_bytes().splitlines()
        except OSError as error:
            raise ResourceError(f"{path}: cannot read: {error.strerror}") from error
        for number, line in enumerate(lines, 1):
            record = _record(line) if line.strip() else None
            if record is None and line.strip():
                tell(f"{path}:{number}: damaged line, not counted; its trial is looked up in its folder, or run again")
            elif record is not None and (record.settled or not _settled(records.get(record.key))):
                records[record.key] = record
    return records


def _settled(record: Record | None) -> bool:
    return record is not None and record.settled


def _line(record: Record) -> bytes:
    data = json_ready(record.to_dict())
    return json.dumps({**data, DIGEST: _digest(data)}, allow_nan=False).encode() + b"\n"


def _record(line: bytes) -> Record | None:
    try:
        data = json.loads(line)
        return Record.from_dict(data) if data.pop(DIGEST) == _digest(data) else None
    except (ValueError, TypeError, KeyError, AttributeError):
        return None


def _digest(data: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(data, sort_keys=True, allow_nan=False).encode()).hexdigest()[:DIGITS]
