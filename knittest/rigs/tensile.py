"""Strip tensile test after DIN EN ISO 13934-1: one clamp fixed, one pulled at constant speed after a smooth start."""

import numpy as np
from numpy.typing import NDArray

from knittest.config.run import Run
from knittest.kernels.state import Motions
from knittest.models.explicit_model import ExplicitModel
from knittest.rigs.base import clamp, make_motions

Array = NDArray[np.float64]

#: a node this close to a clamp edge is gripped [mm]
EDGE = 1e-6


class TensileTest:
    """Pulls the strip along ``axis`` (0: x, 1: y) over a ``gauge`` length [mm]."""

    def __init__(self, run: Run, axis: int, gauge: float) -> None:
        self.axis, self.gauge = axis, gauge
        self.speed, self.ramp = run.solver.kernel("speed"), max(run.solver.kernel("ramp"), 1e-6)
        self.max_strain = run.rig.kernel("max_strain")
        self.stop_ratio = run.rig.stop_force_ratio
        self.duration = 0.5 * self.ramp + self.max_strain * self.gauge / self.speed

    def constrain(self, model: ExplicitModel) -> Motions:
        """Grip all nodes outside the gauge length, which lies in the middle of the model."""
        along = model.position()[:, self.axis]
        middle = 0.5 * (along.min() + along.max())
        fixed = np.flatnonzero(along <= middle - 0.5 * self.gauge + EDGE)
        moving = np.flatnonzero(along >= middle + 0.5 * self.gauge - EDGE)
        node = np.concatenate([fixed, moving])
        clamp(model, node)
        motion = np.repeat(np.array([0, 1]), [len(fixed), len(moving)])
        dof = np.full(len(node), self.axis)
        return make_motions(
            model, node, dof, motion, [[0.0, self.ramp], [0.0, self.ramp]], [[0.0, 0.0], [0.0, self.speed]]
        )

    def travel(self, time: float) -> float:
        """Clamp travel [mm] at ``time`` [ms]: the integral of the smooth start and the constant speed."""
        u = min(time / self.ramp, 1.0)
        ramped = self.ramp * self.speed * (2.5 * u**4 - 3.0 * u**5 + u**6)
        return ramped + self.speed * max(time - self.ramp, 0.0)

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs along the gauge length."""
        return self.gauge / wave_speed

    def channels(self, time: float, reactions: Array) -> dict[str, float]:
        """Displacement, engineering strain of the gauge and force at both clamps."""
        travel = self.travel(time)
        return {
            "displacement_mm": travel,
            "strain_pct": 100.0 * travel / self.gauge,
            "force_n": float(reactions[1]),
            "force_fixed_n": -float(reactions[0]),
        }

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Over when something has failed and the force has fallen to a share of its peak."""
        return broken and force < self.stop_ratio * peak
