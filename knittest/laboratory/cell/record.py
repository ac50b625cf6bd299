"""Energies by mechanism, crossings and thickness of a cell, row by row while it is deformed."""

from collections.abc import Callable

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Array, Overlaps
from knittest.base.rounding import rounded_down
from knittest.laboratory.cell.config import STRETCHING, CellRun
from knittest.laboratory.cell.rig import CellTest
from knittest.models.crossings import Crossings, crossings, surfaces
from knittest.models.periodic_model import PeriodicModel
from knittest.solve.observer import Observer
from knittest.solve.state import Snapshot

#: share of the strain at fracture that a path is said to go to
BELOW = 0.9
NONE = Crossings(0.0, 0.0, 0.0, 0.0, 0.0)


class Recorder(Observer):
    """Records a row of the model in ``mount`` at every sample, and tells ``observer`` all that it hears."""

    def __init__(self, run: CellRun, mount: CellTest, observer: Observer) -> None:
        self.run, self.mount, self.model, self.observer = run, mount, mount.model, observer
        fabric = run.fabric
        fracture = dict.fromkeys(("warp", "weft"), fabric.reinforcing.fracture_strain_fraction)
        self.fracture = fracture | {"knit": fabric.knitting.fracture_strain_fraction}
        self.reached = 0.0

    def phase(self, text: str) -> None:
        """See :class:`Observer`."""
        self.observer.phase(text)

    def overlaps(self, found: Overlaps) -> None:
        """See :class:`Observer`."""
        self.observer.overlaps(found)

    def progress(self, fraction: float, time_ms: float, step_us: float, kinetic_ratio: float) -> None:
        """Keep a row, and see whether the run ends here; where yarns would be torn end the path, or raise
        :class:`InputError` as the run says.
        """
        self.model.record.append(row_of(self.model))
        self.mount.arrived = self.mount.share(time_ms) >= self.mount.ends_at
        if self.run.rig.path in STRETCHING:
            self._look_for_torn(fraction)
        self.reached = fraction
        self.observer.progress(fraction, time_ms, step_us, kinetic_ratio)

    def settling(self, fraction: float) -> None:
        """See :class:`Observer`."""
        self.observer.settling(fraction)

    def resume_from(self) -> Snapshot | None:
        """See :class:`Observer`."""
        return self.observer.resume_from()

    def visit(self, take: Callable[[], Snapshot]) -> None:
        """See :class:`Observer`."""
        self.observer.visit(take)

    def failed(self, take: Callable[[], Snapshot]) -> None:
        """See :class:`Observer`."""
        self.observer.failed(take)

    def _look_for_torn(self, fraction: float) -> None:
        strain, names = self.model.fields()["axial_strain"], self.model.mesh.part_names
        for k, name in enumerate(names):
            of = self.model.mesh.part == k
            if of.any() and (largest := float(strain[of].max())) > self.fracture[name]:
                self.mount.torn = True
                if self.run.rig.torn == "ends":
                    return
                # yarns grow stiffer: a path of this share of the present one strains them by less than to fracture
                would_do = max(self.reached, BELOW * fraction * self.fracture[name] / largest)
                raise InputError(torn(self.run, name, self.fracture[name], would_do))


def torn(run: CellRun, system: str, fracture: float, share: float) -> str:
    """Say that the path tears ``system``, and what would do: ``share`` of it."""
    rig = run.rig
    if rig.path == "steps":
        remedy = f"end the steps at {100.0 * share:.0f} % of their way"
    else:
        remedy = f"rig.max_strain={rounded_down(share * rig.max_strain):g} would do"
    return f"rig.path = {rig.path}: it tears the {system} yarns, which break at {100.0 * fracture:.2f} %; {remedy}"


def row_of(model: PeriodicModel) -> dict[str, float]:
    """Elastic energies [mJ] by system and mechanism, crossings by kind, and thickness [mm]."""
    names, energies = model.mesh.part_names, model.beam_energies()
    row = {f"{m}_{part}_mj": float(v[k]) for m, v in energies.items() for k, part in enumerate(names)}
    found = crossings(model)
    for k, one in enumerate(names):
        for other in names[k:]:
            of, label = found.get(f"{one}-{other}", NONE), f"{one}_{other}"
            row |= {
                f"{label}_contacts": of.count, f"{label}_normal_force_n": of.normal_force,
                f"{label}_largest_force_n": of.largest_force, f"{label}_angle_deg": of.angle,
            }  # fmt: skip
    low, high = surfaces(model, np.flatnonzero(model.owned))
    return row | {"thickness_mm": high - low}


def split(record: list[dict[str, float]]) -> tuple[dict[str, Array], dict[str, Array]]:
    """Columns of the energies, and of the contacts, in ``record``."""
    columns = {name: np.array([row[name] for row in record]) for name in record[0]}
    energies = {name: values for name, values in columns.items() if name.endswith("_mj")}
    return energies, {name: values for name, values in columns.items() if name not in energies}
