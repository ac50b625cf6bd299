"""Poisson coupling of a laminate: strips keep their curves and contract by nu; what would give energy is refused."""

import sys
from pathlib import Path

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.kernels.laws import hinge_force
from knittest.kernels.shell_state import build_shells
from knittest.materials.laminate import laminate, scale_membrane, with_poisson_coupling
from knittest.models import in_plane
from knittest.models.in_plane import highest_stiffness
from knittest.pose import linear_laminate

sys.path.append(str(Path(__file__).parents[1] / "verification"))
from shell_cases import CURVES, fabric, per_width

NU = {"value": 0.3, "source": "assumed"}


def membrane(card, strain: np.ndarray) -> np.ndarray:
    """Forces per width [N/mm] of both directions under both strains."""
    own = [
        2.0 * card.outer[i] * strain[i]
        + card.compression[i] * min(strain[i], 0.0)
        + sum(hinge_force.py_func(strain[i], k, s) for k, s in zip(card.knee[i], card.slope[i], strict=True))
        for i in range(2)
    ]
    return np.array(own) + card.coupling_membrane * strain[::-1]


def bending(card) -> np.ndarray:
    """Matrix of moments per width over bends [N mm]."""
    stiffness = np.diag(2.0 * card.outer * card.layer_offset**2)
    return stiffness + card.coupling_bending * np.array([[0.0, 1.0], [1.0, 0.0]])


def test_isotropic_plate():
    """E t / (1 - nu^2) (1, nu) and E t^3 / (12 (1 - nu^2)) (1, nu); transverse shear 5/6 G t, G = E / (2 (1 + nu))."""
    card = linear_laminate((120.0, 120.0), (10.0, 10.0), 50.0, 1.0, poisson=0.3)
    assert membrane(card, np.array([1.0, 0.0])) == pytest.approx(120.0 / 0.91 * np.array([1.0, 0.3]))
    assert membrane(card, np.array([-1.0, 0.0])) == pytest.approx(-120.0 / 0.91 * np.array([1.0, 0.3]))
    assert bending(card) == pytest.approx(10.0 / 0.91 * np.array([[1.0, 0.3], [0.3, 1.0]]))
    assert card.transverse == pytest.approx(5.0 / 6.0 * 120.0 / 2.6 * np.ones(2))


def test_strips_of_an_orthotropic_plate_keep_their_stiffness():
    """Inverse of both matrices: 1 / (E t), - nu / (E t) of the warp, and the same for a pull of the weft."""
    card = linear_laminate((100.0, 60.0), (4.0, 3.0), 5.0, 1.0, poisson=0.4)
    stiffness = np.column_stack([membrane(card, e) for e in np.eye(2)])
    soft = np.linalg.inv(stiffness)
    assert soft == pytest.approx(np.array([[1.0 / 100.0, -0.4 / 100.0], [-0.4 / 100.0, 1.0 / 60.0]]))
    soft = np.linalg.inv(bending(card))
    assert soft == pytest.approx(np.array([[1.0 / 4.0, -0.4 / 4.0], [-0.4 / 4.0, 1.0 / 3.0]]))


@pytest.mark.parametrize("i", [0, 1])
def test_strip_of_a_fabric_follows_its_curve_and_contracts(i):
    """Macro.poisson of the fabric's file: pulled alone, either direction bears its curve at any strain, and the other
    contracts by nu (warp), by nu C_weft / C_warp (weft).
    """
    plain, card = laminate(fabric(), per_width(CURVES)), laminate(fabric(poisson=NU), per_width(CURVES))
    pushed = plain.compression + 2.0 * plain.outer
    contraction = (0.3, 0.3 * pushed[1] / pushed[0])[i]
    for strain in (0.002, 0.009, 0.015):
        both = np.zeros(2)
        both[i], both[1 - i] = strain, -contraction * strain
        force, uncoupled = membrane(card, both), membrane(plain, np.abs(both))
        assert force[i] == pytest.approx(uncoupled[i], rel=1e-12)
        assert force[1 - i] == pytest.approx(0.0, abs=1e-12 * uncoupled[i])
    assert bending(card)[0, 1] == pytest.approx(0.3 * 3.48 / (1.0 - 0.09 * 3.48 / 5.05))
    assert np.linalg.inv(np.linalg.inv(bending(card)))[0, 0] == pytest.approx(5.05 / (1.0 - 0.09 * 3.48 / 5.05))


def test_none_is_the_default_and_changes_no_bit():
    plain = laminate(fabric(), per_width(CURVES))
    assert (plain.coupling_membrane, plain.coupling_bending) == (0.0, 0.0)
    assert with_poisson_coupling(plain, 0.0) is plain
    nought = laminate(fabric(poisson={**NU, "value": 0.0}), per_width(CURVES))
    assert all(np.array_equal(a, b) for a, b in zip(plain, nought, strict=True))


def test_a_softened_laminate_is_coupled_by_its_share():
    card = linear_laminate((100.0, 60.0), (0.4, 0.3), 5.0, 1.0, poisson=0.4)
    assert scale_membrane(card, 0.5).coupling_membrane == pytest.approx(0.5 * card.coupling_membrane)


@pytest.mark.parametrize("coupling", [15.0, -30.0])
def test_two_uncoupled_stiffnesses_bound_two_coupled_ones(coupling):
    """The rest of the bound is never negative, and nothing in one direction."""
    bound = np.diag(in_plane._bounding_stiffnesses([100.0, 40.0], coupling))
    rest = np.linalg.eigvalsh(bound - np.array([[100.0, coupling], [coupling, 40.0]]))
    assert rest[0] == pytest.approx(0.0, abs=1e-9)
    assert rest[1] > 0.0


@pytest.mark.parametrize("poisson", [0.3, -0.3, 0.9])
def test_the_bound_of_the_step_is_above_both_coupled_directions(poisson):
    """The largest eigenvalue of the membrane's matrix, over that of the stiffer direction alone, on a square."""
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    conn = np.array([[0, 1, 2, 3]])
    shells = build_shells(square, conn, np.array([0.0, 1.0, 0.0]))
    card = linear_laminate((100.0, 100.0), (1e-9, 1e-9), 0.0, 1.0, poisson=poisson, hourglass=0.0)
    found = [highest_stiffness(c, square, conn, shells)[0][0] for c in (card, card._replace(coupling_membrane=0.0))]
    assert found[0] / found[1] == pytest.approx(1.0 + abs(poisson), rel=1e-6)


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (lambda: linear_laminate((40.0, 100.0), (1.0, 1.0), 1.0, 1.0, poisson=0.7), r"poisson = 0.7: .*"
         "below the square root of their ratio, 0.6325"),
        (lambda: linear_laminate((100.0, 100.0), (1.0, 4.0), 1.0, 1.0, poisson=0.6), "in bending .* 0.5"),
        (lambda: linear_laminate((100.0, 100.0), (1.0, 1.0), 1.0, 1.0, poisson=1.0), "poisson = 1: .* in compression"),
        (lambda: linear_laminate((100.0, 100.0), (1.0, 1.0), 1.0, 1.0, poisson=-1.0), "-1; expected more than -1"),
        (lambda: linear_laminate((100.0, 100.0), (1.0, 1.0), 1.0, 1.0, poisson=np.nan), "poisson: not finite: nan"),
        (lambda: laminate(fabric(poisson={**NU, "value": 0.95}, bending_stiffness={
            "warp": {"value": 1.0, "source": "assumed"}, "weft": {"value": 3.0, "source": "assumed"}}),
            per_width(CURVES)), "fabric V1, macro.poisson = 0.95: .* in bending"),
    ],
)  # fmt: skip
def test_what_would_give_energy_is_refused(pose, message):
    with pytest.raises(InputError, match=message):
        pose()


def test_a_membrane_without_bending_contracts():
    """Bending stiffnesses of 0, of which there is no ratio, leave the coupling of the membrane what it is."""
    card = linear_laminate((100.0, 80.0), (0.0, 0.0), 1.0, 1.0, poisson=0.3)
    assert card.coupling_membrane == linear_laminate((100.0, 80.0), (1.0, 0.5), 1.0, 1.0, poisson=0.3).coupling_membrane
    assert card.coupling_bending == 0.0 and card.outer.tolist() == [0.0, 0.0] and np.isfinite(card.slope).all()
    with pytest.raises(InputError, match="in bending is 0 in warp and 2 in weft"):
        linear_laminate((100.0, 100.0), (0.0, 2.0), 1.0, 1.0, poisson=0.3)


def test_a_toe_too_soft_for_the_coupling_is_refused():
    """Stiff in compression and soft in tension: pulled both ways the coupling would outweigh the toe."""
    soft = linear_laminate((100.0, 100.0), (1.0, 1.0), 1.0, 1.0)
    soft = soft._replace(slope=np.full((2, 1), 0.1))
    with pytest.raises(InputError, match=r"softest tangents, .* cannot carry a coupling of 32\.97 N/mm"):
        with_poisson_coupling(soft, 0.3)
