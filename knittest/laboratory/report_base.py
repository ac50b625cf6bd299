"""Parts that all reports share, tests and reports by the name of the rig, and the stamp below the pictures of a run."""

import math
from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from inspect import isfunction
from pathlib import Path
from types import MethodType
from typing import Any, Generic, Protocol

import numpy as np

from knittest.base.errors import InputError
from knittest.base.figure import Stamp
from knittest.base.history import Body, History, Specimen
from knittest.base.kinds import Parts, TestKind, kinds
from knittest.base.progress import tell
from knittest.base.result_rows import mean_factor
from knittest.config.gates import SolverGate, deciding, gates_of, loosened
from knittest.config.run import Run
from knittest.config.sources import numbers_of
from knittest.experiment.conditions import EXACT
from knittest.experiment.curves import ReferenceCurve, noted
from knittest.experiment.origin import assumed_friction, borrowed
from knittest.experiment.tables import PublishedValue
from knittest.export import line_picture
from knittest.export.line_picture import Band, Level
from knittest.laboratory.base import RunT, Test
from knittest.laboratory.judging import Span

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
    line_picture.energy_picture(
        folder / "energies.png", history, title=title_of(run),
        kinetic_limit=0.01 * run.solver.max_kinetic_ratio, energy_limit=0.01 * run.solver.max_energy_error,
        rows=span(history).rows(history),
    )  # fmt: skip


def _made(kind: TestKind, part: str, protocol: type) -> Any:
    """Instance of ``part`` of ``kind``, with what its ``protocol`` does by default where the instance does not say.

    Raises :class:`InputError` where a part of the protocol without a default is missing.
    """
    maker, made = kind.load(part), None
    missing = {*getattr(maker, "__abstractmethods__", ())}  # of one that inherits the protocol, which cannot be made
    if not missing:
        made = maker()
        stated = protocol.__annotations__.keys() - vars(protocol).keys()
        wanted = {*getattr(protocol, "__abstractmethods__", ()), *stated}
        missing = {name for name in wanted if not hasattr(made, name)}
    if missing:
        lacking = ", ".join(sorted(missing))
        raise InputError(f"test {kind.name}: {getattr(kind, part)} lacks {lacking}: see {protocol.__name__}")
    for name, default in vars(protocol).items():  # of one that does not inherit the protocol
        if name.startswith("_") or hasattr(made, name):
            continue
        if isfunction(default):
            setattr(made, name, MethodType(default, made))
        elif name in protocol.__annotations__:
            setattr(made, name, default)
    return made


# each takes runs of its own kind, which only their name tells
TESTS: Mapping[str, Test[Any]] = Parts(lambda kind: _made(kind, "test", Test))
REPORTS: Mapping[str, Report[Any]] = Parts(lambda kind: _made(kind, "report", Report))


def completed(runs: Sequence[Run], quiet: bool = False) -> list[Run]:
    """``runs`` with an estimate of what they leave open, which is told unless ``quiet``."""
    found = [TESTS[run.rig.kind].completed(run) for run in runs]
    for _, said in found:
        if said and not quiet:
            tell(said)
    return [run for run, _ in found]


SCALES = {"macro": "shells (macro)", "meso": "yarns (meso)"}


def run_stamp(run: Run, failures: Sequence[str]) -> Stamp:
    """Stamp of the pictures of ``run``, whose gates refused it for ``failures`` or passed."""
    test = " ".join(filter(None, (run.rig.kind, run.direction)))
    many = f"{run.variability.specimens} specimens" if run.variability.specimens > 1 else ""
    seed = f"seed {run.variability.seed}"
    facts = (
        run.fabric.name, f"parameters {numbers_of(run.parameters)}", test, SCALES[run.model.scale],
        f"preset {run.model.preset}", *size_of(run), many, seed,
    )  # fmt: skip
    verdict = f"comparison refused: {'; '.join(failures)}" if failures else "gates passed"
    accepted = [one.stated for one in loosened(run)]
    looser = f", with accepted limits: {'; '.join(accepted)}" if accepted and run.accept_limits else ""
    return Stamp(facts, f"{verdict}{looser}{_taken_over(run)}", bad=bool(failures or looser))


def size_of(run: Run) -> tuple[str, ...]:
    """Size of the specimen and the forces on it, in words; nothing of a test that does not state it."""
    kind = kinds()[run.rig.kind]
    return tuple(kind.load("size")(run)) if kind.size else ()


def _taken_over(run: Run) -> str:
    """Curves of another fabric that decide the test, and friction that was not measured for it."""
    owners = borrowed(run.fabric)
    found = [f"{field} of {owners[field]}" for field in deciding(run) if field in owners]
    found += assumed_friction(run)
    return f"; assumed: {', '.join(found)}" if found else ""
