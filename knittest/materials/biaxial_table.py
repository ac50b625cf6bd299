"""Table of the forces of warp and weft over both strains."""

from dataclasses import dataclass

import numpy as np

from knittest.base.arrays import Array, Flags

#: excess over the highest strain from which on it counts: tests that end there scatter about it
MARGIN = 0.01


@dataclass(frozen=True)
class BiaxialTable:
    """Force per width of warp and weft (n, m, 2) [N/mm] over rising strains ``warp`` (n,), ``weft`` (m,) [-].

    A corner that a fabric cannot reach may be missing: not a number.
    """

    warp: Array
    weft: Array
    force: Array

    @property
    def samples(self) -> tuple[Array, Array]:
        """Strains and forces of the rows, (n, 2) each."""
        known = np.isfinite(self.force[..., 0])
        return np.stack(np.meshgrid(self.warp, self.weft, indexing="ij"), axis=-1)[known], self.force[known]

    def is_beyond(self, warp: Array, weft: Array) -> Flags:
        """Tell which strains (n,) are above those of the table, by more than :data:`MARGIN`."""
        last = [np.flatnonzero(np.isfinite(row))[-1] for row in self.force[..., 0]]
        end = np.interp(warp, self.warp, self.weft[last])
        margin = MARGIN * self.warp[-1], MARGIN * self.weft[-1]
        return np.asarray((warp > self.warp[-1] + margin[0]) | (weft > end + margin[1]))

    def with_springs(self, direction: int, share: float) -> "BiaxialTable":
        """Table of the fabric with springs in series along ``direction``: its largest tangent falls to a ``share``.

        All forces stay: each row moves to the strain that the fabric and its springs have at its force. So forces
        remain the gradient of an energy.
        """
        strain = (self.warp, self.weft)[direction]
        force = np.moveaxis(self.force, 1 - direction, 0)
        rising = np.fmax.accumulate(force[..., direction], axis=1)
        moved = strain + rising / self.spring(direction, share)
        nearest = np.argsort(np.abs((self.weft, self.warp)[direction]), kind="stable")
        known = np.isfinite(moved[nearest])
        lines = np.maximum.accumulate(moved[nearest[known.argmax(axis=0)], np.arange(len(strain))])
        lines = lines[np.diff(lines, prepend=-np.inf) > 0.0]
        found = np.full((len(moved), len(lines), 2), np.nan)
        for k, row in enumerate(moved):
            known = np.isfinite(row)
            for i in range(2):
                found[k, :, i] = np.interp(lines, row[known], force[k, known, i], left=np.nan, right=np.nan)
        found = np.moveaxis(found, 0, 1 - direction)
        return BiaxialTable(lines, self.weft, found) if direction == 0 else BiaxialTable(self.warp, lines, found)

    def spring(self, direction: int, share: float) -> float:
        """Stiffness [N/mm] of the springs of :meth:`with_springs`."""
        return self.largest_tangent(direction) * share / (1.0 - share)

    def force_at(self, direction: int, strain: float) -> float:
        """Force [N/mm] along ``direction`` at its ``strain``, at the other strain nearest to zero that reaches it."""
        along, force = (self.warp, self.weft)[direction], np.moveaxis(self.force[..., direction], 1 - direction, 0)
        last = np.where(np.isfinite(force), along, -np.inf).max(axis=1)
        enough = last >= min(strain, float(last.max()))
        distance = np.where(enough, np.abs((self.weft, self.warp)[direction]), np.inf)
        row = force[int(distance.argmin())]
        return float(np.interp(strain, along[np.isfinite(row)], row[np.isfinite(row)]))

    def largest_tangent(self, direction: int) -> float:
        """Largest tangent of the force along ``direction`` over its own strain [N/mm]."""
        steps = np.diff((self.warp, self.weft)[direction])
        return float(np.nanmax(np.moveaxis(np.diff(self.force[..., direction], axis=direction), direction, -1) / steps))
