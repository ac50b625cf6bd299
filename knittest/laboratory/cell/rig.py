"""Motion of a cell: its lattice along the path, or two plates that close on it."""

from typing import cast

import numpy as np

from knittest.laboratory.cell.config import CellRun
from knittest.laboratory.cell.path import CellPath, path_of, timed
from knittest.models.boundary import Boundary
from knittest.models.crossings import surfaces
from knittest.models.periodic_model import NUMBERS, PeriodicModel
from knittest.models.readings import Readings
from knittest.models.table import Table, constant
from knittest.models.tool import plane

#: gap between the plates and the yarns at the start [mm]
GAP = 0.002
#: way of the plates over the thickness after which no fabric is left
MOST_CLOSED = 0.9


class CellTest:
    """Drives the lattice of ``model`` along its path; between plates until they press hard enough."""

    coordinate, force = "path_pct", "conjugate_force"
    marks: tuple[float, ...] = ()
    mounted_at, averaged_from = 0.0, np.inf
    #: whether a yarn has come to its fracture strain
    torn = False
    #: whether the run has come to where it ends on the way of its path
    arrived = False

    def __init__(self, run: CellRun, model: PeriodicModel) -> None:
        self.model, self.pressed = model, run.rig.path == "compaction"
        self.own = np.flatnonzero(model.owned)
        low, high = surfaces(model, self.own)
        self.thickness = high - low + 2.0 * GAP
        self.path, self.progress = self._plan(run, model)
        self.duration, self.most = self.path.duration, 1e-3 * run.rig.max_pressure
        self.bent, self.locks = run.rig.about, run.rig.path == "shear"
        self.ends_at = np.inf if run.rig.end_angle is None else run.rig.end_angle / run.rig.max_angle

    def _plan(self, run: CellRun, model: PeriodicModel) -> tuple[CellPath, Table]:
        path = path_of(run, model.reference)
        if self.pressed:
            path = CellPath(path.name, MOST_CLOSED * self.thickness, 1.0, path.at)
        return timed(run, path)

    def constrain(self, boundary: Boundary) -> None:
        """Move, free or hold all numbers of the lattice; put the plates where the yarns are."""
        model = cast(PeriodicModel, boundary.model)
        model.images.group[:] = -1  # it was let come to rest by others
        if self.bent:
            model.bend_along(model.reference[1 if self.bent == "warp" else 0])
        rates = {} if self.pressed else self.path.rates(self.progress)
        for name in NUMBERS:
            if name in self.path.free:
                model.free(boundary, name)
            else:
                model.drive(boundary, name, rates.get(name, constant(0.0)))
        if self.pressed:
            boundary.radius[self.own] = model.group.radius[self.own]
            z, radius = model.nodes.position[2, self.own], model.group.radius[self.own]
            boundary.add_tool(plane((0.0, 0.0, float((z - radius).min()) - GAP), (0.0, 0.0, 1.0)))
            boundary.add_tool(plane((0.0, 0.0, float((z + radius).max()) + GAP), (0.0, 0.0, -1.0)))
            speed = Table(self.progress.time, tuple(-self.path.end * v for v in self.progress.value))
            boundary.move_tool(1, "z", speed)

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs along the cell."""
        return float(np.linalg.norm(self.model.reference, axis=1).max()) / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Share of the path, its coordinate, the force conjugate to that over the area, nominal mean stresses."""
        s = self.share(time)
        pull, area = readings.reaction[self.model.images.group], self.model.area
        nominal = pull[:6].reshape(2, 3).T @ self.model.reference / area
        pressure = 0.5 * float(readings.tool_force[1, 2] - readings.tool_force[0, 2]) / area if self.pressed else 0.0
        return {
            "path_pct": 100.0 * s,
            self.path.name: self.path.shown * self.path.end * s,
            "conjugate_force": pressure if self.pressed else self.path.conjugate(pull, s) / area,
            "weft_n_per_mm": float(nominal[0, 0]),
            "warp_n_per_mm": float(nominal[1, 1]),
            "shear_xy_n_per_mm": float(nominal[0, 1]),
            "shear_yx_n_per_mm": float(nominal[1, 0]),
            "moment_n": float(pull[6]) / area,
            "pressure_kpa": 1e3 * pressure,
        }

    def share(self, time: float) -> float:
        """Share of the path at ``time`` [ms]."""
        return min(self.progress.integral(time), 1.0)

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Over when the plates press hard enough, a yarn is torn, or the run has come to its own end."""
        return self.torn or self.arrived or (self.pressed and force >= self.most)
