"""Cells round a cell, without compiling: each of the up to 27 once, and none beyond the grid."""

from itertools import product

import pytest
from plain import plain

from knittest.kernels import vec


@pytest.mark.parametrize("shape", [(4, 3, 5), (1, 1, 1), (1, 2, 4), (3, 1, 1)])
def test_the_cells_round_each_cell(shape):
    place_of, row_near = plain(vec.place_of), plain(vec.row_near)
    places = list(product(*map(range, shape)))
    for cell, own in enumerate(places):
        assert place_of(cell, shape) == own
        rows = [row_near(own, shape, row) for row in range(vec.GRID_ROWS)]
        found = [k for start, stop in rows for k in range(start, stop)]
        near = [k for k, other in enumerate(places) if max(abs(p - q) for p, q in zip(own, other, strict=True)) <= 1]
        assert found == near  # in their order, by which contacts are numbered
