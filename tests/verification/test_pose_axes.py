"""Motions in axes of one's own: inclined rollers, symmetry planes at an angle, turns about a skew axis."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from knittest.base.errors import InputError
from knittest.pose import ALL, Body, Chain, Table, constant, linear_laminate, section

CARD = section(axial=2000.0, bending=8.0, radius=0.2, linear_density=1e-3)
LINE = np.column_stack([np.linspace(0.0, 10.0, 17), np.zeros(17), np.zeros(17)])


def turned(angle: float) -> np.ndarray:
    """Axes turned about z by ``angle`` [deg], as rows."""
    return Rotation.from_euler("z", angle, degrees=True).as_matrix().T


def skew() -> np.ndarray:
    """Axes turned about all three axes, as rows."""
    return Rotation.from_rotvec([0.4, -0.7, 0.9]).as_matrix().T


def bar(points: np.ndarray = LINE, damping: float = 0.0) -> Body:
    return Body.of_chains([Chain(points, CARD)], damping=damping)


def test_a_block_slides_down_an_inclined_plane():
    """a = g sin 30 deg along the plane, W cos 30 deg on it, and no energy lost: exact but for the half step's start."""
    body, slope = bar(), Rotation.from_euler("y", 30.0, degrees=True).as_matrix().T
    on_plane = body.boundary.move(np.arange(17), "z", axes=slope)
    weight = 0.01 * body.model.mass
    body.boundary.gravity(weight)
    body.advance(2.0)
    gone = body.position - LINE
    assert gone @ slope[2] == pytest.approx(0.0, abs=1e-12)
    assert gone @ slope[0] == pytest.approx(0.5 * 0.01 * 0.5 * body.time**2, rel=1e-3)
    assert body.reaction(on_plane) == pytest.approx(weight.sum() * np.sqrt(0.75), rel=1e-9)
    energies = body.energies()
    assert abs(energies["balance"]) < 1e-6 * energies["kinetic"]


@pytest.mark.parametrize("angle", [20.0, 45.0, -60.0])
def test_inclined_roller(angle):
    """End pushed along y, free along t and held along n: t . K t s = F t . y, reaction n . (K t s - F y).

    K = diag(EA / L, 3 EI / L^3); the move is 1e-6 L, shear and element length take 1e-3.
    """
    body, axes = bar(), turned(angle)
    body.boundary.move([0], ALL)
    roller = body.boundary.move([16], "y", axes=axes)
    body.boundary.move(np.arange(1, 17), "z")
    body.boundary.load([16], "y", 1e-3)
    body.relax(tolerance=1e-7)
    along, across = axes[0], axes[1]
    stiffness = np.array([2000.0 / 10.0, 3.0 * 8.0 / 10.0**3, 0.0])
    slid = 1e-3 * along[1] / (along @ (stiffness * along))
    assert (body.position - LINE)[16] == pytest.approx(slid * along, rel=2e-3, abs=1e-9)
    assert body.reaction(roller) == pytest.approx(across @ (stiffness * slid * along) - 1e-3 * across[1], rel=2e-3)


def test_a_bar_is_wound_about_its_own_skew_axis():
    """Moment GJ phi / L about the bar, the same driven or held; the work is that which the bar stores."""
    axes = skew()
    body = bar(LINE @ axes, damping=0.5)
    held = body.boundary.move([0], ALL, axes=axes)
    wound = body.boundary.move([16], "rx", Table((0.0, 5.0, 10.0), (0.0, 0.06, 0.0)), axes=axes)
    body.boundary.move([16], ("y", "z"), axes=axes)
    body.advance(10.0)
    energies = body.energies()
    assert abs(energies["balance"]) < 1e-4 * energies["external"]
    body.relax(tolerance=1e-6)
    torque = 8.0 / 1.3 * 0.3 / 10.0
    assert body.reaction(wound) == pytest.approx(torque, rel=1e-3)
    assert body.reaction(held) == pytest.approx(-torque, rel=1e-3)  # one sum of all six: the others are zero
    assert Rotation.from_quat(body.rotation[16, [1, 2, 3, 0]]).as_rotvec() == pytest.approx(0.3 * axes[0], abs=1e-5)


def plate(n: int, low: float, axes: np.ndarray) -> tuple[Body, np.ndarray]:
    """A sheet of ``n`` x ``n`` squares from ``low`` to 10 mm, lying in ``axes``; and its points in them."""
    grid = np.linspace(low, 10.0, n + 1)
    y, x = (v.ravel() for v in np.meshgrid(grid, grid))
    points = np.column_stack([x, y, np.zeros(x.size)])
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    cells = np.column_stack([first, first + n + 1, first + n + 2, first + 1])
    laminate = linear_laminate((90.0, 60.0), (4.8, 3.6), 5.0, 1.0)
    return Body.of_shells(points @ axes, cells, laminate, 1e-3, 1.0, warp=axes[1]), points


def test_a_quarter_is_the_whole():
    """A clamped square pushed in its middle and pulled out at its sides, and a quarter of it between two symmetry
    planes that lie askew: to the tolerance of the relaxation.
    """
    whole, points = plate(8, -10.0, np.eye(3))
    x, y, _ = points.T
    edge = np.flatnonzero(np.maximum(abs(x), abs(y)) > 9.9)
    pull = Table((0.0, 1.0, 2.0), (0.0, 0.05, 0.0))
    whole.boundary.move(edge, "x", pull, scale=x[edge] / 10.0)
    whole.boundary.move(edge, ("y", "z", "rx", "ry", "rz"))
    middle = int(np.argmin(x**2 + y**2))
    whole.boundary.load([middle], "z", 2.0)
    whole.advance(2.0)
    whole.relax(tolerance=1e-6)

    axes = skew()
    quarter, points = plate(4, 0.0, axes)
    x, y, _ = points.T
    edge = np.maximum(x, y) > 9.9
    group = quarter.boundary.move(np.flatnonzero(edge), "x", pull, scale=x[edge] / 10.0, axes=axes)
    quarter.boundary.move(np.flatnonzero(edge), ("y", "z", "rx", "ry", "rz"), axes=axes)
    quarter.boundary.move(np.flatnonzero(~edge & (x < 0.1)), ("x", "ry", "rz"), axes=axes)
    across = np.flatnonzero(~edge & (y < 0.1) & (x > 0.1))
    quarter.boundary.move(across, ("y", "rx", "rz"), axes=axes)
    quarter.boundary.move([0], ("y", "rx"), axes=axes)
    for dof, share in zip("xyz", 0.5 * axes[2], strict=True):
        quarter.boundary.load([0], dof, share)
    quarter.advance(2.0)
    quarter.relax(tolerance=1e-6)
    moved, same = (quarter.position @ axes.T - points), whole.position[middle]
    assert moved[0, 2] == pytest.approx(same[2], rel=1e-4)
    assert abs(moved[0, 2]) > 0.1
    assert np.abs(moved[x < 0.1, 0]).max() < 1e-12
    assert quarter.reaction(group) > 1.0
    assert quarter.conjugate(group) == pytest.approx(0.25 * whole.conjugate(0), rel=1e-4)


def refused_planes() -> None:
    body = bar()
    body.boundary.move([0, 3], "x")
    body.boundary.move([3], "x", axes=turned(45.0))
    body.step()


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (refused_planes, r"motions of node 3 .*\(1, 0, 0\) and \(0.707, 0.707, 0\): expected axes at right angles"),
        (lambda: bar().boundary.move([0], "x", axes=2.0 * np.eye(3)), "three rows of length 1 at right angles"),
        (lambda: bar().boundary.move([0], "x", axes=[1.0, 0.0, 0.0]), r"axes: expected the shape \(3, 3\)"),
        (lambda: bar().boundary.move([0], "x", axes=np.full((3, 3), np.nan)), "axes: not finite"),
    ],
)
def test_what_cannot_be_held_is_refused(pose, message):
    with pytest.raises(InputError, match=message):
        pose()


def test_a_motion_that_does_not_end_is_refused_in_any_axes():
    body = bar()
    body.boundary.move([0], ALL)
    body.boundary.move([16], "y", constant(0.1), axes=turned(20.0))
    with pytest.raises(InputError, match="motion 1 ends at a nonzero speed"):
        body.relax()
