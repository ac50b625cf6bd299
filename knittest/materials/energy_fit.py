"""Energy of two strains with the least deviation from given forces, convex everywhere, as a spline.

A knit locks along one combination of both strains, s = warp strain + ratio x weft strain, because its yarn hardly
stretches, and is soft across it. So the energy is a sum of convex functions of such combinations, with many ratios
about that of locking. Their curvatures are found by non-negative least squares.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from knittest.base.arrays import Array
from knittest.base.errors import InputError
from knittest.base.units import to_kernel
from knittest.kernels.biaxial import sample_table

#: largest deviation of the forces of a table from those of an energy, over the largest force of their direction, and
#: share of the strain by which the energy may give them earlier or later: where loops lock the force rises tenfold
#: within a few per cent of the strain, and paths with friction scatter
LARGEST_DEVIATION, STRAIN_SHARE = 0.05, 0.03
#: largest force at zero strain, over the largest force; it is taken off
LARGEST_START = 0.01
#: forces count by their size, and at least as this share of the largest one of their direction; those that push by more
#: hardly count, as the law has its own compression, and buckled loops have several states
LEAST_FORCE = 0.02
#: ratios of the combinations of strains over that of the forces, where loops lock; over that of equal tangents; and
#: some of the geometry of loops, between strong inlays as well
LOCKING_RATIOS, TANGENT_RATIOS = np.geomspace(0.5, 2.0, 21), np.array([-2.0, -0.5, 0.25, 1.0, 4.0])
LOOP_RATIOS = np.geomspace(0.1, 10.0, 7)
#: intervals of the curvature along a combination, from its lowest to its highest value in the samples
INTERVALS = 30
#: weight of second differences between neighbouring curvatures
SMOOTHNESS = 0.01
#: tangent of each direction, over its largest force and range, that the energy has at least: slack loops have none
LEAST_TANGENT = 2e-3
#: cells beyond the highest strains of the samples, in which the tangent stays about as it is; cells of the spline
BEYOND, CELLS = 0.1, 128


class NoConvexEnergyError(InputError):
    """No convex energy gives the forces; ``deviation`` over the largest force [-]."""

    deviation: float


class BiaxialLaw(NamedTuple):
    """Fields of a law of two strains of :class:`knittest.kernels.shell_state.Laminate`."""

    energy: Array
    energy_range: Array
    contraction: Array
    compression_coupling: float
    energy_tangents: Array


class Combination(NamedTuple):
    """Combination ``along`` (2,) of both strains, with :data:`INTERVALS` of the length ``step`` from ``low`` on."""

    along: Array
    low: float
    step: float

    @classmethod
    def over(cls, strain: Array, along: Array) -> "Combination":
        """Combination over its range in the samples ``strain`` (n, 2)."""
        s = strain @ along
        step = (float(s.max()) - float(s.min())) / (INTERVALS - 1)
        return cls(along, float(s.min()) - step, step)

    def functions(self, strain: Array) -> tuple[Array, Array]:
        """Functions whose curvature is a cubic B-spline about one knot, at ``strain`` (n, 2), and their slopes.

        (n, INTERVALS + 2) each. The curvature of the last spline stays at 1 beyond the samples; that of the last
        function is 1 everywhere.
        """
        s = (strain @ self.along)[:, None]
        from_knots = s / self.step - self.low / self.step - np.arange(INTERVALS + 1)
        value, slope = np.zeros(from_knots.shape), np.zeros(from_knots.shape)
        for k, factors in enumerate(zip((1, -4, 6, -4, 1), (1, -3, 3, -1, 0), strict=True)):
            factor = np.where(np.arange(INTERVALS + 1) < INTERVALS, *factors)
            beyond = np.maximum(from_knots + 2.0 - k, 0.0)
            fourth = factor * np.square(np.square(beyond))
            slope += self.step / 24.0 * fourth
            value += self.step**2 / 120.0 * fourth * beyond
        return np.hstack([value, 0.5 * s**2]), np.hstack([slope, s])


class ConvexEnergy(NamedTuple):
    """Sum of functions of ``combinations`` with ``curvatures`` of at least 0, and ``least`` tangents (2,) [N/mm]."""

    combinations: list[Combination]
    curvatures: list[Array]
    least: Array

    def values(self, strain: Array) -> Array:
        """Energy per area [N/mm] at ``strain`` (n, 2), up to a constant and a linear part."""
        found = 0.5 * strain**2 @ self.least
        for one, curvature in zip(self.combinations, self.curvatures, strict=True):
            found += one.functions(strain)[0] @ curvature
        return np.asarray(found)


def fit_energy(strain: Array, force: Array, where: str) -> tuple[BiaxialLaw, float]:
    """Convex energy with the least deviation of its gradient from the ``force`` at each ``strain``, (n, 2) each.

    Returns it with the largest deviation over the largest force of the direction. Raises :class:`InputError`, which
    begins with ``where``; :class:`NoConvexEnergyError` where the forces deviate by too much.
    """
    _check_range(strain, force, where)
    # of the pull: loops that are piled up push with any force
    peaks, size = np.maximum(force.max(axis=0), 1e-12), tangent_size(strain, force)
    least = LEAST_TANGENT * peaks / np.ptp(strain, axis=0)
    pulled = (force > 0.0).all(axis=1)
    own, other = force[pulled].T
    locking = float(own @ other) / max(float(own @ own), 1e-12)
    ratios = [*(locking * LOCKING_RATIOS), *(size[0] / size[1] * TANGENT_RATIOS), *LOOP_RATIOS]
    lines = [np.array([1.0, 0.0]), np.array([0.0, 1.0]), *(np.array([1.0, ratio]) for ratio in ratios if ratio)]
    combinations = [Combination.over(strain, along) for along in lines]
    pushed = np.maximum(-force / peaks, 0.0).max(axis=1) / LEAST_FORCE
    weight = 1.0 / (np.abs(force) + LEAST_FORCE * peaks) / (1.0 + pushed[:, None] ** 2) ** 2
    zero, columns = np.zeros((1, 2)), []
    for one in combinations:
        slope = one.functions(strain)[1] - one.functions(zero)[1]
        columns.append(np.vstack([weight[:, i, None] * one.along[i] * slope for i in range(2)]))
    matrix = np.hstack(columns)
    length = np.linalg.norm(matrix, axis=0) + 1e-12
    right = (weight * (force - least * strain)).T.ravel()
    even = SMOOTHNESS * np.kron(np.eye(len(lines)), np.diff(np.eye(INTERVALS + 1, INTERVALS + 2), n=2, axis=0))
    matrix, right = np.vstack([matrix / length, even]), np.append(right, np.zeros(len(even)))
    found = nnls(matrix, right, maxiter=20 * matrix.shape[1])[0] / length
    high = strain.max(axis=0) + BEYOND * np.ptp(strain, axis=0)
    energy = ConvexEnergy(combinations, np.split(found, len(combinations)), least)
    law = _one_spline(energy, strain.min(axis=0), high)
    off = _deviation(strain, force, law) / peaks * (pushed[:, None] <= 1.0)
    worst, deviation = np.unravel_index(int(off.argmax()), off.shape), float(off.max())
    if deviation > LARGEST_DEVIATION:
        direction = ("warp", "weft")[int(worst[1])]
        error = NoConvexEnergyError(
            f"{where}: the forces of the {direction} deviate by up to {100 * deviation:.1f} % of the largest one, "
            f"{peaks[worst[1]]:.4g} N/mm, from those of a convex energy (limit {100 * LARGEST_DEVIATION:g} %), most at "
            f"{place_of(strain[worst[0]])}; expected forces that rise and give no work on closed paths: take all of "
            "them from loading, without friction, at closer strains, or smooth them"
        )
        error.deviation = deviation
        raise error
    return law, deviation


def tangent_size(strain: Array, force: Array) -> Array:
    """Root of strain over force of each direction, over that of the stiffer one, (2,): tangents times it compare."""
    root = np.sqrt(np.ptp(strain, axis=0) / np.maximum(np.abs(force).max(axis=0), 1e-12))
    return np.asarray(root / root.min())


def _deviation(strain: Array, force: Array, law: BiaxialLaw) -> Array:
    """Deviation of both forces, (n, 2), from those of ``law`` between strains lower and higher by a share."""
    low = strain.min(axis=0)
    shares = (1.0 - STRAIN_SHARE, 1.0 + STRAIN_SHARE)
    found = np.stack([sample_table(np.maximum(share * strain, low), law)[:, :2] for share in shares])
    return np.asarray(np.maximum(np.maximum(found.min(axis=0) - force, force - found.max(axis=0)), 0.0))


def _check_range(strain: Array, force: Array, where: str) -> None:
    low, top, peak = strain.min(axis=0), strain.max(axis=0), float(np.abs(force).max())
    start = force[int(np.abs(strain).sum(axis=1).argmin())]
    if not (low < 0.0).all() or not (top > 0.0).all() or np.abs(start).max() > LARGEST_START * peak:
        raise InputError(
            f"{where}: the rows range from {100 * low[0]:g} to {100 * top[0]:g} % (warp) and {100 * low[1]:g} to "
            f"{100 * top[1]:g} % (weft), and the force at zero strain is {start[0]:g} and {start[1]:g} N/mm; expected "
            f"strains below and above 0 in both directions, and at most {100 * LARGEST_START:g} % of the largest force "
            "at zero strain"
        )


def _one_spline(fit: ConvexEnergy, low: Array, high: Array) -> BiaxialLaw:
    """Tensor product of splines from ``low`` to ``high``, by collocation; energy and forces are 0 at zero strain."""
    knots = np.concatenate([[0.0, 0.5], np.arange(1.0, CELLS), [CELLS - 0.5, CELLS]]) / CELLS
    points = [low[i] + knots * (high[i] - low[i]) for i in range(2)]
    grid = np.stack(np.meshgrid(*points, indexing="ij"), axis=-1).reshape(-1, 2)
    value = fit.values(grid).reshape(CELLS + 3, CELLS + 3)
    one, other = (splines(points[i], low[i], high[i], CELLS)[0] for i in range(2))
    energy = np.linalg.solve(other, np.linalg.solve(one, value).T).T
    frame = np.zeros((2, 5))
    frame[:, 0], frame[:, 1], frame[:, 2] = low, high, CELLS / (high - low)
    law = BiaxialLaw(np.ascontiguousarray(energy), frame, np.zeros((2, 0)), 0.0, np.zeros((2, 2)))
    pull = sample_table(np.zeros((1, 2)), law)[0, :2]
    place = [low[i] + (np.arange(CELLS + 3) - 1.0) / frame[i, 2] for i in range(2)]  # of a linear function
    law.energy[:] -= pull[0] * place[0][:, None] + pull[1] * place[1]
    zero = [splines(np.zeros(1), low[i], high[i], CELLS)[0][0] for i in range(2)]
    law.energy[:] -= float(zero[0] @ law.energy @ zero[1])
    return law


def splines(x: Array, low: float, high: float, cells: int) -> tuple[Array, Array, Array]:
    """Uniform cubic B-splines from ``low`` to ``high`` at ``x`` (n,), with two derivatives, (n, cells + 3) each."""
    per = cells / (high - low)
    at = (np.clip(x, low, high) - low) * per
    cell = np.minimum(at.astype(int), cells - 1)
    t = at - cell
    u = 1.0 - t
    value, slope, bend = np.zeros((3, len(x), cells + 3))
    values = (u**3 / 6, (4 + 3 * t**2 * (t - 2)) / 6, (4 + 3 * u**2 * (u - 2)) / 6, t**3 / 6)
    slopes = (-(u**2) / 2, t * (3 * t - 4) / 2, u * (4 - 3 * u) / 2, t**2 / 2)
    bends = (u, 3 * t - 2, 1 - 3 * t, t)
    row = np.arange(len(x))
    for k in range(4):
        value[row, cell + k], slope[row, cell + k], bend[row, cell + k] = values[k], per * slopes[k], per**2 * bends[k]
    return value, slope, bend


def place_of(strain: Array) -> str:
    """Strains (2,) [-] as columns of the table."""
    percent = strain / to_kernel(1.0, "%")
    return f"strain_warp_pct = {percent[0]:.4g}, strain_weft_pct = {percent[1]:.4g}"
