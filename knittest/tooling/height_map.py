"""Height maps of tools: what is seen of a body from above or from below, on a grid in plan."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, label

from knittest.export.raster import nearest
from knittest.export.tubes import View
from knittest.models.triangle_mesh import TriangleMesh

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: cells along the longer side of the blank
CELLS = 200
#: share of the area of a tool that may stand higher than its face
PROUD = 0.1
#: fall, as a share of the largest one looked at, below which a surface counts as flat
FLAT = 0.02
#: slope of a triangle out of the upright, as a cosine, from which on it is seen
EDGE_ON = 1e-6


@dataclass(frozen=True)
class HeightMap:
    """Height [mm] of a body over a grid in plan with cells of ``cell`` [mm], row 0 at the lowest y; -inf beside it.

    Seen from below, heights are counted downwards: ``height`` is -z of the lowest surface.
    """

    height: Array
    cell: float

    @classmethod
    def of(
        cls, body: TriangleMesh, blank: tuple[float, float], *, below: bool = False, cells: int = CELLS
    ) -> "HeightMap":
        """Map of a closed ``body`` within a ``blank`` (lengths along x and y [mm]), from above or ``below``."""
        x, y = 0.5 * blank[0], 0.5 * blank[1]
        cell = max(blank) / cells
        up = -1.0 if below else 1.0
        seen = up * body.normals[:, 2] > EDGE_ON * np.linalg.norm(body.normals, axis=1)
        corners = body.corners[seen] * np.array([1.0, 1.0, up])
        return cls(nearest(corners, View(-x, x, -y, y, cell))[0], cell)

    @property
    def there(self) -> Mask:
        """Cells that the body covers."""
        return np.isfinite(self.height)

    @property
    def face(self) -> float:
        """Height [mm] that a tenth of the covered area reaches; -inf for a body that covers nothing."""
        heights = self.height[self.there]
        return float(np.quantile(heights, 1.0 - PROUD)) if heights.size else -np.inf

    def rim(self) -> Array:
        """Height [mm] that the body reaches on two opposite sides of each cell, along x or y; the face at most."""
        both = [
            np.minimum(np.maximum.accumulate(h, axis), np.flip(np.maximum.accumulate(np.flip(h, axis), axis), axis))
            for h, axis in ((self.height, 0), (self.height, 1))
        ]
        return np.minimum(np.maximum(*both), self.face)

    def edge_width(self, fall: float, face: float, opening: Mask | None = None) -> float:
        """Mean width in plan [mm] in which the surface falls from ``face`` by ``fall`` [mm]: 0 for a sharp edge.

        ``opening``: cells within the opening round which the edge runs; default: all edges. 0 without an edge.
        """
        low = self.height < face - fall
        if opening is not None:
            low = touching(low, opening)
        border = low & binary_dilation(~low)
        if not border.any():
            return 0.0
        near = binary_dilation(low, iterations=int(np.ceil(2.0 * fall / self.cell)))
        slope = near & (self.height < face - FLAT * fall) & (self.height >= face - fall)
        return self.cell * float(np.count_nonzero(slope)) / float(np.count_nonzero(border))


def touching(region: Mask, seed: Mask) -> Mask:
    """The connected parts of a ``region`` that hold a cell of ``seed``."""
    part, _ = label(region)
    found: Mask = region & np.isin(part, np.unique(part[seed & region]))
    return found
