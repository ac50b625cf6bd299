"""Tension curves and stiffnesses to the laminate; bad curves are refused with file, place and expectation."""

import sys
from pathlib import Path

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.kernels.laws import hinge_force
from knittest.materials.laminate import laminate, scale_membrane
from knittest.models.sections import linear_laminate

sys.path.append(str(Path(__file__).parents[1] / "verification"))
from shell_cases import CURVES, fabric, per_width, toe_curve

FAIL = (1.6, 1.5)


def membrane(sheet, i: int, strain: float) -> float:
    """Force per width of all layers [N/mm]."""
    middle = sum(hinge_force.py_func(strain, k, s) for k, s in zip(sheet.knee[i], sheet.slope[i], strict=True))
    return 2.0 * sheet.outer[i] * strain + middle + sheet.compression[i] * min(strain, 0.0)


@pytest.mark.parametrize(("i", "direction"), [(0, "warp"), (1, "weft")])
def test_layers_sum_to_the_curve(i, direction):
    """Within 0.02 % of the peak, with few of the 800 rows kept."""
    fine = {"warp": toe_curve(5820.0, 1.6, 800), "weft": toe_curve(5744.0, 1.6, 800)}
    sheet = laminate(fabric(), per_width(fine))
    strain, force = fine[direction]
    inside = strain <= FAIL[i]
    found = [50.0 * membrane(sheet, i, 0.01 * e) for e in strain[inside]]
    assert np.abs(found - force[inside]).max() < 2.1e-4 * force[inside].max()
    assert np.count_nonzero(sheet.slope[i]) < 30


def test_bending_compression_shear_and_failure():
    """D = 2 E t z^2; compression is a share of the largest tangent; the outer layers lie at half the thickness."""
    sheet = laminate(fabric(), per_width(CURVES))
    assert sheet.layer_offset == pytest.approx(1.11)
    assert 2.0 * sheet.outer * sheet.layer_offset**2 == pytest.approx([5.05, 3.48])
    tangent = np.max(np.diff(CURVES["warp"][1]) / np.diff(CURVES["warp"][0])) * 100.0 / 50.0
    assert membrane(sheet, 0, -0.001) == pytest.approx(-0.001 * 0.01 * tangent, rel=1e-3)
    assert (sheet.shear_knee.tolist(), sheet.shear_slope.tolist()) == ([0.0], [0.5])
    assert sheet.fail_strain == pytest.approx([0.016, 0.015])
    assert sheet.twist == pytest.approx(2.0 * 0.5 / 3.0 * 1.11**2)


def test_soft_toe_moves_the_outer_layers_out():
    """A tangent of 2 N/mm at the start is below D / (t/2)^2 = 4.1 N/mm: z grows, D stays, no layer pushes back."""
    e, f = toe_curve(5820.0, 1.6)
    soft = {"warp": (np.append([0.0, 0.1], e[1:] + 0.1), np.append([0.0, 0.1], f[1:] + 0.1)), "weft": CURVES["weft"]}
    sheet = laminate(fabric(), per_width(soft))
    assert sheet.layer_offset == pytest.approx(np.sqrt(5.05 / 2.0), rel=1e-6)
    assert 2.0 * sheet.outer[0] * sheet.layer_offset**2 == pytest.approx(5.05)
    assert np.cumsum(sheet.slope[0]).min() > -1e-9


def bad(strain, force):
    return {"warp": (np.array(strain), np.array(force)), "weft": CURVES["weft"]}


@pytest.mark.parametrize(
    ("curve", "says"),
    [
        (bad([0.0, 1.0, 0.9, 1.7], [0, 100, 200, 300]), "does not rise after 1 %"),
        (bad([0.0, 0.5, 1.0, 1.7], [0, 300, 200, 400]), "the force does not rise after 0.5 %"),
        (bad([0.0, 0.5, 1.0], [0, 100, 200]), "ends at 1 %"),
        (bad([0.0, 0.5, 1.7], [40, 100, 200]), "first row is 0 %, 0.8 N/mm"),
        (bad([0.0, np.nan, 1.7], [0, 100, 200]), "finite"),
        (bad([0.0], [0]), "at least two rows"),
        (bad([0.0, 1.0, 1.7], [0, 0.01, 4000]), "too soft for macro.bending_stiffness.warp"),
    ],
)
def test_bad_curves_are_refused(curve, says):
    with pytest.raises(InputError, match=says) as caught:
        laminate(fabric(), per_width(curve))
    assert "macro.tension.warp (warp.csv)" in str(caught.value)
    assert "expected" in str(caught.value)


def test_too_small_a_share_names_one_that_is_enough():
    """The outer layers alone may not be more than the share of the whole."""
    card = laminate(fabric(), per_width(CURVES))
    card = card._replace(outer=0.2 * card.slope[:, 0])
    soft = scale_membrane(card, 1.0)
    tension = soft.slope[:, 0] + 2.0 * soft.outer
    least = float((2.0 * soft.outer / tension).max())
    with pytest.raises(InputError, match=r"--set rig\.membrane_share=[\d.]+") as refused:
        scale_membrane(card, 0.99 * least)
    named = float(str(refused.value).rpartition("=")[2].split()[0])
    assert least < named <= 1.2 * least + 0.01 and (scale_membrane(card, named).slope[:, 0] > 0.0).all()


def test_layers_that_bend_more_than_the_membrane_can_are_refused_with_the_thickness_that_would_do():
    """Two outer layers of 2 D / t^2 each at t / 2: t > 2 sqrt(D / E) leaves the middle one a stiffness."""
    stiffness, bending = (900.0, 400.0), (4.0, 9.0)
    with pytest.raises(InputError, match=r"at thickness 0\.299 mm: .* expected a thickness above 0\.3 mm"):
        linear_laminate(stiffness, bending, 1.0, 0.299)
    card = linear_laminate(stiffness, bending, 1.0, 0.3001)
    assert 2.0 * card.outer + card.compression == pytest.approx(np.array(stiffness)) and (card.compression > 0.0).all()
