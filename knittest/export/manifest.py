"""The manifest of a run folder: where the run comes from, how it began, went on and ended."""

import os
from collections.abc import Iterable, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

import knittest
from knittest.base.errors import KnittestError, OutOfTolerance
from knittest.base.hiding import host_name
from knittest.base.interrupts import INTERRUPTED, Interrupted
from knittest.base.summary import Status
from knittest.config.run import Run
from knittest.export import provenance


def first_manifest(
    run: Run, config_text: str, threads: int, data_files: Iterable[Path], cell: str | None
) -> dict[str, Any]:
    """The manifest of a run that begins; ``cell`` is the digest of its relaxed cell, None for shells."""
    return {
        "status": "running",
        "version": knittest.__version__,
        "git_commit": provenance.git_commit(),
        "config_sha256": provenance.sha256_text(config_text),
        "data_sha256": provenance.sha256_files(data_files),
        "cell_sha256": cell,
        "seed": run.variability.seed,
        "cpu": provenance.cpu_model(),
        "cores": provenance.cores(),
        "threads": threads,
        "libraries": provenance.library_versions(),
        "pid": os.getpid(),
        "host": host_name(),
        "started": now(),
        "ended": None,
        "exit_code": None,
        "message": "",
    }


def restarted_manifest(manifest: Mapping[str, Any], threads: int, notes: Mapping[str, Any]) -> dict[str, Any]:
    """``manifest`` of a run that goes on, with ``notes`` on from where and what was changed by force."""
    again = {"status": "running", "ended": None, "exit_code": None, "message": "", "threads": threads}
    here = {"pid": os.getpid(), "host": host_name()}
    return {**manifest, **again, **here, "resumed": [*manifest.get("resumed", []), {"time": now(), **notes}]}


def ending(error: BaseException | None) -> tuple[Status, int, str]:
    """Status, exit code and message for the exception that ended a run."""
    if error is None:
        return "completed", 0, ""
    if isinstance(error, OutOfTolerance):
        return "completed", error.exit_code, str(error)
    if isinstance(error, KnittestError):
        return "failed", error.exit_code, str(error)
    if isinstance(error, KeyboardInterrupt) or (isinstance(error, SystemExit) and error.code == INTERRUPTED):
        return "interrupted", INTERRUPTED, str(error) if isinstance(error, Interrupted) else "stopped by a signal"
    return "failed", 1, f"{type(error).__name__}: {error}"


def now() -> str:
    """Present time in ISO 8601, with its time zone."""
    return datetime.now().astimezone().isoformat(timespec="seconds")
