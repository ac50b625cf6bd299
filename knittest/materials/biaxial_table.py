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
