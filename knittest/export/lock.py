"""Run folders: lock, names of folder and files, and checks of existing folders."""

import fnmatch
import json
import os
import re
import shutil
import unicodedata
from contextlib import suppress
from datetime import datetime
from itertools import chain, count
from pathlib import Path

from filelock import lock_descriptor

from knittest.base.errors import InputError, ResourceError
from knittest.base.files import data_dir, make_folder, resource_error
from knittest.base.kinds import list_part
from knittest.base.machine import host_name
from knittest.config.run import Run

LOCK_NAME = "run.lock"
# The owner's line starts behind the byte that Windows locks, because nobody else can read that byte there.
_START = 1
# Blanks after the owner's line keep some room on a full disk for the last manifest, see RunLock.give_room.
_PADDING = 65536


class RunLock:
    """An exclusive lock of a folder; ``stale_owner`` describes a dead process whose lock was taken over."""

    def __init__(self, folder: Path) -> None:
        """Take the lock of ``folder``; raise :class:`ResourceError` when a living run holds it."""
        self.path = folder / LOCK_NAME
        try:
            #: file descriptor that holds the lock, also in a process that inherits it
            self.descriptor = self._open()
        except OSError as error:
            raise resource_error(self.path, error) from error
        self.stale_owner = _describe_owner(_read_owner(self.descriptor))
        owner = " " * _START + json.dumps({"pid": os.getpid(), "host": host_name()}) + "\n"
        try:
            os.ftruncate(self.descriptor, _START)
            os.lseek(self.descriptor, 0, os.SEEK_SET)
            os.write(self.descriptor, owner.encode().ljust(_PADDING))
            os.fsync(self.descriptor)
        except OSError as error:
            self.release()
            raise resource_error(self.path, error) from error

    def _open(self) -> int:
        while True:
            handle = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o644)
            try:
                if not lock_descriptor(handle, blocking=False):
                    owner = _describe_owner(_read_owner(handle)) or "an unknown process"
                    raise ResourceError(
                        f"{self.path.parent}: in use by {owner}; wait until it and its child processes end, or choose "
                        "another folder with --out"
                    )
                # The owner before us may have removed the file between our open and our lock: then try again.
                with suppress(FileNotFoundError):
                    if os.path.samestat(os.fstat(handle), self.path.stat()):
                        return handle
            except (OSError, ResourceError):
                os.close(handle)
                raise
            os.close(handle)

    def give_room(self) -> None:
        """Hand the reserved blocks back to the disk, so that the last manifest finds room on a full one."""
        with suppress(OSError):
            os.ftruncate(self.descriptor, _START)
            os.fsync(self.descriptor)

    def release(self) -> None:
        """Remove the lock file and free the lock; harmless when called twice."""
        if self.descriptor < 0:
            return
        with suppress(OSError):
            self.path.unlink(missing_ok=True)
        os.close(self.descriptor)
        self.descriptor = -1
        if os.name == "nt":  # where no open file can be removed, this one neither if another process has it by now
            with suppress(OSError):
                self.path.unlink(missing_ok=True)


def is_locked(folder: Path) -> bool:
    """Return whether a process holds the lock of ``folder``."""
    for access in (os.O_RDWR, os.O_RDONLY):  # a network file system wants write access, another user has none
        try:
            handle = os.open(folder / LOCK_NAME, access | getattr(os, "O_NOFOLLOW", 0))
            break
        except OSError:
            continue
    else:
        return False
    try:
        return not lock_descriptor(handle, blocking=False)
    except OSError:
        return True
    finally:
        os.close(handle)


def _read_owner(descriptor: int) -> bytes:
    os.lseek(descriptor, _START, os.SEEK_SET)
    return os.read(descriptor, 4096)


def _describe_owner(content: bytes) -> str | None:
    """Return ``process 123 on host`` from the content of a lock; None if it is empty."""
    if not content.strip():
        return None
    try:
        owner = json.loads(content)
        where = f" on {owner['host']}" if owner["host"] else ""
        return f"process {int(owner['pid'])}{where}"
    except (ValueError, KeyError, TypeError):
        return "an unknown process"


#: subfolder for copied data
DATA_FOLDER = "data"


def copy_into_run(text: str, folder: Path, name: str) -> str:
    """Copy the file or the tables of the folder ``text`` to :data:`DATA_FOLDER` in ``folder``, unless it is shipped.

    Returns the path to use. Raises :class:`ResourceError`.
    """
    if not Path(text).is_absolute() and (data_dir() / text).exists():
        return text
    copy = folder / DATA_FOLDER / name
    try:
        copy.parent.mkdir(exist_ok=True)
        if Path(text).is_dir():
            copy.mkdir(exist_ok=True)
            for table in sorted(Path(text).glob("*.csv")):
                shutil.copyfile(table, copy / table.name)
        else:
            shutil.copyfile(text, copy)
    except OSError as error:
        raise resource_error(copy, error) from error
    return f"{DATA_FOLDER}/{name}"


# Files of completed runs only; a failed run keeps its tables as incomplete. Tests add their own.
_RESULTS = ("summary.json", "comparison.json", "report.html", "view.html")
_TABLES = ("curve.csv", "energies.csv", "contacts.csv", "yarns.csv")
CHECKPOINTS = "checkpoint-*.npz"
#: files of every run besides
OWN_FILES = ("manifest.json", "config.yaml", "log.jsonl", "frames.pvd", LOCK_NAME)

#: patterns of files that commands add to a finished run, and of files of a run in progress
ADDED = ("compare.*", "film.*", "report-*", "tables.xlsx", "verify", "frames", CHECKPOINTS, ".*.tmp*")


def results_of_runs() -> tuple[str, ...]:
    """Names of the files that only a completed run of any test may show."""
    return tuple(dict.fromkeys((*_RESULTS, *list_part("pictures"))))


def tables_of_runs() -> tuple[str, ...]:
    """Names of the tables of runs of all tests."""
    return tuple(dict.fromkeys((*_TABLES, *list_part("tables"))))


def incomplete_name(name: str) -> str:
    """Name of the file ``name``, a table or a picture, of a run that did not complete."""
    stem, _, ending = name.rpartition(".")
    return f"{stem}.incomplete.{ending}"


def files_of_incomplete_runs() -> tuple[str, ...]:
    """Names of the tables and pictures that a run left that did not complete."""
    return tuple(incomplete_name(name) for name in (*tables_of_runs(), *list_part("pictures")))


def run_name(run: Run, *, direction: str | None = None, at: datetime | None = None) -> str:
    """Name ``<rig>-<variant>-<scale>-<direction>-<time>``, safe as a file name; ``direction`` replaces the rig's."""
    moment = (at or datetime.now()).strftime("%Y%m%d-%H%M%S")
    parts = (run.rig.kind, run.fabric.name, run.model.scale, direction or run.direction, moment)
    return "-".join(slug(part) for part in parts if part)


def slug(text: str) -> str:
    """Convert ``text`` to a file name of letters, digits, dot, dash and underscore, of 1 to 60 characters."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9._-]+", "-", plain).strip("-.")[:60] or "unnamed"


def make_new_folder(path: Path) -> Path:
    """Make ``path``, or ``path-2``, ``path-3``... when runs of the same second got there first."""
    make_folder(path.parent)
    try:
        for candidate in chain([path], (path.with_name(f"{path.name}-{number}") for number in count(2))):
            with suppress(FileExistsError):
                candidate.mkdir()
                break
        return candidate
    except OSError as error:
        raise resource_error(path, error) from error


def prepare_folder(path: Path) -> Path:
    """Make the folder ``path``, or check that it is empty or belongs to a dead run or one with an input error."""
    if os.path.lexists(path) and not path.is_dir():
        raise InputError(f"--out {path}: is a file; choose a new or empty folder")
    make_folder(path)
    try:
        names = [file.name for file in path.iterdir()]
    except OSError as error:
        raise resource_error(path, error) from error
    if names and LOCK_NAME not in names and not ended_by_input_error(path):
        resumable = "config.yaml" in names and any(name.startswith("checkpoint-") for name in names)
        instead = f"continue the run in it with: knittest resume {path}, or " if resumable else ""
        raise InputError(f"--out {path}: not empty; {instead}choose a new folder, or remove this one if not needed")
    return path


def clear_dead_run(path: Path, lock: RunLock) -> None:
    """Remove the files of a run that died or had an input error; raises :class:`InputError` for other files."""
    names = {file.name for file in path.iterdir()} - {LOCK_NAME}
    if not names:
        return
    if _read_ending(path)[0] == "completed":  # and killed before its lock was removed
        raise InputError(f"--out {path}: contains a completed run; choose a new folder, or remove this one")
    leftover = [name for name in names if re.fullmatch(r"\..*\.tmp(\.\w+)?", name)]
    useless = fnmatch.filter(names, CHECKPOINTS) if ended_by_input_error(path) else []  # of another input
    strange = sorted(names - {*OWN_FILES, *results_of_runs(), *tables_of_runs()} - {"frames", *leftover, *useless})
    if strange:
        raise InputError(
            f"--out {path}: contains {strange[0]} and files of {lock.stale_owner or 'a run'}, which no longer runs; "
            "choose a new folder, or remove this one if it is not needed"
        )
    try:
        for file in [*(path / name for name in names - {"frames"}), *(path / "frames").glob("frame-*.vtu")]:
            file.unlink()
    except OSError as error:
        raise resource_error(path, error) from error


def remove_run(path: Path) -> None:
    """Remove the run folder ``path`` and its plan; links in it are removed, their targets are kept.

    Raises :class:`InputError` for a link, another folder and files that knittest did not write, and
    :class:`ResourceError` while a process uses it. Then nothing is removed.
    """
    manifest = _read_manifest(path)
    if path.is_symlink() or not {"status", "config_sha256"} <= manifest.keys():
        raise InputError(f"{path}: not a run folder, not removed")
    path = path.resolve()
    if is_locked(path):
        raise ResourceError(f"{path}: in use by a process, not removed")
    lock = RunLock(path)
    try:
        if strange := sorted(file.name for file in path.iterdir() if not _is_of_run(file)):
            raise InputError(f"{path}: not removed, because {strange[0]} is not a file of a run; move that file first")
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
    """Return whether ``file`` of a run folder has the name of a file that a command writes there."""
    names = {*OWN_FILES, *results_of_runs(), *tables_of_runs(), *files_of_incomplete_runs()}
    if file.name == "frames" and not file.is_symlink():
        return all(inner.suffix == ".vtu" for inner in file.iterdir())
    printed = file.suffix in (".svg", ".pdf") and file.with_suffix(".png").name in names
    return printed or file.name in names or any(fnmatch.fnmatch(file.name, pattern) for pattern in ADDED)


def ended_by_input_error(path: Path) -> bool:
    """Return whether the run in ``path`` ended because of an input error."""
    return _read_ending(path) == ("failed", InputError.exit_code)


def _read_ending(path: Path) -> tuple[object, object]:
    """Return status and exit code of the manifest in ``path``; ``None`` if there is none."""
    manifest = _read_manifest(path)
    return manifest.get("status"), manifest.get("exit_code")


def _read_manifest(path: Path) -> dict[str, object]:
    """Return the manifest in ``path``; empty if there is none."""
    try:
        manifest = json.loads((path / "manifest.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return manifest if isinstance(manifest, dict) else {}
