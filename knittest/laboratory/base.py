"""Parts that all tests share: a prepared specimen, and the interface of a test."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import History, Quality
from knittest.base.resources import data_dir
from knittest.config.fabric import Direction, Fabric
from knittest.config.run import Run
from knittest.experiment.compare import STRAIN
from knittest.experiment.curves import FORCE_PER_WIDTH, ReferenceCurve, load_curve
from knittest.experiment.forces import per_width
from knittest.kernels.shell_state import Laminate
from knittest.laboratory.curve_reach import cut_curves, refuse_blunders, refuse_too_strong
from knittest.materials.laminate import laminate
from knittest.models.boundary import Boundary
from knittest.models.explicit_model import ExplicitModel
from knittest.solve.observer import SILENT, Observer
from knittest.solve.rig import Rig
from knittest.solve.state import SimulationCost

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
    (:mod:`knittest.laboratory.lowered_speed`).
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
