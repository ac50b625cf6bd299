"""A periodic cell in motion: closed forms, any number of repeats, turned as a whole, and the balance of its work."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.fabric.relaxation import relaxed_cell
from knittest.models.meso import build_meso_cell
from knittest.models.periodic_model import PeriodicModel
from knittest.pose import PeriodicBody, PeriodicChain, Table, round_section

MODULUS, DIAMETER = 2e3, 0.5
EA = MODULUS * np.pi * DIAMETER**2 / 4.0
SECTION = round_section(modulus=MODULUS, diameter=DIAMETER, density=1.5e-3)
A, B = 3.0, 2.0
#: rotation of a whole cell
FLAT = np.eye(3)
TURN = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]) @ [[1, 0, 0], [0, 0.28, -0.96], [0, 0.96, 0.28]]


def pulse(duration: float) -> Table:
    """Speed that begins and ends at 0, whose travel is 1."""
    time = np.linspace(0.0, duration, 41)
    speed = (1.0 - np.cos(2.0 * np.pi * time / duration)) / duration
    return Table(tuple(time), tuple(speed))


def straight(turn: np.ndarray) -> PeriodicBody:
    """Cell of one straight yarn along each vector, 5 mm apart, turned as a whole."""
    s = np.arange(8)[:, None] / 8
    chains = [
        PeriodicChain((s * [A, 0.0, 0.0] + [0.0, 0.3, 0.0]) @ turn.T, SECTION, 0, along=0),
        PeriodicChain((s * [0.0, B, 0.0] + [0.4, 0.0, 5.0]) @ turn.T, SECTION, 1, along=1),
    ]
    lattice = np.array([[A, 0.0, 0.0], [0.0, B, 0.0]]) @ turn.T
    return PeriodicBody.of_cell(chains, lattice, None, ("a", "b"))


@pytest.mark.parametrize("turn", [FLAT, TURN], ids=["flat", "turned"])
def test_straight_yarns_stretch_by_their_closed_form(turn: np.ndarray) -> None:
    """Two systems that do not touch: n_x = EA e_x / B, n_y = EA e_y / A, and no shear; in any orientation."""
    body = straight(turn)
    strain = np.diag([0.02, 0.01, 0.0])
    body.stretch(turn @ strain @ turn.T, pulse(1.0))
    body.damping = 2.0
    body.advance(1.0)
    body.damping = 20.0
    body.advance(2.0)
    expected = np.diag([EA * 0.02 / B, EA * 0.01 / A, 0.0])
    assert turn.T @ body.nominal_stress() @ turn == pytest.approx(expected, abs=1e-9 * EA)
    assert turn.T @ body.gradient @ turn == pytest.approx(np.eye(3) + strain, abs=1e-12)
    work = 0.5 * EA * (0.02**2 * A + 0.01**2 * B)
    energies = body.energies()
    assert energies["internal"] == pytest.approx(work, rel=1e-9)
    assert energies["external"] == pytest.approx(work + energies["damping"], rel=1e-4)


def test_a_sheared_cell_turns_its_yarns() -> None:
    """By F = 1 + 0.3 e_x e_y the yarn along y gets sqrt(1 + 0.3^2) as long and leans; Cauchy's stress is symmetric."""
    body = straight(FLAT)
    body.stretch([[0.0, 0.3, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], pulse(1.0))
    body.damping = 2.0
    body.advance(1.0)
    body.damping = 20.0
    body.advance(5.0)
    long = np.hypot(1.0, 0.3)
    force = EA * (long - 1.0) / A
    assert body.nominal_stress()[:, 1] == pytest.approx([force * 0.3 / long, force / long, 0.0], rel=1e-6, abs=1e-9)
    assert body.stress() == pytest.approx(body.stress().T, abs=1e-6 * force)


def test_a_free_width_carries_nothing_at_rest() -> None:
    """One yarn stretched and the vector of the other free: it keeps its length and its force vanishes."""
    body = straight(FLAT)
    body.stretch(np.diag([0.02, 0.0, 0.0]), pulse(1.0))
    body.free("by")
    body.damping = 2.0
    body.advance(1.0)
    body.damping = 20.0
    body.advance(2.0)
    assert abs(body.nominal_stress()[1, 1]) < 1e-6 * EA * 0.02 / A
    assert body.cell.lattice[1] == pytest.approx([0.0, B, 0.0], abs=1e-6)


def test_a_straight_yarn_bends_with_the_cell() -> None:
    """Curvature k along one system: M = EI k / B per length, with the cell on an arc of A."""
    body = straight(FLAT)
    body.bend(Table(pulse(1.0).time, tuple(0.05 * v for v in pulse(1.0).value)), (1.0, 0.0, 0.0))
    body.damping = 2.0
    body.advance(1.0)
    body.damping = 20.0
    body.advance(5.0)
    # the other yarn, 5 mm above, is carried along: no axial force, but its own curvature across is 0
    bending = MODULUS * np.pi * DIAMETER**4 / 64.0
    chord = 8.0 / A * 2.0 * np.sin(0.05 * A / 16.0) / 0.05  # nodes lie on the arc, beams are its chords
    stretched = EA * (chord - 1.0) * np.cos(0.05 * A / 16.0)
    assert abs(stretched) < 1e-4 * EA
    assert body.bending_moment() == pytest.approx(bending * 0.05 / B, rel=2e-3)


def test_a_body_at_speed_has_no_rest_and_a_stress_needs_steps() -> None:
    body = straight(FLAT)
    with pytest.raises(InputError, match="no step has been made"):
        body.stress()
    body.stretch(np.diag([0.02, 0.0, 0.0]), Table((0.0, 1.0), (0.0, 1.0)))
    body.start()
    with pytest.raises(InputError, match="ax of the lattice ends at a nonzero speed"):
        body.relax()


def sheared(
    variant: str, repeats: tuple[int, int], turn: np.ndarray = FLAT
) -> tuple[PeriodicBody, np.ndarray, dict[str, float]]:
    """Cell of a shipped fabric sheared by 0.15 rad in 6 ms as a trellis: its Cauchy stress and what its energies rose
    by.
    """
    run = resolve(test="picture-frame", variant=variant, scale="meso", preset="quick")
    body = turned(build_meso_cell(run, relaxed_cell(run.fabric), *repeats, axial_share=0.05), turn)
    c, s = np.cos(0.075) - 1.0, np.sin(0.075)
    body.stretch(turn @ np.array([[c, s, 0.0], [s, c, 0.0], [0.0, 0.0, 0.0]]) @ turn.T, pulse(6.0))
    body.damping = 0.01
    assert body.settle(1e-2, 20_000).converged
    before = body.cell.stored_energies()
    body.advance(6.0)
    energies = body.energies()
    energies["internal"] -= float(before.internal.sum())
    energies["contact"] -= before.contact
    return body, turn.T @ body.stress() @ turn, energies


def turned(model: PeriodicModel, turn: np.ndarray) -> PeriodicBody:
    """Body of ``model`` turned as a whole."""
    body = PeriodicBody(model)
    if turn is not FLAT:
        body.place(body.position @ turn.T, Rotation.from_matrix(turn).as_rotvec())
        model.reference = model.reference @ turn.T
        model.images.lattice[:6] = model.reference.ravel()
        model.images.axes[:] = model.images.axes @ turn.T
        model.images.map[:, :3] = model.images.map[:, :3] @ turn.T
    return body


@pytest.fixture(scope="module")
def one() -> tuple[PeriodicBody, np.ndarray, dict[str, float]]:
    return sheared("1", (1, 1))


@pytest.mark.parametrize(
    ("repeats", "turn"), [((2, 1), FLAT), ((2, 2), FLAT), ((1, 1), TURN)], ids=["2x1", "2x2", "turned"]
)
def test_neither_the_number_of_repeats_nor_a_turn_of_all_matters(one, repeats, turn) -> None:  # type: ignore[no-untyped-def]
    """Mean stress and energies an area within 1 %: rounding alone sets the cells apart."""
    body, stress, many = sheared("1", repeats, turn)
    assert stress == pytest.approx(one[1], abs=0.01 * np.abs(one[1]).max())
    cells = repeats[0] * repeats[1]
    for name in ("internal", "external", "friction"):
        assert many[name] == pytest.approx(cells * one[2][name], rel=0.01)
    touching, alike = one[0].crossings(), body.crossings()
    assert set(touching) == set(alike) and "knit-knit" in touching
    for kind, found in alike.items():
        assert found.count == pytest.approx(cells * touching[kind].count)
        assert found.normal_force == pytest.approx(touching[kind].normal_force, rel=0.02)


def test_work_is_energy_and_losses(one) -> None:  # type: ignore[no-untyped-def]
    """Work of the mean stress is what yarns and contacts store and what friction and damping take: within 0.2 %."""
    e = one[2]
    taken = sum(e[k] for k in ("internal", "contact", "friction", "contact_damping", "damping", "kinetic"))
    assert e["external"] == pytest.approx(taken, rel=2e-3)
    assert e["friction"] > 0.1 * e["external"] and e["kinetic"] < 0.01 * e["external"]
    stress = one[1]
    assert stress[0, 1] == pytest.approx(stress[1, 0], rel=0.02) and stress[0, 1] > 0.0
