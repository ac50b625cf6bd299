"""Finds the run folders that a user means: run folders themselves, or folders that hold some."""

from dataclasses import dataclass
from pathlib import Path

from knittest.base.errors import InputError

#: a folder with one of these is a run folder
MARKS = ("manifest.json", "summary.json")
#: how deep below a named folder runs are looked for: a sweep, its trials, their directions
DEPTH = 3
#: runs on one page
MOST = 24


@dataclass(frozen=True)
class Found:
    """A run folder; ``named`` by the user, or found in a folder that was."""

    path: Path
    named: bool


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
