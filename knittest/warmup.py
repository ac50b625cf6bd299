"""Compiles the kernels of a scale on a tiny model, so that a user sees compilation as such, once."""

import time as clock
from collections.abc import Callable

import numpy as np

from knittest.config.run import Output, Run, Scale
from knittest.fabric.strip import YarnPath
from knittest.fabric.variability import YarnDraws
from knittest.materials.laminate import laminate
from knittest.models.explicit_model import ExplicitModel
from knittest.models.fabric_model import build_fabric_model
from knittest.models.macro import build_strip
from knittest.models.meso import build_meso
from knittest.rigs.tensile import TensileTest
from knittest.simulate import simulate

_warm: set[str] = set()


def compiled_before(scale: Scale) -> bool:
    """Whether the cache on disk already holds the driver of ``scale``."""
    from knittest.kernels import cache_folder

    entry = "advance_yarns" if scale == "meso" else "advance_fabric"
    return any(cache_folder().rglob(f"*{entry}*.nbc"))


def warm(run: Run, phase: Callable[[str], None] | None = None) -> float:
    """Compile, or load from the cache, what ``run`` needs; returns the seconds it took (0 the second time)."""
    scale = run.model.scale
    if scale in _warm:
        return 0.0
    if phase is not None:
        phase("loading kernels" if compiled_before(scale) else "compiling kernels (once per installation)")
    start = clock.perf_counter()
    model, axis = (_crossing_yarns(run), 1) if scale == "meso" else (_small_strip(run), 1)
    brief = run.model_copy(
        update={
            "rig": run.rig.model_copy(update={"max_strain": 1e-4}),
            "solver": run.solver.model_copy(update={"ramp": 1e-3, "target_step": None}),
        }
    )
    simulate(model, TensileTest(brief, axis, gauge=5.0), brief.solver, Output(samples=20, frames=1))
    _warm.add(scale)
    return clock.perf_counter() - start


def _crossing_yarns(run: Run) -> ExplicitModel:
    along = np.arange(-5.0, 5.01, 0.5)
    zero, above = np.zeros_like(along), np.full_like(along, run.fabric.reinforcing.kernel("beam_diameter"))
    paths = [
        YarnPath("warp", 0, np.column_stack([zero, along, zero])),
        YarnPath("weft", 0, np.column_stack([along, zero, above])),
    ]
    one = YarnDraws(np.full(1, 0.1), np.zeros(1), np.ones(1), np.full(1, 0.5))
    return build_meso(run, paths, {"warp": one, "weft": one, "knit": one})


def _small_strip(run: Run) -> ExplicitModel:
    line = (np.array([0.0, 100.0]), np.array([0.0, 1e6]))
    card = laminate(run.fabric, {"warp": line, "weft": line})
    return build_fabric_model(build_strip(run.fabric, card, "warp", 5.0, 5.0, 5.0, 5.0))
