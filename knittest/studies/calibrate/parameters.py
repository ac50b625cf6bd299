"""The numbers that a calibration looks for, on a scale from 0 at the lower bound to 1 at the upper."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from knittest.base.errors import InputError
from knittest.config import calibration as file
from knittest.config.base import Quantity
from knittest.config.fields import place
from knittest.config.number_path import number_path
from knittest.config.run import Run
from knittest.config.settings import Setting
from knittest.config.yaml_loader import Document, KeyPath, dotted
from knittest.studies.trials.draws import tried


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
        return tried(found, self.low, self.high)

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
        paths = tuple(number_path(n, where, kinds) for n in names)
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
