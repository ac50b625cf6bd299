"""Opens the folder of a run, new or to go on in, with its checkpoints."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from knittest.base.errors import InputError
from knittest.base.interrupts import Interrupts
from knittest.base.progress import tell
from knittest.config.dumping import dump
from knittest.config.run import Run
from knittest.export.folder import RunFolder
from knittest.export.identity import Identity, cell_of, changes, data_files, identity_of
from knittest.export.lock import LOCK_NAME, RunLock
from knittest.report_page.page import FILE, write_if_possible, write_report
from knittest.runs.checkpoints import PATTERN, Checkpoints

#: changes that an error message lists
LISTED = 5


@dataclass(frozen=True)
class Opened:
    """A locked run folder and its checkpoints."""

    folder: RunFolder
    checkpoints: Checkpoints


class Place(Protocol):
    """Place of a run, new or gone on with."""

    @property
    def path(self) -> Path | None:
        """Folder of the run, None where it gets its name when it is made."""

    def open(self, run: Run, interrupts: Interrupts) -> Opened:
        """Lock the folder of ``run``, which ``interrupts`` may stop at a checkpoint."""


@dataclass(frozen=True)
class NewFolder:
    """A new folder ``path``, else one named after the run and the time."""

    path: Path | None = None

    def open(self, run: Run, interrupts: Interrupts) -> Opened:
        """Make it; see :meth:`RunFolder.create`."""
        files = data_files(run)
        folder = RunFolder.create(
            self.path, run, config_text=dump(run), threads=_threads(), data_files=files, cell=cell_of(run)
        )
        return Opened(folder, _checkpoints(run, folder.path, identity_of(run, files), interrupts))


@dataclass(frozen=True)
class StoppedRun:
    """The folder of a run that did not complete, gone on with whatever changed since if ``force``."""

    path: Path
    force: bool = False

    def open(self, run: Run, interrupts: Interrupts) -> Opened:
        """Open it again.

        Raises :class:`InputError` when no checkpoint verifies or, without force, when something changed that the result
        depends on; then nothing in the folder changes. :class:`ResourceError` when it is in use or cannot be written.
        """
        path, lock = self.path, RunLock(self.path)
        try:
            now = identity_of(run, data_files(run))
            checkpoints = _checkpoints(run, path, now, interrupts)
            changed = _changes(path, checkpoints.find(), now, self.force)
            checkpoints.tidy()
            notes: dict[str, Any] = {"at_ms": checkpoints.reached}
            if changed:
                notes |= {"forced": changed, "config_sha256": now["config_sha256"]}
            folder = RunFolder.reopen(path, lock, manifest_of(path), threads=_threads(), notes=notes)
            return Opened(folder, checkpoints)
        except BaseException:
            lock.release()
            raise


def tidy_completed(path: Path, pictures: bool) -> None:
    """Write the page that a kill right after the end of the run left out, and remove what it left in ``path``."""
    leavings = [path / LOCK_NAME, *path.glob(PATTERN), *path.glob(f".{PATTERN}")]
    if any(file.exists() for file in leavings):
        lock = RunLock(path)
        for file in leavings[1:]:
            file.unlink(missing_ok=True)
        lock.release()
    if pictures and not (path / FILE).exists():
        write_if_possible(path, write_report)


def manifest_of(path: Path) -> dict[str, Any]:
    """The manifest of the run folder ``path``; raises :class:`InputError`."""
    try:
        manifest = json.loads((path / "manifest.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: not a run folder with a manifest.json: {error}") from None
    if not isinstance(manifest, dict) or "status" not in manifest:
        raise InputError(f"{path / 'manifest.json'}: expected a manifest with a status")
    return manifest


def joined(run: Run, path: Path, interrupts: Interrupts) -> Checkpoints:
    """The checkpoints of ``run`` in the folder ``path``, which another process has opened."""
    return _checkpoints(run, path, identity_of(run, data_files(run)), interrupts)


def _changes(path: Path, before: Sequence[Identity], now: Identity, force: bool) -> list[str]:
    """Changes since any of the checkpoints, whose identities are ``before``; raises unless ``force``."""
    changed = list(dict.fromkeys(change for identity in before for change in changes(identity, now)))
    if not changed or force:
        return changed
    listed = "; ".join(changed[:LISTED]) + (f"; and {len(changed) - LISTED} more" if len(changed) > LISTED else "")
    raise InputError(
        f"{path}: the run would not go on to the same result: {listed}; undo that, or go on anyway with --force"
    )


def _checkpoints(run: Run, path: Path, identity: Identity, interrupts: Interrupts) -> Checkpoints:
    return Checkpoints(path, identity, run.output.checkpoint_interval, interrupts, tell)


def _threads() -> int:
    import numba

    return int(numba.get_num_threads())
