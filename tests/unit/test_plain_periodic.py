"""A periodic cell: maps of its images, shares of its contacts, and the pull on its lattice as the energy's gradient."""

from dataclasses import replace

import numpy as np
import pytest
from plain import plain

from knittest.base.errors import InputError
from knittest.kernels import contact as contact_scratch
from knittest.kernels import contact_blocks, monitor, periodic
from knittest.kernels.state import CURVATURE, LATTICE
from knittest.kernels.vec import read_tables
from knittest.models.boundary import Boundary, new_tally
from knittest.models.crossings import crossings
from knittest.models.natural_state import rotate_quaternions
from knittest.models.periodic import build_periodic
from knittest.models.periodic_model import PeriodicModel, missing_image
from knittest.models.tool import constant
from knittest.pose import PeriodicBody, PeriodicChain, YarnContact, round_section

SECTION = round_section(modulus=2e3, diameter=0.5, density=1.5e-3)
CONTACT = YarnContact(normal=50.0, tangential=0.0, friction=0.0, damping=0.0)
A, B = np.array([3.0, 0.2, 0.0]), np.array([-0.3, 2.5, 0.0])
DT = 1e-4


def wavy(degree_of_set: float = 1.0, across: bool = True) -> list[PeriodicChain]:
    """Two wavy yarns that cross once a cell, near its corner; ``across`` if they do so with an image of the other."""
    n, depth = 8, 0.49
    s = np.arange(n)[:, None] / n
    wave = 0.1 * np.sin(2.0 * np.pi * s)
    up = np.array([0.0, 0.0, 1.0])
    along_a = s * A + wave * (B / 5.0 + up)
    along_b = s * B + wave * (A / 5.0) - 0.1 * np.sin(4.0 * np.pi * s) * up
    if across:
        along_b = np.vstack([along_b[1:], along_b[:1] + B])
    return [
        PeriodicChain(along_a, SECTION, 0, degree_of_set=degree_of_set, along=0),
        PeriodicChain(along_b + depth * up, SECTION, 1, degree_of_set=degree_of_set, along=1),
    ]


def model_of(
    chains: list[PeriodicChain], repeats: tuple[int, int] = (1, 1), halo: float | None = None
) -> PeriodicModel:
    """Model of ``repeats`` of the cell of :func:`wavy`, its contacts found."""
    more = []
    for chain in chains:
        long, across = (A, B)[chain.along], (B, A)[chain.along]
        times, copies = repeats[chain.along], repeats[1 - chain.along]
        points = np.vstack([chain.points + k * long for k in range(times)])
        more += [
            PeriodicChain(points + k * across, SECTION, chain.part, degree_of_set=chain.degree_of_set,
                          along=chain.along)
            for k in range(copies)
        ]  # fmt: skip
    model = PeriodicBody.of_cell(more, [repeats[0] * A, repeats[1] * B], CONTACT, ("a", "b"), halo).cell
    model.prepare()
    # no overlap is free of force
    reach = model.group.radius[model.tracker.contacts.piece].sum(axis=0)
    model.tracker.contacts.reach[:] = reach
    return model


def shaken(model: PeriodicModel) -> None:
    """Move and turn the nodes of the cell, and close the contacts."""
    rng, n, own = np.random.default_rng(2), model.n_nodes, np.flatnonzero(model.owned)
    model.nodes.position[:, own] += 0.01 * rng.standard_normal((3, len(own)))
    turned = rotate_quaternions(model.nodes.rotation[:, own].T, 0.05 * rng.standard_normal((len(own), 3)))
    model.nodes.rotation[:, own] = turned.T
    assert n > len(own)


def set_lattice(model: PeriodicModel, lattice: np.ndarray) -> None:
    """Bring lattice and images to ``lattice`` (7,), and the contacts to their closest points."""
    model.images.lattice[:] = lattice
    plain(periodic.move_images)(DT, model.nodes, model.images)
    contacts, count = model.tracker.contacts, model.tracker.count
    scratch = np.zeros(contact_scratch.SCRATCH)
    for _ in range(12):
        contacts.reach[:count] = model.group.radius[contacts.piece[:, :count]].sum(axis=0)
        arguments = model.nodes, contacts, model.beams.alive, model.law, model.law.spin, None, scratch
        plain(contact_blocks.contact_forces)((0, count), DT, *arguments)


def energy(model: PeriodicModel, lattice: np.ndarray) -> float:
    """Elastic energy [mJ] of the cell with its nodes where they are."""
    set_lattice(model, lattice)
    contact, _ = plain(monitor.contact_statistics)(
        model.tracker.contacts, model.tracker.count, model.law, model.group.radius
    )
    own = model.beams._replace(alive=model.beams.alive * model.owned)
    return float(plain(monitor.section_energies)(model.nodes, model.parts, own).sum()) + contact


def pulled(model: PeriodicModel, lattice: np.ndarray) -> np.ndarray:
    """The kernel's pull on the lattice (7,), whose numbers are all held."""
    boundary = Boundary(model, DT)
    for name, group in zip(("ax", "ay", "az", "bx", "by", "bz", "curvature"), model.images.group, strict=True):
        if group < 0:
            model.drive(boundary, name, constant(0.0))
    drive, tally = boundary.drive(), new_tally(boundary)
    set_lattice(model, lattice)
    plain(read_tables)(drive.tables, 0.0, 0.0)
    plain(periodic.pull_lattice)(
        model.tracker.count,
        DT,
        model.nodes,
        model.beams,
        model.tracker.contacts,
        None,
        model.images,
        drive.tables,
        tally,
    )
    assert tally.reaction[0] == pytest.approx(model.images.pull)
    return model.images.pull.copy()


@pytest.mark.parametrize("curvature", [0.0, 1e-3, 0.25])
@pytest.mark.parametrize("along", [(1.0, 0.0, 0.0), (0.6, 0.8, 0.0)])
def test_the_pull_is_the_gradient_of_the_energy(curvature, along):
    """By every number of the lattice, flat, barely bent (by series) and bent, along a yarn and askew to both."""
    model = model_of(wavy(degree_of_set=0.6))
    shaken(model)
    model.bend_along(np.array(along))
    lattice = np.array([3.02, 0.22, 0.01, -0.28, 2.52, -0.01, curvature])
    found = pulled(model, lattice)
    for q in range(LATTICE):
        h = 1e-5 * (1.0 if q < CURVATURE else 0.1)
        up, down = (energy(model, lattice + s * h * np.eye(LATTICE)[q]) for s in (1.0, -1.0))
        assert found[q] == pytest.approx((up - down) / (2.0 * h), rel=2e-5, abs=2e-4 * np.abs(found).max())
    assert np.abs(found[:6]).max() > 1.0 and abs(found[6]) > 1.0
    assert np.abs(model.tracker.contacts.force).max() > 0.1


def test_the_power_on_a_lattice_is_its_work_and_free_numbers_follow_the_pull():
    model = model_of(wavy())
    shaken(model)
    boundary = Boundary(model, DT)
    model.drive(boundary, "ax", constant(0.5))
    model.free(boundary, "by")
    drive, tally = boundary.drive(), new_tally(boundary)
    lattice = np.append(np.vstack([A, B]).ravel(), 0.0)
    set_lattice(model, lattice)
    plain(read_tables)(drive.tables, 0.0, 0.0)
    plain(periodic.pull_lattice)(
        model.tracker.count,
        DT,
        model.nodes,
        model.beams,
        model.tracker.contacts,
        None,
        model.images,
        drive.tables,
        tally,
    )
    pull, rate = model.images.pull, model.images.rate
    assert rate[0] == 0.5 and model.images.lattice[0] == pytest.approx(3.0 + 0.5 * DT, rel=1e-12)
    assert rate[4] == pytest.approx(-DT * pull[4] / (4.0 * model.mass.sum()))
    assert tally.energy[0, 0] == pytest.approx(DT * (0.5 * pull[0] + 0.5 * rate[4] * pull[4]))


def test_images_move_as_their_positions_and_rotations_say():
    """Speeds and spins are the differences over a step, and image (1, 1) of a cylinder is that of (1, 0) and (0, 1)."""
    model = model_of(wavy(degree_of_set=0.6), halo=3.0)
    shaken(model)
    model.bend_along(np.array([0.6, 0.8, 0.0]))
    lattice = np.array([3.02, 0.22, 0.0, -0.28, 2.52, 0.0, 0.2])
    set_lattice(model, lattice)
    before = model.position()
    nodes, own, images = model.nodes, np.flatnonzero(model.owned), model.images
    nodes.velocity[:, own] = np.random.default_rng(3).standard_normal((3, len(own)))
    nodes.position[:, own] += DT * nodes.velocity[:, own]
    set_lattice_by = lattice + DT * np.array([0.3, 0.1, 0.0, 0.2, -0.4, 0.0, 0.05])
    images.lattice[:] = set_lattice_by
    plain(periodic.move_images)(DT, nodes, images)
    assert pytest.approx((model.position() - before) / DT, abs=1e-9) == nodes.velocity[:, :-1].T
    turn = images.map[:, 6]
    assert images.map[:, 7] == pytest.approx((turn - np.array([0.2 * _arc(t, lattice) for t in images.times])) / DT)
    one = {tuple(t): k for k, t in enumerate(images.times)}
    g = {k: _map(images, one[k]) for k in ((1, 0), (0, 1), (1, 1))}
    x = np.array([0.3, -0.2, 0.5])
    assert g[1, 0](g[0, 1](x)) == pytest.approx(g[1, 1](x), abs=1e-12)
    assert g[0, 1](g[1, 0](x)) == pytest.approx(g[1, 1](x), abs=1e-12)


def _arc(times, lattice):
    return float((times @ lattice[:6].reshape(2, 3)) @ [0.6, 0.8, 0.0])


def _map(images, k):
    row, axis = images.map[k], images.axes[2]
    return lambda x: np.array(plain(periodic._rotate_about)(tuple(axis), row[8], row[9], tuple(x))) + row[:3]


def test_the_start_is_its_own_image_where_yarns_are_not_set_too():
    """Rotations of yarns bent from straight differ by what a period turns: that stays between image and master."""
    model = model_of(wavy(degree_of_set=0.3))
    place, rotation = model.position(), model.nodes.rotation.copy()
    plain(periodic.move_images)(DT, model.nodes, model.images)
    assert model.position() == pytest.approx(place, abs=1e-12)
    assert model.nodes.rotation == pytest.approx(rotation, abs=1e-12)


def nearest(first: PeriodicChain, second: PeriodicChain, n: int = 200) -> tuple[float, float]:
    """Smallest distance [mm] of the centre-line of ``first`` from those of all images of ``second``, and the angle
    [deg] between them there, by trying all points.
    """
    (one, along), (other, across) = _curve(first, n), _curve(second, n)
    distance = np.concatenate([np.linalg.norm(one[:, None] - other - i * A, axis=2)[None] for i in (-1, 0, 1)])
    _, k, m = np.unravel_index(np.argmin(distance), distance.shape)
    cosine = abs(along[k] @ across[m]) / np.linalg.norm(along[k]) / np.linalg.norm(across[m])
    return float(distance.min()), float(np.rad2deg(np.arccos(cosine)))


def _curve(chain: PeriodicChain, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of the quadratic B-spline of ``chain`` and its tangents."""
    period, p = (A, B)[chain.along], chain.points
    before, after = np.vstack([p[-1:] - period, p[:-1]]), np.vstack([p[1:], p[:1] + period])
    s = np.linspace(0.0, 1.0, n, endpoint=False)[:, None, None]
    place = 0.5 * (1 - s) ** 2 * before + (0.5 + s - s**2) * p + 0.5 * s**2 * after
    return place.reshape(-1, 3), ((1 - s) * (p - before) + s * (after - p)).reshape(-1, 3)


@pytest.mark.parametrize("across", [True, False])
@pytest.mark.parametrize("repeats", [(1, 1), (2, 1), (2, 2)])
def test_each_crossing_counts_once_wherever_the_cell_is_cut(repeats, across):
    """Two halves across an edge, of each of which one piece is an image, or a whole within."""
    model, cells = model_of(wavy(across=across), repeats), repeats[0] * repeats[1]
    count = model.tracker.count
    assert (0.5 in model.tracker.contacts.share[:count]) == across
    lattice = np.append(np.vstack([repeats[0] * A, repeats[1] * B]).ravel(), 0.0)
    set_lattice(model, lattice)
    found = crossings(model)
    assert list(found) == ["a-b"] and found["a-b"].count == pytest.approx(cells)
    distance, angle = nearest(*wavy())
    assert found["a-b"].normal_force == pytest.approx(50.0 * (0.5 - distance), rel=1e-3)
    assert found["a-b"].angle == pytest.approx(angle, abs=0.1)
    one = model_of(wavy())
    assert energy(model, lattice) == pytest.approx(cells * energy(one, np.append(np.vstack([A, B]).ravel(), 0.0)))
    assert model.mass.sum() == pytest.approx(cells * one.mass.sum())
    shaken(model)
    parts = model.beam_energies()
    assert min(v.max() for v in parts.values()) > 1e-3
    assert sum(v.sum() for v in parts.values()) == pytest.approx(
        float(model.stored_energies().internal.sum()), rel=1e-9
    )


def test_a_lattice_without_an_area_and_a_number_moved_twice_are_refused():
    with pytest.raises(InputError, match="not parallel"):
        PeriodicBody.of_cell(wavy(), [A, 2.0 * A])
    body = PeriodicBody.of_cell(wavy(), [A, B])
    body.free("ax")
    with pytest.raises(InputError, match="already moved or free"):
        body.bend(constant(0.0)), body.stretch(np.eye(3), constant(1.0))
    with pytest.raises(InputError, match=r"lattice: .*expected one of"):
        body.free("cx")


def test_yarns_that_reach_where_no_image_is_are_named():
    """With images of the next nodes alone, the yarn across has none where it will touch; by default it has."""
    assert missing_image(model_of(wavy())) == ""
    model = PeriodicBody.of_cell(wavy(), [A, B], CONTACT, ("a", "b"), halo=0.0).cell
    assert "; increase rig.max_slip" in missing_image(model) and "rig.max_slip" in model.diagnose(DT)


@pytest.mark.parametrize(("shrink", "slide"), [(0.5, 2.0), (1.0, 2.0), (1.0, 9.0)])
def test_images_are_those_near_nodes_of_the_cell(shrink, slide):
    """All of them, of all cells around: contacts reach 2 r, the skin and a piece, over the shrink, and yarns slide."""
    model = build_periodic(wavy(), [A, B], ("a", "b"), CONTACT, shrink=shrink, slide=slide)
    own = model.position()[model.owned > 0.0]
    longest = max(float(np.linalg.norm(np.diff(c.points, axis=0), axis=1).max()) for c in wavy())
    reach = (2.0 * 0.25 + 0.1 + longest) / shrink + slide * 0.25
    images = model.images
    held = {(*images.times[images.of[g]].astype(int), m) for g, m in zip(images.ghost, images.master, strict=True)}
    far = 0
    for i, j in np.ndindex(9, 9):
        times = np.array([i - 4, j - 4])
        moved = own + times @ np.vstack([A, B])
        distance = np.linalg.norm(moved[:, None] - own[None], axis=2).min(axis=1)
        names = [(*times, m) for m in np.flatnonzero(model.owned)]
        assert all(name in held for name, d in zip(names, distance, strict=True) if times.any() and d < reach - 1e-3)
        far += sum(name in held for name, d in zip(names, distance, strict=True) if d > reach + 1.5)
    assert far == 0


def test_a_couple_of_friction_bends_as_its_power_says():
    """Its moments on images are about their axes, times what the curvature turns them."""
    model, lattice = model_of(wavy()), np.append(np.vstack([A, B]).ravel(), 0.0)
    model.bend_along(np.array([0.0, 1.0, 0.0]))
    plainly = pulled(model, lattice)
    contacts, count = model.tracker.contacts, model.tracker.count
    contacts.offset[0, :count] += 0.6 * contacts.offset[2, :count]  # about an axis that is not across the bending alone
    before = pulled_with(model, 0.0)
    change = pulled_with(model, 2.0) - before
    expected = 0.0
    for c, side in np.ndindex(count, 2):
        i, s = contacts.piece[side, c], contacts.parameter[side, c]
        weights = 0.5 * (1 - s) ** 2, 0.5 + s - s**2, 0.5 * s**2
        for weight, node in zip(weights, (i - 1, i, i + 1), strict=True):
            arc = float(model.images.times[model.images.of[node]] @ [A[1], B[1]])
            moment = (2.0 if side else -2.0) * contacts.offset[:, c]
            expected -= contacts.share[c] * weight * arc * float(moment @ model.images.axes[2])
    assert abs(expected) > 0.1 and change[CURVATURE] == pytest.approx(expected)
    assert change[:CURVATURE] == pytest.approx(0.0, abs=1e-12) and np.isfinite(plainly).all()


def pulled_with(model: PeriodicModel, couple: float) -> np.ndarray:
    """The pull (7,) at a ``couple`` [N] in every contact."""
    boundary = Boundary(model, DT)
    drive, tally = boundary.drive(), new_tally(boundary)
    model.tracker.contacts.couple[:] = couple
    model.images.group[:] = np.where(np.arange(LATTICE) == CURVATURE, 0, -1)
    plain(read_tables)(drive.tables, 0.0, 0.0)
    model.images.table[:] = 0
    plain(periodic.pull_lattice)(
        model.tracker.count,
        DT,
        model.nodes,
        model.beams,
        model.tracker.contacts,
        None,
        model.images,
        drive.tables,
        tally,
    )
    return model.images.pull.copy()


def test_yarns_of_a_cell_have_no_cut_ends():
    """Yarns go on where images stop: no piece there gives up its contacts."""
    assert not build_periodic(wavy(), [A, B], ("a", "b"), replace(CONTACT, cut=2)).group.cut.any()
