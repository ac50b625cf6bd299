"""Law of yarn contacts by hand-posed yarns: compaction, static friction, memory, parallel yarns, ends."""

import numpy as np
import pytest
from cases.yarn_contact import struck

from knittest.base.errors import NumericalError
from knittest.pose import ALL, Body, Chain, Table, YarnContact, constant, ramp, section

LAW = section(1e4, 5.0, 0.2, 1e-3)
NORMAL, TANGENTIAL = 500.0, 250.0
X = np.arange(-2.0, 2.01, 0.2)


def along(axis: int, height: float = 0.0, shift: float = 0.0, x: np.ndarray = X) -> np.ndarray:
    points = np.zeros((len(x), 3))
    points[:, axis], points[:, 2] = x + shift, height
    return points


def pair(lower: np.ndarray, upper: np.ndarray, contact: YarnContact, **options) -> tuple[Body, np.ndarray]:
    """A held yarn and one above it; returns the nodes of the upper one."""
    body = Body.of_chains([Chain(lower, LAW), Chain(upper, LAW)], contact, **options)
    body.boundary.move(np.arange(len(lower)), ALL)
    return body, np.arange(len(lower), len(lower) + len(upper))


def lowered(contact: YarnContact, depth: float) -> tuple[float, float, float]:
    """Force [N] and energy [mJ] of a crossing that is pressed by ``depth`` [mm], and the work done on it [mJ]."""
    body, upper = pair(along(0), along(1, 0.4), contact)
    body.boundary.move(upper, [d for d in ALL if d != "z"])
    group = body.boundary.move(upper, ["z"], constant(-depth))
    body.advance(1.0)
    energies = body.energies()
    return -body.reaction(group), energies["contact"], energies["external"]


@pytest.mark.parametrize("exponent", [1, 2, 3])
def test_compaction_is_its_power_law(exponent):
    """F = k d (1 + (d / d0)^n), U = k d^2 (1 / 2 + (d / d0)^n / (n + 2)); the force is read half a chunk early."""
    depth, d0 = 0.08, 0.05
    force, energy, work = lowered(YarnContact(NORMAL, TANGENTIAL, 0.0, 0.0, compaction=(exponent, d0)), depth)
    share = (depth / d0) ** exponent
    assert force == pytest.approx(NORMAL * depth * (1.0 + share), rel=0.02)
    assert energy == pytest.approx(NORMAL * depth**2 * (0.5 + share / (exponent + 2)), rel=0.01)
    assert work == pytest.approx(energy, rel=0.01)


def test_compaction_goes_on_along_its_tangent_at_half_a_radius():
    """Radius 0.2: from d = 0.1 on the stiffness is k (1 + 3 (0.1 / d0)^2), the largest, which sets the step."""
    d0 = 0.05
    contact = YarnContact(NORMAL, TANGENTIAL, 0.0, 0.0, compaction=(2, d0))
    stiffest = NORMAL * (1.0 + 3.0 * (0.1 / d0) ** 2)
    assert contact.stiffest(0.2) == pytest.approx(stiffest)
    (low, *_), (high, *_) = lowered(contact, 0.12), lowered(contact, 0.16)
    assert high - low == pytest.approx(0.04 * stiffest, rel=0.02)
    soft = section(100.0, 5.0, 0.2, 1e-3)  # beams that leave the step to the contact

    def step(card: YarnContact) -> float:
        return Body.of_chains([Chain(along(0), soft)], card).model.critical_step

    assert step(contact) == step(YarnContact(stiffest, TANGENTIAL, 0.0)) < step(YarnContact(NORMAL, TANGENTIAL, 0.0))


def test_an_impact_into_compaction_keeps_energy():
    """To more than the depth at which the force is doubled, and back; energy to a few (omega dt)^2 of the contact."""
    body, energies, _ = struck(4, 0.0, compaction=(1, 0.001))
    before, after = (e["kinetic"] + e["internal"] + e["contact"] for e in energies)
    assert after == pytest.approx(before, rel=5e-5)
    assert body.model.mass[:5] @ body.velocity[:5, 2] > 0.0, "it has not bounced"


def dragged(contact: YarnContact, press: float, speed: float, time: float) -> tuple[np.ndarray, np.ndarray, Body]:
    """Way [mm] and drag [N] of a yarn pressed on a held one that crosses it, pulled along the latter."""
    body, upper = pair(along(0), along(1, 0.4), contact, damping=2.0)
    body.boundary.move(upper, ["y", "rx", "ry", "rz"])
    body.boundary.load(upper, "z", -press / len(upper), ramp(1.0, 1.0))
    quick = ramp(0.2, speed)
    pull = Table((0.0, *(2.0 + t for t in quick.time)), (0.0, *quick.value))
    group = body.boundary.move(upper, ["x"], pull)
    body.advance(2.0)
    way, drag = [], []

    def watch(b: Body) -> None:
        way.append(float(b.position[upper, 0].mean()))
        drag.append(b.reaction(group))

    body.advance(time, watch)
    return np.array(way), np.array(drag), body


def test_static_friction_lets_go_at_its_coefficient_and_slides_at_the_kinetic_one():
    """The drag is read as means over 20 steps, in which it climbs by 1 % of the static one at this speed."""
    way, drag, _ = dragged(YarnContact(NORMAL, TANGENTIAL, 0.2, static=0.4), press=2.0, speed=0.03, time=2.5)
    assert drag.max() == pytest.approx(0.4 * 2.0, rel=0.02)
    assert drag[way > 0.05].mean() == pytest.approx(0.2 * 2.0, rel=0.02)
    equal = dragged(YarnContact(NORMAL, TANGENTIAL, 0.2), press=2.0, speed=0.05, time=1.0)[1]
    assert equal.max() == pytest.approx(0.2 * 2.0, rel=0.02)


def test_a_sticking_contact_keeps_its_spring_when_it_passes_to_the_next_piece():
    """Pieces end at the middles of elements, here 0.1 from the crossing: drag k_t times the way, without a jump."""
    way, drag, body = dragged(YarnContact(NORMAL, 20.0, 5.0), press=2.0, speed=0.1, time=2.0)
    assert way[-1] > 0.15
    late = way > 0.02
    assert drag[late] == pytest.approx(20.0 * way[late], rel=0.02, abs=0.02)
    assert int(body.model.tracker.contacts.piece[0, 0]) == len(X) // 2 + 1


@pytest.mark.parametrize("angle", [0.0, 4.0])
def test_nearly_parallel_yarns_share_the_load(angle):
    """F_i = k (a - x_i^2 sin^2 angle / (2 r)) with reach r = 0.4, a from the load: stiff yarns drift apart sideways."""
    a, press = np.deg2rad(angle), 4.0
    upper = np.column_stack([X * np.cos(a), X * np.sin(a), np.full_like(X, 0.4)])
    body, nodes = pair(along(0), upper, YarnContact(NORMAL, TANGENTIAL, 0.0), damping=20.0)
    body.boundary.move(nodes, ["x", "y", "rx", "ry", "rz"])
    body.boundary.load(nodes, "z", -press / len(nodes), ramp(1.0, 1.0))
    body.advance(6.0)
    contacts, count = body.model.tracker.contacts, body.model.tracker.count
    force = np.abs(contacts.force[2, :count])
    assert (contacts.line[:count] == 1.0).all()
    assert force.sum() == pytest.approx(press, rel=0.01)
    apart = X[contacts.piece[0, :count]] ** 2 * np.sin(a) ** 2 / 0.8
    nearest = next(d for d in np.linspace(0.0, 0.02, 20001) if NORMAL * np.maximum(d - apart, 0.0).sum() >= press)
    expected = NORMAL * np.maximum(nearest - apart, 0.0)
    assert force == pytest.approx(expected, abs=0.1 * expected.max())


def test_a_yarn_slides_off_the_end_of_another_without_energy():
    """Past the end nothing touches; what friction took and what is left is what was put in."""
    body, upper = pair(along(0, x=X[:12]), along(1, 0.398), YarnContact(NORMAL, TANGENTIAL, 0.2))
    body.model.tracker.settle()
    body.model.tracker.contacts.reach[:] = 0.4
    body.boundary.move(upper, ["y", "z", "rx", "ry", "rz"])
    body.boundary.move(upper, ["x"], ramp(0.2, 1.0))
    body.advance(0.15)
    assert np.abs(body.model.tracker.contacts.force[2, : body.model.tracker.count]).max() == pytest.approx(
        1.0, rel=0.05
    )
    body.advance(0.6)
    tracker = body.model.tracker
    assert tracker.count == 0 or np.abs(tracker.contacts.force[:, : tracker.count]).max() == 0.0
    assert body.energies()["contact"] == 0.0


def test_a_position_that_is_not_finite_is_named_and_not_searched():
    """Its cell would lie anywhere in the memory."""
    body, upper = pair(along(0), along(1, 0.4), YarnContact(NORMAL, TANGENTIAL, 0.2))
    body.model.nodes.position[1, upper[3]] = np.nan
    with pytest.raises(NumericalError, match="node 24 of yarn 2 is not finite"):
        body.model.prepare()
