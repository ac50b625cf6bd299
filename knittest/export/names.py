"""Names of a run's folder and of the files in it."""

import re
import unicodedata
from datetime import datetime

from knittest.base.kinds import listed
from knittest.config.run import Run
from knittest.export.lock import LOCK_NAME

# What only a completed run may show; a failed one keeps its tables under a name that says so. Tests add their own.
_RESULTS = ("summary.json", "comparison.json", "report.html", "view.html")
_TABLES = ("curve.csv", "energies.csv", "contacts.csv", "yarns.csv")
CHECKPOINTS = "checkpoint-*.npz"
#: files of every run besides
OWN = ("manifest.json", "config.yaml", "log.jsonl", "frames.pvd", LOCK_NAME)

#: patterns of what commands add to a finished run, and of what a run holds on its way
ADDED = ("compare.*", "film.*", "report-*", "tables.xlsx", "verify", "frames", CHECKPOINTS, ".*.tmp*")


def results_of_runs() -> tuple[str, ...]:
    """Names of the files that only a completed run of any test may show."""
    return tuple(dict.fromkeys((*_RESULTS, *listed("pictures"))))


def tables_of_runs() -> tuple[str, ...]:
    """Names of the tables of runs of all tests."""
    return tuple(dict.fromkeys((*_TABLES, *listed("tables"))))


def incomplete(name: str) -> str:
    """Name of the file ``name``, a table or a picture, of a run that did not complete."""
    stem, _, ending = name.rpartition(".")
    return f"{stem}.incomplete.{ending}"


def files_of_incomplete_runs() -> tuple[str, ...]:
    """Names of the tables and pictures that a run left that did not complete."""
    return tuple(incomplete(name) for name in (*tables_of_runs(), *listed("pictures")))


def run_name(run: Run, *, direction: str | None = None, at: datetime | None = None) -> str:
    """``<rig>-<variant>-<scale>-<direction>-<time>``, safe as a file name; ``direction`` replaces the rig's own."""
    moment = (at or datetime.now()).strftime("%Y%m%d-%H%M%S")
    parts = (run.rig.kind, run.fabric.name, run.model.scale, direction or run.direction, moment)
    return "-".join(slug(part) for part in parts if part)


def slug(text: str) -> str:
    """``text`` as letters, digits, dot, dash and underscore, never hidden, never empty, 60 characters at most."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9._-]+", "-", plain).strip("-.")[:60] or "unnamed"
