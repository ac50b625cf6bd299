"""Decks of shells: the layers add up to the laminate, frame and tools move as the rig moves them."""

import numpy as np
import pytest
from deck_reader import BEAM, SHELL, cards_of, cells, curves_of, deck_text

from knittest.base.errors import InputError
from knittest.runs.deck.deck_file import deck_differences


@pytest.fixture(scope="module")
def frame():
    return deck_text("picture-frame", sets=["rig.side=60", "model.macro.element_size=6"], **SHELL)


@pytest.fixture(scope="module")
def cards(frame):
    return cards_of(frame[3])


def _layers(cards):
    """Places over the thickness [mm], thickness of the layers [mm] and their materials."""
    block = cards["INTEGRATION_SHELL"][0]
    thick = cells(cards["SECTION_SHELL_TITLE"][0][2])[0]
    material = {int(cells(b[1])[0]): int(cells(b[1])[2]) for b in cards["PART"]}
    points = [cells(line) for line in block[1:]]
    return [(0.5 * thick * s, weight * thick, material[int(part)]) for s, weight, part in points]


def _fibres(cards):
    """Density, curves of both families and of shear, and transverse moduli of each material."""
    found = {}
    for _, first, _, *rest in cards["MAT_REINFORCED_THERMOPLASTIC_TITLE"]:
        rows = [cells(line) for line in rest]
        found[int(cells(first)[0])] = (cells(first)[1], rows[1][3], rows[3][3], rows[2][1], rows[1][5], rows[3][5])
    return found


def test_its_layers_add_up_to_the_laminate(frame, cards):
    card, curves, fibres = frame[1].model.laminate, curves_of(cards), _fibres(cards)
    assert cells(cards["SECTION_SHELL_TITLE"][0][1])[:6] == [1, 16, 1, 3, 0, -1]
    for direction, strain in [(0, 0.012), (1, 0.012), (0, -0.01), (1, 0.004)]:
        of = [(z, t * np.interp(strain, *curves[int(fibres[m][1 + direction])])) for z, t, m in _layers(cards)]
        slope = card.slope[direction] @ np.maximum(strain - card.knee[direction], 0.0)
        middle = slope + card.compression[direction] * min(strain, 0.0)
        assert sum(f for _, f in of) == pytest.approx(middle + 2 * card.outer[direction] * strain, rel=1e-5)
        bending = sum(t * z**2 * np.interp(1e-3, *curves[int(fibres[m][1 + direction])]) for z, t, m in _layers(cards))
        assert bending / 1e-3 == pytest.approx(2 * card.outer[direction] * card.layer_offset**2, rel=1e-5)
    assert 2 * card.outer * card.layer_offset**2 == pytest.approx(frame[0].fabric.macro.bending_stiffness_n_mm)


@pytest.mark.parametrize("angle", [0.1, 0.5, -0.4])
def test_its_shear_is_the_laminates(frame, cards, angle):
    card, curves, fibres = frame[1].model.laminate, curves_of(cards), _fibres(cards)
    force = sum(t * np.interp(angle, *curves[int(fibres[m][3])]) for _, t, m in _layers(cards))
    law = card.shear_slope @ np.maximum(abs(angle) - card.shear_knee, 0.0)
    assert force == pytest.approx(np.sign(angle) * law, rel=1e-5)
    transverse = sum(t * fibres[m][4] for _, t, m in _layers(cards))
    assert transverse == pytest.approx(card.transverse[0], rel=1e-5)


def test_it_is_as_heavy_as_the_model_and_its_warp_lies_along_a_side(frame, cards):
    _, prepared, mass, _ = frame
    density = {f[0] for f in _fibres(cards).values()}
    thick = sum(t for _, t, _ in _layers(cards))
    assert len(density) == 1 and density.pop() * thick * 60.0**2 == pytest.approx(float(mass.sum()), rel=1e-4)
    vector = cells(cards["MAT_REINFORCED_THERMOPLASTIC_TITLE"][0][2])[5:]
    assert vector == pytest.approx([-np.sqrt(0.5), np.sqrt(0.5), 0.0], abs=1e-5)
    shells = np.array([cells(line, [8] * 6) for line in cards["ELEMENT_SHELL"][0]], int)
    assert (shells[:, 2:] - 1 == prepared.model.mesh.cells).all()


def test_each_needle_goes_with_the_frame(frame, cards):
    """x q and y p: at the end by the stretches of the largest angle, less the slack of the mounting."""
    _, prepared, _, _ = frame
    rig, curves = prepared.rig, curves_of(cards)
    p, q = rig.stretches(rig.duration)
    moved = {}
    for block in cards["BOUNDARY_PRESCRIBED_MOTION_NODE"]:
        for line in block:
            node, dof, vad, curve, factor = cells(line)
            time, value = (np.array(a) for a in curves[int(curve)])
            inside = np.append(time[time < rig.duration], rig.duration)
            moved[int(node) - 1, int(dof)] = factor * np.trapezoid(np.interp(inside, time, value), inside)
            assert vad == 0
    position = prepared.model.position()
    held = {int(n) for n in rig.held}
    still = {node for node in held if (node, 1) not in moved or (node, 2) not in moved}
    assert all(np.abs(position[n, :2]).min() < 1e-9 for n in still)
    for (node, dof), travel in moved.items():
        stretch = (q if dof == 1 else p) * (1.0 - rig.slack)
        assert node in held and travel == pytest.approx(position[node, dof - 1] * (stretch - 1.0), abs=2e-3)


@pytest.fixture(scope="module")
def blank():
    sets = ["rig.blank_holder_force=100", "model.macro.element_size=15", "rig.stamp.kind=hemisphere"]
    return deck_text("forming", sets=sets, **SHELL)


def test_tools_move_and_press_as_the_rig_has_them(blank):
    run, prepared, _, text = blank
    cards, rig = cards_of(text), prepared.rig
    curves = curves_of(cards)
    rigid = {b[0].strip(): (cells(b[1]), cells(b[2])) for b in cards["MAT_RIGID_TITLE"]}
    assert list(rigid) == ["stamp", "die", "holder", "floor"]
    assert [tuple(con) for _, con in rigid.values()] == [(1, 4, 7), (1, 7, 7), (1, 4, 7), (1, 7, 7)]
    parts = {b[0].strip(): int(cells(b[1])[0]) for b in cards["PART"]}
    ((part, dof, vad, curve, factor),) = [cells(b[0]) for b in cards["BOUNDARY_PRESCRIBED_MOTION_RIGID"]]
    time, value = (np.array(a) for a in curves[int(curve)])
    assert (part, dof, vad, factor) == (parts["stamp"], 3, 0, 1)
    assert np.trapezoid(value, time) == pytest.approx(-run.rig.depth_mm, rel=1e-6)
    ((part, dof, curve, factor),) = [cells(b[0]) for b in cards["LOAD_RIGID_BODY"]]
    assert (part, dof, factor) == (parts["holder"], 3, 1) and curves[int(curve)][1][-1] == -100.0
    contacts = [cells(b[1])[:4] for b in cards["CONTACT_AUTOMATIC_SURFACE_TO_SURFACE_ID"]]
    assert contacts == [[1, parts[name], 3, 3] for name in rigid]
    rubbing = {tuple(cells(b[2])[:2]) for b in cards["CONTACT_AUTOMATIC_SURFACE_TO_SURFACE_ID"]}
    assert rubbing == {(rig.rig.static_coefficient, rig.rig.kinetic_coefficient)}


def test_a_free_holder_has_its_mass(blank):
    _, _, mass, text = blank
    cards = cards_of(text)
    nodes = {int(n): x for b in cards["NODE"] for n, *x in (cells(line, [8, 16, 16, 16]) for line in b)}
    parts = {b[0].strip(): int(cells(b[1])[0]) for b in cards["PART"]}
    area = 0.0
    for block in cards["ELEMENT_SHELL"]:
        for line in block:
            _, part, a, b, c, _ = (int(v) for v in cells(line, [8] * 6))
            if part == parts["holder"]:
                area += 0.5 * np.linalg.norm(np.cross(*(np.subtract(nodes[k], nodes[a]) for k in (b, c))))
    density = next(cells(b[1])[1] for b in cards["MAT_RIGID_TITLE"] if b[0].strip() == "holder")
    assert density * area * cells(cards["SECTION_SHELL_TITLE"][1][2])[0] == pytest.approx(float(mass.sum()), rel=1e-5)


def test_the_blank_hangs_on_its_weight(blank):
    run, _, _, text = blank
    rows = [cells(line) for b in cards_of(text)["LOAD_NODE_POINT"] for line in b]
    area = run.rig.blank_width_mm * run.rig.blank_length_mm
    weight = run.fabric.area_mass_g_per_mm2 * area * run.rig.gravity_mm_per_ms2
    assert {row[1] for row in rows} == {3} and sum(row[3] for row in rows) == pytest.approx(-weight, rel=1e-4)


def test_numbers_of_nodes_elements_and_parts_are_each_given_once(blank):
    cards = cards_of(blank[3])
    for keyword, width in (("NODE", 8), ("ELEMENT_SHELL", 8)):
        numbers = [int(line[:width]) for b in cards[keyword] for line in b]
        assert len(set(numbers)) == len(numbers)
    nodes = {int(line[:8]) for b in cards["NODE"] for line in b}
    assert {int(v) for b in cards["ELEMENT_SHELL"] for line in b for v in cells(line, [8] * 6)[2:]} <= nodes


def test_yarns_over_tools_touch_them_by_their_radius():
    """Each system of yarns with each tool, whose own shells have next to no thickness."""
    sets = ["model.meso.elements_per_loop=16", "model.meso.elements_per_wave=4", "rig.blank_holder_force=13"]
    _, prepared, _, text = deck_text("forming", sets=sets, **BEAM)
    cards, mesh = cards_of(text), prepared.model.mesh
    parts = {b[0].strip(): int(cells(b[1])[0]) for b in cards["PART_CONTACT"] + cards["PART"]}
    touching = {}
    for block in cards["CONTACT_AUTOMATIC_NODES_TO_SURFACE_ID"]:
        yarns, tool, *kinds = cells(block[1])[:4]
        assert kinds == [3, 3] and cells(block[3])[3] < 0.02
        touching[int(yarns), int(tool)] = cells(block[3])[2]
    expected = {
        (parts[f"{system}; bending"], parts[tool]): 2 * mesh.radius[mesh.part == k][0]
        for k, system in enumerate(mesh.part_names)
        for tool in ("stamp", "die", "holder", "floor")
    }
    assert touching == pytest.approx(expected)


def test_the_head_of_one_of_many_specimens_says_so(frame):
    run, prepared, _, _ = frame
    many = run.model_copy(update={"variability": run.variability.model_copy(update={"specimens": 3})})
    assert "ensemble: this is the first of 3 specimens" in deck_differences(many, prepared)
    assert not any("ensemble" in line for line in deck_differences(run, prepared))


def test_another_test_is_refused():
    with pytest.raises(InputError, match=r"deck of cantilever for ls-dyna: not supported; expected one of .*tensile"):
        deck_text("cantilever", "warp", **SHELL)
