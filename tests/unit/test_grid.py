"""Cells round a cell, without compiling: each of the up to 27 once, and none beyond the grid."""

from itertools import product

import pytest
from plain import plain

from knittest.kernels import grid


@pytest.mark.parametrize("shape", [(4, 3, 5), (1, 1, 1), (1, 2, 4), (3, 1, 1)])
def test_the_cells_round_each_cell(shape):
    place_of, row_near = plain(grid.place_of), plain(grid.row_near)
    places = list(product(*map(range, shape)))
    for cell, own in enumerate(places):
        assert place_of(cell, shape) == own
        rows = [row_near(own, shape, row) for row in range(grid.ROWS)]
        found = [k for start, stop in rows for k in range(start, stop)]
        near = [k for k, other in enumerate(places) if max(abs(p - q) for p, q in zip(own, other, strict=True)) <= 1]
        assert found == near  # in their order, by which contacts are numbered
