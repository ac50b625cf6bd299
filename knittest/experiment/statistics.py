"""Mean, standard deviation and corridor of tested specimens."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment.lab_recording import Origin

Array = NDArray[np.float64]

#: multiple of the preload up to which a curve is a line from the origin
PRELOADS = 3.0


@dataclass(frozen=True)
class Specimen(Origin):
    """Strain [%] and force [N] of one specimen, (n,) each; width and gauge length [mm] where they are known."""

    strain: Array
    force: Array
    width: float | None = None
    gauge: float | None = None


@dataclass(frozen=True)
class Corridor:
    """Mean and sd (n - 1; NaN of one) of the force over strain [%], (points,) each, of ``n`` specimens."""

    strain: Array
    mean: Array
    sd: Array
    n: int


def peaks(specimens: Sequence[Specimen]) -> tuple[Array, Array]:
    """Maximum force [N] and strain at maximum force [%] (ISO 13934-1) of each specimen."""
    tops = [int(np.argmax(s.force)) for s in specimens]
    force = np.array([s.force[k] for s, k in zip(specimens, tops, strict=True)])
    return force, np.array([s.strain[k] for s, k in zip(specimens, tops, strict=True)])


def mean_sd(values: Array) -> tuple[float, float]:
    """Mean and sample standard deviation, NaN for one value.

    >>> mean_sd(np.array([2.0, 4.0, 6.0]))
    (4.0, 2.0)
    """
    return float(np.mean(values)), float(np.std(values, ddof=1)) if len(values) > 1 else np.nan


def corridor(specimens: Sequence[Specimen], points: int = 201) -> Corridor:
    """Corridor on a common grid up to the smallest strain at maximum force, beyond which not all specimens count.

    :func:`peaks` gives the end points. Raises :class:`InputError` if the specimens have no common range.
    """
    curves, end = [(s.strain, s.force) for s in specimens], float(peaks(specimens)[1].min())
    return band(curves, end, "strain up to their maximum forces", points)


def band(curves: Sequence[tuple[Array, Array]], end: float, common: str, points: int = 201) -> Corridor:
    """Corridor of ``curves`` (x, y) from the largest start to ``end``; ``common`` is what x is called in messages."""
    start = max(float(x[0]) for x, _ in curves)
    if not end > start:
        raise InputError(f"the specimens have no common range of {common}")
    return corridor_on_grid(np.linspace(start, end, points), curves)


def corridor_on_grid(grid: Array, curves: Sequence[tuple[Array, Array]]) -> Corridor:
    """Corridor of ``curves`` (x, y) on ``grid`` (points,) of x.

    >>> found = corridor_on_grid(np.array([0.5]), [(np.array([0.0, 1.0]), np.array([0.0, f])) for f in (2.0, 4.0, 6.0)])
    >>> found.mean.item(), found.sd.item(), found.n
    (2.0, 1.0, 3)
    """
    values = np.array([np.interp(grid, x, y) for x, y in curves])
    sd = values.std(axis=0, ddof=1) if len(curves) > 1 else np.full(len(grid), np.nan)
    return Corridor(grid, values.mean(axis=0), sd, len(curves))


def mean_curve(specimens: Sequence[Specimen], points: int = 201) -> tuple[Array, Array]:
    """Mean strain [%] and force [N], (points,), at equal shares of each strain at maximum force, to the mean peak."""
    _, strain = peaks(specimens)
    share = np.linspace(max(s.strain[0] / end for s, end in zip(specimens, strain, strict=True)), 1.0, points)
    forces = [np.interp(share * end, s.strain, s.force) for s, end in zip(specimens, strain, strict=True)]
    return share * float(strain.mean()), np.mean(forces, axis=0)


def tension_curve(specimens: Sequence[Specimen]) -> tuple[Array, Array]:
    """:func:`mean_curve` as a material law: from the origin, and rising everywhere.

    If noise makes the mean fall, neighbours are pooled (isotonic regression). A preload, the force at the first point,
    has no strain: points below :data:`PRELOADS` times it are replaced by a line to the origin.
    """
    from scipy.optimize import isotonic_regression

    strain, force = mean_curve(specimens)
    level, block = np.unique(isotonic_regression(force).x, return_inverse=True)
    middle = np.bincount(block, strain) / np.bincount(block)
    keep = (level > PRELOADS * max(force[0], 0.0)) & (middle > 0.0) & (level > 0.0)
    keep[-1] = True
    return np.append(0.0, middle[keep]), np.append(0.0, level[keep])
