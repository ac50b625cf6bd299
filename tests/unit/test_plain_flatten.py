"""Elliptic sections that flatten, in plain Python: gradient, closed forms of the law, energy, area."""

from types import SimpleNamespace

import numpy as np
import pytest
from contact_cases import derivative
from plain import plain
from scipy.integrate import quad
from test_plain_ellipses import SMOOTH, Pair, along

from knittest.kernels.flattening import DROVE, HIGH, LENGTH, MOVED, PRODUCT, PULL, flatten, reshape, squeeze
from knittest.models.natural_state import shape_energy, shapes_at_rest

HIGH0, WIDE0, MODULUS = 0.35, 0.7, 5.0


def yarn(exponent=1.0, n=6, modulus=MODULUS):
    """Contacts, beams and alive flags of a free yarn of ``n`` nodes, elements of 0.5 mm."""
    ones = np.ones(n)
    length = np.full(n, 0.5)
    length[[0, -1]] = 0.25
    stiff = np.full(n, modulus)
    shape = shapes_at_rest(HIGH0 * ones, WIDE0 * ones, stiff, exponent * ones, length, 1.0)
    contacts = SimpleNamespace(shape=shape, square=WIDE0**2 * ones, excess=(HIGH0**2 - WIDE0**2) * ones)
    alive = np.append(np.ones(n - 1), [0.0, 0.0])
    return contacts, SimpleNamespace(alive=alive, inv_length=np.full(n, 2.0)), length


@pytest.mark.parametrize("exponent", [1, 3])
@pytest.mark.parametrize("line_force", [1.5, -0.8])
def test_an_evenly_pressed_section_gives_way_by_its_law_at_equal_area(exponent, line_force):
    """Faces: q = 2 a modulus (1 - b / b0)^m; sides: 2 b modulus (1 - a / a0)^m. What goes in is stored or lost."""
    contacts, beams, length = yarn(float(exponent))
    shape, work, lost = contacts.shape, 0.0, 0.0
    for _ in range(8000):
        wide = shape[PRODUCT] / shape[HIGH]
        pull = 2.0 * line_force if line_force > 0.0 else 2.0 * line_force * wide / shape[HIGH]
        shape[PULL] = pull * length
        work -= 0.5 * np.sum((shape[PULL] + getattr(contacts, "last", 0.0)) * shape[MOVED])
        contacts.last = shape[PULL].copy()
        lost += plain(flatten)(0, 6, beams, contacts)
    b = shape[HIGH]
    a = np.sqrt(contacts.square)
    assert a * b == pytest.approx(WIDE0 * HIGH0)
    assert np.sqrt(contacts.square + contacts.excess) == pytest.approx(b)
    if line_force > 0.0:
        assert 2.0 * a * MODULUS * (1.0 - b / HIGH0) ** exponent == pytest.approx(line_force, rel=1e-3)
    else:
        assert 2.0 * b * MODULUS * (1.0 - a / WIDE0) ** exponent == pytest.approx(-line_force, rel=1e-3)
    stored = shape_energy(shape, beams, beams.alive, None)
    assert stored + lost == pytest.approx(work, rel=1e-3)
    low, high = sorted((float(b[0]), HIGH0))

    def faces(h):  # work of both faces, or both sides, a length
        ratio = min(h / HIGH0, HIGH0 / h)
        return 4.0 * WIDE0 * HIGH0 * MODULUS / h * (1.0 - ratio) ** exponent

    assert stored == pytest.approx(quad(faces, low, high)[0] * length.sum(), rel=1e-3)


def test_a_squeeze_at_a_point_spreads_over_the_height():
    """Half heights fall off as exp(-s / b0): the force is that of a length of two half heights, whatever the mesh."""
    contacts, beams, _ = yarn(n=61)
    contacts.shape[LENGTH], beams.inv_length = 0.1, np.full(61, 10.0)
    beams.alive = np.append(np.ones(60), [0.0, 0.0])
    for _ in range(6000):
        contacts.shape[PULL][30] = 0.01
        plain(flatten)(0, 61, beams, contacts)
    give = HIGH0 - contacts.shape[HIGH]
    assert np.log(give[34] / give[38]) == pytest.approx(0.4 / HIGH0, rel=0.03)
    assert 4.0 * WIDE0 * MODULUS / HIGH0 * HIGH0 * 2.0 * give[30] == pytest.approx(0.01, rel=0.05)


def test_contacts_pull_half_heights_by_the_gradient_of_their_energy():
    pair = Pair(along(0.0, 0.66, 0.1), along(np.deg2rad(70.0), 0.0, -0.05), (0.5, -0.8))
    high = np.sqrt(pair.contacts.square + pair.contacts.excess)
    wide = np.sqrt(pair.contacts.square)
    ones = np.ones(6)
    shape = shapes_at_rest(high, wide, MODULUS * ones, ones, 2.0 * ones, 1.0)
    pair.contacts = pair.contacts._replace(shape=shape)
    assert pair.settle() > 0.005
    force, offset = pair.contacts.force[:, 0], pair.contacts.offset[:, 0]
    for piece, parameter in zip(pair.contacts.piece[:, 0], pair.contacts.parameter[:, 0], strict=True):
        plain(squeeze)(int(piece), parameter, tuple(force), tuple(offset), pair.contacts)
    found = shape[PULL].copy()
    assert np.abs(found).max() > 0.1 * np.linalg.norm(force)

    def energy() -> float:
        plain(reshape)(0, 6, pair.contacts)
        return pair.energy()

    for node in range(6):
        pulled = derivative(energy, shape, (int(HIGH), node), 1e-5)
        assert pulled == pytest.approx(found[node], abs=5e-3 * np.abs(found).max())


def test_what_sections_grow_in_a_step_a_loaded_contact_is_deeper_by():
    pair = Pair(along(0.0, 0.62), along(0.5 * np.pi, 0.0))
    high, ones = np.sqrt(pair.contacts.square + pair.contacts.excess), np.ones(6)
    shape = shapes_at_rest(high, np.sqrt(pair.contacts.square), MODULUS * ones, ones, 2.0 * ones, 1.0)
    pair.contacts = pair.contacts._replace(shape=shape)
    depth = pair.settle()
    shape[MOVED], shape[DROVE] = -1e-4, 0.0
    shape[HIGH] += shape[MOVED]
    plain(reshape)(0, 6, pair.contacts)
    pair.step(SMOOTH)
    now = pair.contacts.reach[0] - np.linalg.norm(pair.contacts.offset[:, 0])
    assert now - depth == pytest.approx(-2e-4, rel=1e-3)
