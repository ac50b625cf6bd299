"""The critical step that contacts leave: highest eigenvalues, in closed form or dense, against the bound by nodes."""

from dataclasses import replace

import numpy as np
import pytest

from knittest.kernels.contact import spline_weights
from knittest.kernels.monitor import stiffest_node
from knittest.models import chains
from knittest.models.chains import build_chains, nodal_loads
from knittest.pose import Body, Chain, Patch, Section, YarnContact, section

#: beams so soft that the contact alone sets the step
SOFT = section(1.0, 1e-4, 0.2, 1e-3)
CONTACT = YarnContact(500.0, 50.0, 0.0, damping=0.0)
X = np.arange(9) * 0.4


def crossing(parameter: float, card: Section = SOFT) -> tuple[Chain, Chain]:
    """A yarn along x and one across it, ``parameter`` elements from where the centre-line of the first begins."""
    first = np.column_stack([X, np.zeros(9), np.zeros(9)])
    second = np.column_stack([np.full(9, (0.5 + parameter) * 0.4), X - X[4], np.full(9, 0.39)])
    return Chain(first, card), Chain(second, card)


def highest(body: Body) -> float:
    """Largest squared frequency [1/ms^2] of the one contact: k n n^T has rank one, so omega^2 = k sum w_i^2 / m_i."""
    contacts, mass, total = body.model.tracker.contacts, body.model.mass, 0.0
    assert body.model.tracker.count == 1
    for side in range(2):
        i, s = contacts.piece[side, 0], contacts.parameter[side, 0]
        total += float((np.array(spline_weights.py_func(s)) ** 2 / mass[i - 1 : i + 2]).sum())
    return CONTACT.normal * total


def pressed(parameter: float, safety: float, contact: YarnContact = CONTACT) -> Body:
    """The crossing, its first yarn pushed into the other one."""
    body = Body.of_chains(crossing(min(max(parameter, 0.01), 0.99)), contact, safety=safety)
    body.start()
    # beyond its end a yarn is not found anew, only followed
    body.model.nodes.position[0, 9:18] = (0.5 + parameter) * 0.4
    body.model.tracker.contacts.parameter[0, 0] = parameter
    body.model.tracker.contacts.offset[0, 0] = 0.0
    body.model.tracker.contacts.reach[0] = 0.4
    return body


@pytest.mark.parametrize("parameter", [-0.4, -0.2, 0.0, 0.25, 0.5, 1.0])
def test_a_contact_at_the_end_of_a_yarn_stays_below_the_bound(parameter):
    body = pressed(parameter, 1.0)
    assert body.dt**2 * highest(body) < 4.0


@pytest.mark.parametrize("parameter", [-0.499, -0.25, 0.0, 0.5])
def test_with_damping_too_and_the_guard_agrees(parameter):
    """Damping looks back half a step: stable below omega dt = 2 (sqrt(1 + xi^2) - xi), c = 2 xi k / omega."""
    body = pressed(parameter, 0.9, YarnContact(500.0, 50.0, 0.0))
    omega = highest(body) ** 0.5
    xi = 0.5 * body.model.law.viscous * omega / CONTACT.normal
    assert xi > 0.05
    assert omega * body.dt < 2.0 * ((1.0 + xi * xi) ** 0.5 - xi)
    body.step(1)
    assert body.model.diagnose(body.dt) == ""


def test_ends_do_not_govern_the_step():
    """They are made as heavy as their load asks: 45/16 k on 45/32 of the mass of a node within, whose load is 2 k."""
    free = build_chains([crossing(0.5)[0]], ("yarn",), CONTACT)
    inner = 4.0 * free.mass[4] / (chains.CONTACT_STEP_SHARE * CONTACT.normal)
    assert free.critical_step**2 == pytest.approx(inner, rel=0.02)
    assert free.mass[0] == free.mass[-1] == pytest.approx(45.0 / 32.0 * free.mass[4], rel=0.02)
    assert free.added_mass == pytest.approx(2 * (45.0 / 32.0 - 0.5) / 8.0, rel=0.03)


def test_the_guard_bounds_a_contact_between_its_frequency_and_the_row_sum():
    """Row sum of k n n^T: 2 k w / m; the beams are too soft to count."""
    body = pressed(0.5, 0.9)
    body.step(1)
    model = body.model
    assert model.diagnose(body.dt) == ""
    contacts = model.tracker.contacts
    args = contacts, 1, model.law, model.axial_stiffness, model.shear_stiffness, model.nodes, model.node_load
    worst, bound = stiffest_node(*args)
    assert worst in contacts.piece[:, 0]
    row_sum = 2.0 * 0.75 * CONTACT.normal / model.mass[worst]
    assert highest(body) < bound == pytest.approx(row_sum, rel=0.02)
    assert not model.node_load.any()


@pytest.mark.parametrize("axial", [20.0, 200.0])
def test_the_guard_tells_along_a_yarn_from_across_it(axial):
    """Beams along x, penalty along z, sticking along x: bounds of either direction do not add up."""
    body = Body.of_chains(crossing(0.5, section(axial, 1e-3, 0.2, 1e-3, shear=1.0)), CONTACT)
    body.start()
    model = body.model
    model.nodes.position[2, 9:18] -= 0.01  # touching
    body.step(1)
    contacts = model.tracker.contacts
    args = contacts, 1, model.law, model.axial_stiffness, model.shear_stiffness, model.nodes, model.node_load
    worst, bound = stiffest_node(*args)
    node = int(contacts.piece[0, 0])
    assert worst in (node, int(contacts.piece[1, 0]))
    arm2_m_over_i = 0.195**2 * model.mass[node] / model.inertia[node]
    share = 2.0 * 0.75
    along = 4.0 * axial / 0.4 + share * CONTACT.tangential * (1.0 + arm2_m_over_i)
    across = 4.0 * 1.0 / 0.4 + share * CONTACT.normal
    assert bound * model.mass[node] == pytest.approx(max(along, across), rel=0.02)


@pytest.mark.parametrize("bend", [0.0, 0.3, 0.8])
@pytest.mark.parametrize("penalty", [0.1, 1.0, 10.0])
def test_the_bound_by_direction_holds_and_is_not_wasteful(bend, penalty):
    """A bent chain whose nodes are all pressed across it, against the largest eigenvalue of its assembly."""
    turn = bend * np.arange(40)
    chord = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(40)])
    stiffness, tangent = np.zeros((120, 120)), np.vstack([chord[:1], chord[1:] + chord[:-1]])
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    for i in range(39):
        ends = np.r_[3 * i : 3 * i + 6]
        spring = np.outer(chord[i], chord[i]) + 0.3 * (np.eye(3) - np.outer(chord[i], chord[i]))
        stiffness[np.ix_(ends, ends)] += np.kron([[1.0, -1.0], [-1.0, 1.0]], spring)
    for i in range(40):
        at = np.r_[3 * i : 3 * i + 3]
        stiffness[np.ix_(at, at)] += penalty * (np.eye(3) - np.outer(tangent[i], tangent[i]))
    joined = np.append(np.ones(39, bool), False)
    loads = nodal_loads(chord, joined, np.ones(40), np.full(40, 0.3), np.full(40, penalty), np.zeros(40))
    largest = float(np.linalg.eigvalsh(stiffness)[-1])
    assert largest <= loads.max() * (1.0 + 1e-12)
    assert loads.max() < 1.1 * largest


def spinning(torsional: float) -> tuple[Body, float]:
    """A crossing that touches, k dt^2 sum w^2 / I of its spring against spin ``torsional``: 4 is the limit of central
    differences. Returns dt^2 sum w^2 / I too.
    """
    patch = YarnContact(500.0, 50.0, 1e4, damping=0.0, patch=Patch.disc(0.5))
    body = pressed(0.5, 1.0, patch)
    model, contacts, weights = body.model, body.model.tracker.contacts, 0.0
    for side in range(2):
        i, s = contacts.piece[side, 0], contacts.parameter[side, 0]
        weights += float((np.array(spline_weights.py_func(s)) ** 2 / model.inertia[i - 1 : i + 2]).sum())
    model.law = model.law._replace(torsional=torsional / (body.dt**2 * weights))
    return body, body.dt**2 * weights


@pytest.mark.parametrize(("share", "grows"), [(3.8, False), (4.2, True)])
def test_spin_is_unstable_beyond_the_limit_of_central_differences(share, grows):
    body, _ = spinning(share)
    nodes = body.model.nodes
    nodes.inv_mass[:] = 0.0  # they stay in touch
    body.step(1)
    nodes.spin[2, 9:18] = 1e-6
    body.step(25)
    assert (np.abs(nodes.spin[2, :18]).max() > 1e-3) == grows


def test_resistance_to_spin_takes_a_share_of_the_step():
    """omega^2 of two sets of springs is at most the sum; a disc of sticking springs, k R^2 / 2, if it bears it."""
    free, tough = (
        build_chains(crossing(0.5), ("yarn",), c) for c in (CONTACT, replace(CONTACT, patch=Patch.disc(9.0)))
    )
    assert (free.critical_step / tough.critical_step) ** 2 == pytest.approx(1.0 + chains.SPIN_STEP_SHARE, rel=1e-6)
    inertia = float(tough.inertia.min())
    assert tough.law.torsional * free.critical_step**2 / inertia == pytest.approx(0.1, rel=0.3)
    small = build_chains(crossing(0.5), ("yarn",), replace(CONTACT, patch=Patch.disc(0.01)))
    assert small.law.torsional == pytest.approx(0.5 * CONTACT.tangential * 0.01**2)
    assert small.critical_step == pytest.approx(free.critical_step, rel=1e-3)


def test_the_guard_sees_spin():
    body, _ = spinning(8.0)
    body.step(1)
    model = body.model
    assert model.stable_step()[0] < body.dt
