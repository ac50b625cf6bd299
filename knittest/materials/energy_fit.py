"""Energy of two strains with the least deviation from given forces, convex in tension, as a spline.

A knit locks along one combination of both strains, s = warp strain + ratio x weft strain, because its yarn hardly
stretches, and is soft across it. So the energy is fitted as phi(s) + psi(warp strain, weft strain), which leaves psi
smooth, and is then one tensor product of cubic B-splines with fine cells.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from knittest.base.arrays import Array
from knittest.base.errors import InputError
from knittest.base.units import to_kernel
from knittest.kernels.biaxial import sample_table

#: largest deviation of the forces of a table from those of an energy, over the largest force
LARGEST_DEVIATION = 0.05
#: largest force at zero strain, over the largest force; it is taken off
LARGEST_START = 0.01
#: forces count by their size, and at least as this share of the largest one; those that push by more hardly count, as
#: the law has its own compression, and buckled loops have several states
LEAST_FORCE = 0.02
#: ratios of the strains among which the one along which the fabric locks is found, and cells of phi
RATIOS, LOCKING_CELLS = np.geomspace(0.2, 5.0, 33), 20
#: weights of third differences of psi and of phi, which decide where there are no samples
SMOOTHNESS, LOCKING_SMOOTHNESS = 0.1, 1e-4
#: softest tangent in tension over the stiffest one at the same place; a fit that is softer is repeated with this weight
SOFTEST, ROUNDS, STIFF = 0.01, 12, 5.0
#: cells beyond the highest strains of the samples, in which the tangent stays about as it is; cells of the final spline
CELLS_BEYOND, CELLS = 2, 48


class BiaxialLaw(NamedTuple):
    """Fields of a law of two strains of :class:`knittest.kernels.shell_state.Laminate`."""

    energy: Array
    energy_range: Array
    contraction: Array
    compression_coupling: float
    energy_tangents: Array


class Basis(NamedTuple):
    """Functions of the energy: ``ratio`` of s, ranges (2,) and cells of psi, range of s."""

    ratio: float
    low: Array
    high: Array
    cells: tuple[int, int]

    def locking(self, strain: Array) -> tuple[Array, Array, Array]:
        """Splines of s at ``strain`` (n, 2), with first and second derivatives."""
        along = np.array([1.0, self.ratio])
        return splines(strain @ along, float(self.low @ along), float(self.high @ along), LOCKING_CELLS)

    def values(self, strain: Array) -> Array:
        """All functions at ``strain`` (n, 2), (n, m)."""
        (a, *_), (b, *_) = (splines(strain[:, i], self.low[i], self.high[i], self.cells[i]) for i in range(2))
        return np.hstack([self.locking(strain)[0], products(a, b)])

    def derivatives(self, strain: Array) -> Array:
        """Derivatives by a, b, aa, ab, bb of all functions at ``strain`` (n, 2), (5, n, m)."""
        (a, da, dda), (b, db, ddb) = (splines(strain[:, i], self.low[i], self.high[i], self.cells[i]) for i in range(2))
        r, (_, ds, dds) = self.ratio, self.locking(strain)
        pairs = (
            (ds, da, b), (r * ds, a, db), (dds, dda, b), (r * dds, da, db), (r * r * dds, a, ddb),
        )  # fmt: skip
        return np.stack([np.hstack([phi, products(x, y)]) for phi, x, y in pairs])

    def third_differences(self, smoothness: float) -> Array:
        """Rows of weighted third differences of all control values."""
        m, n = (count + 3 for count in self.cells)
        per = np.array(self.cells) / (self.high - self.low)
        first, second = (np.diff(np.eye(count), n=3, axis=0) for count in (m, n))
        psi = np.vstack([per[0] * np.kron(first, np.eye(n)), per[1] * np.kron(np.eye(m), second)])
        phi = np.diff(np.eye(LOCKING_CELLS + 3), n=3, axis=0) * per[0]
        zeros = np.zeros((len(phi), m * n)), np.zeros((len(psi), LOCKING_CELLS + 3))
        return np.vstack([np.hstack([LOCKING_SMOOTHNESS * phi, zeros[0]]), np.hstack([zeros[1], smoothness * psi])])


def fit_energy(
    strain: Array, force: Array, cells: list[int], where: str, places: Array, smoothness: float = SMOOTHNESS
) -> tuple[BiaxialLaw, float]:
    """Energy with the least deviation of its gradient from the ``force`` at each ``strain``, (n, 2) each.

    It is convex at those of the ``places`` (m, 2) that are in tension. Returns it with the largest deviation over the
    largest force. ``smoothness`` weighs third differences. Raises :class:`InputError`, which begins with ``where``.
    """
    low, top, peak = strain.min(axis=0), strain.max(axis=0), float(np.abs(force).max())
    _check_range(strain, force, where)
    high = top + CELLS_BEYOND * (top - low) / np.array(cells)
    pushed = np.maximum(-force.min(axis=1), 0.0) / (LEAST_FORCE * peak)
    weight = 1.0 / (np.linalg.norm(force, axis=1) / peak + LEAST_FORCE) / (1.0 + pushed**2) ** 2
    count = (cells[0] + CELLS_BEYOND, cells[1] + CELLS_BEYOND)
    basis = Basis(_locking_ratio(strain, force, weight), low, high, count)
    rows = basis.derivatives(strain)[:2] * weight[:, None]
    smooth = basis.third_differences(smoothness)
    gauge = 1e-5 * np.eye(smooth.shape[1])  # what both parts can be, and a constant
    matrix = np.vstack([*rows, smooth, gauge])
    right = np.concatenate([*(weight * force[:, i] for i in range(2)), np.zeros(len(smooth) + len(gauge))])
    held = basis.derivatives(places)
    for _ in range(ROUNDS):
        q, r = np.linalg.qr(matrix)
        found = solve_triangular(r, q.T @ right)
        soft, least = _soft_tangents(held, found, 0.5 * LEAST_FORCE * peak)
        if not len(least):
            break
        scale = STIFF * float((high - low).min()) / max(count)
        matrix, right = np.vstack([matrix, scale * soft]), np.append(right, scale * least)
    law = _one_spline(basis, found)
    off = np.abs(sample_table(strain, law)[:, :2] - force).max(axis=1) * (pushed <= 1.0)
    worst, deviation = int(off.argmax()), float(off.max()) / peak
    if deviation > LARGEST_DEVIATION:
        raise InputError(
            f"{where}: the forces deviate by up to {100 * deviation:.1f} % of the largest force, {peak:.4g} N/mm, from "
            f"those of a convex energy (limit {100 * LARGEST_DEVIATION:g} %), most at {place_of(strain[worst])}; "
            "expected forces that rise and give no work on closed paths: take all of them from loading, without "
            "friction, at closer strains, or smooth them"
        )
    return law, deviation


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


def _locking_ratio(strain: Array, force: Array, weight: Array) -> float:
    """Ratio of the strains in s for which a function of s alone fits the forces best."""
    errors = []
    for ratio in RATIOS:
        s = strain @ np.array([1.0, ratio])
        _, slope, _ = splines(s, float(s.min()), float(s.max()), LOCKING_CELLS)
        matrix = np.vstack([weight[:, None] * slope, ratio * weight[:, None] * slope])
        right = np.concatenate([weight * force[:, 0], weight * force[:, 1]])
        found = np.linalg.lstsq(matrix, right, rcond=1e-8)[0]
        errors.append(float(np.sum((matrix @ found - right) ** 2)))
    return float(RATIOS[int(np.argmin(errors))])


def _soft_tangents(held: Array, found: Array, pull: float) -> tuple[Array, Array]:
    """Rows for the tangent in the softest direction at the places that are too soft, and what they shall give.

    ``held`` (5, n, m) are the derivatives at the places. Those count whose forces are at least ``pull``.
    """
    w_a, w_b, aa, ab, bb = held @ found
    value, vector = np.linalg.eigh(np.stack([aa, ab, ab, bb], axis=-1).reshape(-1, 2, 2))
    soft = (np.minimum(w_a, w_b) >= pull) & (value[:, 0] < SOFTEST * np.abs(value[:, 1]))
    v, w = (vector[soft, i, :1] for i in range(2))
    rows = v * v * held[2, soft] + 2.0 * v * w * held[3, soft] + w * w * held[4, soft]
    return rows, 2.0 * SOFTEST * np.abs(value[soft, 1])


def _one_spline(basis: Basis, found: Array) -> BiaxialLaw:
    """One tensor product for both parts, by collocation; energy and forces are 0 at zero strain."""
    knots = np.concatenate([[0.0, 0.5], np.arange(1.0, CELLS), [CELLS - 0.5, CELLS]]) / CELLS
    points = [basis.low[i] + knots * (basis.high[i] - basis.low[i]) for i in range(2)]
    grid = np.stack(np.meshgrid(*points, indexing="ij"), axis=-1).reshape(-1, 2)
    value = (basis.values(grid) @ found).reshape(CELLS + 3, CELLS + 3)
    one, other = (splines(points[i], basis.low[i], basis.high[i], CELLS)[0] for i in range(2))
    energy = np.linalg.solve(other, np.linalg.solve(one, value).T).T
    frame = np.zeros((2, 5))
    frame[:, 0], frame[:, 1], frame[:, 2] = basis.low, basis.high, CELLS / (basis.high - basis.low)
    law = BiaxialLaw(np.ascontiguousarray(energy), frame, np.zeros((2, 0)), 0.0, np.zeros((2, 2)))
    pull = sample_table(np.zeros((1, 2)), law)[0, :2]
    place = [basis.low[i] + (np.arange(CELLS + 3) - 1.0) / frame[i, 2] for i in range(2)]  # of a linear function
    law.energy[:] -= pull[0] * place[0][:, None] + pull[1] * place[1]
    zero = [splines(np.zeros(1), basis.low[i], basis.high[i], CELLS)[0][0] for i in range(2)]
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


def products(a: Array, b: Array) -> Array:
    """Products of all functions of the first direction (n, k) with all of the second (n, m), (n, k m)."""
    return (a[:, :, None] * b[:, None, :]).reshape(len(a), a.shape[1] * b.shape[1])


def place_of(strain: Array) -> str:
    """Strains (2,) [-] as columns of the table."""
    percent = strain / to_kernel(1.0, "%")
    return f"strain_warp_pct = {percent[0]:.4g}, strain_weft_pct = {percent[1]:.4g}"
