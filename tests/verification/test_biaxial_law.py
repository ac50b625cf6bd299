"""Law of two strains: forces are the gradient of one energy, strips contract as it says, no state is above the step."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from shell_cases import fabric
from test_plain_shell import PlainSolid, plain

from knittest.base.errors import InputError
from knittest.kernels.biaxial import sample_law, sample_table
from knittest.kernels.shell_output import shell_fields
from knittest.kernels.shell_state import Laminate, build_shells
from knittest.materials.biaxial import BiaxialFit, contraction_of, fit_law
from knittest.materials.biaxial_table import BiaxialTable
from knittest.materials.energy_fit import Combination
from knittest.materials.laminate import laminate, limit_membrane, scale_membrane
from knittest.models.in_plane import KINK, highest_stiffness
from knittest.models.macro import build_sheet

WARP, WEFT = np.linspace(-0.4, 0.6, 21), np.linspace(-0.72, 0.6, 23)
REST = np.array([[1.5, 0.8], [0.8, 1.4]])
SQUARE = 2.0 * np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


def knit(strain: np.ndarray) -> np.ndarray:
    """Forces per width of W = e K e / 2 + 0.1 (exp(4 s) - 1 - 4 s - 8 s^2), s = e_warp + 0.6 e_weft: it locks."""
    s = strain @ np.array([1.0, 0.6])
    locking = 0.4 * (np.exp(4.0 * s) - 1.0 - 4.0 * s)
    return strain @ REST + np.stack([locking, 0.6 * locking], axis=-1)


def orthotropic(strain: np.ndarray) -> np.ndarray:
    return strain @ REST


def table_of(law, warp=WARP, weft=WEFT) -> BiaxialTable:
    return BiaxialTable(warp, weft, law(np.stack(np.meshgrid(warp, weft, indexing="ij"), axis=-1)))


def knit_fabric(**macro):
    q = {"source": "assumed"}
    changes = {
        "tension": None, "fracture_strain": None, "biaxial": {"curve": "knit.csv", **q},
        "bending_stiffness": {d: {"value": 0.02, **q} for d in ("warp", "weft")},
        "shear": {"stiffness": {"value": 0.3, **q}},
    }  # fmt: skip
    return fabric(**{**changes, **macro})


@pytest.fixture(scope="module")
def fit() -> BiaxialFit:
    return fit_law(table_of(knit), 0.01, "here")


@pytest.fixture(scope="module")
def card() -> Laminate:
    return laminate(knit_fabric(), {}, None, table_of(knit))


def test_the_law_is_that_of_its_table(fit):
    """Between the rows too, within half a per cent of the largest force; small forces within 1e-3 N/mm."""
    rng = np.random.default_rng(0)
    strain = rng.uniform([-0.4, -0.7], 0.6, (4000, 2))
    expected = knit(strain)
    pulled = (expected >= 0.0).all(axis=1)
    found = sample_law(strain[pulled], fit.law)[:, :2]
    assert pulled.sum() > 1500
    assert np.abs(found - expected[pulled]).max() < 5e-3 * np.abs(table_of(knit).force).max()
    small = pulled & (np.abs(expected).max(axis=1) < 0.5)
    assert np.abs(sample_law(strain[small], fit.law)[:, :2] - expected[small]).max() < 1e-3
    assert fit.deviation < 5e-3
    assert (sample_law(np.zeros((1, 2)), fit.law) == 0.0).all()
    assert sample_table(np.zeros((1, 2)), fit.law)[0, :2] == pytest.approx(0.0, abs=1e-12)


def test_a_quadratic_energy_is_the_orthotropic_plate():
    """Exact, with a symmetric tangent; in compression of both the plate at rest times one share."""
    law = fit_law(table_of(orthotropic), 0.01, "here").law
    strain = np.random.default_rng(1).uniform(0.0, 0.6, (200, 2))
    assert sample_law(strain, law)[:, :2] == pytest.approx(orthotropic(strain), abs=1e-7)
    assert sample_table(strain, law)[:, 2:] == pytest.approx(np.tile([1.5, 0.8, 1.4], (200, 1)), abs=1e-6)
    assert sample_law(-strain, law)[:, :2] == pytest.approx(-0.01 * orthotropic(strain), rel=1e-3)


def gradients(law, strain: np.ndarray, h: float = 1e-6) -> np.ndarray:
    """Gradient of the energy by central differences, (n, 2)."""
    sides = [sample_law(strain + s * h * move, law)[:, 2] for move in np.eye(2) for s in (1.0, -1.0)]
    return np.column_stack([sides[0] - sides[1], sides[2] - sides[3]]) / (2.0 * h)


def test_forces_are_the_gradient_of_the_energy_everywhere(fit):
    """Pulled, slack in one direction, pushed in both, beyond the table: central differences, h^2."""
    strain = np.random.default_rng(2).uniform([-0.8, -1.0], 1.1, (4000, 2))
    found = sample_law(strain, fit.law)
    assert gradients(fit.law, strain) == pytest.approx(found[:, :2], abs=1e-8 * np.abs(found).max())


def test_functions_of_a_combination_are_convex_and_their_slopes_are_derivatives():
    """By central differences, h^2; all of them together have the curvature 1 everywhere, beyond the samples too."""
    one = Combination.over(np.array([[-0.3, -0.4], [0.5, 0.6]]), np.array([1.0, 0.7]))
    strain, h = np.random.default_rng(5).uniform(-0.3, 0.8, (50, 2)), 1e-5
    (value, slope), (up, up_slope), (down, down_slope) = (one.functions(strain + k * h) for k in (0, 1, -1))
    assert (up - down) / (2.0 * h) == pytest.approx(1.7 * slope, abs=1e-6)
    curvature = (up_slope - down_slope) / (2.0 * h * 1.7)
    assert (curvature >= -1e-6).all() and value.min() >= -1e-12
    assert curvature[:, :-1].sum(axis=1) == pytest.approx(1.0, abs=1e-5)


def test_a_fabric_that_locks_is_stable_between_its_rows():
    """Yarns that hardly stretch: forces of one combination of both strains, a hundred times as stiff as across it."""

    def locking(strain: np.ndarray) -> np.ndarray:
        push = 0.02 * np.exp(9.0 * strain @ np.array([1.0, 0.7])) - 0.02
        return strain @ np.array([[0.2, 0.05], [0.05, 0.15]]) + np.stack([push, 0.7 * push], axis=-1)

    table = table_of(locking, np.linspace(-0.3, 0.25, 12), np.linspace(-0.4, 0.4, 17))
    table.force[table.force.max(axis=-1) > 1.0] = np.nan
    fit = fit_law(table, 0.01, "here")
    strain = np.random.default_rng(6).uniform([-0.2, -0.3], [0.25, 0.4], (4000, 2))
    expected = locking(strain)
    known = (expected > 0.01).all(axis=1) & (expected.max(axis=1) < 0.9) & ~table.is_beyond(*strain.T)
    tangent = sample_table(strain[known], fit.law)[:, 2:]
    size = np.linalg.eigvalsh(tangent[:, [0, 1, 1, 2]].reshape(-1, 2, 2))
    assert known.sum() > 200 and (size[:, 0] > -0.005 * size[:, 1]).all()
    assert np.abs(sample_law(strain[known], fit.law)[:, :2] - expected[known]).max() < 0.02


@pytest.mark.filterwarnings("ignore::scipy.integrate.IntegrationWarning")
def test_a_closed_path_gives_no_work(fit):
    """Through all parts of the law: below 1e-8 of the largest stored energy, the quadrature over all spline cells."""
    corners = np.array([[0.5, -0.6], [0.7, 0.3], [-0.3, 0.75], [-0.2, -0.4]])
    work, stored = 0.0, 0.0
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):

        def power(s: float, start=start, way=end - start) -> float:
            return float(sample_law((start + s * way)[None], fit.law)[0, :2] @ way)

        work += quad(power, 0.0, 1.0, limit=2000, epsabs=1e-11, epsrel=1e-11)[0]
        along = start + np.linspace(0.0, 1.0, 101)[:, None] * (end - start)
        stored = max(stored, float(sample_law(along, fit.law)[:, 2].max()))
    assert abs(work) < 1e-8 * stored


def test_parts_of_the_law_meet_with_equal_forces(fit):
    """At the strain of free contraction, at zero strain and at the end of the spline."""
    law, step = fit.law, 1e-9
    end = law.energy_range[:, 1]
    for at, across in (
        ((0.3, float(contraction(0, 0.3))), (0, 1)), ((float(contraction(1, 0.4)), 0.4), (1, 0)),
        ((0.0, -0.3), (1, 0)), ((-0.2, 0.0), (0, 1)), ((end[0], 0.1), (1, 0)), ((0.2, end[1]), (0, 1)),
        ((end[0], -0.9), (1, 0)), ((-0.9, end[1]), (0, 1)),
    ):  # fmt: skip
        sides = [sample_law(np.array([at]) + sign * step * np.array([across]), law)[0, :2] for sign in (1.0, -1.0)]
        assert sides[0] == pytest.approx(sides[1], abs=1e-6), at


def contraction(direction: int, pull: float) -> float:
    """Strain across a strip with free sides, by the formula."""

    def cross(other: float) -> float:
        strain = np.array([pull, other] if direction == 0 else [other, pull])
        return float(knit(strain)[1 - direction])

    return float(brentq(cross, -0.9, 0.1, xtol=1e-14))


def sheet(card: Laminate) -> PlainSolid:
    return PlainSolid(SQUARE, build_shells(SQUARE, np.array([[0, 1, 2, 3]]), np.array([0.0, 1.0, 0.0])), card)


def stretched(warp: float, weft: float) -> np.ndarray:
    return SQUARE @ np.diag([weft, warp, 0.0])


def test_a_patch_carries_the_gradient_of_the_energy(card):
    """Even strains of a square, warp along y: forces of its sides, and those of its fields."""
    solid = sheet(card)
    for strain in ((0.3, 0.1), (0.2, -0.5), (-0.1, 0.4), (-0.1, -0.05), (0.9, 0.2)):
        solid.place(stretched(*strain))
        force, _ = solid.forces()
        expected = sample_law(np.array([strain]), card)[0]
        assert -force[2:, 1].sum() / 2.0 == pytest.approx(expected[0], abs=1e-12)
        assert -force[1:3, 0].sum() / 2.0 == pytest.approx(expected[1], abs=1e-12)
        assert plain(shell_fields)(1, solid.nodes, solid.shells, card)[3:, 0] == pytest.approx(expected[:2], abs=1e-12)
        assert solid.energy() == pytest.approx(4.0 * expected[2], rel=1e-12)


@pytest.mark.parametrize("direction", [0, 1])
def test_a_strip_contracts_as_the_energy_says(card, direction):
    """Sides without force: the root of the other force, at small and at large strains, within 1 %; so is the force."""
    solid = sheet(card)
    for pull in (0.02, 0.2, 0.5):

        def side(other: float, pull=pull) -> float:
            solid.place(stretched(*((pull, other) if direction == 0 else (other, pull))))
            return float(solid.forces()[0][1:3, 0].sum() if direction == 0 else solid.forces()[0][2:, 1].sum())

        found, expected = brentq(side, -0.9, 0.1, xtol=1e-12), contraction(direction, pull)
        assert found == pytest.approx(expected, rel=0.01)
        both = np.array([pull, found] if direction == 0 else [found, pull])
        alone = np.array([pull, expected] if direction == 0 else [expected, pull])
        assert sample_law(both[None], card)[0, direction] == pytest.approx(knit(alone)[direction], rel=0.01)


def test_forces_of_bent_shells_are_the_gradient_too(card):
    """The membrane's law and bending of one warped shell, by central differences."""
    rng = np.random.default_rng(3)
    solid = sheet(card)
    solid.place(stretched(0.3, -0.1) + rng.normal(0.0, 0.05, (4, 3)), rng.normal(0.0, 0.2, (4, 3)))
    force, _ = solid.forces()
    expected = np.zeros((4, 3))
    for i in range(4):
        for axis in range(3):
            for h in (1e-6, -1e-6):
                solid.nodes.position[axis, i] += h
                expected[i, axis] -= solid.energy() / (2.0 * h)
                solid.nodes.position[axis, i] -= h
    assert force == pytest.approx(expected, abs=1e-7 * np.abs(force).max())


def test_a_kink_counts_more_than_a_stiffness(card):
    """Of a linear law, whose largest tangent is at rest, the kink to compression governs the step."""
    plain_card = laminate(knit_fabric(), {}, None, table_of(orthotropic))
    stiffness = plain_card.energy_tangents
    assert stiffness[1] == pytest.approx(stiffness[0], rel=0.15)
    shells = sheet(plain_card).shells
    found = highest_stiffness(plain_card, SQUARE, np.array([[0, 1, 2, 3]]), shells)[0][0]
    assert KINK * stiffness[1].max() < found < 1.3 * KINK * stiffness[1].max()


def test_the_step_bears_every_state(card):
    """Two uncoupled stiffnesses are above the tangent in every state, a kink counts KINK times."""
    shells = sheet(card).shells
    found = highest_stiffness(card, SQUARE, np.array([[0, 1, 2, 3]]), shells)[0][0]
    h, strain = 1e-6, np.random.default_rng(4).uniform([-0.6, -0.9], 0.7, (4000, 2))
    strain = strain[(strain <= [0.6, 0.6]).all(axis=1)]
    sides = [[sample_law(strain + s * h * e, card)[:, :2] for s in (1.0, -1.0)] for e in np.eye(2)]
    tangent = np.stack([(more - less) / (2.0 * h) for more, less in sides], axis=-1)
    assert tangent[:, 0, 1] == pytest.approx(tangent[:, 1, 0], abs=1e-4 * np.abs(tangent).max())
    # patterns of a square are orthogonal: twice the stiffest direction times area times squared gradient, 1 / 2
    assert np.linalg.eigvalsh(tangent).max() < found < 3.0 * np.linalg.eigvalsh(tangent).max()
    kink = sample_table(np.array([[0.5, contraction(0, 0.5)]]), card)[0, 4] - card.energy_range[1, 4]
    assert found > KINK * kink
    model = build_sheet(SQUARE, np.array([[0, 1, 2, 3]]), card, 2.5e-4, 1.2)
    assert 0.0 < model.critical_step < np.inf


def test_linear_models_of_a_knit_are_those_of_its_strips(card):
    """Cantilevers take the strip's stiffness at rest; forming keeps the law."""
    rest = card.slope[:, 0] + 2.0 * card.outer
    free = 1.5 - 0.8**2 / 1.4, 1.4 - 0.8**2 / 1.5
    assert rest == pytest.approx(free, rel=0.03)
    assert scale_membrane(card, 1.0).energy is None
    assert limit_membrane(card, 0.5) is card
    assert np.isinf(card.fail_strain).all()


def swirl(strain: np.ndarray) -> np.ndarray:
    return knit(strain) + 6.0 * np.stack([-strain[..., 1], strain[..., 0]], axis=-1)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (table_of(swirl), r"here: the forces of the we?\w+ deviate by up to \d.*limit 5 %\), most at strain_warp_pct"),
        (table_of(lambda e: e @ np.array([[1.0, 1.2], [1.2, 1.0]])), "from those of a convex energy"),
        (table_of(knit, weft=np.linspace(-0.2, 0.6, 9)), "lowest strain_weft_pct, -20; expected rows on both"),
        (table_of(lambda e: knit(e) + 0.4), r"force at zero strain is 0.4 and 0.4 N/mm; expected"),
        (table_of(knit, warp=np.linspace(0.0, 0.6, 9)), "expected strains below and above 0 in both directions"),
    ],
)  # fmt: skip
def test_tables_that_are_no_law_are_refused(table, message):
    with pytest.raises(InputError, match=message):
        fit_law(table, 0.01, "here")


def test_a_corner_may_be_missing():
    """Of a table without the states of both large strains the rest is the same law; the corner counts as beyond."""
    table = table_of(knit)
    force = table.force.copy()
    force[(WARP[:, None] + WEFT > 0.7)] = np.nan
    cut = BiaxialTable(WARP, WEFT, force)
    law = fit_law(cut, 0.01, "here").law
    strain, expected = cut.samples
    pulled = (expected >= 0.0).all(axis=1)
    assert np.abs(sample_law(strain[pulled], law)[:, :2] - expected[pulled]).max() < 2e-3 * np.abs(expected).max()
    warp, weft = np.array([0.1, 0.5, 0.5, 0.7]), np.array([0.55, 0.5, 0.1, 0.0])
    assert cut.is_beyond(warp, weft).tolist() == [False, True, False, True]


def test_a_strip_contracts_no_further_than_the_lowest_strain_of_the_table():
    """Loops that lock pull stiff inlays together, down to the lowest row: the spline of the energy begins there."""
    warp, weft = np.linspace(-0.1, 0.25, 36), np.linspace(-0.03, 0.032, 32)

    def inlaid(strain: np.ndarray) -> np.ndarray:
        s = strain @ np.array([1.0, 0.2])
        locking = 15.05 * np.maximum(s, 0.0) ** 3 / 0.244**3
        return np.stack([0.05 * strain[..., 0] + locking, 100.0 * strain[..., 1] + 0.2 * locking], axis=-1)

    law = fit_law(table_of(inlaid, warp, weft), 0.01, "here").law
    across = contraction_of(law, 0, np.linspace(0.0, law.energy_range[0, 1], 500))
    assert across[-1] < 0.95 * weft[0] and across.min() >= law.energy_range[1, 0] - 1e-12


def test_springs_along_the_inlays_leave_the_forces_and_lower_the_largest_tangent():
    """Forces at the strain of fabric and springs; those of the other direction stay, too."""
    warp, weft, stiff = np.linspace(-0.2, 0.25, 46), np.linspace(-0.03, 0.03, 61), 100.0

    def inlaid(strain: np.ndarray) -> np.ndarray:
        s = strain @ np.array([1.0, 0.2])
        locking = 2.0 * np.maximum(s, 0.0) ** 2
        return np.stack([0.05 * strain[..., 0] + locking, stiff * strain[..., 1] + 0.2 * locking], axis=-1)

    table = table_of(inlaid, warp, weft)
    soft = table.with_springs(1, 0.1)
    largest = table.largest_tangent(1)
    assert soft.largest_tangent(1) == pytest.approx(0.1 * largest, rel=1e-3)
    assert soft.warp is table.warp and np.isclose(soft.weft, 0.0, atol=1e-12).any()
    k = 40
    before = np.array([inlaid(np.array([warp[k], e])) for e in weft])
    moved = weft + before[:, 1] / table.spring(1, 0.1)
    for i in range(2):
        known = np.isfinite(soft.force[k, :, i]) & (soft.weft > moved[0]) & (soft.weft < moved[-1])
        assert known.sum() > 40
        expected = np.interp(soft.weft[known], moved, before[:, i])
        assert soft.force[k, known, i] == pytest.approx(expected, abs=1e-3 * np.abs(before[:, i]).max())
    assert table.force_at(1, 0.02) == pytest.approx(stiff * 0.02, rel=1e-4)
