"""Finds run folders, and folders with run folders in them."""

import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from knittest.base.errors import InputError
from knittest.base.files import size_on_disk
from knittest.base.result_rows import result_rows
from knittest.config.aliases import OldNameWarning
from knittest.config.yaml_loader import parse_document
from knittest.export.lock import is_locked
from knittest.report_page.files import Manifest, Reader, Summary

#: a folder with one of these is a run folder
MARKS = ("manifest.json", "summary.json")
#: depth of the search for runs below a named folder: a sweep, its trials, their directions
DEPTH = 3
#: runs on one page
MOST_RUNS = 24
#: files of the folder of a study of many runs, such as a sweep
LEDGERS = "ledger*.jsonl"
#: characters of a message in a list
SHORT = 60
STUDY, RUNNING = "study", "running"
#: message of a run that fails a quality check; earlier versions wrote "comparison refused"
NOT_COMPARED = "not compared with the experiment"
HEADER = ("run", "test", "fabric", "scale", "result", "MB", "passed", "date")


@dataclass(frozen=True)
class FoundRun:
    """A run folder, ``named`` by the user or found in a named folder."""

    path: Path
    named: bool


def command_folder(run: Path) -> Path:
    """Folder of a command with several runs, of which ``run`` is one; else ``run`` itself."""
    return run.parent if (run.parent / f"config-{run.name}.yaml").is_file() else run


def find_runs(paths: list[Path]) -> tuple[list[FoundRun], list[str]]:
    """Run folders in the given order, each once, and notes on planned runs without a folder.

    A path inside a run folder means that run. A file next to other named runs is ignored, since a pattern of the shell
    names it too. Raises :class:`InputError` for any other path without runs, and for more than :data:`MOST` runs.
    """
    found: dict[Path, FoundRun] = {}
    notes: list[str] = []
    runs_or_files = list(dict.fromkeys(p if _is_run(p) else next(filter(_is_run, p.parents), p) for p in paths))
    for path in runs_or_files:
        if not path.exists():
            raise InputError(f"{path}: no such folder")
        if path.is_file() and any(p.is_dir() and p.resolve().parent == path.resolve().parent for p in runs_or_files):
            continue
        if not path.is_dir():
            raise InputError(f"{path}: is a file, expected a run folder{_curves_hint(path)}")
        runs = _runs_below(path, DEPTH)
        if not runs:
            raise InputError(f"{path}: not a run folder (it has no manifest.json), and holds none{_curves_hint(path)}")
        for run in runs:
            found.setdefault(run.resolve(), FoundRun(run, named=run == path))
        planned = [plan.stem.removeprefix("config-") for plan in sorted(path.glob("config-*.yaml"))]
        notes += [f"{path.name}: {name} is planned but has no run yet" for name in planned if not _is_run(path / name)]
    if len(found) > MOST_RUNS:
        raise InputError(f"{len(found)} runs: expected at most {MOST_RUNS} on a page; name fewer of them")
    return list(found.values()), notes


def _is_run(path: Path) -> bool:
    return any((path / mark).is_file() for mark in MARKS)


def _curves_hint(path: Path) -> str:
    """Hint on the comparison with measured curves, if ``path`` is or has some."""
    curves = path.suffix == ".csv" or (path.is_dir() and any(path.glob("*.csv")))
    return "; to compare a run with measured curves: knittest compare RUN --against FILE" if curves else ""


def _runs_below(folder: Path, depth: int) -> list[Path]:
    """``folder`` if it is a run folder, else the run folders in it."""
    if depth == 0 or _is_run(folder):
        return [folder] if _is_run(folder) else []
    return [run for path in _inner_folders(folder) for run in _runs_below(path, depth - 1)]


def _inner_folders(folder: Path) -> list[Path]:
    """Visible folders in ``folder``, without links; raises :class:`InputError`."""
    try:
        return sorted(p for p in folder.iterdir() if p.is_dir() and not p.is_symlink() and not p.name.startswith("."))
    except OSError as error:
        raise InputError(f"{folder}: cannot be read: {error.strerror}") from None


@dataclass(frozen=True)
class ListedFolder:
    """A run folder, or the folder of a study, in a list; ``bytes`` is its size on the disk."""

    path: Path
    test: str
    fabric: str
    scale: str
    result: str
    bytes: int
    passed: str
    failed: bool
    date: datetime

    @property
    def is_removable(self) -> bool:
        """Tell whether it is a run folder that no process uses."""
        return self.test != STUDY and self.passed != RUNNING

    def row(self, folder: Path) -> tuple[str, ...]:
        """Cells in the order of :data:`HEADER`, the path relative to ``folder``."""
        name = str(self.path.relative_to(folder) if self.path.is_relative_to(folder) else self.path)
        size, date = f"{self.bytes / 1e6:.1f}", self.date.strftime("%Y-%m-%d %H:%M")
        return name, self.test, self.fabric, self.scale, self.result, size, self.passed, date


def list_runs(paths: Sequence[Path]) -> list[ListedFolder]:
    """Run folders and folders of studies in ``paths``, the oldest first; raises :class:`InputError` without any."""
    found: dict[Path, Path] = {}
    for path in paths:
        if not path.is_dir() or (path.is_symlink() and _is_run(path)):
            raise InputError(f"{path}: {'is a link' if path.is_symlink() else 'no such folder'}")
        below = _folders_below(path, DEPTH)
        if not below and len(paths) > 1:
            raise InputError(f"{path}: not a run folder, and holds none")
        for one in below:
            found.setdefault(one.resolve(), one)
    return sorted(map(_list_folder, found.values()), key=lambda one: one.date)


def _folders_below(folder: Path, depth: int) -> list[Path]:
    if _is_study(folder):
        return [folder]
    if depth == 0 or _is_run(folder):
        return _runs_below(folder, 0)
    return [one for path in _inner_folders(folder) for one in _folders_below(path, depth - 1)]


def _is_study(folder: Path) -> bool:
    return any(folder.glob(LEDGERS)) and not _is_run(folder)


def _list_folder(path: Path) -> ListedFolder:
    date, size = datetime.fromtimestamp(path.stat().st_mtime).astimezone(), size_on_disk(path)
    if _is_study(path):
        return ListedFolder(path, STUDY, "", "", f"{len(_runs_below(path, DEPTH))} runs", size, "", False, date)
    reader = Reader(path)
    manifest, summary = reader.model("manifest.json", Manifest), Summary()
    if manifest.status == "completed":
        summary = reader.model("summary.json", Summary)
    test, fabric, scale = summary.rig, summary.variant, summary.scale
    if not test:
        test, fabric, scale = _planned_texts(path)
    with suppress(TypeError, ValueError):
        date = datetime.fromisoformat(manifest.ended or manifest.started or "")
    rows = result_rows(summary.plain(), refused=True) if summary.results else []
    result = next((f"{row.label}: {row.simulated}" for row in rows), "")
    failed = manifest.status == "failed" or (manifest.status == "completed" and manifest.exit_code != 0)
    return ListedFolder(path, test, fabric, scale, result, size, _passed_text(path, manifest), failed, date)


def _planned_texts(path: Path) -> Iterator[str]:
    fields: dict[str, object] = {}
    with suppress(OSError, InputError, UnicodeDecodeError), warnings.catch_warnings():
        warnings.simplefilter("ignore", OldNameWarning)  # an earlier version wrote them
        fields = parse_document((path / "config.yaml").read_text(encoding="utf-8"), "config.yaml").data
    for group, *names in (("rig", "kind"), ("fabric", "experiment_variant", "name"), ("model", "scale")):
        inner = fields.get(group)
        yield next((str(inner[n]) for n in names if inner.get(n)), "") if isinstance(inner, dict) else ""


def _passed_text(path: Path, manifest: Manifest) -> str:
    """``yes`` if the run passed its quality checks, else why not, or how it ended."""
    if manifest.status == "running":
        return RUNNING if is_locked(path) else "killed"
    if manifest.status == "completed" and manifest.exit_code == 0:
        return "yes"
    how = "no" if manifest.status == "completed" else manifest.status or "unknown"
    why = re.sub(rf"^({NOT_COMPARED}|comparison refused): ", "", manifest.message).partition("; ")[0]
    return f"{how}: {why if len(why) <= SHORT else why[:SHORT] + ' ...'}" if why else how
