"""Yarn-to-yarn scatter: fracture strain, slack and wave amplitude of every yarn of a specimen."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.config.fabric import Fabric
from knittest.config.run import Variability

Array = NDArray[np.float64]

#: a drawn fracture strain is not taken below this share of its mean: a yarn that weak would not survive knitting
WEAKEST = 0.2


@dataclass(frozen=True)
class YarnDraws:
    """Yarns of one system, each (n,): fracture strain [-], slack [-], relative wave amplitude [-], place of the
    weakest element along the yarn, from 0 to 1; length of the loops of each course over their mean [-], which other
    yarns have none of.
    """

    fracture_strain: Array
    slack: Array
    amplitude: Array
    weakest: Array
    loop: Array | None = None


def _uniforms(mode: str, n: int, rng: np.random.Generator) -> Array:
    """Probabilities in (0, 1): independent draws, or mid-point quantiles in random order."""
    if mode == "random":
        return np.clip(rng.random(n), 1e-12, 1.0 - 1e-12)
    return rng.permutation((np.arange(n) + 0.5) / n)


def draw(fabric: Fabric, variability: Variability, system: str, n: int, specimen: int) -> YarnDraws:
    """Draw the yarns of ``system`` (warp, weft, knit) of one specimen.

    Fracture strain and amplitude are normal, slack is half-normal (the tautest yarn has none). ``uniform`` gives every
    yarn the mean fracture strain and the median slack. The same seed and specimen give the same bits.
    """
    from scipy.stats import halfnorm, norm

    yarn = fabric.knitting if system == "knit" else fabric.reinforcing
    mean = yarn.fracture_strain_fraction
    relative = (yarn.fracture_strain.sd or 0.0) / yarn.fracture_strain.value
    slack = amplitude = 0.0
    if system != "knit":
        slack = fabric.reinforcing.slack_fraction.of(system)
        amplitude = fabric.reinforcing.crimp_scatter.of(system).value
    rng = np.random.default_rng([variability.seed, specimen, ("warp", "weft", "knit").index(system)])
    weakest = rng.random(n)
    if variability.mode == "uniform":
        return YarnDraws(np.full(n, mean), np.full(n, slack * float(halfnorm.ppf(0.5))), np.ones(n), weakest)
    strength, looseness, wave = (_uniforms(variability.mode, n, rng) for _ in range(3))
    scattered = system == "knit" and fabric.knitting.loop_scatter == "courses"
    loop = 1.0 + loop_scatter(fabric) * norm.ppf(_uniforms(variability.mode, n, rng)) if scattered else None
    return YarnDraws(
        mean * np.maximum(1.0 + relative * norm.ppf(strength), WEAKEST),
        slack * halfnorm.ppf(looseness),
        np.maximum(1.0 + amplitude * norm.ppf(wave), 0.0),
        weakest,
        loop,
    )


def loop_scatter(fabric: Fabric) -> float:
    """Standard deviation of the loop length over its mean [-]; raises :class:`InputError` where none is stated."""
    length = fabric.loop_length
    if length.sd is None:
        raise InputError(
            "fabric.knitting.loop_scatter = courses: fabric.loop_length states no sd; expected the scatter of the "
            "measured lengths in fabric.loop_length.sd"
        )
    return length.sd / length.value


def bundle_peak(draws: YarnDraws, axial_stiffness: float) -> tuple[float, float]:
    """Peak force [N] and strain [-] of straight linear yarns between rigid clamps (Daniels, 1945).

    Without slack this is max_k EA e_(k) (n - k + 1) over the ordered fracture strains.
    """
    breaks = draws.fracture_strain + draws.slack
    forces = [
        axial_stiffness * np.maximum(strain - draws.slack, 0.0)[breaks >= strain].sum() for strain in np.sort(breaks)
    ]
    best = int(np.argmax(forces))
    return float(forces[best]), float(np.sort(breaks)[best])
