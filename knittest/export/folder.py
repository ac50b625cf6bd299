"""The run folder: everything a run leaves behind, and a manifest that always says how it ended."""

import fnmatch
import json
import os
import re
import unicodedata
from collections.abc import Iterable, Mapping
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from numpy.typing import ArrayLike

from knittest.base.atomic import make_folder, resource_error, write_atomic
from knittest.base.errors import InputError, KnittestError
from knittest.base.kinds import listed
from knittest.base.summary import Status, Summary
from knittest.config.run import Run
from knittest.export.jsonfile import json_text
from knittest.export.lock import LOCK_NAME, RunLock
from knittest.export.manifest import ending, first_manifest, now, restarted_manifest

#: values of equal length by the name of their column
Columns = Mapping[str, ArrayLike]

# What only a completed run may show; a failed one keeps its tables under a name that says so. Tests add their own.
_RESULTS = ("summary.json", "comparison.json", "report.html", "view.html")
_TABLES = ("curve.csv", "energies.csv", "contacts.csv", "yarns.csv")
CHECKPOINTS = "checkpoint-*.npz"
_OWN = ("manifest.json", "config.yaml", "log.jsonl", "frames.pvd", LOCK_NAME)


def results_of_runs() -> tuple[str, ...]:
    """Names of the files that only a completed run of any test may show."""
    return tuple(dict.fromkeys((*_RESULTS, *listed("pictures"))))


def tables_of_runs() -> tuple[str, ...]:
    """Names of the tables of runs of all tests."""
    return tuple(dict.fromkeys((*_TABLES, *listed("tables"))))


class RunFolder:
    """A locked folder with a manifest; a context manager that ends the manifest with the right status.

    Leaving the block without an exception completes the run (exit code 0) unless :meth:`finish` was called; a failed
    or interrupted run keeps no file that looks like a result.
    """

    def __init__(self, path: Path, lock: RunLock, manifest: dict[str, Any]) -> None:
        self.path = path
        self.frames = path / "frames"
        self._lock = lock
        self._manifest = manifest
        #: why a dead run's folder was taken over, for the user; empty otherwise
        self.notice = _notice(path, lock)

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
        path = fresh_folder(Path("runs") / run_name(run)) if out is None else _chosen_folder(out)
        lock = RunLock(path)
        try:
            _clear_dead_run(path, lock)
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
        """The folder of a run that did not complete, which goes on under ``lock``; ``notes`` go into its manifest."""
        folder = cls(path, lock, restarted_manifest(manifest, threads, notes))
        folder.notice = ""
        for name in tables_of_runs():
            (path / _incomplete(name)).unlink(missing_ok=True)
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

    def write_curve(self, columns: Columns) -> Path:
        """Write curve.csv, the rig's sampled channels (``History.curve``)."""
        return self.write_table("curve.csv", columns)

    def write_energies(self, columns: Columns) -> Path:
        """Write energies.csv, energies and ratios by time (``History.energies``)."""
        return self.write_table("energies.csv", columns)

    def write_contacts(self, columns: Columns) -> Path:
        """Write contacts.csv, penetration by time (``History.contacts``)."""
        return self.write_table("contacts.csv", columns)

    def write_yarns(self, columns: Columns) -> Path:
        """Write yarns.csv, one row a yarn."""
        return self.write_table("yarns.csv", columns)

    def write_comparison(self, comparison: Mapping[str, object]) -> Path:
        """Write comparison.json, the metrics for each reference."""
        return self.write_text("comparison.json", json_text(comparison))

    def write_summary(self, summary: Summary) -> Path:
        """Write summary.json (see :func:`knittest.export.summary.build_summary`)."""
        return self.write_text("summary.json", json_text(summary))

    def log(self, event: str, **fields: object) -> None:
        """Append one line to log.jsonl: time, event and its fields."""
        line = json_text({"time": now(), "event": event, **fields}, indent=None)
        path = self.path / "log.jsonl"
        try:
            with path.open("a", encoding="utf-8") as stream:
                stream.write(line)
        except OSError as error:
            raise resource_error(path, error) from error

    def finish(self, status: Status, exit_code: int, message: str = "") -> None:
        """End the run: sweep what must not look like a result, write the last manifest, free the lock."""
        if status != "completed":
            self._sweep()
        self._manifest |= {"status": status, "ended": now(), "exit_code": exit_code, "message": message}
        self._lock.give_room()
        try:
            self._write_manifest()
            if status == "completed":
                self._remove_checkpoints()
        finally:
            self._lock.release()

    @property
    def lock(self) -> int:
        """File descriptor of the lock: a process that inherits it holds the folder as long as it lives."""
        return self._lock.descriptor

    @property
    def finished(self) -> bool:
        """True after :meth:`finish`."""
        return self._manifest["status"] != "running"

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.finished:
            return
        try:
            self.finish(*ending(error))
        except KnittestError:
            # The first error is the one to report; a second, from the full disk, adds nothing.
            if error is None:
                raise

    @property
    def forced(self) -> list[str]:
        """Changes under which the run was gone on with by force."""
        return [change for note in self._manifest.get("resumed", []) for change in note.get("forced", [])]

    def _write_manifest(self) -> None:
        self.write_text("manifest.json", json_text(self._manifest))

    def _remove_checkpoints(self) -> None:
        for path in [*self.path.glob(CHECKPOINTS), *self.path.glob(f".{CHECKPOINTS}")]:
            with suppress(OSError):
                path.unlink()

    def _sweep(self) -> None:
        for name in results_of_runs():
            with suppress(OSError):
                (self.path / name).unlink(missing_ok=True)
        for name in tables_of_runs():
            with suppress(OSError):
                (self.path / name).replace(self.path / _incomplete(name))


def _incomplete(table: str) -> str:
    return table.replace(".csv", ".incomplete.csv")


def run_name(run: Run, *, direction: str | None = None, at: datetime | None = None) -> str:
    """``<rig>-<variant>-<scale>-<direction>-<time>``, safe as a file name; ``direction`` replaces the rig's own."""
    moment = (at or datetime.now()).strftime("%Y%m%d-%H%M%S")
    parts = (run.rig.kind, run.fabric.name, run.model.scale, direction or run.direction, moment)
    return "-".join(slug(part) for part in parts if part)


def slug(text: str) -> str:
    """``text`` as letters, digits, dot, dash and underscore, never hidden, never empty, 60 characters at most."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9._-]+", "-", plain).strip("-.")[:60] or "unnamed"


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


def _chosen_folder(path: Path) -> Path:
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


def _clear_dead_run(path: Path, lock: RunLock) -> None:
    """Remove the files of a run that is dead or had a bad input; refuse when there are others among them."""
    names = {file.name for file in path.iterdir()} - {LOCK_NAME}
    if not names:
        return
    if _completed(path):  # and killed before its lock was removed
        raise InputError(f"--out {path}: holds a completed run; choose a new folder, or remove this one")
    leftover = [name for name in names if re.fullmatch(r"\..*\.tmp(\.\w+)?", name)]
    useless = fnmatch.filter(names, CHECKPOINTS) if of_bad_input(path) else []  # of another input
    strange = sorted(names - {*_OWN, *results_of_runs(), *tables_of_runs()} - {"frames", *leftover, *useless})
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


def _completed(path: Path) -> bool:
    return _ended(path)[0] == "completed"


def of_bad_input(path: Path) -> bool:
    """Tell whether a run ended in ``path`` because of its input, which its next start has corrected."""
    return _ended(path) == ("failed", InputError.exit_code)


def _ended(path: Path) -> tuple[object, object]:
    """Status and exit code that the manifest in ``path`` states; nothing where there is none."""
    try:
        manifest = json.loads((path / "manifest.json").read_text(encoding="utf-8"))
        return manifest["status"], manifest.get("exit_code")
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None, None


def _notice(path: Path, lock: RunLock) -> str:
    if lock.stale_owner is None:
        return ""
    return f"{path}: {lock.stale_owner} died without finishing here; its files were replaced"
