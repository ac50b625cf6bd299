"""Opens the folder of a new or resumed run, with its checkpoints."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numba

from knittest.base.errors import InputError
from knittest.base.interrupts import Interrupts
from knittest.base.progress import tell
from knittest.config.run import Run
from knittest.config.yaml_writer import dump
from knittest.export.folder import RunFolder
from knittest.export.identity import Identity, cell_of, changes, data_files, identity_of
from knittest.export.lock import LOCK_NAME, RunLock
from knittest.report_page.page import FILE, write_if_possible, write_report
from knittest.runs.checkpoints import PATTERN, Checkpoints

#: changes that an error message lists
MOST_CHANGES = 5


@dataclass(frozen=True)
class OpenedRun:
    """A locked run folder and its checkpoints."""

    folder: RunFolder
    checkpoints: Checkpoints


class RunPlace(Protocol):
    """Folder of a new or resumed run."""

    @property
    def path(self) -> Path | None:
        """Folder of the run; None where its name is chosen when it is created."""

    def open(self, run: Run, interrupts: Interrupts) -> OpenedRun:
        """Create or reopen the folder of ``run`` and lock it; ``interrupts`` may stop the run at a checkpoint."""


@dataclass(frozen=True)
class NewFolder:
    """A new folder ``path``, by default named after the run and the time."""

    path: Path | None = None

    def open(self, run: Run, interrupts: Interrupts) -> OpenedRun:
        """Create the folder; see :meth:`RunFolder.create`."""
        files, threads, text = data_files(run), numba.get_num_threads(), dump(run)
        folder = RunFolder.create(
            self.path, run, config_text=text, threads=threads, data_files=files, cell=cell_of(run)
        )
        return OpenedRun(folder, _make_checkpoints(run, folder.path, identity_of(run, files, text), interrupts))


@dataclass(frozen=True)
class StoppedRun:
    """Folder of an incomplete run; with ``force`` the run is resumed although its inputs changed."""

    path: Path
    force: bool = False

    def open(self, run: Run, interrupts: Interrupts) -> OpenedRun:
        """Reopen the folder.

        Raises :class:`InputError`, with the folder unchanged, when no checkpoint is valid or, without force, when the
        result would change; :class:`ResourceError` when the folder is in use or cannot be written.
        """
        path, lock = self.path, RunLock(self.path)
        try:
            now = identity_of(run, data_files(run))
            checkpoints = _make_checkpoints(run, path, now, interrupts)
            changed = _check_changes(path, checkpoints.find(), now, self.force)
            checkpoints.remove_unused()
            notes: dict[str, Any] = {"at_ms": checkpoints.reached}
            if changed:
                notes |= {"forced": changed, "config_sha256": now["config_sha256"]}
            folder = RunFolder.reopen(path, lock, manifest_of(path), threads=numba.get_num_threads(), notes=notes)
            return OpenedRun(folder, checkpoints)
        except BaseException:
            lock.release()
            raise


def clean_completed_run(path: Path, pictures: bool) -> None:
    """Remove the lock and checkpoints of a run killed right after its end, and write its page if it is missing."""
    remains = [path / LOCK_NAME, *path.glob(PATTERN), *path.glob(f".{PATTERN}")]
    if any(file.exists() for file in remains):
        lock = RunLock(path)
        for file in remains[1:]:
            file.unlink(missing_ok=True)
        lock.release()
    if pictures and not (path / FILE).exists():
        write_if_possible(path, write_report)


def manifest_of(path: Path) -> dict[str, Any]:
    """Manifest of the run folder ``path``; raises :class:`InputError`."""
    try:
        manifest = json.loads((path / "manifest.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: not a run folder with a manifest.json: {error}") from None
    if not isinstance(manifest, dict) or "status" not in manifest:
        raise InputError(f"{path / 'manifest.json'}: expected a manifest with a status")
    return manifest


def open_checkpoints(run: Run, path: Path, interrupts: Interrupts) -> Checkpoints:
    """Checkpoints of ``run`` in the folder ``path``, which another process has opened."""
    return _make_checkpoints(run, path, identity_of(run, data_files(run)), interrupts)


def _check_changes(path: Path, before: Iterable[Identity], now: Identity, force: bool) -> list[str]:
    """Changes since the identities ``before``; raises :class:`InputError` for any unless ``force``."""
    changed = list(dict.fromkeys(change for identity in before for change in changes(identity, now)))
    if changed and not force:
        more = f"; and {len(changed) - MOST_CHANGES} more" if len(changed) > MOST_CHANGES else ""
        listed = "; ".join(changed[:MOST_CHANGES]) + more
        raise InputError(
            f"{path}: the resumed run would give another result: {listed}; undo the changes, or resume with --force"
        )
    return changed


def _make_checkpoints(run: Run, path: Path, identity: Identity, interrupts: Interrupts) -> Checkpoints:
    return Checkpoints(path, identity, run.output.checkpoint_interval, interrupts, tell)
