"""Small yarn models posed by hand for the verification tests."""

import numpy as np

from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.fabric.strip import YarnPath
from knittest.fabric.variability import YarnDraws
from knittest.kernels import monitor
from knittest.kernels.explicit import SCRATCH
from knittest.kernels.options import PARTITIONS
from knittest.kernels.state import Motions, Tally
from knittest.models.meso import build_meso
from knittest.models.yarn_model import YarnModel

NO_MOTION = Motions(
    np.zeros(PARTITIONS + 1, np.int64), *(np.zeros(0, np.int64) for _ in range(3)), np.zeros((0, 2)), np.zeros((0, 2))
)


def card(*sets: str) -> Run:
    """Variant 1 as measured at the meso scale, with settings."""
    return resolve(variant="1", scale="meso", parameters="as-measured", sets=list(sets))


def unbreakable(n: int = 1) -> YarnDraws:
    return YarnDraws(np.full(n, 10.0), np.zeros(n), np.ones(n), np.full(n, 0.5))


def yarns(run: Run, *points: np.ndarray, systems: tuple[str, ...] = ("warp", "weft"), draws=None) -> YarnModel:
    """Model of one yarn a system through ``points``."""
    paths = [YarnPath(s, 0, np.asarray(p, float)) for s, p in zip(systems, points, strict=False)]
    return build_meso(run, paths, draws or {s: unbreakable() for s in ("warp", "weft", "knit")})


class Driver:
    """Steps a model by hand: loads by a velocity kick, damping, energies."""

    def __init__(self, model: YarnModel, damping: float = 0.0, safety: float = 0.9) -> None:
        self.model, self.dt, self.time = model, safety * model.critical_step, 0.0
        model.nodes.keep[:] = np.exp(-damping * self.dt)
        self.tally = Tally(np.zeros((PARTITIONS, 1)), np.zeros((PARTITIONS, 3)))
        self.scratch = np.zeros((PARTITIONS, SCRATCH))
        self.load = np.zeros((3, model.n_nodes + 1))
        model.prepare()

    def step(self, steps: int, loaded: bool = False) -> None:
        """Advance; a constant load needs its impulse every step."""
        for _ in range(steps if loaded else 1):
            if loaded:
                self.model.nodes.velocity[:] += self.dt * self.load * self.model.nodes.inv_mass
            n = 1 if loaded else steps
            self.model.advance(n, self.time, self.dt, NO_MOTION, self.tally, self.scratch)
            self.time += n * self.dt

    def energy(self) -> float:
        """Kinetic, elastic and dissipated energy [mJ], taken over one step as central differences conserve it."""
        stored = self.model.stored()
        self.step(1)
        kinetic, _ = monitor.kinetic_energy(self.model.nodes, self.model.mass, self.model.inertia, self.dt)
        return float(kinetic + stored.internal.sum() + stored.contact + self.tally.energy[:, 1].sum())


def clamp(model: YarnModel, node: int) -> None:
    """Hold all degrees of freedom of a node."""
    for array in (model.nodes.inv_mass, model.nodes.inv_inertia, model.mass, model.inertia):
        array[node] = 0.0
