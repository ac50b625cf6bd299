"""Parts that all tests share: a prepared specimen, the interface of a test, and tension curves of the macro model."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.base.history import Array, History, Quality
from knittest.config.base import Quantity
from knittest.config.fabric import Direction, Fabric
from knittest.config.run import Run
from knittest.config.yarn import TENACITY
from knittest.experiment.biaxial_table import read_biaxial, table_of
from knittest.experiment.comparison import STRAIN
from knittest.experiment.conditions import EXACT
from knittest.experiment.curves import FORCE_PER_WIDTH, ReferenceCurve, load_curve, to_force_per_width
from knittest.experiment.origin import borrowed_curves
from knittest.kernels.shell_state import Laminate
from knittest.materials.biaxial_table import BiaxialTable
from knittest.materials.laminate import DIRECTIONS, fit_table, laminate, limit_membrane
from knittest.models.boundary import Boundary
from knittest.models.explicit_model import ExplicitModel
from knittest.models.macro import ALONG, build_sheet, self_contact
from knittest.solve.state import SILENT, Observer, Rig, SimulationCost

Index = NDArray[np.int64]

#: a fracture strain may lie this share before the strain at the largest force: rounding, and the mean of peaks
MARGIN = 0.02


@dataclass(frozen=True)
class CurveCoverage:
    """Largest force of a tension curve at ``end`` [%], of which the macro model misses the share ``lost`` [-]."""

    direction: Direction
    end: float
    fracture_strain: Quantity
    lost: float
    is_borrowed: bool

    @property
    def is_cut(self) -> bool:
        """Tell whether the fracture strain lies before the largest force by more than the margin."""
        return self.fracture_strain.value < (1.0 - MARGIN) * self.end

    def text(self) -> str:
        """Say which curve is cut, and by how much."""
        strain = self.fracture_strain
        return (
            f"macro.fracture_strain.{self.direction} = {strain.value:g} % ({strain.source}) cuts macro.tension."
            f"{self.direction} before its largest force at {self.end:.4g} %; {100.0 * self.lost:.0f} % of this force "
            "are not reached"
        )


def curve_coverages(fabric: Fabric, curves: Mapping[Direction, ReferenceCurve]) -> list[CurveCoverage]:
    """Part of each tension curve up to the fracture strain of ``fabric``."""
    owners, found = borrowed_curves(fabric), []
    for direction, curve in curves.items():
        top, strain = int(np.argmax(curve.mean)), fabric.macro.fracture_strain.of(direction)
        lost = 1.0 - float(np.interp(strain.value, curve.x, curve.mean)) / float(curve.mean[top])
        found.append(
            CurveCoverage(direction, float(curve.x[top]), strain, lost, f"macro.tension.{direction}" in owners)
        )
    return found


def check_fracture_strains(fabric: Fabric, curves: Mapping[Direction, ReferenceCurve]) -> None:
    """Raise :class:`InputError` for an assumed fracture strain that cuts a curve of the fabric's own."""
    for one in curve_coverages(fabric, curves):
        if one.is_cut and one.fracture_strain.source == "assumed" and not one.is_borrowed:
            raise InputError(
                f"fabric {fabric.name}: {one.text()}. Give the strain at the largest force of your tests, about "
                f"{one.end:.3g} %, with its source (knittest new NAME --from FOLDER copies it from the import)"
            )


def check_curve_strength(fabric: Fabric, curves: Mapping[Direction, ReferenceCurve]) -> None:
    """Raise :class:`InputError` for a curve that no fibres of the area mass of ``fabric`` can carry."""
    most = TENACITY * fabric.area_mass.value  # g/m2 are tex a mm of width
    for direction, curve in curves.items():
        if (top := float(np.max(curve.mean))) > most:
            file, remedy = "", "divide it by the width"
            if curve.file:
                file, remedy = f" ({curve.file})", "name the column force_n and add a line # strip_width_mm: ..."
            raise InputError(
                f"fabric {fabric.name}, macro.tension.{direction}{file}: {top:.4g} N/mm at area_mass = "
                f"{fabric.area_mass.value:g} g/m2 exceeds the strength of fibres ({TENACITY:g} N/tex: {most:.4g} N/mm)."
                f" If it is the force of a whole strip, {remedy}"
            )


def tension_curves(fabric: Fabric) -> dict[Direction, ReferenceCurve]:
    """:func:`tension_curve` of both directions."""
    return {d: tension_curve(fabric, d) for d in DIRECTIONS}


def cut_curve_warnings(run: Run) -> tuple[str, ...]:
    """Warn of each curve that a stated fracture strain cuts, of a macro model."""
    macro = run.fabric.macro
    if run.model.scale != "macro" or macro.fracture_strain is None or macro.biaxial is not None:
        return ()
    return tuple(one.text() for one in curve_coverages(run.fabric, tension_curves(run.fabric)) if one.is_cut)


def nontrivial_factors(factors: Iterable[float]) -> tuple[float, ...]:
    """``factors``; empty where all are 1."""
    found = tuple(factors)
    return () if all(math.isclose(factor, 1.0, rel_tol=EXACT) for factor in found) else found


#: the run of a test
RunT = TypeVar("RunT", bound=Run, contravariant=True)


class StaticMount(ABC):
    """A mount that only holds the model, of a test that looks for an equilibrium without time."""

    @abstractmethod
    def constrain(self, boundary: Boundary) -> None:
        """Hold ``boundary.model``."""


@dataclass(frozen=True)
class PreparedSpecimen:
    """A model with its rig or holder, ``yarns``, ``facts`` for results, ``notes``, and ratios for ``restarts``."""

    model: ExplicitModel
    mount: Rig | StaticMount
    geometry_s: float = 0.0
    yarns: dict[str, np.ndarray] = field(default_factory=dict)
    facts: dict[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    restarts: tuple[str, ...] = ()

    @property
    def rig(self) -> Rig:
        """Rig that moves the model; raises :class:`TypeError` for a holder."""
        if isinstance(self.mount, StaticMount):
            raise TypeError(f"{type(self.mount).__name__} is a holder: it has no motion to simulate")
        return self.mount

    @property
    def duration(self) -> float:
        """Longest time [ms] of the test; 0 for a holder."""
        return 0.0 if isinstance(self.mount, StaticMount) else self.mount.duration


class Test(Protocol[RunT]):
    """A test of the laboratory, of one kind of runs."""

    #: whether a failure of the specimen ends the test early
    ends_at_failure: bool
    #: whether a meso test restarts at a lower speed when an energy ratio exceeds its limit
    lowers_speed: bool = False

    def completed(self, run: RunT) -> tuple[Run, str]:
        """Estimate what ``run`` leaves open; return the run and a sentence on the estimate, empty if none is needed."""
        return run, ""

    def check_run(self, run: RunT) -> None:
        """Raise :class:`InputError` for a run without a possible specimen, before one is made."""
        return

    @abstractmethod
    def prepare(self, run: RunT, specimen: int = 0, observer: Observer = SILENT) -> PreparedSpecimen:
        """Cut and mount specimen number ``specimen``."""

    @abstractmethod
    def solve(self, prepared: PreparedSpecimen, run: RunT, observer: Observer) -> tuple[History, SimulationCost]:
        """Simulate the test."""

    def finish(self, run: RunT, prepared: PreparedSpecimen, history: History) -> History:
        """Return the part of a ``history``, whole or ended early, from which results are read: all by default."""
        return history

    @abstractmethod
    def results(self, run: RunT, prepared: PreparedSpecimen, history: History) -> dict[str, float]:
        """Return the numbers of summary.json, with their unit in the name."""

    @abstractmethod
    def assess(self, run: RunT, prepared: PreparedSpecimen, history: History, cost: SimulationCost) -> Quality:
        """Evaluate the quality checks."""


def fabric_laminate(run: Run) -> Laminate:
    """Laminate of the run's fabric with its tension curves; raises :class:`InputError` for an unfit card."""
    if missing := run.fabric.macro.missing_card_parts:
        raise InputError(
            f"fabric {run.fabric.name}: missing macro.{', macro.'.join(missing)}; knittest homogenise --from cell "
            "derives them from the yarns and writes the complete fabric file"
        )
    if run.solver.target_step is not None:
        raise InputError(
            f"solver.target_step = {run.solver.target_step:g} us: a macro model has no mass scaling; remove it"
        )
    if (table := biaxial_table(run.fabric)) is not None:
        return laminate(run.fabric, {}, shear_curve(run), table)
    curves = tension_curves(run.fabric)
    check_fracture_strains(run.fabric, curves)
    check_curve_strength(run.fabric, curves)
    return laminate(run.fabric, {d: (c.x, c.mean) for d, c in curves.items()}, shear_curve(run))


def limited_laminate(run: Run, share: float) -> Laminate:
    """Laminate that keeps a ``share`` of its largest membrane tangents, and breaks at the force at which it would.

    With a law of two strains it is the inlays that are softer: springs in series with them leave all forces, also those
    of the loops, as they are. The stiffness in compression stays about as it is.
    """
    card, table = fabric_laminate(run), biaxial_table(run.fabric)
    if table is None:
        return limit_membrane(card, share)
    fail, fabric = card.fail_strain.copy(), run.fabric
    if not (share < 1.0 and fabric.inlays):
        return card
    for i, direction in enumerate(DIRECTIONS):
        if fabric.inlays_along(direction):
            if np.isfinite(fail[i]):
                fail[i] += table.force_at(i, float(fail[i])) / table.spring(i, share)
            table = table.with_springs(i, share)
    pushed = fabric.macro.compression_ratio
    pushed = pushed.model_copy(update={"value": min(pushed.value / share, 1.0)})
    fabric = fabric.model_copy(update={"macro": fabric.macro.model_copy(update={"compression_ratio": pushed})})
    return laminate(fabric, {}, shear_curve(run), table)._replace(fail_strain=fail)


def sheet_model(
    run: Run, points: Array, cells: Index, warp: ArrayLike = ALONG, strength: Array | None = None
) -> ExplicitModel:
    """Shells of the run's fabric at ``points`` (n, 3) [mm] with corners ``cells`` (n_el, 4)."""
    fabric, contact = run.fabric, self_contact(run.fabric, run.model.macro, run.solver.safety)
    area_mass, thickness = fabric.area_mass_g_per_mm2, fabric.thickness_mm
    return build_sheet(points, cells, fabric_laminate(run), area_mass, thickness, warp, strength, contact)


def tension_curve(fabric: Fabric, direction: Direction) -> ReferenceCurve:
    """Force per width [N/mm] over strain along ``direction``, an input; raises :class:`InputError` for other data."""
    if (table := biaxial_table(fabric)) is not None:
        strain, force = fit_table(fabric, table).strip_curve(DIRECTIONS.index(direction))
        law = fabric.macro.biaxial
        assert law is not None
        source = f"strip with free sides under macro.biaxial ({law.curve or law.ref or law.source})"
        return ReferenceCurve("input", 100.0 * strain, force, None, STRAIN, FORCE_PER_WIDTH, source)
    given = fabric.macro.tension[direction]
    if not isinstance(given, str):
        strain, force = (np.array(column) for column in zip(*given.points, strict=True))
        return ReferenceCurve("input", strain, force, None, STRAIN, FORCE_PER_WIDTH, given.ref or given.source)
    curve = load_curve(data_dir() / given)
    found, where = curve.conditions, f"fabric {fabric.name}, macro.tension.{direction}"
    if found.test not in ("", "tensile") or found.direction not in ("", direction):
        stated = f"{found.test or 'tensile'} {found.direction}".strip()
        raise InputError(f"{where}: {curve.file} is a curve of {stated}; expected one of tensile {direction}")
    try:
        return to_force_per_width(curve)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def biaxial_table(fabric: Fabric) -> BiaxialTable | None:
    """Table of the fabric's law of two strains, if it has one; raises :class:`InputError` for other data."""
    if (given := fabric.macro.biaxial) is None:
        return None
    if given.curve is not None:
        return read_biaxial(data_dir() / given.curve)
    return table_of(f"fabric {fabric.name}, macro.biaxial.points", {row[:2]: row[2:] for row in given.points})


def shear_curve(run: Run) -> ReferenceCurve | None:
    """Curve of the fabric's shear law, if it names a file."""
    path = run.fabric.macro.shear.curve
    return None if path is None else load_curve(data_dir() / path)
