"""Plates under even load and a twisted rod against closed forms; see :mod:`cases.textbook`."""

import pytest
from cases import textbook as case


@pytest.mark.parametrize("held", case.SAG)
def test_plate_under_even_load(held: str) -> None:
    """The moment at a clamped rim falls by some 1 / n over the last of n shells: 2 % at 16, a third of that of 8."""
    coarse, fine = (abs(case.plate(held, n).error) for n in (8, 16))
    assert fine < 0.02
    assert fine < 0.33 * coarse


def test_a_light_load_is_not_lost_in_rounding() -> None:
    """To 1e-3, where 8 % of the sag was missing before the bending had come to rest."""
    assert abs(case.light_plate().error) < 1e-3


def test_a_twisted_rod_leaves_its_axis_at_the_moment_of_greenhill() -> None:
    """(2 u / n)^2 / 12 = 0.4 % at 40 elements, the turn of one at its critical moment; as much for two loads' line."""
    coarse, fine = (abs(case.twisted_rod(n).error) for n in (20, 40))
    assert fine < 0.008
    assert fine < 0.33 * coarse
