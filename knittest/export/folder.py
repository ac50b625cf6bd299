"""Run folder: all files of a run, and a manifest with its status."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

from numpy.typing import ArrayLike

from knittest.base.errors import KnittestError
from knittest.base.files import resource_error, write_atomic
from knittest.base.summary import Status
from knittest.config.run import Run
from knittest.export.files import json_text
from knittest.export.lock import (
    CHECKPOINTS,
    RunLock,
    clear_dead_run,
    files_of_incomplete_runs,
    incomplete_name,
    make_new_folder,
    prepare_folder,
    results_of_runs,
    run_name,
    tables_of_runs,
)
from knittest.export.summary import exit_status, first_manifest, resume_manifest, timestamp

#: values of equal length by the name of their column
Columns = Mapping[str, ArrayLike]


class RunFolder:
    """A locked folder with a manifest; a context manager that writes the final status.

    Leaving the block without an exception completes the run (exit code 0) unless :meth:`finish` was called. A failed
    or interrupted run keeps no file that looks like a result.
    """

    def __init__(self, path: Path, lock: RunLock, manifest: dict[str, Any]) -> None:
        self.path = path
        self.frames = path / "frames"
        self._lock = lock
        self._manifest = manifest
        #: message to the user if the folder of a dead run was taken over
        self.notice = ""
        if lock.stale_owner is not None:
            self.notice = (
                f"{path}: the earlier run of {lock.stale_owner} ended without completing; its files were replaced"
            )

    @classmethod
    def create(
        cls,
        out: Path | None,
        run: Run,
        *,
        config_text: str,
        threads: int,
        data_files: Iterable[Path] = (),
        cell: str | None = None,
    ) -> Self:
        """Make and lock the folder ``out`` (default ``runs/<name>-<time>``), write manifest.json, then config.yaml.

        ``config_text`` is the resolved config, ``data_files`` are those the run reads (hashed into the manifest),
        ``cell`` is the digest of its relaxed cell.
        Raises :class:`InputError` when ``out`` is a file or holds something else, :class:`ResourceError` when it
        cannot be written or another run is using it.
        """
        path = make_new_folder(Path("runs") / run_name(run)) if out is None else prepare_folder(out)
        lock = RunLock(path)
        try:
            clear_dead_run(path, lock)
            folder = cls(path, lock, first_manifest(run, config_text, threads, data_files, cell))
            folder._write_manifest()
            folder.write_text("config.yaml", config_text)
            folder.log("started", **({"notice": folder.notice} if folder.notice else {}))
        except BaseException:
            lock.release()
            raise
        return folder

    @classmethod
    def reopen(
        cls, path: Path, lock: RunLock, manifest: dict[str, Any], *, threads: int, notes: dict[str, Any]
    ) -> Self:
        """Resume a run that did not complete, under ``lock``; ``notes`` go into its manifest."""
        folder = cls(path, lock, resume_manifest(manifest, threads, notes))
        folder.notice = ""
        for name in (*files_of_incomplete_runs(), *results_of_runs()):
            (path / name).unlink(missing_ok=True)
        folder._write_manifest()
        folder.log("resumed", **notes)
        return folder

    def write_text(self, name: str, text: str) -> Path:
        """Write a text file of the folder, whole or not at all."""
        write_atomic(self.path / name, text)
        return self.path / name

    def write_table(self, name: str, columns: Columns) -> Path:
        """Write ``columns``, whose names state their units, as a CSV with one header line."""
        import pandas as pd

        return self.write_text(name, pd.DataFrame(dict(columns)).to_csv(index=False, float_format="%.10g"))

    def write_json(self, name: str, content: Mapping[str, object]) -> Path:
        """Write ``content`` as JSON."""
        return self.write_text(name, json_text(content))

    def mark_incomplete(self, names: Iterable[str]) -> None:
        """Rename those of the files ``names`` that exist, so that none looks like one of a completed run."""
        for name in names:
            with suppress(OSError):
                (self.path / name).replace(self.path / incomplete_name(name))

    def log(self, event: str, **fields: object) -> None:
        """Append one line to log.jsonl: time, event and its fields."""
        line = json_text({"time": timestamp(), "event": event, **fields}, indent=None)
        path = self.path / "log.jsonl"
        try:
            with path.open("a", encoding="utf-8") as stream:
                stream.write(line)
        except OSError as error:
            raise resource_error(path, error) from error

    def finish(self, status: Status, exit_code: int, message: str = "") -> None:
        """End the run: remove or rename files that look like results, write the manifest, free the lock."""
        if status != "completed":
            for name in results_of_runs():
                with suppress(OSError):
                    (self.path / name).unlink(missing_ok=True)
            self.mark_incomplete(tables_of_runs())
        self._manifest |= {"status": status, "ended": timestamp(), "exit_code": exit_code, "message": message}
        self._lock.give_room()
        try:
            self._write_manifest()
            if status == "completed":
                for path in [*self.path.glob(CHECKPOINTS), *self.path.glob(f".{CHECKPOINTS}")]:
                    with suppress(OSError):
                        path.unlink()
        finally:
            self._lock.release()

    def note(self, **facts: object) -> None:
        """Add ``facts`` to the manifest, for a resume."""
        self._manifest |= facts
        self._write_manifest()

    @property
    def lock(self) -> int:
        """File descriptor of the lock; a child process that inherits it keeps the folder locked."""
        return self._lock.descriptor

    @property
    def is_finished(self) -> bool:
        """True after :meth:`finish`."""
        return self._manifest["status"] != "running"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        if self.is_finished:
            return
        try:
            self.finish(*exit_status(error))
        except KnittestError:
            # The first error is the one to report; a second, from the full disk, adds nothing.
            if error is None:
                raise

    @property
    def forced_changes(self) -> list[str]:
        """Changes under which the run was resumed by force."""
        return [change for note in self._manifest.get("resumed", []) for change in note.get("forced", [])]

    def _write_manifest(self) -> None:
        self.write_json("manifest.json", self._manifest)
