"""Bending of yarns in the plane of the shells, in plain Python: gradients, closed forms, cuts, bound of the step."""

import itertools

import numpy as np
import pytest
from contact_cases import derivative
from plain import plain
from scipy.spatial.transform import Rotation
from shell_cases import Solid, grid, linear_laminate

from knittest.kernels.in_plane import OWN_EACH
from knittest.kernels.in_plane_blocks import SCRATCH, bend_energy, bend_forces, gather_bends
from knittest.kernels.shell_blocks import gather_shells, shell_forces
from knittest.kernels.shell_state import build_shells
from knittest.models.explicit_model import make_nodes
from knittest.models.in_plane import bend_bound, bend_bound_now, build_bends

STIFFNESS = np.array([4.2, 3.5])  # N mm
#: warp along the squares, at 45 degrees to them and at 29
DIRECTIONS = {"along": (1.0, 0.0, 0.0), "diagonal": (1.0, 1.0, 0.0), "oblique": (0.9, 0.5, 0.0)}


class Weave:
    """Shells whose yarns bend in the plane, with the forces of that alone, in plain Python."""

    def __init__(self, points, cells, warp=(1.0, 0.0, 0.0), stiffness=STIFFNESS) -> None:
        self.points, self.n = points, len(points)
        self.shells = build_shells(points, cells, np.asarray(warp, float))
        self.bends = build_bends(points, cells, self.shells, np.asarray(stiffness, float))
        self.nodes = make_nodes(points, np.ones(self.n), np.ones(self.n))
        self.cut = 0.0

    def place(self, position: np.ndarray) -> None:
        """Put the nodes at ``position`` (n, 3) [mm]."""
        self.nodes.position[:, : self.n] = position.T

    def forces(self, time: float = 0.0) -> np.ndarray:
        """Forces [N] on the nodes, (n, 3)."""
        self.nodes.force[:] = 0.0
        blocks = self.bends.first.size - 1
        self.cut += plain(bend_forces)(
            0, blocks, time, self.nodes, self.shells.fail_time, self.bends, np.zeros(SCRATCH)
        )
        plain(gather_bends)(0, self.n, self.nodes, self.bends)
        return self.nodes.force[:, : self.n].T.copy()

    def energy(self) -> float:
        """Energy [mJ] of the yarns' bending in the plane."""
        return plain(bend_energy)(self.nodes, self.bends)


def shaken(seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """A flat irregular mesh of 5 x 4 shells of 2 mm."""
    points, cells = grid(5, 4, 10.0, 8.0)
    points[:, :2] += np.random.default_rng(seed).uniform(-0.3, 0.3, (len(points), 2))
    return points, cells


def crumpled(weave: Weave, seed: int = 2) -> np.ndarray:
    """Put the nodes into a sheared, stretched and uneven state, and give it."""
    linear = np.array([[0.05, 0.0, 0.0], [0.4, 0.03, 0.0], [0.1, 0.2, 0.0]])
    place = weave.points + weave.points @ linear + np.random.default_rng(seed).normal(0.0, 0.2, (weave.n, 3))
    weave.place(place)
    return place


@pytest.mark.parametrize("warp", DIRECTIONS.values(), ids=DIRECTIONS)
def test_forces_are_the_gradient_of_the_energy(warp):
    """f = -dU/dx by central differences, at each third node of a sheared, crumpled sheet."""
    weave = Weave(*grid(4, 3, 8.0, 6.0), warp)
    crumpled(weave)
    force = weave.forces()
    for i, axis in itertools.product(range(0, weave.n, 3), range(3)):
        found = -derivative(weave.energy, weave.nodes.position, (axis, i), 1e-5)
        assert found == pytest.approx(force[i, axis], abs=1e-7 * np.abs(force).max())


@pytest.mark.parametrize("warp", DIRECTIONS.values(), ids=DIRECTIONS)
def test_forces_balance_and_turn_with_the_sheet(warp):
    """No momentum, no angular momentum; a rigid turn turns the forces and leaves the energy."""
    weave = Weave(*grid(4, 3, 8.0, 6.0), warp)
    place = crumpled(weave)
    force, energy = weave.forces(), weave.energy()
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()
    assert np.abs(np.cross(place, force).sum(axis=0)).max() < 1e-11 * np.abs(force).sum()
    turned = Rotation.from_rotvec([0.9, 1.2, 2.0]).apply
    weave.place(turned(place) + np.array([3.0, -2.0, 1.0]))
    assert weave.energy() == pytest.approx(energy, rel=1e-11)
    assert weave.forces() == pytest.approx(turned(force), abs=1e-11 * np.abs(force).max())


def test_a_curved_sheet_is_free_of_stress_where_it_starts():
    """A cylinder with a warp that leans, shells shaken: curvatures are those beyond the ones at rest."""
    points, cells = shaken()
    angle = points[:, 0] / 20.0
    curved = np.column_stack([20.0 * np.sin(angle), points[:, 1], 20.0 * np.cos(angle)])
    weave = Weave(curved, cells, (0.8, 0.6, 0.0))
    assert np.abs(weave.bends.natural).max() > 1e-5 and weave.bends.stiffness.max() > 1.0
    assert weave.energy() == pytest.approx(0.0, abs=1e-25)
    assert np.abs(weave.forces()).max() < 1e-12


@pytest.mark.parametrize("warp", DIRECTIONS.values(), ids=DIRECTIONS)
@pytest.mark.parametrize("mesh", [lambda: grid(5, 4, 10.0, 8.0), shaken], ids=["squares", "shaken"])
def test_curvature_along_the_yarn_is_exact_and_no_other_counts(warp, mesh):
    """x + m (k s^2 / 2 + p s t + q t^2 / 2), s along the warp, m across it: the warp bends by k, shear and its change
    across the yarns cost nothing; the weft, along t, is only stretched. U = B k^2 / 2 an area, to the order of k.
    """
    weave = Weave(*mesh(), warp)
    along = np.array(warp) / np.linalg.norm(warp)
    across = np.array([-along[1], along[0], 0.0])
    s, t = weave.points @ along, weave.points @ across
    k = 1e-5
    weave.place(weave.points + (0.5 * k * s**2 + 0.7 * k * s * t + 0.4 * k * t**2 + 0.01 * s)[:, None] * across)
    expected = 0.5 * k**2 * weave.bends.stiffness[0].sum()
    assert weave.bends.stiffness[0].sum() > 30.0 * STIFFNESS[0]  # mm2, of 80
    assert weave.energy() == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("warp", DIRECTIONS.values(), ids=DIRECTIONS)
def test_weights_that_are_alike_do_what_weights_of_each_stencil_do(warp):
    """Inside an even sheet all are alike, an uneven one has its own; forces are the same however they are spread."""
    weave, uneven = Weave(*grid(12, 12, 24.0, 24.0), warp), Weave(*shaken(), warp)
    assert (weave.bends.spread < OWN_EACH).mean() > 0.6 > 0.4 > (uneven.bends.spread < OWN_EACH).mean()
    crumpled(weave)
    force = weave.forces()
    weave.bends.spread[:] = OWN_EACH
    assert weave.forces() == pytest.approx(force, abs=1e-12 * np.abs(force).max())


def test_the_area_of_the_yarns_is_that_of_the_sheet_less_their_ends():
    """Squares of 2 mm, 10 x 8 mm: each yarn bends at all nodes but its ends, those of the edges with half a width."""
    bends = Weave(*grid(5, 4, 10.0, 8.0)).bends
    assert bends.stiffness.sum(axis=1) == pytest.approx(STIFFNESS * [8.0 * 8.0, 10.0 * 6.0])


def test_an_uneven_sheet_has_the_yarns_of_a_flat_one():
    """Heights of some hundredths of a millimetre tell no derivatives that the flat mesh does not."""
    points, cells = grid(5, 4, 10.0, 8.0)
    flat = Weave(points, cells).bends
    points[:, 2] = np.random.default_rng(1).uniform(-0.05, 0.05, len(points))
    uneven = Weave(points, cells).bends
    assert (
        (uneven.stiffness > 0.0).sum(axis=1).tolist() == [5 * 4, 6 * 3] == (flat.stiffness > 0.0).sum(axis=1).tolist()
    )
    assert uneven.stiffness.sum(axis=1) == pytest.approx(flat.stiffness.sum(axis=1), rel=2e-3)
    assert bend_bound(uneven, np.ones(30)) == pytest.approx(bend_bound(flat, np.ones(30)), rel=2e-3)


def test_a_sheet_that_is_slightly_uneven_spreads_its_weights_as_a_flat_one(monkeypatch):
    """Energy and forces are those of weights of each stencil to 1e-3, and rigid motions still cost nothing."""
    points, cells = grid(12, 12, 24.0, 24.0)
    points[:, 2] = np.random.default_rng(1).uniform(-0.05, 0.05, len(points))
    weave = Weave(points, cells)
    monkeypatch.setattr("knittest.models.in_plane.UNEVEN", 0.0)
    own = Weave(points, cells)
    assert (weave.bends.spread < OWN_EACH).mean() > 0.6 > 0.4 > (own.bends.spread < OWN_EACH).mean()
    weave.place(Rotation.from_rotvec([0.9, 1.2, 2.0]).apply(points + 5.0))
    assert np.abs(weave.forces()).max() < 1e-10 and weave.energy() < 1e-20
    bent = points + np.column_stack([0.02 * points[:, 1] ** 2, 0.3 * points[:, 0], 0.0 * points[:, 0]])
    for each in (weave, own):
        each.place(bent)
    assert weave.energy() == pytest.approx(own.energy(), rel=1e-3)
    assert weave.forces() == pytest.approx(own.forces(), abs=2e-3 * np.abs(own.forces()).max())


def jacobian(function, place: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Central differences of ``function`` of places along ``moves`` (k, n, 3), whose length is the step."""
    sides = [function(place + move) - function(place - move) for move in moves]
    return np.column_stack(sides) / (2.0 * np.abs(moves).max())


def columns(weave: Weave, n: int, shells: bool) -> np.ndarray:
    """Stiffness [N/mm] of n columns of nodes against sliding along y past each other, by central differences."""
    rows = weave.n // n
    card = linear_laminate(9e3, 9e3, hourglass_fibre=np.zeros(2), hourglass_shear=0.0, drilling=0.0)  # no node turns
    solid = Solid(weave.points, weave.shells, card)

    def forces(place: np.ndarray) -> np.ndarray:
        weave.place(place)
        force = weave.forces()
        if shells:
            solid.nodes.position[:, : solid.n], solid.nodes.force[:] = place.T, 0.0
            plain(shell_forces)(0, solid.blocks, 0.0, solid.nodes, solid.shells, solid.laminate, solid.scratch)
            plain(gather_shells)(0, solid.n, solid.nodes, solid.shells)
            force = force + solid.nodes.force[:, : solid.n].T
        return force[:, 1].reshape(n, rows).sum(axis=1)

    moves = np.zeros((n, weave.n, 3))
    moves[..., 1] = 1e-4 * np.repeat(np.eye(n), rows, axis=1)
    return -jacobian(forces, weave.points, moves)


@pytest.mark.parametrize(("n", "error"), [(5, 0.02), (10, 0.005)])
def test_strip_that_bends_in_its_plane(n, error):
    """A strip of yarns that slide freely, held in its middle, F at both ends: F L^3 / (3 B b), and 1 + 1 / (2 n^2) of
    it by second differences (trapezoids).
    """
    length, width = 20.0, 4.0
    weave = Weave(*grid(2 * n, 2, 2.0 * length, width), stiffness=(STIFFNESS[0], 0.0))
    free = np.arange(2 * n + 1) != n
    load = np.zeros(2 * n + 1)
    load[[0, -1]] = 1e-3
    sag = np.linalg.solve(columns(weave, 2 * n + 1, shells=False)[np.ix_(free, free)], load[free])
    expected = 1e-3 * length**3 / (3.0 * STIFFNESS[0] * width)
    assert sag[[0, -1]] == pytest.approx(expected * (1.0 + 0.5 / n**2), rel=1e-5)
    assert sag[-1] == pytest.approx(expected, rel=1.01 * error)


@pytest.mark.parametrize(("size", "error"), [(1.4, 0.02), (0.7, 0.004)])
def test_shear_grows_from_a_clamped_edge(size, error):
    """Shear angle beside an edge that the yarns leave straight: g0 (1 - exp(-x / w)), w = sqrt(B / (dS/dg)), which is
    sqrt(4.2 / 0.5) = 2.9 mm; none of it without the yarns' stiffness.
    """
    n, rows = round(25.0 / size), 2
    stiffness, shear = STIFFNESS[0], 0.5
    weave = Weave(*grid(n, rows, n * size, rows * size), stiffness=(stiffness, 0.0))
    load = np.zeros(n + 1)
    load[-1] = shear * 1e-3 * rows * size
    slide = np.zeros(n + 1)
    slide[2:] = np.linalg.solve(columns(weave, n + 1, shells=True)[2:, 2:], load[2:])
    angle = np.diff(slide)[: n // 2] / size / 1e-3
    x = size * np.arange(n // 2)  # from the shell that is held
    assert angle == pytest.approx(1.0 - np.exp(-x / np.sqrt(stiffness / shear)), abs=error)


def test_a_broken_shell_cuts_the_yarns_beside_it_in_the_next_step():
    """Their energy is lost, no more and no less, and no force is left on the nodes of the shell."""
    weave = Weave(*grid(5, 4, 10.0, 8.0))
    crumpled(weave)
    before, forces = weave.energy(), weave.forces()
    weave.shells.fail_time[7] = 1.0  # between nodes 8, 9, 13 and 14
    weave.bends.broken[3] = 1.0
    weave.forces(time=1.0)
    assert weave.cut == 0.0 and weave.energy() == before
    after = weave.forces(time=1.1)
    assert 0.0 < weave.cut == pytest.approx(before - weave.energy(), rel=1e-12)
    assert weave.bends.alive.sum() == 26 - 4
    assert np.abs(after[[0, 1, 5]]) == pytest.approx(np.abs(forces[[0, 1, 5]]))
    cut = weave.cut
    weave.forces(time=1.2)
    assert weave.cut == cut


def test_yarns_end_at_seams_and_folds():
    """A warp that jumps by 45 degrees, or a sheet folded by 100: no yarn goes through the nodes of that line."""
    points, cells = grid(4, 2, 8.0, 4.0)
    right = points[cells].mean(axis=1)[:, 0] > 4.0
    seam = np.where(right[:, None], [[1.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    fold = np.column_stack([np.minimum(points[:, 0], 4.0), points[:, 1], np.maximum(points[:, 0] - 4.0, 0.0)])
    fold[:, 0] -= 0.18 * fold[:, 2]
    line = {6, 7, 8}
    for place, warp in ((points, seam), (fold, (1.0, 0.02, 0.0))):
        bends = Weave(place, cells, warp).bends
        assert bends.alive.sum() > 0 and not _centres(bends, place, cells) & line
    assert _centres(Weave(points, cells).bends, points, cells) >= line


def _centres(bends, points, cells) -> set[int]:
    """Nodes of the stencils, by the shells round them."""
    found = set()
    for s in np.flatnonzero(bends.alive):
        shells = bends.around[bends.around_start[s] : bends.around_start[s + 1]]
        common = set(cells[shells[0]]).intersection(*(set(cells[e]) for e in shells))
        found |= {int(n) for n in common if (cells == n).any(axis=1).sum() == len(shells)}
    return found


@pytest.mark.parametrize("warp", DIRECTIONS.values(), ids=DIRECTIONS)
def test_no_state_vibrates_faster_than_the_bound(warp):
    """Highest eigenvalue of the whole sheet at rest, sheared by 57 degrees, and crumpled by 0.3 mm."""
    weave = Weave(*grid(3, 3, 6.0, 6.0), warp)
    mass = 824.2e-6 * np.bincount(grid(3, 3, 6.0, 6.0)[1].ravel(), minlength=weave.n)
    bound, rng = bend_bound(weave.bends, mass), np.random.default_rng(5)
    for shear, uneven in ((0.0, 0.0), (1.0, 0.0), (0.9, 0.15)):
        place = weave.points @ np.array([[1.0, 0.0, 0.0], [np.sin(shear), np.cos(shear), 0.0], [0.0, 0.0, 1.0]])
        found = _highest(weave, mass, place + uneven * 2.0 * rng.normal(size=place.shape))
        assert found < bound, (shear, uneven)


@pytest.mark.parametrize("warp", DIRECTIONS.values(), ids=DIRECTIONS)
def test_the_bound_of_a_state_holds_where_that_at_rest_does_not(warp):
    """Sheared by 80 degrees and crumpled by a sixth of the side, then shaken alone; at rest both are the same."""
    weave = Weave(*grid(3, 3, 6.0, 6.0), warp)
    mass, rng = np.full(weave.n, 3.3e-3), np.random.default_rng(5)
    rest = bend_bound(weave.bends, mass)
    assert bend_bound_now(weave.bends, weave.nodes.position, mass)[0] == pytest.approx(rest)
    for shear, uneven in ((1.4, 0.16), (0.0, 0.16)):
        place = weave.points @ np.array([[1.0, 0.0, 0.0], [np.sin(shear), np.cos(shear), 0.0], [0.0, 0.0, 1.0]])
        place += uneven * 2.0 * rng.normal(size=place.shape)
        found = _highest(weave, mass, place)
        weave.place(place)
        assert found < bend_bound_now(weave.bends, weave.nodes.position, mass)[0], (shear, uneven)
        if shear and warp == DIRECTIONS["along"]:
            assert found > 3.0 * rest  # what a guard is for


@pytest.mark.parametrize(("out", "off", "most"), [(0.0, 40.0, 6.0), (20.0, 0.0, 1.5), (20.0, 40.0, 15.0)])
def test_the_bound_of_a_state_knows_what_turns_and_what_bends_out_of_the_plane(out, off, most):
    """Sheared yarns far from their natural curvature, and bent far out of the plane [1/mm]: never too low."""
    weave = Weave(*grid(2, 2, 4.0, 4.0))
    mass, (x, y, _) = np.full(weave.n, 3.3e-3), (weave.points - [2.0, 2.0, 0.0]).T
    weave.bends.natural[:] += off
    place = np.column_stack([x + 0.6 * y, 0.8 * y, 0.5 * out * (x**2 + y**2)])
    found = _highest(weave, mass, place)
    weave.place(place)
    assert found < bend_bound_now(weave.bends, weave.nodes.position, mass)[0] < most * found


def test_the_bound_of_squares_is_sixteen_bending_stiffnesses_over_the_squared_size():
    """A long wave across and the shortest one along the yarn: 16 B / h^2 a mass of m' h^2."""
    weave = Weave(*grid(12, 12, 24.0, 24.0), stiffness=(4.2, 0.0))
    mass = np.full(weave.n, 824.2e-6 * 4.0)
    mass[weave.points[:, 1] % 24.0 == 0.0] *= 0.5
    assert bend_bound(weave.bends, mass) == pytest.approx(16.0 * 4.2 / 2.0**2 / mass.max())
    wave = np.cos(np.pi * weave.points[:, 0] / 2.0)
    weave.place(weave.points + 1e-6 * wave[:, None] * [0.0, 1.0, 0.0])
    inside = (np.abs(weave.points[:, 0] - 12.0) < 7.0) & (np.abs(weave.points[:, 1] - 12.0) < 11.0)
    force = weave.forces()[inside, 1] / mass[inside]
    assert force == pytest.approx(-1e-6 * wave[inside] * bend_bound(weave.bends, mass), rel=1e-6)


def _highest(weave: Weave, mass: np.ndarray, place: np.ndarray) -> float:
    """Largest squared frequency [1/ms^2] about a state; central differences of the forces."""

    def forces(moved: np.ndarray) -> np.ndarray:
        weave.place(moved)
        return weave.forces().ravel()

    tangent = -jacobian(forces, place, 1e-5 * np.eye(place.size).reshape(-1, *place.shape))
    masses = np.repeat(mass, 3)
    return float(np.linalg.eigvals(tangent / np.sqrt(np.outer(masses, masses))).real.max())
