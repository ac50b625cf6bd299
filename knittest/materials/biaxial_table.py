"""Table of the forces of warp and weft over both strains."""

from dataclasses import dataclass

import numpy as np

from knittest.base.arrays import Array, Flags


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
        """Tell which strains (n,) are above the strains of the table; below them a direction slackens."""
        last = [np.flatnonzero(np.isfinite(row))[-1] for row in self.force[..., 0]]
        end = np.interp(warp, self.warp, self.weft[last])
        return np.asarray((warp > self.warp[-1]) | (weft > end))
