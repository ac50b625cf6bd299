"""Table of forces over two strains to a law with one stored energy, for shells whose directions pull each other.

The control values of the energy are those of least squares over the forces of the table, weighted by their size so that
small forces count as well. Their largest deviation says how far the table is from any energy.
"""

from dataclasses import dataclass

import numpy as np

from knittest.base.arrays import Array
from knittest.base.errors import InputError
from knittest.kernels.biaxial import sample_law, sample_table
from knittest.materials.biaxial_table import BiaxialTable
from knittest.materials.energy_fit import LEAST_FORCE, BiaxialLaw, fit_energy, place_of, splines, tangent_size

#: negative tangent over the positive one at the same place that is refused: less is the accuracy of a table
UNSTABLE = 0.04
#: force over the largest one that counts as none where a slack fabric contracts to the lowest strain of the table
SLACK = 1e-3
#: cells of the strain to which a pull contracts the other direction
CONTRACTION_CELLS = 24
#: strains across the other direction at which forces and tangents are looked up
ACROSS = 160
#: strain, over the square of the pull and the range, by which a direction slackens late: strips stay out of the kink
LATE = 1e-3


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
    value, _, _ = splines(strain, 0.0, float(law.energy_range[direction, 1]), law.contraction.shape[1] - 3)
    return np.asarray(value @ law.contraction[direction])


def fit_law(table: BiaxialTable, compression_ratio: float, where: str) -> BiaxialFit:
    """Law of ``table``, in compression with ``compression_ratio`` times its largest tangents at the most.

    Raises :class:`InputError`, which begins with ``where``, for forces that no energy gives, a tangent that is not
    positive definite in tension, and a table that does not reach the contraction of strips.
    """
    strain, force = table.samples
    law, deviation = fit_energy(strain, force, where)
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


def _places(table: BiaxialTable) -> Array:
    """Strains (n, 2) of the rows of ``table``, and between four of them."""
    full = np.stack(np.meshgrid(table.warp, table.weft, indexing="ij"), axis=-1)
    full[~np.isfinite(table.force[..., 0])] = np.nan
    middle = 0.25 * (full[1:, 1:] + full[1:, :-1] + full[:-1, 1:] + full[:-1, :-1])
    strain = np.vstack([part.reshape(-1, 2) for part in (full, middle)])
    return np.asarray(strain[np.isfinite(strain[:, 0])])


def _check_tangents(table: BiaxialTable, law: BiaxialLaw, rest: Array, where: str) -> Array:
    """Tangents W_aa, W_ab, W_bb (n, 3) where both directions are pulled; raise :class:`InputError` for an unstable one.

    At the rows of the table, and between four of them.
    """
    strain = _places(table)
    found = sample_table(strain, law)
    pulled = (found[:, :2] > LEAST_FORCE * np.nanmax(np.abs(table.force), axis=(0, 1))).all(axis=1)
    strain, found = np.vstack([np.zeros((1, 2)), strain[pulled]]), np.vstack([rest, found[pulled, 2:]])
    scale = tangent_size(*table.samples)
    size = np.linalg.eigvalsh(found[:, [0, 1, 1, 2]].reshape(-1, 2, 2) * np.outer(scale, scale))
    unstable = size[:, 0] < -UNSTABLE * size[:, 1]
    unstable[0] |= size[0, 0] <= 0.0
    if unstable.any():
        at = int(np.flatnonzero(unstable)[0])
        raise InputError(
            f"{where}: the tangent is not positive definite at {place_of(strain[at])}: warp {found[at, 0]:.4g}, weft "
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
    across = np.linspace(low, high, ACROSS + 1)

    def cross_force(of: Array, other: Array) -> Array:
        strain = np.column_stack([of, other] if direction == 0 else [other, of])
        return sample_table(strain, law)[:, 1 - direction]

    force = cross_force(np.repeat(pull, len(across)), np.tile(across, len(pull))).reshape(len(pull), -1)
    lower, upper, last = np.zeros(len(pull)), np.zeros(len(pull)), 0.0
    for k, row in enumerate(force[1:], 1):  # of several roots the one next to that of less pull
        rising = np.flatnonzero((row[:-1] < 0.0) & (row[1:] >= 0.0))
        if rising.size:
            at = int(rising[np.abs(across[rising] - last).argmin()])
            lower[k], upper[k], last = across[at], across[at + 1], across[at]
        elif 0.0 <= row[0] <= SLACK * np.abs(force).max():
            lower[k] = upper[k] = last = low
        elif pull[k] <= end * (1.0 + 1e-9):
            name, other = ("warp", "weft") if direction == 0 else ("weft", "warp")
            raise InputError(
                f"{where}: at strain_{name}_pct = {100 * pull[k]:.4g} the force of the {other} does not change its "
                f"sign: {row[0]:.4g} N/mm at the lowest strain_{other}_pct, {100 * low:.4g}; expected rows on both "
                f"sides of the strain to which a strip pulled along the {name} contracts"
            )
        else:
            lower[k] = upper[k] = last
    for _ in range(40):
        mean = 0.5 * (lower + upper)
        pushed = cross_force(pull, mean) < 0.0
        lower, upper = np.where(pushed, mean, lower), np.where(pushed, upper, mean)
    root = 0.5 * (lower + upper)
    root[0] = 0.0
    root -= LATE * pull**2 / pull[-1]
    value, slope, _ = splines(pull, 0.0, pull[-1], CONTRACTION_CELLS)
    # begins as at rest, where it meets compression, and goes on as a constant
    ends = np.array([-float(rest[1]) / float(rest[2 if direction == 0 else 0]), 0.0])
    control = np.linalg.solve(np.vstack([value, slope[[0, -1]]]), np.concatenate([root, ends]))
    # a spline stays above its least control value; the energy is not known below the lowest strain
    return np.maximum(control, low)


def _largest_tangents(law: BiaxialLaw, rest: Array, share: float) -> Array:
    """Stiffness of warp and weft that bounds all tangents, to the end of the spline, and all jumps of them, (2, 2)."""
    low, high = law.energy_range[:, 0], law.energy_range[:, 1]
    axes = [np.linspace(low[i], high[i], ACROSS) for i in range(2)]
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
