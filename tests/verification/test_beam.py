"""Beams against closed forms; each case with its source is in ``cases/beam_static.py`` and ``cases/beam_dynamic.py``.

Tolerances follow the method: second order in the element length h, with the constant of the closed form's next term.
"""

import numpy as np
import pytest
from cases import beam_dynamic, beam_static
from cases.row import Row


def converges(rows: list[Row], error: float, slack: float = 0.15) -> None:
    """All within ``error`` of the reference on the finest mesh, and second order but for ``slack``."""
    assert rows
    for row in rows:
        assert abs(row.error) < error, row
        assert row.order == pytest.approx(2.0, abs=slack), row


def test_rigid_rotation_makes_no_force() -> None:
    """Rounding: some tens of operations of 1e-16."""
    (row,) = beam_static.rigid_rotation()
    assert row.error < 1e-13


def test_patch_of_constant_strain_and_constant_curvature_is_exact() -> None:
    """Relaxed to 1e-6; rotations of 1e-3 square to less."""
    for row in beam_static.patch():
        assert abs(row.error) < 2e-6, row


def test_cantilever_follows_the_elastica() -> None:
    """h^2 = 1/256 at 16 elements."""
    converges(beam_static.elastica(), 1.0 / 256)


def test_table_of_the_elastica() -> None:
    """The integrals reproduce the five digits of Mattiasson (1981), IJNME 17, 145."""
    for alpha, across, along in ((1.0, 0.30172, 0.05643), (5.0, 0.71379, 0.38763), (10.0, 0.81061, 0.55500)):
        assert beam_static.tip_of_elastica(alpha) == pytest.approx((across, along), abs=6e-6)


def test_end_moment_rolls_a_beam_up() -> None:
    """Gap of (2 pi / n)^2 / 12 = 0.0021 radii of 2 pi at 40 elements, plus as much again."""
    converges(beam_static.roll_up(), (2.0 * np.pi / 40) ** 2 / 6.0)


def test_bend_of_45_degrees() -> None:
    """(pi / 128)^2 = 6e-4 at 32 elements; Bathe & Bolourchi's eight elements are worth 16 times as much, 1.6 %."""
    rows = beam_static.bend_45(300.0) + beam_static.bend_45(600.0, (15.9, 47.2, 53.4))
    converges([r for r in rows if r.order is not None], 6e-4)
    published = [r for r in rows if r.order is None]
    assert len(published) == 3
    for row in published:
        assert abs(row.error) < 0.016, row


def test_column_buckles_at_the_load_of_euler() -> None:
    """(pi h)^2 / 4 = 1 % at 16 elements."""
    converges(beam_static.buckling(), 0.01)


def test_buckled_column_is_an_elastica() -> None:
    """As the critical load, 1 %."""
    converges(beam_static.post_buckling(), 0.01)


def test_wavy_yarn_straightens() -> None:
    """(2 pi / 32)^2 / 4 = 1 % at 32 elements a wave."""
    converges(beam_static.wavy_yarn(), 0.01)


def test_beam_hangs_under_its_weight_as_the_heavy_elastica() -> None:
    """h^2 = 1/400 at 20 elements; the collocation gives the chord of 41.5 degrees at 8.0042 to its last digit."""
    assert beam_static.chord_angle(8.0042) == pytest.approx(41.5, abs=1e-4)
    converges(beam_static.heavy_elastica(), 1.0 / 400)


def test_cantilever_vibrates_at_its_first_three_frequencies() -> None:
    """(b h)^2 / 10 = 0.6 % of the third at 32 elements; shear takes 3e-4, which bends the order."""
    converges(beam_dynamic.frequencies(), 0.006, slack=0.2)


def test_pulse_runs_along_a_bar_and_comes_back() -> None:
    """A pulse of 100 elements at 90 % of the critical step: dispersion (2 pi / 50)^2 / 24 (1 - 0.81) a length."""
    speed, clamp, back = beam_dynamic.bar_wave()
    assert abs(speed.error) < 1e-4
    converges([clamp], 1e-3)
    assert abs(back.error) < 1e-3
