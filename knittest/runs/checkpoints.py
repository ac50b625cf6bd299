"""Checkpoints and finished specimens of a run folder; each specimen has its own files, for several processes.

``checkpoint-0002-0007.npz`` is state 7 of specimen 2; the newest two are kept. ``checkpoint-frame-0002-0003.npz`` is
its frame 3, written once, with a ``-copy.npz`` because every later checkpoint needs it.
``checkpoint-specimen-0002.npz`` is the finished specimen, ``checkpoint-failed.npz`` the state at a numerical error.
"""

import json
import re
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError, ResourceError
from knittest.base.history import Cost, History, Mesh, Overlaps, Quality, Specimen
from knittest.base.interrupts import Interrupts
from knittest.export.files import Damaged, read_arrays, write_arrays
from knittest.export.identity import Identity
from knittest.models.explicit_model import State, arrays_of, checked_array, with_prefix, without_prefix
from knittest.solve.state import Observer, Snapshot, frame_of, frame_state

PATTERN = "checkpoint-*.npz"
KEPT_CHECKPOINTS = 2
#: key in a checkpoint: share of the configured speed
SPEED_SHARE = "speed_share"


class Checkpoints:
    """Writes and finds the checkpoints of the run in ``folder``, which its process has locked.

    ``identity`` is that of config, data and code (:mod:`knittest.export.identity`); ``interval`` [s] lies between two
    checkpoints; ``tell(text)`` prints a message.
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
        #: largest simulated time [ms] of the unfinished specimens, set by :meth:`find`
        self.reached = 0.0
        self._damaged: list[Path] = []
        self._needed: set[Path] = set()

    def find(self) -> list[Identity]:
        """Identities of what specimens resume from; raises :class:`InputError` if no checkpoint can be used."""
        earlier = sorted(p.name for p in self.folder.glob(PATTERN) if re.fullmatch(r"checkpoint-\d+\.npz", p.name))
        if earlier:
            raise InputError(
                f"{self.folder}: {earlier[0]} was written by an earlier version of knittest; resume with that version, "
                f"or start again with --config {self.folder / 'config.yaml'}"
            )
        identities, lost = list[Identity](), list[int]()
        for specimen in self._begun():
            identity = self._finished_identity(specimen)
            if identity is None and (newest := self.newest_checkpoint(specimen)) is not None:
                identity = newest[0]
                self.reached = max(self.reached, newest[1].time)
                self._needed |= {
                    p for k in range(len(newest[1].frames)) for p in _frame_paths(self.folder, specimen, k)
                }
            if identity is None:
                lost.append(specimen)
            else:
                identities.append(identity)
        numbered = list(self.folder.glob("checkpoint-[0-9]*.npz"))
        if numbered and not identities:
            raise InputError(
                f"{self.folder}: none of its {len(numbered)} checkpoints can be read; start again with "
                f"--config {self.folder / 'config.yaml'}"
            )
        for specimen in lost:
            self.tell(f"{self.folder}: no file of specimen {specimen + 1} can be read; the specimen is run again")
        return identities

    def remove_unused(self) -> None:
        """Remove damaged and incomplete files, and frames later than the states."""
        later = set(self.folder.glob("checkpoint-frame-*.npz")) - self._needed
        for path in [*self._damaged, *later, *self.folder.glob(".*.tmp*")]:
            remove(path)

    def newest_checkpoint(self, specimen: int) -> tuple[Identity, Snapshot] | None:
        """Newest valid checkpoint of ``specimen`` with its identity; ``None`` if there is none."""
        for number in sorted(self._numbers(specimen), reverse=True):
            path = _checkpoint_path(self.folder, specimen, number)
            try:
                state = read_arrays(path)
                identity = dict(json.loads(str(state.pop("identity"))))
                frames = [self._frame(specimen, k, path.name) for k in range(int(state["n_frames"]))]
                return identity, Snapshot({k: v for k, v in state.items() if k != "specimen"}, frames)
            except Damaged as error:
                self._damaged.append(path)
                self.tell(f"{error}; the previous checkpoint is tried")
        return None

    def is_finished(self, specimen: int) -> bool:
        """Tell whether ``specimen`` is stored as finished."""
        return _finished_path(self.folder, specimen).exists()

    def finished_state(self, specimen: int) -> State | None:
        """State of a finished specimen; ``None`` if there is none."""
        if not self.is_finished(specimen):
            return None
        try:
            return {k: v for k, v in read_arrays(_finished_path(self.folder, specimen)).items() if k != "identity"}
        except Damaged as error:
            self.tell(f"{error}; specimen {specimen + 1} is run again")
            return None

    @contextmanager
    def hold_signals(self, specimen: int, keeper: "SpecimenKeeper | None" = None) -> Iterator["SpecimenKeeper"]:
        """``keeper`` of a specimen; inside, signals wait for the next checkpoint once the simulation has begun."""
        keeper = keeper or SpecimenKeeper(self, specimen)
        with self.interrupts.hold_signals(when=lambda: keeper.began):
            yield keeper
        self.interrupts.check()

    def write(self, specimen: int, snapshot: Snapshot) -> None:
        """Write the next checkpoint and its new frames, then remove the third newest."""
        for k, frame in enumerate(snapshot.frames):
            for path in _frame_paths(self.folder, specimen, k):
                if not path.exists():
                    write_arrays(path, frame)
        numbers = self._numbers(specimen)
        newest = max(numbers, default=0) + 1
        write_arrays(_checkpoint_path(self.folder, specimen, newest), self._add_identity(snapshot.state, specimen))
        for number in numbers:
            if number <= newest - KEPT_CHECKPOINTS:
                remove(_checkpoint_path(self.folder, specimen, number))

    def write_failed(self, specimen: int, snapshot: Snapshot) -> None:
        """Write the state at a numerical error; a full disk must not hide that error."""
        with suppress(ResourceError):
            write_arrays(self.folder / "checkpoint-failed.npz", self._add_identity(snapshot.state, specimen))

    def write_finished(self, specimen: int, state: State) -> None:
        """Write a finished specimen and remove its checkpoints and frames."""
        write_arrays(_finished_path(self.folder, specimen), self._add_identity(state, specimen))
        self.drop(specimen)

    def drop(self, specimen: int) -> None:
        """Remove the checkpoints and frames of a specimen."""
        for name in (f"checkpoint-{specimen:04d}-*.npz", f"checkpoint-frame-{specimen:04d}-*.npz"):
            for path in self.folder.glob(name):
                remove(path)

    def _add_identity(self, state: Mapping[str, np.ndarray], specimen: int) -> State:
        return {**state, "identity": np.array(json.dumps(self.identity)), "specimen": np.array(specimen)}

    def _frame(self, specimen: int, frame: int, needed_by: str) -> State:
        """Frame from its file or its copy; raises :class:`Damaged` when neither is valid."""
        damaged = []
        for path in _frame_paths(self.folder, specimen, frame):
            if not path.exists():
                damaged.append(f"{path.name}, which {needed_by} needs, is missing")
                continue
            try:
                found = read_arrays(path)
            except Damaged as error:
                damaged.append(str(error))
                self._damaged.append(path)  # written again with the next checkpoint
                continue
            if damaged:
                self.tell(f"{damaged[0]}; using {path.name}")
            return found
        raise Damaged(damaged[0])

    def _finished_identity(self, specimen: int) -> Identity | None:
        if not self.is_finished(specimen):
            return None
        path = _finished_path(self.folder, specimen)
        try:
            return dict(json.loads(str(read_arrays(path)["identity"])))
        except Damaged as error:
            self._damaged.append(path)
            self.tell(str(error))
            return None

    def _begun(self) -> list[int]:
        names = [path.name for path in self.folder.glob(PATTERN)]
        found = (re.fullmatch(r"checkpoint-(\d{4})-\d{4,}\.npz|checkpoint-specimen-(\d{4})\.npz", n) for n in names)
        return sorted({int(match[1] or match[2]) for match in found if match})

    def _numbers(self, specimen: int) -> list[int]:
        names = [path.stem for path in self.folder.glob(f"checkpoint-{specimen:04d}-*.npz")]
        return [int(name.rpartition("-")[2]) for name in names]


class SpecimenKeeper(Observer):
    """Observer that stores the simulation of one specimen."""

    def __init__(self, store: Checkpoints, specimen: int) -> None:
        self.store, self.specimen = store, specimen
        self.due = time.monotonic() + store.interval
        self.began = False  # the simulation, which :meth:`resume_from` starts
        self._speed_share = 1.0

    def resume_from(self) -> Snapshot | None:
        """Newest checkpoint of the specimen, if there is one."""
        self.began = True
        self.due = time.monotonic() + self.store.interval
        newest = self.store.newest_checkpoint(self.specimen)
        return None if newest is None else newest[1]

    def speed_share(self) -> float:
        """Share of the configured speed of the newest checkpoint; 1 if there is none."""
        newest = self.store.newest_checkpoint(self.specimen)
        self._speed_share = 1.0 if newest is None else float(newest[1].state.get(SPEED_SHARE, 1.0))
        return self._speed_share

    def restarts(self, share: float, reason: str = "") -> None:
        """Discard the checkpoints; the specimen restarts at ``share`` of the configured speed."""
        self.store.drop(self.specimen)
        self._speed_share, self.began = share, False

    def visit(self, take: Callable[[], Snapshot]) -> None:
        """Write a checkpoint when it is due or a signal came; raise :class:`Interrupted` for the signal."""
        if not self.store.interrupts.asked and time.monotonic() < self.due:
            return
        snapshot = take()
        snapshot.state[SPEED_SHARE] = np.array(self._speed_share)
        self.store.write(self.specimen, snapshot)
        self.store.interrupts.check()
        self.due = time.monotonic() + self.store.interval

    def visit_failure(self, take: Callable[[], Snapshot]) -> None:
        """Write the failed state."""
        self.store.write_failed(self.specimen, take())

    def finish(self, state: State) -> None:
        """Write the finished specimen."""
        self.store.write_finished(self.specimen, state)


def remove(path: Path) -> None:
    """Remove a checkpoint file; a folder of that name is renamed instead."""
    try:
        path.unlink(missing_ok=True)
    except IsADirectoryError:
        path.rename(path.with_name(f"{path.stem}-not-a-file-{time.time_ns()}"))


def _finished_path(folder: Path, specimen: int) -> Path:
    return folder / f"checkpoint-specimen-{specimen:04d}.npz"


def _checkpoint_path(folder: Path, specimen: int, number: int) -> Path:
    return folder / f"checkpoint-{specimen:04d}-{number:04d}.npz"


def _frame_paths(folder: Path, specimen: int, frame: int) -> tuple[Path, Path]:
    name = f"checkpoint-frame-{specimen:04d}-{frame:04d}"
    return folder / f"{name}.npz", folder / f"{name}-copy.npz"


MESH_ARRAYS = ("cells", "part", "yarn", "radius")


def specimen_state(specimen: Specimen, frames: bool) -> State:
    """``specimen`` as arrays, with or without its ``frames``."""
    history, mesh = specimen.history, specimen.history.mesh
    n_frames = len(history.frames) if frames else 0
    plain = {
        "kind": mesh.kind,
        "part_names": mesh.part_names,
        "first_failure": history.first_failure,
        "overlaps": asdict(history.overlaps),
        "n_frames": n_frames,
        "peak": history.peak if frames else None,
        "results": specimen.results,
        "quality": asdict(specimen.quality),
        "cost": asdict(specimen.cost),
        "facts": specimen.facts,
        "rest": specimen.rest,
    }
    state = {"plain": np.array(json.dumps(plain, default=np.generic.item))} | arrays_of("mesh", mesh, MESH_ARRAYS)
    state |= with_prefix("curve", history.curve) | with_prefix("energies", history.energies)
    state |= with_prefix("yarns", specimen.yarns) | with_prefix("contacts", history.contacts)
    state |= arrays_of("history", history, ("tool_force",))
    for k in range(n_frames):
        state |= with_prefix(f"frame-{k:04d}", frame_state(history.frames[k]))
    return state


def specimen_of(state: State) -> Specimen:
    """Specimen of a state written by :func:`specimen_state`."""
    plain = json.loads(str(checked_array(state, "plain")))
    arrays = {name: checked_array(state, f"mesh/{name}") for name in MESH_ARRAYS}
    mesh = Mesh(plain["kind"], part_names=tuple(plain["part_names"]), **arrays)
    frames = [frame_of(without_prefix(state, f"frame-{k:04d}")) for k in range(plain["n_frames"])]
    overlaps = Overlaps(**(plain["overlaps"] | {"worst": tuple(plain["overlaps"]["worst"])}))
    history = History(
        mesh, without_prefix(state, "curve"), without_prefix(state, "energies"), frames, plain["first_failure"],
        without_prefix(state, "contacts"), checked_array(state, "history/tool_force"), overlaps, plain.get("peak"),
    )  # fmt: skip
    lists = {name: tuple(plain["quality"][name]) for name in ("failures", "warnings")}
    quality = Quality(**(plain["quality"] | lists))
    return Specimen(
        history,
        plain["results"],
        quality,
        Cost(**plain["cost"]),
        without_prefix(state, "yarns"),
        plain["facts"],
        plain["rest"],
    )
