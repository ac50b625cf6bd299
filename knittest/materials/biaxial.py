"""Table of forces over two strains to a law with one stored energy, for shells whose directions pull each other.

The control values of the energy are those of least squares over the forces of the table, weighted by their size so that
small forces count as well. Their largest deviation says how far the table is from any energy.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from knittest.base.arrays import Array
from knittest.base.errors import InputError
from knittest.base.units import to_kernel
from knittest.kernels.biaxial import sample_law, sample_table
from knittest.materials.biaxial_table import BiaxialTable

#: largest deviation of the forces of a table from those of an energy, over the largest force
LARGEST_DEVIATION = 0.05
#: largest force at zero strain, over the largest force; it is taken off
LARGEST_START = 0.01
#: cells of the spline in each direction; more than intervals of the table show its noise
FEWEST_CELLS, MOST_CELLS = 4, 16
#: cells of the strain to which a pull contracts the other direction
CONTRACTION_CELLS = 24
#: forces count by their size, and at least as this share of the largest one
LEAST_FORCE = 0.02
#: weight of third differences, which determine cells that no row of the table is in
SMOOTHNESS = 1e-3
#: cells beyond the highest strains of the table, in which the tangent stays about as it is
CELLS_BEYOND = 2
#: strain, over the square of the pull and the range, by which a direction slackens late: strips stay out of the kink
LATE = 1e-3


class BiaxialLaw(NamedTuple):
    """Fields of a law of two strains of :class:`knittest.kernels.shell_state.Laminate`."""

    energy: Array
    energy_range: Array
    contraction: Array
    compression_coupling: float
    energy_tangents: Array


@dataclass(frozen=True)
class BiaxialFit:
    """Law of a table, its largest ``deviation`` from the forces over the largest one, and the last strains (2,) [-]."""

    law: BiaxialLaw
    deviation: float
    end: Array

    def strip_curve(self, direction: int) -> tuple[Array, Array]:
        """Strain [-] and force [N/mm] of a strip of ``direction`` whose sides are free, up to the end of the table."""
        strain = np.linspace(0.0, self.end[direction], 4 * CONTRACTION_CELLS + 1)
        both = np.zeros((len(strain), 2))
        both[:, direction], both[:, 1 - direction] = strain, contraction_of(self.law, direction, strain)
        return strain, sample_law(both, self.law)[:, direction]


def contraction_of(law: BiaxialLaw, direction: int, strain: Array) -> Array:
    """Strain of the other direction of a strip of ``direction`` with free sides, (n,)."""
    value, _ = _splines(strain, 0.0, float(law.energy_range[direction, 1]), law.contraction.shape[1] - 3)
    return np.asarray(value @ law.contraction[direction])


def fit_law(table: BiaxialTable, compression_ratio: float, where: str) -> BiaxialFit:
    """Law of ``table``, in compression with ``compression_ratio`` times its largest tangents at the most.

    Raises :class:`InputError`, which begins with ``where``, for forces that no energy gives, a tangent that is not
    positive definite in tension, and a table that does not reach the contraction of strips.
    """
    strain, force = table.samples
    cells = [min(max(len(along) - 1, FEWEST_CELLS), MOST_CELLS) for along in (table.warp, table.weft)]
    law, deviation = fit_energy(strain, force, cells, where)
    end = strain.max(axis=0)
    rest = sample_table(np.zeros((1, 2)), law)[0, 2:]
    pulled = _check_tangents(table, law, rest, where)
    largest = pulled[:, [0, 2]].max(axis=0)
    share = compression_ratio * float((largest / rest[[0, 2]]).min())
    law.energy_range[:, 3], law.energy_range[:, 4] = largest, share * rest[[0, 2]]
    law = law._replace(
        contraction=np.stack([_contraction(law, i, rest, end[i], where) for i in range(2)]),
        compression_coupling=share * float(rest[1]),
    )
    return BiaxialFit(law._replace(energy_tangents=_largest_tangents(law, rest, share)), deviation, end)


def fit_energy(
    strain: Array, force: Array, cells: list[int], where: str, smoothness: float = SMOOTHNESS
) -> tuple[BiaxialLaw, float]:
    """Spline of the energy with the least deviation of its gradient from the ``force`` at each ``strain``, (n, 2) each.

    Returns it with the largest deviation over the largest force. ``smoothness`` weighs third differences, which decide
    between the samples. Raises :class:`InputError` as :func:`fit_law`.
    """
    low, top = strain.min(axis=0), strain.max(axis=0)
    per = np.array(cells) / (top - low)
    cells = [n + CELLS_BEYOND for n in cells]
    high = low + np.array(cells) / per
    peak = float(np.abs(force).max())
    start = force[int(np.abs(strain).sum(axis=1).argmin())]
    if not (low < 0.0).all() or not (top > 0.0).all() or np.abs(start).max() > LARGEST_START * peak:
        raise InputError(
            f"{where}: the rows range from {100 * low[0]:g} to {100 * top[0]:g} % (warp) and {100 * low[1]:g} to "
            f"{100 * top[1]:g} % (weft), and the force at zero strain is {start[0]:g} and {start[1]:g} N/mm; expected "
            f"strains below and above 0 in both directions, and at most {100 * LARGEST_START:g} % of the largest force "
            "at zero strain"
        )
    (a, a_slope), (b, b_slope) = (_splines(strain[:, i], low[i], high[i], cells[i]) for i in range(2))
    rows = [_products(a_slope, b), _products(a, b_slope)]
    weight = 1.0 / (np.linalg.norm(force, axis=1) / peak + LEAST_FORCE)
    thirds = [np.diff(np.eye(n + 3), n=3, axis=0) for n in cells]
    smooth = [
        np.kron(thirds[0], np.eye(cells[1] + 3)) * (smoothness * per[0]),
        np.kron(np.eye(cells[0] + 3), thirds[1]) * (smoothness * per[1]),
    ]
    gauge = np.full((1, smooth[0].shape[1]), SMOOTHNESS)  # the energy is determined up to a constant
    matrix = np.vstack([*(weight[:, None] * row for row in rows), *smooth, gauge])
    right = np.concatenate([*(weight * force[:, i] for i in range(2)), np.zeros(len(matrix) - 2 * len(strain))])
    q, r = np.linalg.qr(matrix)
    energy = solve_triangular(r, q.T @ right).reshape(cells[0] + 3, cells[1] + 3)
    frame = np.zeros((2, 5))
    frame[:, 0], frame[:, 1], frame[:, 2] = low, high, per
    law = BiaxialLaw(energy, frame, np.zeros((2, 0)), 0.0, np.zeros((2, 2)))
    pull = sample_table(np.zeros((1, 2)), law)[0, :2]
    place = [low[i] + (np.arange(cells[i] + 3) - 1.0) / frame[i, 2] for i in range(2)]  # of a linear function
    energy -= pull[0] * place[0][:, None] + pull[1] * place[1]
    zero = [_splines(np.zeros(1), low[i], high[i], cells[i])[0][0] for i in range(2)]
    energy -= float(zero[0] @ energy @ zero[1])
    off = np.abs(sample_table(strain, law)[:, :2] - force).max(axis=1)
    worst, deviation = int(off.argmax()), float(off.max()) / peak
    if deviation > LARGEST_DEVIATION:
        raise InputError(
            f"{where}: the forces deviate by up to {100 * deviation:.1f} % of the largest force, {peak:.4g} N/mm, from "
            f"those of an energy (limit {100 * LARGEST_DEVIATION:g} %), most at {_place(strain[worst])}; expected "
            "forces without work on closed paths: take all of them from loading, without friction, or smooth them"
        )
    return law, deviation


def _splines(x: Array, low: float, high: float, cells: int) -> tuple[Array, Array]:
    """Values and derivatives (n, cells + 3) of uniform cubic B-splines at ``x`` (n,) from ``low`` to ``high``."""
    per = cells / (high - low)
    at = (np.clip(x, low, high) - low) * per
    cell = np.minimum(at.astype(int), cells - 1)
    t = at - cell
    u = 1.0 - t
    value, slope = np.zeros((2, len(x), cells + 3))
    values = (u**3 / 6, (4 + 3 * t**2 * (t - 2)) / 6, (4 + 3 * u**2 * (u - 2)) / 6, t**3 / 6)
    slopes = (-(u**2) / 2, t * (3 * t - 4) / 2, u * (4 - 3 * u) / 2, t**2 / 2)
    row = np.arange(len(x))
    for k in range(4):
        value[row, cell + k], slope[row, cell + k] = values[k], per * slopes[k]
    return value, slope


def _products(a: Array, b: Array) -> Array:
    return (a[:, :, None] * b[:, None, :]).reshape(len(a), -1)


def _place(strain: Array) -> str:
    percent = strain / to_kernel(1.0, "%")
    return f"strain_warp_pct = {percent[0]:.4g}, strain_weft_pct = {percent[1]:.4g}"


def _check_tangents(table: BiaxialTable, law: BiaxialLaw, rest: Array, where: str) -> Array:
    """Tangents W_aa, W_ab, W_bb (n, 3) where both directions are pulled; raise :class:`InputError` for an unstable one.

    At the rows of the table, and between four of them.
    """
    full = np.stack(np.meshgrid(table.warp, table.weft, indexing="ij"), axis=-1)
    full[~np.isfinite(table.force[..., 0])] = np.nan
    middle = 0.25 * (full[1:, 1:] + full[1:, :-1] + full[:-1, 1:] + full[:-1, :-1])
    strain = np.vstack([part.reshape(-1, 2) for part in (full, middle)])
    strain = strain[np.isfinite(strain[:, 0])]
    found = sample_table(strain, law)
    pulled = (found[:, :2] >= 0.0).all(axis=1)
    strain, found = np.vstack([np.zeros((1, 2)), strain[pulled]]), np.vstack([rest, found[pulled, 2:]])
    unstable = (found[:, 0] <= 0.0) | (found[:, 0] * found[:, 2] <= found[:, 1] ** 2)
    if unstable.any():
        at = int(np.flatnonzero(unstable)[0])
        raise InputError(
            f"{where}: the tangent is not positive definite at {_place(strain[at])}: warp {found[at, 0]:.4g}, weft "
            f"{found[at, 2]:.4g}, coupling {found[at, 1]:.4g} N/mm; expected forces that rise under tension, more by "
            "the own strain than by the other one: check these rows, or smooth the table"
        )
    return found


def _contraction(law: BiaxialLaw, direction: int, rest: Array, end: float, where: str) -> Array:
    """Control values of the strain of the other direction, of no force, over the strain of ``direction``.

    The table ends at ``end``; the curve goes on to the end of the spline, where it becomes level.
    """
    low, high = law.energy_range[1 - direction, :2]
    pull = np.linspace(0.0, law.energy_range[direction, 1], CONTRACTION_CELLS + 1)
    across = np.linspace(low, high, 8 * MOST_CELLS + 1)

    def cross_force(of: Array, other: Array) -> Array:
        strain = np.column_stack([of, other] if direction == 0 else [other, of])
        return sample_table(strain, law)[:, 1 - direction]

    force = cross_force(np.repeat(pull, len(across)), np.tile(across, len(pull))).reshape(len(pull), -1)
    below = np.cumsum(force[:, ::-1] < 0.0, axis=1)[:, ::-1] == 0  # pulled from here on
    first = np.argmax(below, axis=1)
    bad = (first == 0) | ~below.any(axis=1)
    if (bad & (pull <= end * (1.0 + 1e-9))).any():
        at = int(np.flatnonzero(bad)[0])
        name, other = ("warp", "weft") if direction == 0 else ("weft", "warp")
        edge = "lowest" if first[at] == 0 and below[at, 0] else "highest"
        raise InputError(
            f"{where}: at strain_{name}_pct = {100 * pull[at]:.4g} the force of the {other} does not change its sign: "
            f"{force[at, 0 if edge == 'lowest' else -1]:.4g} N/mm at the {edge} strain_{other}_pct, "
            f"{100 * (low if edge == 'lowest' else high):.4g}; expected rows on both sides of the strain to which a "
            f"strip pulled along the {name} contracts"
        )
    lower, upper = across[first - 1], across[first]
    for _ in range(40):
        mean = 0.5 * (lower + upper)
        pushed = cross_force(pull, mean) < 0.0
        lower, upper = np.where(pushed, mean, lower), np.where(pushed, upper, mean)
    root = 0.5 * (lower + upper)
    root[bad] = root[~bad][-1]
    root[0] = 0.0
    root -= LATE * pull**2 / pull[-1]
    value, slope = _splines(pull, 0.0, pull[-1], CONTRACTION_CELLS)
    # begins as at rest, where it meets compression, and goes on as a constant
    ends = np.array([-float(rest[1]) / float(rest[2 if direction == 0 else 0]), 0.0])
    return np.linalg.solve(np.vstack([value, slope[[0, -1]]]), np.concatenate([root, ends]))


def _largest_tangents(law: BiaxialLaw, rest: Array, share: float) -> Array:
    """Stiffness of warp and weft that bounds all tangents, to the end of the spline, and all jumps of them, (2, 2)."""
    low, high = law.energy_range[:, 0], law.energy_range[:, 1]
    axes = [np.linspace(low[i], high[i], 6 * MOST_CELLS) for i in range(2)]
    strain = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    step, columns = 1e-6, []
    for move in step * np.eye(2):
        columns.append((sample_law(strain + move, law)[:, :2] - sample_law(strain - move, law)[:, :2]) / (2.0 * step))
    smooth = np.abs([columns[0][:, 0], columns[1][:, 1], columns[1][:, 0]]).T
    jumps = [np.abs((1.0 - share) * rest[None, [0, 2, 1]])]
    for direction in range(2):
        other, pull = 1 - direction, np.linspace(0.0, high[direction], 4 * CONTRACTION_CELLS + 1)
        both = np.zeros((len(pull), 2))
        both[:, direction], both[:, other] = pull, contraction_of(law, direction, pull)
        slope = np.gradient(both[:, other], pull)
        kink = np.abs(sample_table(both, law)[:, 4 if direction == 0 else 2] - law.energy_range[other, 4])
        found = np.zeros((len(pull), 3))
        found[:, direction], found[:, other], found[:, 2] = kink * slope**2, kink, kink * np.abs(slope)
        jumps.append(found)
    return np.stack([_bound(smooth), _bound(np.vstack(jumps))])


def _bound(tangents: Array) -> Array:
    """Two uncoupled stiffnesses that are at least all coupled ones with sizes ``tangents`` of warp, weft, coupling."""
    ratio = np.sqrt(tangents[:, 0].max() / tangents[:, 1].max())
    warp, weft, coupling = tangents.T
    return np.array([(warp + coupling * ratio).max(), (weft + coupling / ratio).max()])
