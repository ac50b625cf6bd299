"""Finds the run folders that a user means: run folders themselves, or folders that hold some."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from knittest.base.errors import InputError
from knittest.base.files import size_on_disk
from knittest.base.result_rows import result_rows
from knittest.config.yaml_loader import parse_document
from knittest.export.lock import is_locked
from knittest.report_page.files import Manifest, Reader, Summary

#: a folder with one of these is a run folder
MARKS = ("manifest.json", "summary.json")
#: how deep below a named folder runs are looked for: a sweep, its trials, their directions
DEPTH = 3
#: runs on one page
MOST = 24
#: what tells the folder of a study of many runs, such as a sweep
LEDGERS = "ledger*.jsonl"
#: characters of a message in a list
SHORT = 60
STUDY, RUNNING = "study", "running"
HEADER = ("run", "test", "fabric", "scale", "result", "MB", "passed", "date")


@dataclass(frozen=True)
class Found:
    """A run folder; ``named`` by the user, or found in a folder that was."""

    path: Path
    named: bool


def command_folder(run: Path) -> Path:
    """Folder of the command that ``run`` is one of several runs of, else ``run`` itself."""
    return run.parent if (run.parent / f"config-{run.name}.yaml").is_file() else run


def find_runs(paths: list[Path]) -> tuple[list[Found], list[str]]:
    """Run folders in the order given, each once, and notes on runs that were planned but have no folder.

    What lies in a run folder means that run, and a file beside runs that are named nothing, as a pattern of the shell
    names them too. Raises :class:`InputError` for any other path that is none and holds none, and for more than
    :data:`MOST` runs.
    """
    found: dict[Path, Found] = {}
    notes: list[str] = []
    whole = list(dict.fromkeys(_whole(path) for path in paths))
    for path in whole:
        if not path.exists():
            raise InputError(f"{path}: no such folder")
        if path.is_file() and any(one.is_dir() and one.resolve().parent == path.resolve().parent for one in whole):
            continue
        if not path.is_dir():
            raise InputError(f"{path}: is a file, expected a run folder{_of_curves(path)}")
        runs = _below(path, DEPTH)
        if not runs:
            raise InputError(f"{path}: not a run folder (it has no manifest.json), and holds none{_of_curves(path)}")
        for run in runs:
            found.setdefault(run.resolve(), Found(run, named=run == path))
        notes += _not_started(path)
    if len(found) > MOST:
        raise InputError(f"{len(found)} runs: expected at most {MOST} on a page; name fewer of them")
    return list(found.values()), notes


def _whole(path: Path) -> Path:
    """The run folder that ``path`` lies in, else ``path``."""
    inside = (parent for parent in path.parents if any((parent / mark).is_file() for mark in MARKS))
    return path if _below(path, 0) else next(inside, path)


def _of_curves(path: Path) -> str:
    """Hint on where curves belong, if there are any in ``path``."""
    curves = path.suffix == ".csv" or (path.is_dir() and any(path.glob("*.csv")))
    return "; measured curves go beside a run with knittest compare RUN --against FILE" if curves else ""


def _below(folder: Path, depth: int) -> list[Path]:
    """``folder`` if it is a run folder, else those in it."""
    if any((folder / mark).is_file() for mark in MARKS):
        return [folder]
    if depth == 0:
        return []
    try:
        inner = sorted(p for p in folder.iterdir() if p.is_dir() and not p.is_symlink() and not p.name.startswith("."))
    except OSError as error:
        raise InputError(f"{folder}: cannot be read: {error.strerror}") from None
    return [run for path in inner for run in _below(path, depth - 1)]


def _not_started(parent: Path) -> list[str]:
    """Directions that ``config-DIRECTION.yaml`` of a folder of both plans, without a folder yet."""
    planned = [plan.stem.removeprefix("config-") for plan in sorted(parent.glob("config-*.yaml"))]
    return [f"{parent.name}: {name} was planned but has no run yet" for name in planned if not _below(parent / name, 0)]


@dataclass(frozen=True)
class Listed:
    """A run folder in a list, or the folder of a study with all its runs; ``bytes`` is its size on the disk."""

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
    def removable(self) -> bool:
        """Tell whether it is a run folder that no process uses."""
        return self.test != STUDY and self.passed != RUNNING

    def row(self, folder: Path) -> tuple[str, ...]:
        """Cells in the order of :data:`HEADER`, the path as seen from ``folder``."""
        name = str(self.path.relative_to(folder) if self.path.is_relative_to(folder) else self.path)
        size, date = f"{self.bytes / 1e6:.1f}", self.date.strftime("%Y-%m-%d %H:%M")
        return name, self.test, self.fabric, self.scale, self.result, size, self.passed, date


def list_runs(paths: Sequence[Path]) -> list[Listed]:
    """Run folders, and folders of studies, in ``paths``, the oldest first; raises :class:`InputError` without any."""
    found: dict[Path, Path] = {}
    for path in paths:
        if not path.is_dir() or (path.is_symlink() and any((path / mark).is_file() for mark in MARKS)):
            raise InputError(f"{path}: {'is a link' if path.is_symlink() else 'no such folder'}")
        below = _listed_below(path, DEPTH)
        if not below and len(paths) > 1:
            raise InputError(f"{path}: not a run folder, and holds none")
        for one in below:
            found.setdefault(one.resolve(), one)
    return sorted(map(_listed, found.values()), key=lambda one: one.date)


def _listed_below(folder: Path, depth: int) -> list[Path]:
    if _is_study(folder):
        return [folder]
    if depth == 0 or any((folder / mark).is_file() for mark in MARKS):
        return _below(folder, 0)
    inner = sorted(p for p in folder.iterdir() if p.is_dir() and not p.is_symlink() and not p.name.startswith("."))
    return [one for path in inner for one in _listed_below(path, depth - 1)]


def _is_study(folder: Path) -> bool:
    return any(folder.glob(LEDGERS)) and not any((folder / mark).is_file() for mark in MARKS)


def _listed(path: Path) -> Listed:
    date, size = datetime.fromtimestamp(path.stat().st_mtime).astimezone(), size_on_disk(path)
    if _is_study(path):
        return Listed(path, STUDY, "", "", f"{len(_below(path, DEPTH))} runs", size, "", False, date)
    reader = Reader(path)
    manifest, summary = reader.model("manifest.json", Manifest), Summary()
    if manifest.status == "completed":
        summary = reader.model("summary.json", Summary)
    test, fabric, scale = summary.rig, summary.variant, summary.scale
    if not test:
        test, fabric, scale = _planned(path)
    with suppress(TypeError, ValueError):
        date = datetime.fromisoformat(manifest.ended or manifest.started or "")
    rows = result_rows(summary.plain(), refused=True) if summary.results else []
    result = next((f"{row.label}: {row.simulated}" for row in rows), "")
    failed = manifest.status == "failed" or (manifest.status == "completed" and manifest.exit_code != 0)
    return Listed(path, test, fabric, scale, result, size, _passed(path, manifest), failed, date)


def _planned(path: Path) -> Iterator[str]:
    """Test, fabric and scale that config.yaml states."""
    fields: dict[str, object] = {}
    with suppress(OSError, InputError, UnicodeDecodeError):
        fields = parse_document((path / "config.yaml").read_text(encoding="utf-8"), "config.yaml").data
    for group, *names in (("rig", "kind"), ("fabric", "experiment_variant", "name"), ("model", "scale")):
        inner = fields.get(group)
        yield next((str(inner[n]) for n in names if inner.get(n)), "") if isinstance(inner, dict) else ""


def _passed(path: Path, manifest: Manifest) -> str:
    """Say whether the run passed its quality checks, or how it ended."""
    if manifest.status == "running":
        return RUNNING if is_locked(path) else "killed"
    if manifest.status == "completed" and manifest.exit_code == 0:
        return "yes"
    how = "no" if manifest.status == "completed" else manifest.status or "unknown"
    why = manifest.message.removeprefix("comparison refused: ").partition("; ")[0]
    return f"{how}: {why if len(why) <= SHORT else why[:SHORT] + ' ...'}" if why else how
