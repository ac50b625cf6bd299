"""Targets of a calibration, and the deviation of a finished trial from them in standard deviations."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.base.history import Array
from knittest.base.kinds import kinds
from knittest.base.result_rows import number_of, to_nominal_size
from knittest.config import studies as file
from knittest.config.run import Run
from knittest.config.yaml_loader import Document
from knittest.experiment.comparison import columns_of
from knittest.experiment.curves import ReferenceCurve, find_curve
from knittest.experiment.origin import ROW_NAMES
from knittest.experiment.tables import PublishedValue, published_rows
from knittest.laboratory.report_base import REPORTS
from knittest.studies.trials.trial import Record

#: points of a curve that are compared, evenly spaced over its range
CURVE_POINTS = 21
#: least scatter of a curve, as a share of its largest one: a curve that starts at the origin has none there
LEAST_SCATTER = 0.1


@dataclass(frozen=True)
class NumberTarget:
    """Target ``mean`` of the result ``quantity``; deviations are over ``sd``; both come from ``source``.

    ``factors``, one a specimen, scale results of specimens of whole yarns to the nominal size.
    """

    test: str
    quantity: str
    mean: float
    sd: float
    weight: float
    source: str
    label: str
    where: str
    factors: tuple[float, ...] = ()

    def simulated(self, record: Record, folder: Path) -> float:
        """Result in ``record`` for the nominal size; raises :class:`InputError` if the test has none."""
        if self.quantity not in record.values:
            known = ", ".join(record.values)
            raise InputError(f"{self.where}: quantity = {self.quantity}: the test has no such result (known: {known})")
        found = number_of(to_nominal_size(record.values[self.quantity], self.factors))
        return math.nan if found is None else found

    def deviations(self, record: Record, folder: Path) -> Array:
        """Deviation from the mean over sd (1,)."""
        return np.array([(self.simulated(record, folder) - self.mean) / self.sd])


@dataclass(frozen=True)
class CurveTarget:
    """Reference curve for the test ``run``; ``sd`` (n,) belongs to the points ``x`` (n,), ``y`` (n,)."""

    test: str
    run: Run
    reference: ReferenceCurve
    x: Array
    y: Array
    sd: Array
    weight: float
    label: str
    where: str

    @property
    def source(self) -> str:
        """Source of the curve, its kind (measured), and how it was scaled to the test."""
        note = f"; {self.reference.note}" if self.reference.note else ""
        return f"{self.reference.source} ({self.reference.kind}{note})"

    def simulated(self, record: Record, folder: Path) -> float:
        """Root mean square of the deviations."""
        return float(np.sqrt(np.sum(self.deviations(record, folder) ** 2)))

    def deviations(self, record: Record, folder: Path) -> Array:
        """Deviations over sd and sqrt(n) (n,), as a curve weighs as a number; after its end the last force counts."""
        import pandas as pd

        table = pd.read_csv(folder / "curve.csv")
        columns = {str(name): table[name].to_numpy(float) for name in table}
        columns = REPORTS[self.run.rig.kind].scale_to_nominal_size(self.run, columns)
        x, y = (columns[name] for name in columns_of(columns, self.reference))
        forward = np.append(True, x[1:] > np.maximum.accumulate(x)[:-1])
        found = np.interp(self.x, x[forward], y[forward])
        return np.asarray((found - self.y) / self.sd / np.sqrt(len(self.x)))


Target = NumberTarget | CurveTarget


def targets_of(calibration: file.Calibration, document: Document, runs: dict[str, Run]) -> list[Target]:
    """Read all targets; ``runs`` are the tests by name. Raises :class:`InputError` for one without data or scatter."""
    folder = Path(document.source).resolve().parent
    found: list[Target] = []
    for number, one in enumerate(calibration.targets):
        where = document.place_of(("targets", number))
        if one.test not in runs:
            raise InputError(f"{where}: test = {one.test}: no such test in this file (known: {', '.join(runs)})")
        run = runs[one.test]
        found.append(_curve_target(one, run, folder, where) if one.curve else _number_target(one, run, where))
    return found


def _number_target(one: file.Target, run: Run, where: str) -> NumberTarget:
    quantity = str(one.quantity)
    if one.value is not None and one.sd is not None:
        label = f"{run.direction} {quantity} = {one.value:g}".strip()
        return NumberTarget(one.test, quantity, one.value, one.sd, one.weight, "given in the file", label, where)
    row = _published_row(quantity, run, where)
    sd = row.sd if one.sd is None else one.sd
    if not sd > 0.0:
        raise InputError(f"{where}: quantity = {quantity}: the table states no scatter: add sd")
    named = (f"V{run.fabric.experiment_variant}", run.direction, ROW_NAMES.get(quantity, quantity))
    label = " ".join(filter(None, named))
    return NumberTarget(one.test, quantity, row.mean, sd, one.weight, row.table, label, where, row.factors)


def _published_row(quantity: str, run: Run, where: str) -> PublishedValue:
    fabric = run.fabric
    if fabric.experiment is None or fabric.experiment_variant is None:
        raise InputError(f"{where}: quantity = {quantity}: {fabric.name} names no experiment: add value and sd")
    folder = data_dir() / fabric.experiment
    try:
        rows = published_rows(folder, fabric.experiment_variant, run.direction, kinds()[run.rig.kind].published)
    except InputError as error:
        raise InputError(f"{where}: quantity = {quantity}: {error}; add value and sd instead") from None
    report = REPORTS[run.rig.kind]
    scaled = [row for row in report.scaled(run, rows) if row.quantity == quantity]
    if apart := report.apart(run, [row for row in rows if row.quantity == quantity]):
        raise InputError(f"{where}: quantity = {quantity}: {'; '.join(apart)}; or add value and sd")
    if not scaled:
        wanted = f"variant {fabric.experiment_variant} {run.direction}".strip()
        raise InputError(f"{where}: quantity = {quantity}: no row of {wanted} in {folder}: add value and sd")
    return scaled[0]


def _curve_target(one: file.Target, run: Run, folder: Path, where: str) -> CurveTarget:
    own = folder / str(one.curve)
    try:
        found = find_curve(own if own.is_file() else Path(str(one.curve)))
        reference: ReferenceCurve = REPORTS[run.rig.kind].scale_curve(run, found)
    except InputError as error:
        raise InputError(f"{where}: curve: {error}") from None
    x = np.linspace(reference.x[0], reference.x[-1], CURVE_POINTS)
    if reference.sd is None and one.sd is None:
        raise InputError(f"{where}: curve = {one.curve}: it has no third column with the sd of the force: add sd")
    own_sd = np.full(CURVE_POINTS, one.sd or 0.0)
    sd = own_sd if reference.sd is None or one.sd else np.interp(x, reference.x, reference.sd)
    if not sd.max() > 0.0:
        raise InputError(f"{where}: curve = {one.curve}: its sd is 0 everywhere: add sd")
    y, sd = np.interp(x, reference.x, reference.mean), np.maximum(sd, LEAST_SCATTER * sd.max())
    label = f"{run.direction} curve {Path(str(one.curve)).name}".strip()
    return CurveTarget(one.test, run, reference, x, y, sd, one.weight, label, where)
