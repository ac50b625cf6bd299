"""Contact of soft yarns against closed forms, another solver, and the balance of its energy."""

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.fabric.relaxation import relaxed_cell
from knittest.kernels.soft_contact import pair_statistics, press_pairs
from knittest.materials.soft_shell import LEAST_SHARE, SoftShell
from knittest.models.boundary import Boundary, new_tally
from knittest.models.chains import Chain, build_chains
from knittest.models.meso import build_meso_cell
from knittest.models.yarn_contact import YarnContact
from knittest.models.yarn_model import YarnModel
from knittest.pose import Body, PeriodicBody, round_section
from knittest.solve.relaxed_cell import with_rest_spacing

SHELL = SoftShell(outer=1.5, core=0.65, rigidity=1.2e-3, exponent=2.4)
SECTION = round_section(modulus=500.0, diameter=0.65, density=1e-3)


def contact(friction: float = 0.0) -> YarnContact:
    return YarnContact(100.0, 10.0, friction, shell=SHELL)


def crossing(distance: float, angle: float, friction: float = 0.0, step: float = 0.04) -> YarnModel:
    """Two straight yarns whose middles lie above each other."""
    s = np.arange(-3.0, 3.0 + 0.5 * step, step)
    first = np.column_stack([s, 0.0 * s, 0.0 * s + distance])
    second = np.column_stack([np.cos(angle) * s, np.sin(angle) * s, 0.0 * s])
    model = build_chains([Chain(first, SECTION), Chain(second, SECTION)], ("yarn",), contact(friction))
    model.prepare()
    return model


def press(model: YarnModel, dt: float = 1e-6) -> np.ndarray:
    """Sum of the forces [N] on the first yarn, (3,), and book friction in ``model.tally``."""
    shells = model.soft_contact
    assert shells is not None
    model.tally = getattr(model, "tally", None) or new_tally(Boundary(model, dt))  # type: ignore[attr-defined]
    for p in range(model.parts.node.size - 1):
        press_pairs(p, dt, model.nodes, shells.pairs, shells.law, model.tally)  # type: ignore[attr-defined]
    first = model.group.chain[shells.pairs.node] == 0
    between = first[0] & ~first[1]
    return np.asarray(shells.pairs.force[:, between].sum(axis=1))


def test_the_pressure_is_the_slope_of_the_energy_and_the_table_agrees() -> None:
    at = np.linspace(SHELL.core + 1.01 * LEAST_SHARE * SHELL.depth, SHELL.outer, 2000)
    slope = -np.gradient(SHELL.energy(at), at)
    assert SHELL.pressure(at)[5:-5] == pytest.approx(slope[5:-5], rel=2e-3, abs=1e-8)
    law = SHELL.law(0.0, 0.1)
    rows = np.linspace(law.least, law.outer, law.pressure.size)
    assert law.energy == pytest.approx(SHELL.energy(rows), rel=1e-3, abs=1e-9)
    assert law.steepest == pytest.approx(-np.diff(law.pressure)[0] * law.inv_step, rel=0.03)


@pytest.mark.parametrize("angle", [90.0, 60.0, 40.0])
@pytest.mark.parametrize("distance", [0.72, 0.9, 1.2])
def test_two_crossed_straight_yarns_press_by_their_closed_form(distance: float, angle: float) -> None:
    """F = 2 pi d V(d) / sin(angle), by polar coordinates in the plane of both arc lengths."""
    force = press(crossing(distance, np.deg2rad(angle)))
    assert force[2] == pytest.approx(SHELL.crossing_force(distance, np.deg2rad(angle)), rel=4e-3)
    assert np.abs(force[:2]).max() < 1e-6 * force[2]


def test_friction_slides_at_its_coefficient_and_books_its_work() -> None:
    model = crossing(0.9, np.pi / 2.0, friction=0.3)
    normal, way, dt = press(model)[2], 2e-4, 1e-3
    own = np.flatnonzero(model.group.chain == 0)
    for step in range(2000):  # the yarn slides along itself, across the other
        if step == 1000:
            stuck = float(model.tally.energy[:, 1].sum())  # type: ignore[attr-defined]
        model.nodes.position[0, own] += way
        model.nodes.velocity[0, own] = way / dt
        model.tracker.update(dt)
        force = press(model, dt)
    pairs = model.soft_contact.pairs  # type: ignore[union-attr]
    across = np.linalg.norm(pairs.force, axis=0)
    assert force[2] == pytest.approx(normal, rel=0.02)  # the next nodes are where the first were
    lost = float(model.tally.energy[:, 1].sum())  # type: ignore[attr-defined]
    assert -force[0] == pytest.approx(0.3 * normal, rel=0.12)  # at pairs off the middle the normal is inclined
    assert lost - stuck == pytest.approx(-force[0] * 1000 * way, rel=0.03)
    assert across.max() < 1.05 * float(np.hypot(1.0, 0.3)) * pairs.weight.max() * SHELL.pressure(np.array(0.9))


def test_yarns_that_bounce_off_each_other_keep_their_energy() -> None:
    model = crossing(1.6, np.pi / 2.0, step=0.1)
    body = Body(model)
    own = np.flatnonzero(model.group.chain == 0)
    model.nodes.velocity[2, own] = -0.05
    energies = []
    body.start()
    for _ in range(40):
        body.advance(0.5)
        found = body.energies()
        energies.append(
            (
                found["kinetic"],
                found["internal"] + found["contact"],
                found["kinetic"] + found["internal"] + found["contact"],
            )
        )
    _, stored, total = np.array(energies).T
    assert stored.max() > 0.2 * total[0], "they met"
    assert total == pytest.approx(total[0], rel=2e-3)
    assert model.nodes.velocity[2, own].mean() > 0.0


def cell(wales: int = 1, elements: int = 32) -> PeriodicBody:
    run = resolve(
        test="cell", variant="acrylic-jersey", scale="meso", preset="quick",
        sets=[f"model.meso.elements_per_loop={elements}"],
    )  # fmt: skip
    return PeriodicBody(build_meso_cell(run, relaxed_cell(run.fabric), wales, 1), run.solver.safety, threads=1)


def settled(wales: int, stretch: float = 1.0) -> PeriodicBody:
    body = cell(wales)
    body.start()
    body.cell.images.lattice[0] *= stretch
    for _ in range(3):
        body.settle(1e-9, 20_000)
    return body


def test_the_relaxed_jersey_is_that_of_another_solver() -> None:
    """Wale 2.919, course 2.089 mm, energies 0.355 and 0.0320 mJ: minimised by L-BFGS, 32 nodes in a loop."""
    run = resolve(
        test="cell", variant="acrylic-jersey", scale="meso", preset="quick", sets=["model.meso.elements_per_loop=32"]
    )
    fabric = with_rest_spacing(run).fabric
    assert fabric.wale_spacing == pytest.approx(2.919, rel=5e-3)
    assert fabric.course_spacing == pytest.approx(2.089, rel=5e-3)


def test_the_pull_of_the_lattice_is_the_slope_of_the_energy() -> None:
    """dE/da of the cell at rest by a difference, with contacts across all edges; and doubled cells alike."""
    energy, pull = [], []
    for stretch in (0.995, 1.0, 1.005):
        body = settled(1, stretch)
        stored = body.cell.stored_energies()
        energy.append(float(stored.internal.sum() + stored.contact))
        pull.append(float(body.cell.images.pull[0]))
    width = float(body.cell.reference[0, 0])
    # Simpson's rule
    work = (pull[0] + 4.0 * pull[1] + pull[2]) / 6.0 * 0.01 * width
    assert energy[2] - energy[0] == pytest.approx(work, rel=0.01)
    double = settled(2)
    stored = double.cell.stored_energies()
    assert stored.internal.sum() + stored.contact == pytest.approx(2.0 * energy[1], rel=1e-4)
    assert double.cell.images.pull[0] == pytest.approx(pull[1], rel=5e-3)


def test_yarns_pressed_into_their_cores_stay_stable_and_count_as_penetration() -> None:
    """The step of the start holds where cores touch, also in yarns so soft that beams do not limit it."""
    s, height = np.arange(-3.0, 3.01, 0.3), SHELL.core + 0.5 * LEAST_SHARE * SHELL.depth
    section = round_section(modulus=5.0, diameter=0.65, density=1e-3)
    first, second = np.column_stack([s, 0.0 * s, 0.0 * s + height]), np.column_stack([0.0 * s, s, 0.0 * s])
    model = build_chains([Chain(first, section), Chain(second, section)], ("yarn",), contact())
    model.prepare()
    assert model.critical_step <= model.stable_step()[0]
    body, total = Body(model), []
    body.start()
    for _ in range(20):
        body.advance(0.05)
        found = body.energies()
        total.append(found["kinetic"] + found["contact"] + found["internal"])
    assert np.array(total) == pytest.approx(total[0], rel=0.05)
    deep = crossing(0.6, np.pi / 2.0)
    depth = (0.65 + LEAST_SHARE * 0.85 - 0.6) / 0.325
    assert deep.stored_energies().penetration.max() == pytest.approx(depth, rel=1e-3)
    assert not crossing(0.9, np.pi / 2.0).stored_energies().penetration.any()
    assert "pass through each other" in crossing(0.1, np.pi / 2.0).invalid_state(1e-6)


def test_pairs_keep_their_friction_when_the_list_is_renewed_and_restored() -> None:
    model = crossing(0.9, np.pi / 2.0, friction=0.3)
    own = np.flatnonzero(model.group.chain == 0)
    model.nodes.velocity[0, own] = 1e-3
    press(model, 1.0)
    shells = model.soft_contact
    assert shells is not None
    before, state = shells.pairs.spring.copy(), shells.state()
    assert before.any()
    model.nodes.position[2, own] += 0.2
    shells.update(0.0)
    assert shells.pairs.spring.sum() == pytest.approx(before.sum(), rel=1e-6)
    again = crossing(0.9, np.pi / 2.0, friction=0.3)
    assert again.soft_contact is not None
    again.soft_contact.restore(state)
    assert np.array_equal(again.soft_contact.pairs.spring, before)
    energy, total, least = pair_statistics(again.nodes, again.soft_contact.pairs, again.soft_contact.law)
    assert energy > 0.0 and total > 0.0 and least == pytest.approx(0.9, rel=1e-9)
