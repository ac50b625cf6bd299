"""Yarns over the shoulder of a die; see :mod:`cases.forming_edge`."""

from cases import forming_edge as case


def test_a_yarn_slides_over_the_shoulder_without_snagging():
    """A node that turns the yarn by d = 0.12 counts as tan(d / 2), 1e-3; a swing of 1 % is the nodes' passing.

    Trilinear samples turn the normal by h / (8 + 0.4) mm from cell to cell: 7 %, on which the mean does not depend.
    """
    rows = iter(case.shoulder())
    for name, mean, swing in (("side", 2e-3, 0.01), ("corner", 5e-3, 0.02), ("STL", 5e-3, 0.12)):
        tension, swung, sideways = next(rows), next(rows), next(rows)
        assert abs(tension.error) < mean, name
        assert swung.result < swing, name
        assert sideways.result < 0.05, name
