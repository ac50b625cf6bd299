"""Parts that all reports share, tests and reports by the name of the rig, and the stamp below the pictures of a run."""

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from inspect import isfunction
from pathlib import Path
from types import MethodType
from typing import Any, Generic, Protocol

import numpy as np

from knittest.base.errors import InputError
from knittest.base.figure import Stamp
from knittest.base.history import Body, History, Specimen
from knittest.base.kinds import Parts, TestKind, check_method_names, kinds
from knittest.base.progress import tell
from knittest.base.result_rows import mean_factor
from knittest.config.quality_checks import SolverCheck, deciding_fields, quality_checks_of, relaxed_limits
from knittest.config.run import Run
from knittest.config.sources import parameter_set_text
from knittest.experiment.conditions import Conditions
from knittest.experiment.curves import ReferenceCurve, add_note
from knittest.experiment.origin import assumed_friction, borrowed_curves
from knittest.experiment.tables import PublishedValue
from knittest.export import line_picture
from knittest.export.line_picture import Band, Level, Line
from knittest.export.yarn_pictures import faces_picture
from knittest.laboratory.base import RunT, Test
from knittest.laboratory.quality_checks import Span

Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class References:
    """Published rows, reference curve and own curves; ``apart``: reasons why rows are not compared with the run."""

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
    """Columns of curve.csv that make the curve, and the texts at its axes; ``mean`` and ``sd`` of an ensemble.

    ``others``: further columns that may be compared, with their ``labels``. ``reach``: field of the rig that ends x.
    ``peak``: result with the x of the largest force, of a test that is checked up to the first failure.
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
class QualityCheck:
    """Limit [``unit``] of a number of summary.json (``part``: quality or results)."""

    label: str
    part: str
    key: str
    limit: float
    unit: str = "%"
    scale: float = 1.0  # from the number in the file to ``unit``
    field: str = ""  # of the config, that states the limit


def energy_checks(run: Run) -> list[QualityCheck]:
    """Quality checks of every test that is integrated in time."""
    return [energy_check(run, check) for check in quality_checks_of(run)]


def energy_check(run: Run, check: SolverCheck) -> QualityCheck:
    """Quality check with its limit in ``run``."""
    limit, field = getattr(run.solver, check.limit), f"solver.{check.limit}"
    return QualityCheck(check.label, "quality", check.key, limit, scale=check.scale, field=field)


class Report(Protocol[RunT]):
    """Comparison and pictures of a test; pictures show the first specimen."""

    axes: CurveAxes
    #: facts with the places of the tools; specimens of an earlier version may lack them
    placement_facts: tuple[str, ...] = ()

    def levels(self, run: RunT) -> list[Level]:
        """Horizontal lines of the curve's picture: none by default."""
        return []

    def quality_checks(self, run: RunT) -> list[QualityCheck]:
        """Limits above which a run is not compared: by default those of every test in time."""
        return energy_checks(run)

    @abstractmethod
    def scaled(self, run: RunT, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Published rows for the size of the run's specimen."""

    def apart(self, run: RunT, rows: Sequence[PublishedValue]) -> list[str]:
        """Reasons why :meth:`scaled` leaves out some of ``rows``: none by default."""
        return []

    def factors(self, run: RunT) -> tuple[float, ...]:
        """Nominal size over that of the model, one a specimen, by which results are multiplied; none by default."""
        return ()

    def scale_to_nominal_size(self, run: RunT, columns: Mapping[str, np.ndarray]) -> Columns:
        """Columns of curve.csv with the force for the nominal size of the specimen."""
        factor, forces = mean_factor(self.factors(run)), (self.axes.y, self.axes.mean, self.axes.sd)
        return {name: factor * values if name in forces else values for name, values in columns.items()}

    def conditions(self, run: RunT) -> Conditions:
        """Conditions under which the curve of ``run`` serves as a reference: by default its test and direction."""
        return Conditions(test=run.rig.kind, direction=run.direction)

    @abstractmethod
    def scale_curve(self, run: RunT, curve: ReferenceCurve) -> ReferenceCurve:
        """Scale ``curve`` of the same test to the size of ``run``; raises :class:`InputError` if it cannot."""

    @abstractmethod
    def size(self, run: RunT) -> tuple[float, str]:
        """Size [mm] with which the forces of the specimen grow, and the same in words; 1 where there is none."""

    @abstractmethod
    def size_free_curve(self, run: RunT, columns: Mapping[str, np.ndarray]) -> tuple[CurveAxes, Columns]:
        """Axes and columns of the curve, independent of the specimen's size."""

    @abstractmethod
    def reference_curve(self, run: RunT) -> ReferenceCurve | None:
        """Curve to compare with."""

    def curve(self, specimens: list[Specimen]) -> Columns:
        """Columns of curve.csv: by default the channels of the first specimen."""
        return specimens[0].history.curve

    def tables(self, run: RunT, specimens: list[Specimen]) -> dict[str, Columns]:
        """Columns of further CSV files by name: none by default."""
        return {}

    def bodies(self, run: RunT, specimen: Specimen) -> list[Body]:
        """Tools in each frame of ``specimen``; none where it lacks a fact of ``placed_by``."""
        return self.placed(run, specimen) if set(self.placement_facts) <= specimen.facts.keys() else []

    def placed(self, run: RunT, specimen: Specimen) -> list[Body]:
        """Tools of a ``specimen`` with all facts of ``placed_by``: none by default."""
        return []

    @abstractmethod
    def pictures(self, run: RunT, specimens: list[Specimen], references: References, folder: Path) -> None:
        """Write the pictures."""


class SizeFreeReport(Generic[RunT]):
    """Part of a :class:`Report` of a test whose results do not depend on the size of the specimen."""

    axes: CurveAxes

    def scaled(self, run: RunT, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Values as they are."""
        return list(rows)

    def scale_curve(self, run: RunT, curve: ReferenceCurve) -> ReferenceCurve:
        """Curve as it is, of the same test."""
        return check_same_test(run, curve)

    def size(self, run: RunT) -> tuple[float, str]:
        """No size: a factor of 1 without a unit."""
        return 1.0, ""

    def size_free_curve(self, run: RunT, columns: Mapping[str, np.ndarray]) -> tuple[CurveAxes, Columns]:
        """The curve as it is."""
        return self.axes, dict(columns)


def check_same_test(run: Run, curve: ReferenceCurve) -> ReferenceCurve:
    """``curve``; raises :class:`InputError` where its file states another test or direction than that of ``run``."""
    stated, own = curve.conditions, (run.rig.kind, run.direction)
    if stated.test not in ("", own[0]) or (own[1] and stated.direction not in ("", own[1])):
        raise InputError(
            f"{curve.file or curve.source}: a curve of {stated.test or own[0]} {stated.direction}".rstrip()
            + f" (from its header, else its name), but the run is {' '.join(filter(None, own))}"
        )
    if own[1] and not stated.direction:
        assumed = f"the file states no direction, {own[1]} is assumed"
        return add_note(replace(curve, doubt=f"{assumed}; confirm it by a line '# direction: {own[1]}'"), assumed)
    return curve


class FabricReport(Report[RunT]):
    """Report with the pictures that most tests have: curve.png, energies.png and those of the specimen."""

    def reference_curve(self, run: RunT) -> ReferenceCurve | None:
        """No curve by default."""
        return None

    def pictures(self, run: RunT, specimens: list[Specimen], references: References, folder: Path) -> None:
        """Draw the curve, the energies, and the specimen."""
        self.draw_curve(run, specimens, references, folder / "curve.png")
        test: Any = TESTS[run.rig.kind]
        draw_energies(run, specimens, folder, test.span)
        self.draw_specimen(run, specimens[0], folder)

    def draw_curve(self, run: RunT, specimens: list[Specimen], references: References, path: Path) -> None:
        """Draw the curves of all specimens and the references."""
        self.draw_lines(run, self.simulated(specimens, self.axes.y), references, path)

    def draw_specimen(self, run: RunT, specimen: Specimen, folder: Path) -> None:
        """Draw deformed.png of yarns, at the end."""
        history, path = specimen.history, folder / "deformed.png"
        faces_picture(path, history.mesh, history.frames[-1], title=title_of(run), note=self.note(specimen))

    def note(self, specimen: Specimen) -> str:
        """Return the note below deformed.png."""
        return "at the end"

    def simulated(self, specimens: list[Specimen], column: str) -> list[Line]:
        """Lines of a ``column`` of the curve, one a specimen."""
        curves = [specimen.history.curve for specimen in specimens]
        return [Line(c[self.axes.x], c[column], f"simulated, specimen {k}") for k, c in enumerate(curves, 1)]

    def draw_lines(self, run: RunT, lines: Sequence[Line], references: References, path: Path, **texts: Any) -> None:
        """Draw ``lines`` and the references with the texts of the axes, or the ``texts`` of :func:`line_picture`."""
        usual: dict[str, Any] = {
            "title": title_of(run), "xlabel": self.axes.xlabel, "ylabel": self.axes.ylabel, "levels": self.levels(run),
            "bands": scatter_bands(references.curves),
        }  # fmt: skip
        own = [Line(c.x, c.mean, f"{c.source} ({c.kind})", "--") for c in references.curves]
        line_picture.line_picture(path, [*lines, *own], **usual | texts)


def title_of(run: Run) -> str:
    """Title of the pictures."""
    what = " ".join(part for part in (run.rig.kind, run.direction) if part)
    return f"{run.fabric.name}, {what}, {run.model.scale} ({parameter_set_text(run.parameters)})"


def scatter_bands(curves: Sequence[ReferenceCurve]) -> list[Band]:
    """Bands of the standard deviation of references."""
    return [Band(c.x, c.mean - c.sd, c.mean + c.sd, f"{c.kind}, ± sd") for c in curves if c.sd is not None]


def draw_energies(run: Run, specimens: list[Specimen], folder: Path, span: Callable[[History], Span]) -> None:
    """Draw energies.png of the first specimen, with its limits and the ``span`` that is checked."""
    history = specimens[0].history
    line_picture.energy_picture(
        folder / "energies.png", history, title=title_of(run),
        kinetic_limit=0.01 * run.solver.max_kinetic_ratio, energy_limit=0.01 * run.solver.max_energy_error,
        rows=span(history).rows(history),
    )  # fmt: skip


#: present name of each method of a test that would no longer be called by its old name
OLD_METHODS = {"refuse": "check_run", "gates": "quality_checks"}


def _make_part(kind: TestKind, part: str, protocol: type) -> Any:
    """Instance of ``part`` of ``kind`` with defaults of its ``protocol``; raises :class:`InputError` if incomplete."""
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
    check_method_names(type(made), OLD_METHODS)
    for name, default in vars(protocol).items():  # of one that does not inherit the protocol
        if name.startswith("_") or hasattr(made, name):
            continue
        if isfunction(default):
            setattr(made, name, MethodType(default, made))
        elif name in protocol.__annotations__:
            setattr(made, name, default)
    return made


# each takes runs of its own kind, which only their name tells
TESTS: Mapping[str, Test[Any]] = Parts(lambda kind: _make_part(kind, "test", Test))
REPORTS: Mapping[str, Report[Any]] = Parts(lambda kind: _make_part(kind, "report", Report))


def with_estimates(runs: Sequence[Run], quiet: bool = False) -> list[Run]:
    """Estimate what ``runs`` leave open; print the estimates unless ``quiet``."""
    found = [TESTS[run.rig.kind].completed(run) for run in runs]
    for _, text in found:
        if text and not quiet:
            tell(text)
    return [run for run, _ in found]


def run_stamp(run: Run, failures: Sequence[str]) -> Stamp:
    """Stamp of the pictures of ``run``: its size, and the ``failures`` of its quality checks."""
    test = " ".join(filter(None, (run.rig.kind, run.direction)))
    many = f"{run.variability.specimens} specimens" if run.variability.specimens > 1 else ""
    seed = f"seed {run.variability.seed}"
    facts = (
        run.fabric.name, f"parameters {parameter_set_text(run.parameters)}", test, f"{run.model.scale} model",
        f"preset {run.model.preset}", *size_of(run), many, seed,
    )  # fmt: skip
    verdict = f"rejected: {'; '.join(failures)}" if failures else "quality checks passed"
    accepted = [one.text for one in relaxed_limits(run)]
    relaxed = f", with relaxed limits: {'; '.join(accepted)}" if accepted and run.accept_limits else ""
    owners = borrowed_curves(run.fabric)
    assumed = [f"{field} of {owners[field]}" for field in deciding_fields(run) if field in owners]
    assumed += assumed_friction(run)
    ending = f"; assumed: {', '.join(assumed)}" if assumed else ""
    return Stamp(facts, f"{verdict}{relaxed}{ending}", bad=bool(failures or relaxed))


def size_of(run: Run) -> tuple[str, ...]:
    """Size of the specimen and the forces on it, in words; empty of a test that does not state it."""
    kind = kinds()[run.rig.kind]
    if isinstance(kind.size, tuple):
        return tuple(text.format(rig=run.rig) for text in kind.size)
    return tuple(kind.load("size")(run)) if kind.size else ()
