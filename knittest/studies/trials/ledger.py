"""The ledger: one line a finished trial, which no crash can take back or damage unseen."""

import fcntl
import hashlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from knittest.base.atomic import resource_error
from knittest.base.errors import ResourceError
from knittest.export.jsonfile import json_ready
from knittest.studies.trials.record import Record

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
