"""Parts that all reports share."""

import math
from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Generic, Protocol

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Body, History, Specimen
from knittest.base.result_rows import mean_factor
from knittest.config.gates import SolverGate, gates_of
from knittest.config.run import Run
from knittest.config.sources import numbers_of
from knittest.experiment.conditions import EXACT
from knittest.experiment.curves import ReferenceCurve
from knittest.experiment.forces import noted
from knittest.experiment.tables import PublishedValue
from knittest.export import energy_picture
from knittest.export.line_picture import Band, Level
from knittest.laboratory.base import RunT
from knittest.laboratory.span import Span

Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class References:
    """Published rows and the reference curve, if there are any, the curves of a user's own, and why rows stand
    ``apart``: the run is not compared with them.
    """

    rows: Sequence[PublishedValue] = ()
    curve: ReferenceCurve | None = None
    own: Sequence[ReferenceCurve] = ()
    apart: Sequence[str] = ()

    @property
    def curves(self) -> list[ReferenceCurve]:
        """All curves to compare with."""
        return [*([] if self.curve is None else [self.curve]), *self.own]


@dataclass(frozen=True)
class CurveAxes:
    """Columns of curve.csv that make the curve, and what stands at its axes; ``mean`` and ``sd`` of an ensemble;
    ``others`` may be compared with as well; ``labels`` are what stands at the axis of them; ``reach`` is the field of
    the rig that says how far x goes; ``peak`` is the result that says at which x the largest force lies, of a test
    whose gates judge up to the first failure.
    """

    x: str
    y: str
    xlabel: str
    ylabel: str
    mean: str = ""
    sd: str = ""
    logarithmic: bool = False
    others: tuple[str, ...] = ()
    labels: Mapping[str, str] = field(default_factory=dict)
    reach: str = ""
    peak: str = ""


@dataclass(frozen=True)
class Gate:
    """A number of summary.json (``part``: quality or results) that may not exceed ``limit`` [``unit``]."""

    label: str
    part: str
    key: str
    limit: float
    unit: str = "%"
    scale: float = 1.0  # from the number in the file to ``unit``
    field: str = ""  # of the config, that states the limit


def energy_gates(run: Run) -> list[Gate]:
    """The gates of every test that is integrated in time."""
    return [energy_gate(run, gate) for gate in gates_of(run)]


def energy_gate(run: Run, gate: SolverGate) -> Gate:
    """A gate on a number of the quality, with its limit in ``run``."""
    limit, field = getattr(run.solver, gate.limit), f"solver.{gate.limit}"
    return Gate(gate.label, "quality", gate.key, limit, scale=gate.scale, field=field)


class Report(Protocol[RunT]):
    """Comparison and pictures of a test; pictures show the first specimen."""

    axes: CurveAxes
    #: facts that say where its tools are: specimens that an earlier version kept may lack them
    placed_by: tuple[str, ...] = ()

    def levels(self, run: RunT) -> list[Level]:
        """Horizontal lines of the curve's picture: none unless stated."""
        return []

    def gates(self, run: RunT) -> list[Gate]:
        """Limits above which the comparison is refused: those of every test in time unless stated."""
        return energy_gates(run)

    @abstractmethod
    def scaled(self, run: RunT, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Published rows for the size of the run's specimen."""

    def apart(self, run: RunT, rows: Sequence[PublishedValue]) -> list[str]:
        """Reasons why some of ``rows`` are not among those that :meth:`scaled` returns: all are unless stated."""
        return []

    def factors(self, run: RunT) -> tuple[float, ...]:
        """Nominal size over that of the model, one a specimen, which multiplies results and curves before they are
        compared. None where both sizes are the same, or no size matters: so unless stated.
        """
        return ()

    def for_nominal_size(self, run: RunT, columns: Mapping[str, np.ndarray]) -> Columns:
        """Columns of curve.csv with the force for the nominal size of the specimen."""
        factor, forces = mean_factor(self.factors(run)), (self.axes.y, self.axes.mean, self.axes.sd)
        return {name: factor * values if name in forces else values for name, values in columns.items()}

    @abstractmethod
    def matched(self, run: RunT, curve: ReferenceCurve) -> ReferenceCurve:
        """``curve`` of another specimen as the run's curve can be compared with it: of the same test, and of its size
        or of none; says in its note what was scaled. Raises :class:`InputError` where it cannot.
        """

    @abstractmethod
    def size(self, run: RunT) -> tuple[float, str]:
        """Size that the forces of the specimen grow with [mm], and the same in words; 1 where there is none."""

    @abstractmethod
    def size_free(self, run: RunT, columns: Mapping[str, np.ndarray]) -> tuple[CurveAxes, Columns]:
        """Axes and columns of the curve as no size of a specimen enters it."""

    @abstractmethod
    def reference_curve(self, run: RunT) -> ReferenceCurve | None:
        """The curve that the run's curve is compared with."""

    def curve(self, specimens: list[Specimen]) -> Columns:
        """Columns of curve.csv: channels of the first specimen unless stated."""
        return specimens[0].history.curve

    def tables(self, run: RunT, specimens: list[Specimen]) -> dict[str, Columns]:
        """Columns of further CSV files by name, which the record of the test names: none unless stated."""
        return {}

    def bodies(self, run: RunT, specimen: Specimen) -> list[Body]:
        """Tools as they move over the frames of ``specimen``; none where it lacks a fact of ``placed_by``."""
        return self.placed(run, specimen) if set(self.placed_by) <= specimen.facts.keys() else []

    def placed(self, run: RunT, specimen: Specimen) -> list[Body]:
        """Tools of a ``specimen`` with all facts of ``placed_by``: none unless stated."""
        return []

    @abstractmethod
    def pictures(self, run: RunT, specimens: list[Specimen], references: References, folder: Path) -> None:
        """Write the pictures."""


def unless_one(factors: Iterable[float]) -> tuple[float, ...]:
    """``factors``; none where all are 1 but for rounding."""
    found = tuple(factors)
    return () if all(math.isclose(factor, 1.0, rel_tol=EXACT) for factor in found) else found


class NoSize(Generic[RunT]):
    """The part of a :class:`Report` of a test whose results do not grow with the specimen."""

    axes: CurveAxes

    def scaled(self, run: RunT, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Values as they are."""
        return list(rows)

    def matched(self, run: RunT, curve: ReferenceCurve) -> ReferenceCurve:
        """Curve as it is, of the same test."""
        return same_test(run, curve)

    def size(self, run: RunT) -> tuple[float, str]:
        """No size: a factor of 1 without a unit."""
        return 1.0, ""

    def size_free(self, run: RunT, columns: Mapping[str, np.ndarray]) -> tuple[CurveAxes, Columns]:
        """The curve as it is."""
        return self.axes, dict(columns)


def same_test(run: Run, curve: ReferenceCurve) -> ReferenceCurve:
    """``curve``; raises :class:`InputError` where its file states another test or direction than that of ``run``."""
    stated, own = curve.conditions, (run.rig.kind, run.direction)
    if stated.test not in ("", own[0]) or (own[1] and stated.direction not in ("", own[1])):
        raise InputError(
            f"{curve.file or curve.source}: a curve of {stated.test or own[0]} {stated.direction}".rstrip()
            + f" (by its header, else its name); the run is {' '.join(filter(None, own))}: not the same test"
        )
    if own[1] and not stated.direction:
        taken = f"the file states no direction: taken as {own[1]}"
        return noted(replace(curve, doubt=f"{taken}; add '# direction: {own[1]}' to its head if it is"), taken)
    return curve


def title_of(run: Run) -> str:
    """Title of the pictures; what stands below them says where a limit is looser than the preset's."""
    what = " ".join(part for part in (run.rig.kind, run.direction) if part)
    return f"{run.fabric.name}, {what}, {run.model.scale} ({numbers_of(run.parameters)})"


def scatter(curves: Sequence[ReferenceCurve]) -> list[Band]:
    """Mean and standard deviation of the references that are means of several specimens."""
    return [Band(c.x, c.mean - c.sd, c.mean + c.sd, f"{c.kind}, ± sd") for c in curves if c.sd is not None]


def draw_energies(run: Run, specimens: list[Specimen], folder: Path, span: Callable[[History], Span]) -> None:
    """energies.png of the first specimen, with the limits of the gates and the ``span`` of the run that is judged."""
    history = specimens[0].history
    energy_picture.energy_picture(
        folder / "energies.png", history, title=title_of(run),
        kinetic_limit=0.01 * run.solver.max_kinetic_ratio, energy_limit=0.01 * run.solver.max_energy_error,
        rows=span(history).rows(history),
    )  # fmt: skip
