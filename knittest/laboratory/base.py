"""Parts that all tests share: a prepared specimen, the interface of a test, the part of a tension curve that shells
reach.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.base.history import History, Quality
from knittest.config.base import Quantity
from knittest.config.fabric import Direction, Fabric
from knittest.config.run import Run
from knittest.config.yarn import TENACITY
from knittest.experiment.compare import STRAIN
from knittest.experiment.curves import FORCE_PER_WIDTH, ReferenceCurve, load_curve, per_width
from knittest.experiment.origin import borrowed
from knittest.kernels.shell_state import Laminate
from knittest.materials.laminate import laminate
from knittest.models.boundary import Boundary
from knittest.models.explicit_model import ExplicitModel
from knittest.solve.state import SILENT, Observer, Rig, SimulationCost

#: a fracture strain may stand this share before the strain at the largest force: rounding, and the mean of peaks
MARGIN = 0.02


@dataclass(frozen=True)
class Reach:
    """Largest force of a curve, at ``end`` [%], beside the ``fracture_strain`` of its ``direction``.

    ``lost`` is the share of that force which the shells do not reach [-]; ``borrowed``: the curve is another fabric's.
    """

    direction: Direction
    end: float
    fracture_strain: Quantity
    lost: float
    borrowed: bool

    @property
    def is_cut(self) -> bool:
        """Tell whether the fracture strain lies before the largest force by more than the margin."""
        return self.fracture_strain.value < (1.0 - MARGIN) * self.end

    @property
    def is_blunder(self) -> bool:
        """Tell whether nobody vouches for the number that cuts the fabric's own curve."""
        return self.is_cut and self.fracture_strain.source == "assumed" and not self.borrowed

    def text(self) -> str:
        """Sentence on what is cut, and by how much."""
        strain = self.fracture_strain
        return (
            f"macro.fracture_strain.{self.direction} = {strain.value:g} % ({strain.source}) cuts macro.tension."
            f"{self.direction}, whose largest force is at {self.end:.4g} %: {100.0 * self.lost:.0f} % of it are lost"
        )


def reaches(fabric: Fabric, curves: Mapping[Direction, ReferenceCurve]) -> list[Reach]:
    """Parts of its tension ``curves`` that the fracture strains of ``fabric`` leave."""
    owners = borrowed(fabric)
    found = []
    for direction, curve in curves.items():
        top, strain = int(np.argmax(curve.mean)), fabric.macro.fracture_strain.of(direction)
        lost = 1.0 - float(np.interp(strain.value, curve.x, curve.mean)) / float(curve.mean[top])
        end = float(curve.x[top])
        found.append(Reach(direction, end, strain, lost, f"macro.tension.{direction}" in owners))
    return found


def refuse_blunders(fabric: Fabric, curves: Mapping[Direction, ReferenceCurve]) -> None:
    """Raise :class:`InputError` for an assumed fracture strain that cuts a curve of the fabric's own."""
    for one in reaches(fabric, curves):
        if one.is_blunder:
            raise InputError(
                f"fabric {fabric.name}, {one.text()}; expected that of your tests, about {one.end:.3g} %, with its "
                "source (knittest new NAME --from FOLDER takes it over from the import)"
            )


def refuse_too_strong(fabric: Fabric, curves: Mapping[Direction, ReferenceCurve]) -> None:
    """Raise :class:`InputError` for a curve that no fibres of the area mass of ``fabric`` can carry."""
    most = TENACITY * fabric.area_mass.value  # g/m2 are tex a mm of width
    for direction, curve in curves.items():
        if (top := float(np.max(curve.mean))) > most:
            raise InputError(
                f"fabric {fabric.name}, macro.tension.{direction} ({curve.file}): {top:.4g} N/mm at area_mass = "
                f"{fabric.area_mass.value:g} g/m2, expected at most {most:.4g} N/mm, {TENACITY:g} N/tex as of fibres: "
                "the force of a whole strip? Then name the column force_n, under a line # strip_width_mm: ..."
            )


def cut_curves(fabric: Fabric, curves: Mapping[Direction, ReferenceCurve]) -> tuple[str, ...]:
    """A warning for each curve that a stated fracture strain cuts."""
    return tuple(one.text() for one in reaches(fabric, curves) if one.is_cut)


#: the run of a test
RunT = TypeVar("RunT", bound=Run, contravariant=True)


class Holder(ABC):
    """A mount that only holds: the test looks for a state of rest, and no time passes."""

    @abstractmethod
    def constrain(self, boundary: Boundary) -> None:
        """Hold ``boundary.model``."""


@dataclass(frozen=True)
class Prepared:
    """A model with its rig, or with a holder where nothing moves.

    ``yarns`` is the table of drawn yarns, ``facts`` numbers that results need, ``notes`` what the model leaves out.
    ``restarts`` are the shares of energies by which the test may restart at a lower speed
    (:mod:`knittest.laboratory.after_rest`).
    """

    model: ExplicitModel
    mount: Rig | Holder
    geometry_s: float = 0.0
    yarns: dict[str, np.ndarray] = field(default_factory=dict)
    facts: dict[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    restarts: tuple[str, ...] = ()

    @property
    def rig(self) -> Rig:
        """Rig that moves the model; raises :class:`TypeError` where it is only held."""
        if isinstance(self.mount, Holder):
            raise TypeError(f"{type(self.mount).__name__} only holds the model: it has no motion to simulate")
        return self.mount

    @property
    def duration(self) -> float:
        """Longest time [ms] of the test; none passes where the model is only held."""
        return 0.0 if isinstance(self.mount, Holder) else self.mount.duration


class Test(Protocol[RunT]):
    """A test of the laboratory, of one kind of runs."""

    #: whether a failure of the specimen ends it before the rig's motion does
    ends_at_failure: bool
    #: whether a test of yarns restarts at a lower speed where a share of its energies exceeds its limit
    lowers_speed: bool = False

    def completed(self, run: RunT) -> tuple[Run, str]:
        """``run`` with an estimate of what it leaves open, and a sentence that says so; as it is, and none."""
        return run, ""

    def refuse(self, run: RunT) -> None:
        """Raise :class:`InputError` for a run that no specimen fits, as far as that is known before one is made."""
        return

    @abstractmethod
    def prepare(self, run: RunT, specimen: int = 0, observer: Observer = SILENT) -> Prepared:
        """Cut and mount specimen number ``specimen``."""

    @abstractmethod
    def solve(self, prepared: Prepared, run: RunT, observer: Observer) -> tuple[History, SimulationCost]:
        """Run it."""

    def finish(self, run: RunT, prepared: Prepared, history: History) -> History:
        """Return what is read of a ``history`` of this test, whole or ended early; by default all of it."""
        return history

    @abstractmethod
    def results(self, run: RunT, prepared: Prepared, history: History) -> dict[str, float]:
        """Numbers of summary.json, with their unit in the name."""

    @abstractmethod
    def assess(self, run: RunT, prepared: Prepared, history: History, cost: SimulationCost) -> Quality:
        """Quality gates."""


def fabric_laminate(run: Run) -> Laminate:
    """Laminate of the run's fabric with its tension curves.

    Raises :class:`InputError` for a card that is not complete, for mass scaling, which shells lack, for an assumed
    fracture strain that cuts a curve of the fabric's own, and for a curve beyond the strength of fibres.
    """
    if missing := run.fabric.macro.missing:
        raise InputError(
            f"fabric {run.fabric.name}: macro.{', macro.'.join(missing)} are missing: knittest homogenise --from cell "
            "derives them from the yarns and writes a fabric file that has them"
        )
    if run.solver.target_step is not None:
        raise InputError(
            f"solver.target_step = {run.solver.target_step:g} us: shells are not mass-scaled; leave it out"
        )
    curves = tension_curves(run.fabric)
    refuse_blunders(run.fabric, curves)
    refuse_too_strong(run.fabric, curves)
    return laminate(run.fabric, {d: (c.x, c.mean) for d, c in curves.items()}, shear_curve(run))


def tension_curves(fabric: Fabric) -> dict[Direction, ReferenceCurve]:
    """:func:`tension_curve` of both directions."""
    return {d: tension_curve(fabric, d) for d in fabric.macro.tension}


def cut_curve_warnings(run: Run) -> tuple[str, ...]:
    """A warning for each curve of which the shells of ``run`` reach a part only."""
    return cut_curves(run.fabric, tension_curves(run.fabric)) if run.model.scale == "macro" else ()


def tension_curve(fabric: Fabric, direction: Direction) -> ReferenceCurve:
    """Force per width [N/mm] over strain that the shells are fed along ``direction``.

    Raises :class:`InputError` for a file of the other direction or another test, and for the force of a strip of
    unknown width.
    """
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
        return per_width(curve)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def shear_curve(run: Run) -> ReferenceCurve | None:
    """Curve of the fabric's shear law, if it names a file."""
    path = run.fabric.macro.shear.curve
    return None if path is None else load_curve(data_dir() / path)
