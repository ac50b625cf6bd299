"""A deck of yarns: what it says is what the model has."""

import numpy as np
import pytest
from deck_reader import BEAM, cards_of, cells, curves_of, deck_text


@pytest.fixture(scope="module")
def strip():
    return deck_text("tensile", "warp", ["rig.width=12", "rig.gauge_length=12"], **BEAM)


@pytest.fixture(scope="module")
def cards(strip):
    return cards_of(strip[3])


NODE, BEAMS = [8, 16, 16, 16], [8, 8, 8, 8, 8]


def test_its_head_says_that_nobody_ran_it_its_units_and_its_differences(strip):
    head = strip[3].split("*TITLE")[0]
    for words in (
        "NOT RUN IN LS-DYNA",
        "ran in OpenRadioss after a conversion",
        "mm, ms, g",
        "Differences",
        "of contact, 1000 N/mm",
        "not 0.9 as in",
    ):
        assert words in head


def test_nodes_and_beams_are_the_models(strip, cards):
    model = strip[1].model
    nodes = np.array([cells(line, NODE) for line in cards["NODE"][0]])
    assert len(nodes) == model.n_nodes + 3
    assert np.allclose(nodes[: model.n_nodes, 1:], model.position(), atol=1e-9)
    rows = [cells(line, BEAMS) for line in cards["ELEMENT_BEAM"][0]]
    beams = np.array([r[:4] for r in rows], int)
    assert len(np.unique(beams[:, 0])) == len(beams) == 2 * len(model.mesh.cells)
    bending = beams[np.argsort(beams[:, 0])][: len(model.mesh.cells)]
    cables = beams[np.argsort(beams[:, 0])][len(model.mesh.cells) :]
    assert (bending[:, 2:] - 1 == model.mesh.cells).all() and (cables[:, 2:] == bending[:, 2:]).all()


def test_no_beam_is_oriented_along_itself(strip, cards):
    where = {int(n): np.array(x) for n, *x in (cells(line, NODE) for line in cards["NODE"][0])}
    for line in cards["ELEMENT_BEAM"][0]:
        _, _, a, b, third = cells(line, BEAMS)
        if third is not None:
            along, across = where[int(b)] - where[int(a)], where[int(third)] - where[int(a)]
            sine = np.linalg.norm(np.cross(along, across)) / np.linalg.norm(along) / np.linalg.norm(across)
            assert sine > 0.3


def _parts(cards):
    """Section, material and elements of each part."""
    sections = {int(cells(b[1])[0]): (int(cells(b[1])[1]), cells(b[2])) for b in cards["SECTION_BEAM_TITLE"]}
    elastic = {int(cells(b[1])[0]): cells(b[1]) for b in cards["MAT_ELASTIC_TITLE"]}
    cable = {int(cells(b[1])[0]): cells(b[1]) + cells(b[2]) for b in cards["MAT_CABLE_DISCRETE_BEAM_TITLE"]}
    found = {}
    for block in cards["PART_CONTACT"] + cards["PART"]:
        part, section, material = (int(v) for v in cells(block[1])[:3])
        found[part] = (*sections[section], {**elastic, **cable}[material], block[0])
    return found


def test_the_resultants_are_those_of_the_yarns_and_tension_adds_up(strip, cards):
    run, prepared, _, _ = strip
    model, parts, curves = prepared.model, _parts(cards), curves_of(cards)
    stretch, _, torsion, bending = model.beams.stiffness.T
    element = [[int(v) for v in cells(line, BEAMS)[:2]] for line in cards["ELEMENT_BEAM"][0]]
    of = dict(element)
    n_el = len(model.mesh.cells)
    for e in (0, n_el // 2, n_el - 1):
        s = int(np.flatnonzero(np.array(model.mesh.part_names) == parts[of[e + 1]][3].split(";")[0])[0])
        form, (area, iss, itt, j, *_), (_, _, modulus, poisson, *_), _ = parts[of[e + 1]]
        assert form == 2 and area == pytest.approx(np.pi * model.mesh.radius[e] ** 2, rel=1e-6)
        assert modulus * iss == pytest.approx(bending[s], rel=1e-5) and iss == itt
        assert modulus / (2 * (1 + poisson)) * j == pytest.approx(torsion[s], rel=1e-5)
        form, cable, (_, _, _, curve, *_, mxeps, _), _ = parts[of[e + 1 + n_el]]
        node = model.element_node[e]
        assert form == 6 and mxeps == pytest.approx(model.beams.fail_strain[node], rel=1e-5)
        strain = 0.9 * mxeps
        held = modulus * area * strain + cable[3] * np.interp(strain, *curves[int(curve)])
        law = model.beams.hinge_slope[s] @ np.maximum(strain - model.beams.slack[node] - model.beams.hinge_strain[s], 0)
        assert held == pytest.approx(law, rel=1e-4)
    assert (stretch > 0).all() and run.fabric.name


def test_it_is_as_heavy_as_the_model(strip, cards):
    _, prepared, mass, _ = strip
    position = prepared.model.position()
    total = 0.0
    parts = _parts(cards)
    for line in cards["ELEMENT_BEAM"][0]:
        _, part, a, b, *_ = (v and int(v) for v in cells(line, BEAMS))
        form, section, material, _ = parts[part]
        length = float(np.linalg.norm(position[b - 1] - position[a - 1]))
        total += material[1] * (section[0] * length if form == 2 else section[0])
    assert total == pytest.approx(float(mass.sum()), rel=1e-4)


def test_one_clamp_is_held_and_the_other_moves_as_the_rig_does(strip, cards):
    _, prepared, _, _ = strip
    model, rig = prepared.model, prepared.rig
    sets = {int(b[1][:10]): [int(v) for line in b[2:] for v in cells(line)] for b in cards["SET_NODE_LIST_TITLE"]}
    held = {tuple(cells(b[0])[2:]): np.array(sets[int(cells(b[0])[0])]) - 1 for b in cards["BOUNDARY_SPC_SET"]}
    ((nodes, dof, vad, curve, factor),) = [cells(line) for b in cards["BOUNDARY_PRESCRIBED_MOTION_SET"] for line in b]
    moving = np.array(sets[int(nodes)]) - 1
    along = model.position()[:, 1] - rig.middle
    assert set(moving) == set(np.flatnonzero(along >= 0.5 * rig.gauge - 1e-6)) and (dof, vad, factor) == (2, 0, 1)
    assert set(held[1, 1, 1, 1, 1, 1]) == set(np.flatnonzero(along <= -0.5 * rig.gauge + 1e-6))
    assert set(held[1, 0, 1, 1, 1, 1]) == set(moving)
    time, value = (np.array(a) for a in curves_of(cards)[int(curve)])
    assert np.trapezoid(value, time) == pytest.approx(rig.pull.integral(time[-1]), rel=1e-9)
    assert cells(cards["CONTROL_TERMINATION"][0][0])[0] == pytest.approx(rig.duration, rel=1e-7)


def test_yarns_touch_with_the_fabrics_friction(strip, cards):
    run = strip[0]
    block = cards["CONTACT_AUTOMATIC_GENERAL_ID"][0]
    assert cells(block[2])[:2] == [run.fabric.contact.friction_coefficient.value] * 2
    assert cells(block[1])[2] == 2 and cells(cards["SET_PART_LIST_TITLE"][0][2]) == [1, *_bending(cards)[1:]]
    assert cells(cards["DAMPING_GLOBAL"][0][0])[1] == run.solver.damping_per_ms


def _bending(cards):
    return [cells(block[1])[0] for block in cards["PART_CONTACT"]]
