"""A starter file of yarns for OpenRadioss: what it says is what the model has."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from deck_reader import BEAM, cells
from radioss_reader import functions_of, numbers_of, starter_of, table

from knittest.models.yarn_contact import CONTACT_DAMPING

PROPERTY = [10, 10, 10, 20]


@pytest.fixture(scope="module")
def strip():
    return starter_of("tensile", "warp", ["rig.width=12", "rig.gauge_length=12"], **BEAM)


@pytest.fixture(scope="module")
def blocks(strip):
    return strip[3]


def _parts(blocks):
    """Property and material of each part."""
    return {n: [int(v) for v in cells(lines[1], PROPERTY)[:2]] for n, lines in blocks["PART"].items()}


def _elements(blocks, name):
    """Element, part and nodes, sorted by element."""
    rows = [(int(r[0]), part, *map(int, r[1:])) for part, own in blocks[name].items() for r in table(own, 10)]
    return np.array(sorted(rows))


def test_it_states_units_version_and_name(strip, blocks):
    name, version, *units = blocks["BEGIN"][0]
    assert name == "strip" and cells(version) == [2026, 0]
    assert [line[k : k + 20].strip() for line in units for k in (0, 20, 40)] == ["g", "mm", "ms"] * 2
    run, prepared, _, _, engine = strip
    lines = engine.splitlines()
    assert lines[:2] == ["#RADIOSS ENGINE", "/RUN/strip/1"] and float(lines[2]) == pytest.approx(prepared.rig.duration)
    assert lines[lines.index("/DT/NODA") + 1].split() == [f"{run.solver.safety:g}", "0"]
    sample = float(lines[lines.index("/TFILE/3") + 1])
    assert sample * run.output.samples == pytest.approx(prepared.rig.duration)


def test_nodes_beams_and_cables_are_the_models(strip, blocks):
    model = strip[1].model
    nodes = np.array(table(blocks["NODE"][0], [10, 20, 20, 20]))
    assert len(nodes) == model.n_nodes + 3 and (nodes[:, 0] == np.arange(1, len(nodes) + 1)).all()
    assert np.allclose(nodes[: model.n_nodes, 1:], model.position(), atol=1e-12)
    beams, springs = _elements(blocks, "BEAM"), _elements(blocks, "SPRING")
    n = len(model.mesh.cells)
    assert (beams[:, 0] == np.arange(1, n + 1)).all() and (springs[:, 0] == np.arange(n + 1, 2 * n + 1)).all()
    assert (beams[:, 2:4] - 1 == model.mesh.cells).all() and (springs[:, 2:4] == beams[:, 2:4]).all()
    along, across = (nodes[beams[:, k] - 1, 1:] - nodes[beams[:, 2] - 1, 1:] for k in (3, 4))
    sine = np.linalg.norm(np.cross(along, across), axis=1) / np.linalg.norm(along, axis=1)
    assert (sine / np.linalg.norm(across, axis=1) > 0.3).all()


def test_it_is_as_heavy_as_the_model(strip, blocks):
    _, prepared, mass, _, _ = strip
    parts, position = _parts(blocks), prepared.model.position()
    total = 0.0
    for name in ("BEAM", "SPRING"):
        for _, part, a, b, *_ in _elements(blocks, name):
            length, (prop, material) = np.linalg.norm(position[b - 1] - position[a - 1]), parts[part]
            if name == "BEAM":
                density, area = float(blocks["MAT/LAW1"][material][1]), cells(blocks["PROP/TYPE3"][prop][3], 20)[0]
                total += density * area * length
            else:
                mass_line = cells(blocks["PROP/TYPE4"][prop][1], [20, 30, 10, 10, 10])
                assert mass_line[-1] == 1  # per length, force over strain
                total += mass_line[0] * length
    assert total == pytest.approx(float(mass.sum()), rel=1e-9)


def test_the_resultants_are_those_of_the_yarns_and_tension_adds_up(strip, blocks):
    model, parts, functions = strip[1].model, _parts(blocks), functions_of(blocks)
    _, _, torsion, bending = model.beams.stiffness.T
    beams, springs = _elements(blocks, "BEAM"), _elements(blocks, "SPRING")
    for e in range(0, len(beams), 23):
        s, node = int(model.mesh.part[e]), model.element_node[e]
        prop, material = parts[beams[e, 1]]
        area, yy, zz, xx = cells(blocks["PROP/TYPE3"][prop][3], 20)
        modulus, poisson = cells(blocks["MAT/LAW1"][material][2], 20)
        assert modulus * yy == pytest.approx(bending[s], rel=1e-9) and yy == zz
        assert modulus / (2 * (1 + poisson)) * xx == pytest.approx(torsion[s], rel=1e-9)
        prop, material = parts[springs[e, 1]]
        curve = cells(blocks["PROP/TYPE4"][prop][3], [10, 10, 10, 10, 10, 10, 20, 20])
        x, y = functions[int(curve[0])]
        fail = model.beams.fail_strain[node]
        assert material == 0 and np.interp(-0.5, x, y) == 0.0
        assert np.interp(1.002 * fail, x, y) == np.interp(3.0 * fail, x, y) == y[-1] == y[-2] == 0.0  # broken
        length = np.linalg.norm(np.diff(model.position()[springs[e, 2:] - 1], axis=0))
        assert curve[-1] >= fail * max(length, 1.0) * (1 - 1e-12)  # does not break it before, as strain or in mm
        assert cells(blocks["PROP/TYPE4"][prop][2], 20)[0] >= np.max(np.diff(y) / np.diff(x))  # for the time step
        for strain in (0.3 * fail, 0.9 * fail, 0.9999 * fail):
            held = modulus * area * strain + np.interp(strain, x, y)
            law = model.beams.hinge_slope[s] @ np.maximum(
                strain - model.beams.slack[node] - model.beams.hinge_strain[s], 0
            )
            assert held == pytest.approx(law, rel=1e-9)


def test_a_beam_fails_at_the_strain_of_its_cable(strip, blocks):
    """Epsilon_f2 bounds the signed axial strain; Epsilon_f1, for compression too, is out of reach."""
    model, parts = strip[1].model, _parts(blocks)
    for e, part, *_ in _elements(blocks, "BEAM"):
        limits, failed = blocks["FAIL/TENSSTRAIN"][parts[part][1]]
        t1, t2, function, f1, f2, flag = cells(limits, [20, 20, 10, 20, 20, 10])
        assert (t1, t2, function, flag, cells(failed)) == (0, 0, 0, 11, [0]) and f1 == 1e20
        assert f2 == pytest.approx(model.beams.fail_strain[model.element_node[e - 1]], rel=1e-12)


def test_each_two_systems_touch_at_the_sum_of_their_radii(strip, blocks):
    run, prepared, _, _, _ = strip
    mesh, parts = prepared.model.mesh, _parts(blocks)
    beams = _elements(blocks, "BEAM")
    of_part = {part: mesh.part[own[0] - 1] for own in beams for part in (own[1],)}
    radius = {s: mesh.radius[mesh.part == s][0] for s in range(len(mesh.part_names))}
    lines = {n: set(numbers_of(own[1:])) for n, own in blocks["LINE/PART"].items()}
    halves = {n: set(numbers_of(blocks["GRBEAM/BEAM"][numbers_of(own[1:])[0]][1:])) for n, own in
              blocks["LINE/GRBEAM"].items()}  # fmt: skip
    assert not set(lines) & set(halves) and parts
    touching = []
    for title, first, _, stiffness, flags, _ in blocks["INTER/TYPE11"].values():
        one, other, stf, _, gap_flag, _, _, delete = cells(first)
        stfac, friction, gap, _, _ = cells(stiffness, 20)
        assert (stf, gap_flag, delete) == (1, 1000, 2) and stfac == 4 * prepared.model.group.law.normal
        assert friction == run.fabric.contact.friction_coefficient.value
        assert flags[:10] == "       000" and cells(flags[30:], [10, 20]) == [5, CONTACT_DAMPING]
        if one in lines:
            systems = tuple({int(of_part[p]) for p in lines[side]} for side in (one, other))
            assert all(len(s) == 1 for s in systems)
            pair = tuple(s.pop() for s in systems)
        else:
            pair = _system_of_halves(mesh, halves[one], halves[other])
        assert title == f"{mesh.part_names[pair[0]]} with " + (
            mesh.part_names[pair[1]] if pair[0] != pair[1] else "itself"
        )
        assert gap == pytest.approx(radius[pair[0]] + radius[pair[1]])
        touching.append(pair)
    assert sorted(touching) == [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]


def _system_of_halves(mesh, one, other):
    """The halves hold all elements of one system; neighbouring yarns are in different halves."""
    (system,) = {int(mesh.part[e - 1]) for e in one | other}
    assert not one & other and one | other == set(np.flatnonzero(mesh.part == system) + 1)
    return system, system


def test_neighbouring_yarns_are_in_different_halves(strip, blocks):
    model = strip[1].model
    for own in blocks["GRBEAM/BEAM"].values():
        elements = np.array(numbers_of(own[1:])) - 1
        system = model.mesh.part_names[model.mesh.part[elements[0]]]
        axis = {"warp": 0, "weft": 1, "knit": 1}[system]
        yarn = model.group.chain[model.element_node[elements]]
        places = model.position()[model.mesh.cells[elements]].mean(axis=1)[:, axis]
        middles = sorted(places[yarn == y].mean() for y in np.unique(yarn))
        everyone = model.mesh.part == model.mesh.part[elements[0]]
        every = model.group.chain[model.element_node[everyone]]
        where = model.position()[model.mesh.cells[everyone]].mean(axis=1)[:, axis]
        between = [where[every == y].mean() for y in np.unique(every) if y not in yarn]
        for low, high in pairwise(middles):
            assert sum(low < x < high for x in between) == 1


def test_one_clamp_is_held_and_the_other_moves_as_the_rig_does(strip, blocks):
    run, prepared, _, _, _ = strip
    model, rig = prepared.model, prepared.rig
    groups = {n: np.array(numbers_of(own[1:])) - 1 for n, own in blocks["GRNOD/NODE"].items()}
    held = {own[1][3:10]: groups[int(own[1][20:30])] for own in blocks["BCS"].values()}
    ((_, motion, scale),) = blocks["IMPVEL"].values()
    assert motion[10:20].strip() == "Y" and cells(scale, 20) == [1, 1, 0, 1e30]
    moving = groups[int(motion[40:50])]
    along = model.position()[:, 1] - rig.middle
    assert set(moving) == set(np.flatnonzero(along >= 0.5 * rig.gauge - 1e-6)) == set(held["101 111"])
    assert set(held["111 111"]) == set(np.flatnonzero(along <= -0.5 * rig.gauge + 1e-6))
    time, value = (np.array(a) for a in functions_of(blocks)[int(motion[:10])])
    assert np.trapezoid(value, time) == pytest.approx(rig.pull.integral(time[-1]), rel=1e-9)
    title, names, *members = blocks["TH/NODE"][1]
    assert title and names == "DX        DY        REACX     REACY     "
    assert {int(row[0]) - 1 for row in table(members, 10)} == set(moving)
    alpha, beta, group, *_ = cells(blocks["DAMP"][1][1], [20, 20, 10, 10, 20, 20])
    assert alpha == run.solver.damping_per_ms and beta == 0 and len(groups[group]) == model.n_nodes


@pytest.mark.parametrize("variant", ["jersey", "90-0-90-0"])
def test_a_fabric_of_any_systems_has_each_pair_of_them(variant):
    sets = ["rig.width=12", "rig.gauge_length=12"]
    _, prepared, mass, blocks, _ = starter_of("tensile", "weft", sets, **{**BEAM, "variant": variant})
    names = prepared.model.mesh.part_names
    assert len(names) == {"jersey": 1, "90-0-90-0": 5}[variant]
    titles = [own[0] for own in blocks["INTER/TYPE11"].values()]
    expected = [f"{a} with {b}" for a, b in combinations(names, 2)] + [f"{a} with itself" for a in names]
    assert titles == expected and mass.sum() > 0.0
