"""Trials: one run each, with a key of all that its result depends on; folder, record, and the ledger of records."""

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
from typing import Any, Literal, Self

from filelock import lock_descriptor

import knittest
from knittest.base.errors import InputError, ResourceError
from knittest.base.files import PACKAGE, resource_error
from knittest.base.interrupts import Interrupts
from knittest.base.kinds import kinds, package_digest
from knittest.base.machine import host_name
from knittest.base.result_rows import number_of, unfold_results
from knittest.base.summary import CostBlock, Summary, Value
from knittest.config.run import Run
from knittest.export.files import json_ready
from knittest.export.identity import FREE, data_files, sha256_files
from knittest.export.lock import RunLock
from knittest.export.summary import timestamp
from knittest.runs.opened_run import NewFolder, OpenedRun, RunPlace, StoppedRun

#: sources that show, schedule or evaluate runs; a change of any other source changes the key of every trial
SOURCES_NOT_IN_KEY = (
    "cli", "studies", "report_page", "base/progress.py", "runs/terminal_output.py", "laboratory/numerical_error.py",
)  # fmt: skip
KEY_DIGITS = 16


@dataclass(frozen=True)
class Trial:
    """A run with its ``label`` for the user and its ``key``, which names its folder.

    ``place``, if given, says how the folder is opened. With ``specimen`` the trial is one specimen of an ensemble, in
    the folder that the parent process has opened.
    """

    run: Run
    key: str
    label: str = ""
    specimen: int | None = None
    place: RunPlace | None = None


def trial_of(run: Run, label: str = "") -> Trial:
    """Make the trial of ``run`` with the present code and data; raises :class:`InputError` for unreadable data and for
    a run with ``output.verify``, because a trial is one run.
    """
    if run.output.verify:
        raise InputError("output.verify: a study does not estimate the numerical error of its runs; remove it")
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
    """Digest of the sources that a result depends on, as they were at the first call in this process."""
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE)
        if not any(name.is_relative_to(one) for one in SOURCES_NOT_IN_KEY):
            digest.update(name.as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:KEY_DIGITS]


Status = Literal["completed", "refused", "failed", "invalid", "error", "timeout", "crashed", "blocked"]

MEANING: dict[Status, str] = {
    "completed": "the run ended and passed all quality checks",
    "refused": "the run ended, but failed a quality check",
    "failed": "the computation failed",
    "invalid": "the input is invalid",
    "error": "error in the program",
    "timeout": "stopped at the time limit",
    "crashed": "the process of the run died",
    "blocked": "no disk space or memory, or the folder is in use",
}
#: status of a run that has no record yet
OPEN = "open"
#: a repeated run would end the same way
FINAL_STATUSES = ("completed", "refused", "failed", "invalid", "error")


@dataclass(frozen=True)
class Record:
    """Outcome of a trial: ``summary`` is its summary.json, None without a result; ``reason`` says why there is none.

    ``seconds`` is the wall time of the last attempt, ``limit`` its time limit [s], ``earlier`` the reasons why the
    attempts before it failed.
    """

    key: str
    status: Status
    reason: str = ""
    summary: Summary | None = None
    seconds: float = 0.0
    limit: float | None = None
    earlier: tuple[str, ...] = ()
    host: str = field(default_factory=host_name)
    ended: str = field(default_factory=timestamp)

    @property
    def values(self) -> dict[str, Value]:
        """Results of a completed trial; empty for any other."""
        if self.status != "completed" or self.summary is None:
            return {}
        return unfold_results(self.summary["results"])

    @property
    def results(self) -> dict[str, float]:
        """Numbers of a completed trial (means of an ensemble, NaN for null in JSON); empty for any other."""
        found = {name: number_of(value) for name, value in self.values.items()}
        return {name: math.nan if value is None else value for name, value in found.items()}

    @property
    def cost(self) -> CostBlock | None:
        """Cost of a run that has a result."""
        return self.summary.get("cost") if self.summary else None

    @property
    def relaxed_limits(self) -> list[str]:
        """Limits of quality checks that were looser than those of the preset, as ``name=value``."""
        return [f"{one['name']}={one['value']}" for one in (self.summary.get("limits", []) if self.summary else [])]

    @property
    def settled(self) -> bool:
        """Tell whether a repeated run would end the same way."""
        return self.status in FINAL_STATUSES

    def settled_within(self, limit: float) -> bool:
        """Tell whether a repeated run of ``limit`` seconds would end the same way; more time may help."""
        return self.settled or (self.status == "timeout" and limit <= (self.limit or 0.0))


def record_of(key: str, summary: Summary, seconds: float = 0.0) -> Record:
    """Record of a run that ended and wrote ``summary``."""
    if summary["refused"]:
        return Record(key, "refused", "; ".join(summary["refused"]), summary, seconds)
    return Record(key, "completed", "", summary, seconds)


def relaxed_limits_note(records: Iterable[Record]) -> list[str]:
    """One line on limits of ``records`` that were looser than those of the preset; none without such limits."""
    names = dict.fromkeys(name for record in records for name in record.relaxed_limits)
    return [f"limits looser than those of the preset, accepted by --accept-limits: {', '.join(names)}"] if names else []


def recover_record(key: str, folder: Path) -> Record | None:
    """Record of a run that completed in ``folder`` after its study had ended; None for any other folder."""
    try:
        manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        return record_of(key, summary) if manifest["status"] == "completed" else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


@dataclass(frozen=True)
class TrialFolder:
    """Folder of a trial: the run in it is resumed where this gives the same result, and started again elsewhere."""

    path: Path

    def open(self, run: Run, interrupts: Interrupts) -> OpenedRun:
        """Open the folder; raises :class:`ResourceError` if another process uses it or it cannot be written."""
        if (self.path / "config.yaml").is_file():
            with suppress(InputError):  # another processor or library, or a damaged manifest
                return StoppedRun(self.path).open(run, interrupts)
        if self.path.exists():
            lock = RunLock(self.path)
            try:
                for entry in self.path.iterdir():
                    if entry != lock.path:
                        shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
            except OSError as error:
                raise resource_error(self.path, error) from error
            finally:
                lock.release()
        return NewFolder(self.path).open(run, interrupts)


PATTERN = "ledger*.jsonl"
DIGEST = "sha256"
DIGITS = 16


class Ledger:
    """Append-only file ``path`` of records, locked for one process; raises :class:`ResourceError` if it is in use."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            # a file of its own, because Windows lets nobody read what is locked
            self._lock = path.with_name(f".{path.stem}.lock").open("w")
            try:
                if not lock_descriptor(self._lock.fileno(), blocking=False):
                    raise ResourceError(f"{path}: another process runs this study; wait until it ends")
                self._stream = path.open("ab+")
            except BaseException:
                self._lock.close()
                raise
        except OSError as error:
            raise resource_error(path, error) from error

    def add(self, record: Record) -> None:
        """Append one line and flush it to the disk; first ends a line that a crash cut short."""
        try:
            size = self._stream.seek(0, os.SEEK_END)
            self._stream.seek(max(size - 1, 0))
            torn = size > 0 and self._stream.read(1) != b"\n"
            data = json_ready(asdict(record) | {"summary": record.summary or {}})
            line = json.dumps({**data, DIGEST: _digest(data)}, allow_nan=False).encode() + b"\n"
            self._stream.write(b"\n" * torn + line)
            self._stream.flush()
            os.fsync(self._stream.fileno())
        except OSError as error:
            raise resource_error(self.path, error) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()
        self._lock.close()


def read_ledgers(folder: Path, tell: Callable[[str], None]) -> dict[str, Record]:
    """Last record of every key in all ledgers of ``folder``, or its settled one; ``tell`` hears of damaged lines."""
    records: dict[str, Record] = {}
    for path in sorted(folder.glob(PATTERN)):
        try:
            lines = path.read_bytes().splitlines()
        except OSError as error:
            raise ResourceError(f"{path}: cannot read: {error.strerror}") from error
        for number, line in enumerate(lines, 1):
            if not line.strip():
                continue
            if (record := _parse_record(line)) is None:
                tell(f"{path}:{number}: damaged line skipped; its run is read from its folder or repeated")
            elif record.settled or not ((known := records.get(record.key)) and known.settled):
                records[record.key] = record
    return records


def _parse_record(line: bytes) -> Record | None:
    try:
        data = json.loads(line)
        if data.pop(DIGEST) != _digest(data) or data["status"] not in MEANING or not isinstance(data["summary"], dict):
            return None
        return Record(**{**data, "summary": data["summary"] or None, "earlier": tuple(data["earlier"])})
    except (ValueError, TypeError, KeyError, AttributeError):
        return None


def _digest(data: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(data, sort_keys=True, allow_nan=False).encode()).hexdigest()[:DIGITS]
