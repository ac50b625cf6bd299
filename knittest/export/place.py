"""The folder that a run is written to: a new one, or that of a dead run, emptied; never one with others' files."""

import fnmatch
import json
import os
import re
import shutil
from pathlib import Path

from knittest.base.atomic import make_folder, resource_error
from knittest.base.errors import InputError, ResourceError
from knittest.export.lock import LOCK_NAME, RunLock, is_locked
from knittest.export.names import ADDED, CHECKPOINTS, OWN, files_of_incomplete_runs, results_of_runs, tables_of_runs


def fresh_folder(path: Path) -> Path:
    """Make ``path``, or ``path-2``, ``path-3``... when runs of the same second got there first."""
    make_folder(path.parent)
    try:
        candidate, number = path, 1
        while True:
            try:
                candidate.mkdir()
                return candidate
            except FileExistsError:
                number += 1
                candidate = path.with_name(f"{path.name}-{number}")
    except OSError as error:
        raise resource_error(path, error) from error


def chosen_folder(path: Path) -> Path:
    """Make the folder the user chose, or check that it is empty, a dead run's, or one's that its input stopped."""
    if os.path.lexists(path) and not path.is_dir():
        raise InputError(f"--out {path}: is a file, expected a new or empty folder")
    make_folder(path)
    try:
        names = [file.name for file in path.iterdir()]
    except OSError as error:
        raise resource_error(path, error) from error
    if names and LOCK_NAME not in names and not of_bad_input(path):
        resumable = "config.yaml" in names and any(name.startswith("checkpoint-") for name in names)
        instead = f"continue the run in it with: knittest resume {path}, or " if resumable else ""
        raise InputError(
            f"--out {path}: not empty; {instead}choose a new folder, or remove this one if it is not needed"
        )
    return path


def clear_dead_run(path: Path, lock: RunLock) -> None:
    """Remove the files of a run that is dead or had a bad input; refuse when there are others among them."""
    names = {file.name for file in path.iterdir()} - {LOCK_NAME}
    if not names:
        return
    if _completed(path):  # and killed before its lock was removed
        raise InputError(f"--out {path}: holds a completed run; choose a new folder, or remove this one")
    leftover = [name for name in names if re.fullmatch(r"\..*\.tmp(\.\w+)?", name)]
    useless = fnmatch.filter(names, CHECKPOINTS) if of_bad_input(path) else []  # of another input
    strange = sorted(names - {*OWN, *results_of_runs(), *tables_of_runs()} - {"frames", *leftover, *useless})
    if strange:
        raise InputError(
            f"--out {path}: left by {lock.stale_owner or 'a run'}, which is no longer running, and holds {strange[0]}; "
            "choose a new folder, or remove this one if it is not needed"
        )
    try:
        for file in [*(path / name for name in names - {"frames"}), *(path / "frames").glob("frame-*.vtu")]:
            file.unlink()
    except OSError as error:
        raise resource_error(path, error) from error


def remove_run(path: Path) -> None:
    """Remove the run folder ``path`` and what plans it; links in it go, what they lead to stays.

    Raises :class:`InputError` for a link, for what is no run folder and for one with files that knittest did not write,
    :class:`ResourceError` while a process uses it. Then nothing is removed.
    """
    manifest = _manifest(path)
    if path.is_symlink() or not {"status", "config_sha256"} <= manifest.keys():
        raise InputError(f"{path}: not a run folder, not removed")
    path = path.resolve()
    if is_locked(path):
        raise ResourceError(f"{path}: a process uses it: not removed")
    lock = RunLock(path)
    try:
        if strange := sorted(file.name for file in path.iterdir() if not _is_of_run(file)):
            raise InputError(
                f"{path}: holds {strange[0]}, which is not a file of a run: not removed; move it to another place"
            )
        for file in sorted(path.iterdir(), key=lambda file: file.name == "manifest.json"):  # last: until then it is one
            if file.is_dir() and not file.is_symlink():
                shutil.rmtree(file)
            else:
                file.unlink()
        path.rmdir()
    except OSError as error:
        raise resource_error(path, error) from error
    finally:
        lock.release()
    plan = path.parent / f"config-{path.name}.yaml"
    if plan.is_file():
        plan.unlink()
        if {file.name for file in path.parent.iterdir()} <= {"report.html"}:
            shutil.rmtree(path.parent)


def _is_of_run(file: Path) -> bool:
    """Tell whether ``file`` of a run folder has the name of one that a command writes there."""
    names = {*OWN, *results_of_runs(), *tables_of_runs(), *files_of_incomplete_runs()}
    if file.name == "frames" and not file.is_symlink():
        return all(inner.suffix == ".vtu" for inner in file.iterdir())
    printed = file.suffix in (".svg", ".pdf") and file.with_suffix(".png").name in names
    return printed or file.name in names or any(fnmatch.fnmatch(file.name, pattern) for pattern in ADDED)


def _completed(path: Path) -> bool:
    return _ended(path)[0] == "completed"


def of_bad_input(path: Path) -> bool:
    """Tell whether a run ended in ``path`` because of its input, which its next start has corrected."""
    return _ended(path) == ("failed", InputError.exit_code)


def _ended(path: Path) -> tuple[object, object]:
    """Status and exit code that the manifest in ``path`` states; nothing where there is none."""
    manifest = _manifest(path)
    return manifest.get("status"), manifest.get("exit_code")


def _manifest(path: Path) -> dict[str, object]:
    """The manifest in ``path``, empty where there is none."""
    try:
        manifest = json.loads((path / "manifest.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return manifest if isinstance(manifest, dict) else {}
