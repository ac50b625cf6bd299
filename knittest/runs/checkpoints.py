"""Checkpoints of a run folder: the newest two of the specimen that runs, its frames, and the finished specimens.

``checkpoint-0007.npz`` state of one simulation; ``checkpoint-frame-0000-0003.npz`` frame 3 of specimen 0, written once,
and its ``-copy.npz``, because every later checkpoint needs it; ``checkpoint-specimen-0000.npz`` a finished specimen;
``checkpoint-failed.npz`` the state when the numbers went wrong.
"""

import json
import re
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Self

import numpy as np

from knittest.base.atomic import resource_error
from knittest.base.errors import InputError, ResourceError
from knittest.base.interrupts import Interrupts
from knittest.export.identity import Identity
from knittest.export.npz import Damaged, read_arrays, write_arrays
from knittest.models.snapshot import State
from knittest.solve.state import Snapshot

PATTERN = "checkpoint-*.npz"
KEPT = 2


class Checkpoints:
    """Writes and finds the checkpoints of the run in ``folder``, which its process has locked.

    ``identity`` says what a state belongs to (:mod:`knittest.export.identity`); ``interval`` [s] lies between two
    checkpoints; ``tell(text)`` passes on what a user should know.
    """

    def __init__(
        self,
        folder: Path,
        identity: Identity,
        interval: float,
        interrupts: Interrupts | None = None,
        tell: Callable[[str], None] = lambda text: None,
    ) -> None:
        self.folder, self.identity, self.interval, self.tell = folder, identity, interval, tell
        self.interrupts = interrupts or Interrupts()
        self.found: tuple[int, Snapshot] | None = None
        self._number = max(_numbered(folder), default=0)
        self._damaged: list[Path] = []

    def find(self) -> Identity | None:
        """Read the newest checkpoint that verifies; returns its identity, None when there are no checkpoints at all.

        Raises :class:`InputError` when there are some and none can be used.
        """
        numbers = sorted(_numbered(self.folder), reverse=True)
        for number in numbers:
            try:
                return self._load(number)
            except Damaged as error:
                self._damaged.append(_path(self.folder, number))
                self.tell(f"{error}; trying the checkpoint before it")
        finished = self._finished_identity()
        if numbers and finished is None:
            raise InputError(
                f"{self.folder}: none of its {len(numbers)} checkpoints can be read; start again with "
                f"--config {self.folder / 'config.yaml'}"
            )
        return finished

    def tidy(self) -> None:
        """Before going on: remove what did not verify, what was half-written, and frames later than the state."""
        specimen, snapshot = self.found or (0, Snapshot({}, []))
        needed = {p for k in range(len(snapshot.frames)) for p in _frame_paths(self.folder, specimen, k)}
        later = set(self.folder.glob("checkpoint-frame-*.npz")) - needed
        for path in [*self._damaged, *later, *self.folder.glob(".*.tmp*")]:
            path.unlink(missing_ok=True)

    def finished(self, specimen: int) -> State | None:
        """State kept of a finished specimen; ``None`` if there is none."""
        path = self.folder / _finished_name(specimen)
        if not path.exists():
            return None
        try:
            return {k: v for k, v in read_arrays(path).items() if k != "identity"}
        except Damaged as error:
            self.tell(f"{error}; specimen {specimen + 1} is run again")
            return None

    @contextmanager
    def keeping(self, specimen: int) -> Iterator["SpecimenKeeper"]:
        """The keeper of a specimen; inside, signals wait for the next checkpoint once the simulation has begun."""
        keeper = SpecimenKeeper(self, specimen)
        with keeper.holding():
            yield keeper
        self.interrupts.check()

    def write(self, specimen: int, snapshot: Snapshot) -> None:
        """Write the next checkpoint and its new frames; then the third newest goes."""
        for k, frame in enumerate(snapshot.frames):
            for path in _frame_paths(self.folder, specimen, k):
                if not path.exists():
                    write_arrays(path, frame)
        self._number += 1
        write_arrays(_path(self.folder, self._number), self._labelled(snapshot.state, specimen))
        for number in _numbered(self.folder):
            if number <= self._number - KEPT:
                _path(self.folder, number).unlink(missing_ok=True)

    def write_failed(self, specimen: int, snapshot: Snapshot) -> None:
        """Write the state in which the numbers went wrong; the error that did it matters more than a full disk."""
        with suppress(ResourceError):
            write_arrays(self.folder / "checkpoint-failed.npz", self._labelled(snapshot.state, specimen))

    def write_finished(self, specimen: int, state: State) -> None:
        """Keep a finished specimen; its checkpoints and frames go."""
        write_arrays(self.folder / _finished_name(specimen), self._labelled(state, specimen))
        for path in [*self.folder.glob("checkpoint-[0-9]*.npz"), *self.folder.glob("checkpoint-frame-*.npz")]:
            path.unlink(missing_ok=True)

    def hand_over(self, specimen: int, folder: Path) -> None:
        """Move a finished specimen to ``folder``, that of its ensemble."""
        name = _finished_name(specimen)
        try:
            (self.folder / name).replace(folder / name)
        except OSError as error:
            raise resource_error(folder / name, error) from error

    def _labelled(self, state: Mapping[str, np.ndarray], specimen: int) -> State:
        return {**state, "identity": np.array(json.dumps(self.identity)), "specimen": np.array(specimen)}

    def _load(self, number: int) -> Identity:
        state = read_arrays(_path(self.folder, number))
        specimen, identity = int(state.pop("specimen")), json.loads(str(state.pop("identity")))
        frames = [self._frame(specimen, k, number) for k in range(int(state["n_frames"]))]
        self.found = specimen, Snapshot(state, frames)
        return dict(identity)

    def _frame(self, specimen: int, frame: int, number: int) -> State:
        """The frame from its file or from the copy; raises :class:`Damaged` when neither verifies."""
        damaged = []
        for path in _frame_paths(self.folder, specimen, frame):
            if not path.exists():
                damaged.append(f"{path.name}, which {_path(self.folder, number).name} needs, is missing")
                continue
            try:
                found = read_arrays(path)
            except Damaged as error:
                damaged.append(str(error))
                self._damaged.append(path)  # and is written anew with the next checkpoint
                continue
            if damaged:
                self.tell(f"{damaged[0]}; using {path.name}")
            return found
        raise Damaged(damaged[0])

    def _finished_identity(self) -> Identity | None:
        for path in sorted(self.folder.glob("checkpoint-specimen-*.npz"), reverse=True):
            with suppress(Damaged):
                return dict(json.loads(str(read_arrays(path)["identity"])))
        return None


class SpecimenKeeper:
    """Keeps the simulation of one specimen, as a :class:`knittest.solve.observer.Observer` asks it to."""

    def __init__(self, store: Checkpoints, specimen: int) -> None:
        self.store, self.specimen = store, specimen
        self.due = time.monotonic() + store.interval
        self._began = False

    @contextmanager
    def holding(self) -> Iterator[Self]:
        """Let :meth:`resume_from` begin to hold signals back, up to the end of this block."""
        with self.store.interrupts.held(when=lambda: self._began):
            yield self

    def resume_from(self) -> Snapshot | None:
        """The checkpoint that was found, if it is of this specimen."""
        self._began = True
        self.due = time.monotonic() + self.store.interval
        if self.store.found is None or self.store.found[0] != self.specimen:
            return None
        return self.store.found[1]

    def visit(self, take: Callable[[], Snapshot]) -> None:
        """Write a checkpoint when it is due or a signal came; raise :class:`Interrupted` for the signal."""
        if not self.store.interrupts.asked and time.monotonic() < self.due:
            return
        self.store.write(self.specimen, take())
        self.store.interrupts.check()
        self.due = time.monotonic() + self.store.interval

    def failed(self, take: Callable[[], Snapshot]) -> None:
        """Write the state as it is."""
        self.store.write_failed(self.specimen, take())

    def finish(self, state: State) -> None:
        """Keep the finished specimen."""
        self.store.write_finished(self.specimen, state)


def _finished_name(specimen: int) -> str:
    return f"checkpoint-specimen-{specimen:04d}.npz"


def _path(folder: Path, number: int) -> Path:
    return folder / f"checkpoint-{number:04d}.npz"


def _frame_paths(folder: Path, specimen: int, frame: int) -> tuple[Path, Path]:
    name = f"checkpoint-frame-{specimen:04d}-{frame:04d}"
    return folder / f"{name}.npz", folder / f"{name}-copy.npz"


def _numbered(folder: Path) -> list[int]:
    """Numbers of the checkpoints in ``folder``."""
    matches = (re.fullmatch(r"checkpoint-(\d{4,})\.npz", path.name) for path in folder.glob(PATTERN))
    return [int(match[1]) for match in matches if match]
