"""The bound behind the shells' time step against the highest eigenvalue of single elements, whatever their state."""

import numpy as np
import pytest
from shell_cases import Solid, linear_laminate, product, quaternion

from knittest.kernels.shell_state import Laminate
from knittest.models.in_plane import KINK
from knittest.models.macro import build_sheet

SIDE, AREA_MASS, THICKNESS = 2.0, 824.2e-6, 2.22
SQUARE = SIDE * np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
LEANING = SQUARE + SIDE * np.array([[0.0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0]])
#: what governs: a fibre, hourglass control, shear, drilling
LAMINATES = {
    "fibre": linear_laminate(900.0, 600.0),
    "control": linear_laminate(600.0, 900.0, hourglass_fibre=np.full(2, 300.0), hourglass_shear=300.0),
    "stiff shear": linear_laminate(900.0, 900.0, shear_slope=np.array([900.0])),
    "drilling": linear_laminate(30.0, 30.0, drilling=900.0),
    "shear": linear_laminate(900.0, 900.0, shear_slope=np.array([300.0])),
    "poisson": linear_laminate(900.0, 600.0, coupling_membrane=500.0, coupling_bending=3.0),
}


def highest(solid: Solid, mass: np.ndarray, position: np.ndarray, turn: np.ndarray) -> float:
    """Largest squared frequency [1/ms^2] of one element about a state; central differences of its forces."""
    nodes, step = solid.nodes, 1e-6

    def forces(moved: np.ndarray, turned: np.ndarray) -> np.ndarray:
        nodes.position[:, :4], nodes.rotation[:, :4] = moved.T, turned.T
        return np.hstack(solid.forces()).ravel()

    tangent = np.empty((24, 24))
    for k in range(24):
        node, dof = divmod(k, 6)
        sides = []
        for sign in (step, -step):
            moved, turned, vector = position.copy(), turn.copy(), np.zeros((1, 3))
            if dof < 3:
                moved[node, dof] += sign
            else:
                vector[0, dof - 3] = sign
                turned[node] = product(quaternion(vector)[0], turn[node])
            sides.append(forces(moved, turned))
        tangent[:, k] = (sides[1] - sides[0]) / (2.0 * step)
    return float(np.linalg.eigvals(tangent / np.sqrt(np.outer(mass, mass))).real.max())


def ratios_of(law: Laminate, seed: int, side: float, states: int = 6) -> np.ndarray:
    """Highest over bounding squared frequency of a square in random states, sheared, pulled (``side`` 1) or pushed."""
    rng = np.random.default_rng(seed)
    model = build_sheet(SQUARE, np.array([[0, 1, 2, 3]]), law, AREA_MASS, THICKNESS)
    solid = Solid(SQUARE, model.shells, model.laminate)
    mass = np.repeat(np.c_[model.mass, model.inertia], 3, axis=1).ravel()
    found = []
    for _ in range(states):
        shear, stretch = np.deg2rad(rng.uniform(-75.0, 75.0)), 1.0 + side * rng.uniform(0.01, 0.3, 2)
        rows = stretch * np.array([[1.0, np.sin(shear)], [0.0, np.cos(shear)]])
        position = SQUARE @ np.pad(rows, (0, 1)).T
        found.append(highest(solid, mass, position, quaternion(np.zeros((4, 3)))) * (model.critical_step / 2.0) ** 2)
    return np.array(found)


def ratios(
    card: str, distortion: float, hourglass: float, seed: int, states: int = 12, plan: np.ndarray = SQUARE
) -> np.ndarray:
    """Highest over bounding squared frequency of an element in its undeformed and in random states, (states,)."""
    rng = np.random.default_rng(seed)
    corners = plan + distortion * SIDE * np.c_[rng.uniform(-1.0, 1.0, (4, 2)), np.zeros(4)]
    angle = rng.uniform(0.0, 6.3)
    warp = (np.cos(angle), np.sin(angle), 0.0) if distortion else (0.0, 1.0, 0.0)
    model = build_sheet(corners, np.array([[0, 1, 2, 3]]), LAMINATES[card], AREA_MASS, THICKNESS, warp)
    solid = Solid(corners, model.shells, model.laminate)
    mass = np.repeat(np.c_[model.mass, model.inertia], 3, axis=1).ravel()
    bound, found = (2.0 / model.critical_step) ** 2, []
    for state in range(states):
        # hourglass control grows with the square of the stretch: where it governs, none
        most = 0.0 if card == "control" else 0.3
        shear, stretch = np.deg2rad(rng.uniform(-75.0, 75.0)), 1.0 + rng.uniform(-0.2, most, 2)
        if state == 0:
            shear, stretch = 0.0, np.ones(2)
        rows = stretch * np.array([[1.0, np.sin(shear)], [0.0, np.cos(shear)]])
        pattern = np.array([[1.0], [-1], [1], [-1]]) * rng.normal(size=3)
        position = corners @ np.pad(rows, (0, 1)).T + (state > 0) * hourglass * SIDE * pattern
        turn = quaternion((state > 0) * hourglass * rng.normal(size=(4, 3)))
        found.append(highest(solid, mass, position, turn) / bound)
    return np.array(found)


@pytest.mark.parametrize("card", ["fibre", "control", "shear", "poisson"])
@pytest.mark.parametrize("distortion", [0.0, 0.1, 0.25])
@pytest.mark.parametrize(("hourglass", "limit"), [(0.0, 1.0), (0.1, 1.2)])
def test_no_state_of_an_element_is_above_its_bound(card, distortion, hourglass, limit):
    """Sheared by 75 degrees, stretched by 30 %; corners out of a linear map by a tenth of a side add some per cent,
    a seventh where the control governs.
    """
    for seed in range(3):
        assert ratios(card, distortion, hourglass, seed).max() < limit, seed


def test_a_leaning_element_shears_along_both_fibres_at_once():
    """Gradients of warp and weft turning against each other add, where those of a rectangle are orthogonal."""
    for seed in range(4):
        assert ratios("stiff shear", 0.0, 0.0, seed, plan=LEANING).max() < 1.0, seed


def test_drilling_is_in_the_bound():
    """Stretches that lengthen its fibres add to it: none, as of hourglass control."""
    for seed in range(4):
        assert 0.2 < ratios("drilling", 0.25 * (seed % 2), 0.0, seed, states=1).max() < 1.0, seed


def test_the_bound_of_a_square_is_its_frequency():
    """Rotations may add a tenth."""
    assert ratios("fibre", 0.0, 0.0, 0, states=1)[0] == pytest.approx(1.0, abs=0.11)


def kinked(pulled: float, pushed: float) -> Laminate:
    """A law of stiffness ``pulled`` in tension and ``pushed`` in compression [N/mm], in both directions."""
    card = linear_laminate(pulled, pulled, hourglass_fibre=np.zeros(2), hourglass_shear=0.0, drilling=0.0)
    return card._replace(compression=pushed - 2.0 * card.outer)


def test_a_kink_shortens_the_step():
    """By the root of KINK where nothing pushes back, less as the kink is smaller, not at all for a fourth of it. What
    does not scale with the kink (rotations, shear) keeps the ratio 3 % above the root.
    """
    step = {
        pushed: build_sheet(SQUARE, np.array([[0, 1, 2, 3]]), kinked(900.0, pushed), AREA_MASS, THICKNESS).critical_step
        for pushed in (900.0, 9.0, 450.0, 700.0)
    }
    assert step[9.0] / step[900.0] == pytest.approx((0.99 * KINK) ** -0.5, rel=0.04)
    assert step[450.0] / step[900.0] == pytest.approx((0.5 * KINK) ** -0.5, rel=0.04)
    assert step[700.0] == step[900.0]


@pytest.mark.parametrize("pushed", [9.0, 180.0])
def test_no_state_of_a_kinked_element_is_above_its_bound(pushed):
    """On either side of the kink, sheared by 75 degrees and stretched by 30 %."""
    for seed in range(3):
        for side in (1.0, -1.0):
            found = ratios_of(kinked(900.0, pushed), seed, side)
            assert 0.3 * (side > 0.0) / KINK < found.max() < 1.0, (seed, side)


def bounce(share: float, times: int = 2000) -> float:
    """Mean gain of energy of a ball that central differences bounce on a spring at ``share`` of its critical step."""
    gains, rng = [], np.random.default_rng(0)
    for _ in range(times):
        x, v, touched = -float(rng.uniform()), 1.0, False
        while (x <= 0.0 and not touched) or x > 0.0:
            x += v
            v -= (2.0 * share) ** 2 * max(x, 0.0)
            touched = touched or x > 0.0
        gains.append(v * v)
    return float(np.mean(gains))


def test_a_bounce_gains_little_at_the_step_of_a_kink():
    """A step of 0.9 is 0.9 / sqrt(KINK) of that of the spring, which gains 3 % a bounce on average; 0.9 doubles it."""
    assert bounce(0.9 / KINK**0.5) < 1.05
    assert bounce(0.9) > 1.8
