"""Small yarn models posed by hand for the verification tests."""

import numpy as np

from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.fabric.strip import YarnPath
from knittest.fabric.topology import YarnDraws
from knittest.kernels.state import Tally
from knittest.models.meso import build_meso
from knittest.models.yarn_model import YarnModel
from knittest.pose import Body


def card(*sets: str) -> Run:
    """Variant 1 as measured at the meso scale, with settings."""
    return resolve(variant="1", scale="meso", parameters="as-measured", sets=list(sets))


def unbreakable(n: int = 1) -> YarnDraws:
    return YarnDraws(np.full(n, 10.0), np.zeros(n), np.ones(n), np.full(n, 0.5))


def yarns(run: Run, *points: np.ndarray, systems: tuple[str, ...] = ("warp", "weft"), draws=None) -> YarnModel:
    """Model of one yarn a system through ``points``."""
    paths = [YarnPath(s, 0, np.asarray(p, float)) for s, p in zip(systems, points, strict=False)]
    return build_meso(run, paths, draws or {s: unbreakable() for s in ("warp", "weft", "knit")})


class Driver(Body):
    """A body with constant loads that can be set at any time, and its energy as one number."""

    def __init__(self, model: YarnModel, damping: float = 0.0, safety: float = 0.9) -> None:
        super().__init__(model, safety, damping)
        self.load = np.zeros((3, model.n_nodes + 1))
        self.start()

    @property
    def tally(self) -> Tally:
        return self.start()[1]

    def step(self, steps: int = 1, loaded: bool = False) -> None:
        """Advance; a constant load needs its impulse every step."""
        for _ in range(steps if loaded else 1):
            if loaded:
                self.model.nodes.velocity[:] += self.dt * self.load * self.model.nodes.inv_mass
            super().step(1 if loaded else steps)

    def energy(self) -> float:
        """Kinetic, elastic and dissipated energy [mJ]."""
        e = self.energies()
        return e["kinetic"] + e["internal"] + e["contact"] + e["friction"] + e["contact_damping"]


def clamp(model: YarnModel, node: int) -> None:
    """Hold all degrees of freedom of a node."""
    for array in (model.nodes.inv_mass, model.nodes.inv_inertia, model.mass, model.inertia):
        array[node] = 0.0
