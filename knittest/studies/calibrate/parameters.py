"""The numbers that a calibration looks for, on a scale from 0 at the lower bound to 1 at the upper."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from knittest.base.errors import InputError
from knittest.config import calibration as file
from knittest.config.base import Quantity
from knittest.config.fields import all_paths, place
from knittest.config.messages import unknown
from knittest.config.run import Run
from knittest.config.settings import Setting
from knittest.config.yaml_loader import Document, KeyPath, dotted

#: digits of a value that is tried: enough for any use, few enough that a trial is found again
DIGITS = 8


@dataclass(frozen=True)
class Parameter:
    """A number between ``low`` and ``high``, the same at all ``paths`` of a run; ``prior`` is its mean and sd."""

    paths: tuple[KeyPath, ...]
    unit: str
    low: float
    high: float
    start: float
    log: bool
    prior: tuple[float, float] | None
    where: str

    @property
    def name(self) -> str:
        """Dotted path of the first field."""
        return dotted(self.paths[0])

    def value(self, position: float) -> float:
        """The value at ``position``, 0 at ``low`` and 1 at ``high``."""
        p = min(max(float(position), 0.0), 1.0)
        found = self.low * (self.high / self.low) ** p if self.log else self.low + p * (self.high - self.low)
        return float(f"{min(max(found, self.low), self.high):.{DIGITS}g}")

    def position(self, value: float) -> float:
        """The inverse of :meth:`value`."""
        if self.log:
            return float(np.log(value / self.low) / np.log(self.high / self.low))
        return (value - self.low) / (self.high - self.low)

    def settings(self, value: float, kind: str) -> list[Setting]:
        """``value`` at those paths that a test of ``kind`` has."""
        return [Setting(path, value, self.where) for path in self.paths if place(path, kind) is not None]


def parameters_of(calibration: file.Calibration, document: Document, runs: Sequence[Run]) -> list[Parameter]:
    """All parameters, checked against the schema and against ``runs``, one a test with the fabric as it is.

    Raises :class:`InputError` with file and line for a field that no run has, that is no number, or is given twice.
    """
    kinds = [run.rig.kind for run in runs]
    found, said = [], dict[KeyPath, str]()
    for name, one in calibration.parameters.items():
        where = document.where(("parameters", name))
        names = [name, *one.also]
        paths = tuple(_path(n, where, kinds) for n in names)
        for path in paths:
            if path in said:
                raise InputError(f"{where}: {dotted(path)}: given twice, first at {said[path]}: give it once")
            said[path] = where
        prior = None if one.mean is None or one.sd is None else (one.mean, one.sd)
        first = place(paths[0], next(kind for kind in kinds if place(paths[0], kind)))
        log = one.spacing == "log"
        start = _start(one, current(paths[0], runs))
        found.append(Parameter(paths, first.unit if first else "", one.low, one.high, start, log, prior, where))
    return found


def _path(name: str, where: str, kinds: Sequence[str]) -> KeyPath:
    """The key path of ``name``, a number of the fabric or the rig of one of ``kinds``."""
    path: KeyPath = tuple(name.split("."))
    if path[0] not in ("fabric", "rig"):
        raise InputError(f"{where}: {name}: expected a field of the fabric or the rig, such as {_example(name, kinds)}")
    field = next((f for f in (place(path, kind) for kind in kinds) if f is not None), None)
    if field is None:
        known = sorted({p for kind in kinds for p in all_paths(kind) if p.split(".")[0] == path[0]})
        raise InputError(f"{where}: {name}: {unknown(name, known) if known else 'unknown field'}")
    if field.model is not None and not field.is_quantity:
        raise InputError(f"{where}: {name}: expected a number, this is a group of {', '.join(field.names)}")
    return path


def _example(name: str, kinds: Sequence[str]) -> str:
    last = name.split(".")[-1]
    known = (p for kind in kinds for p in all_paths(kind) if p.split(".")[0] in ("fabric", "rig"))
    return next((p for p in known if p.split(".")[-1] == last), "fabric.macro.bending_stiffness.warp")


def _start(one: file.Parameter, here: Quantity | float | None) -> float:
    for value in (one.start, one.mean, here.value if isinstance(here, Quantity) else here):
        if value is not None and one.low <= value <= one.high:
            return value
    return float(np.sqrt(one.low * one.high)) if one.spacing == "log" else 0.5 * (one.low + one.high)


def current(path: KeyPath, runs: Sequence[Run]) -> Quantity | float | None:
    """Number at ``path`` in the first run that has it; ``None`` for anything but a number."""
    for run in runs:
        if place(path, run.rig.kind) is None:
            continue
        value: object = run
        for part in path:
            value = getattr(value, str(part), None)
        return value if isinstance(value, Quantity | int | float) else None
    return None
