"""Starter files of shells for OpenRadioss: layers add up to the laminate, frames move and are guided as in a run."""

import numpy as np
import pytest
from deck_reader import BEAM, SHELL, cells, deck_text
from radioss_reader import functions_of, numbers_of, starter_of, table

from knittest.base.errors import InputError
from knittest.models.tool import Table
from knittest.runs.deck.drives import guide_table

LAYER = [20, 20, 20, 20, 10]


@pytest.fixture(scope="module")
def frame():
    return starter_of("picture-frame", sets=["rig.side=60", "model.macro.element_size=6"], **SHELL)


@pytest.fixture(scope="module")
def blocks(frame):
    return frame[3]


def _layers(blocks):
    """Place and thickness [mm] of each layer, and its material's density and functions (warp, weft, shear)."""
    (own,) = blocks["PROP/TYPE16"].values()
    found = []
    for phi, alpha, thick, place, material in table(own[5:], LAYER):
        assert (phi, alpha) == (0, 90)
        _, density, _, _, *functions, _ = blocks["MAT/LAW158"][int(material)]
        found.append((place, thick, float(density), [int(cells(line, [10, 10, 20])[0]) for line in functions]))
    return found


def test_its_layers_add_up_to_the_laminate(frame, blocks):
    card, functions, layers = frame[1].model.laminate, functions_of(blocks), _layers(blocks)
    for direction, strain in [(0, 0.012), (1, 0.012), (0, -0.01), (1, 0.004)]:
        force = [(z, t * np.interp(strain, *functions[f[direction]])) for z, t, _, f in layers]
        slope = card.slope[direction] @ np.maximum(strain - card.knee[direction], 0.0)
        middle = slope + card.compression[direction] * min(strain, 0.0)
        assert sum(f for _, f in force) == pytest.approx(middle + 2 * card.outer[direction] * strain, rel=1e-9)
        bending = sum(t * z**2 * np.interp(1e-3, *functions[f[direction]]) for z, t, _, f in layers)
        assert bending / 1e-3 == pytest.approx(2 * card.outer[direction] * card.layer_offset**2, rel=1e-9)


@pytest.mark.parametrize("angle", [0.1, 0.5, -0.4])
def test_its_shear_is_the_laminates_over_degrees(frame, blocks, angle):
    card, functions = frame[1].model.laminate, functions_of(blocks)
    force = sum(t * np.interp(np.degrees(angle), *functions[f[2]]) for _, t, _, f in _layers(blocks))
    law = card.shear_slope @ np.maximum(abs(angle) - card.shear_knee, 0.0)
    assert force == pytest.approx(np.sign(angle) * law, rel=1e-9)


def test_it_is_as_heavy_as_its_area(frame, blocks):
    """The starter takes the thickness between the faces of the outer layers, and warns if another is stated."""
    run, prepared, mass, _, _ = frame
    (own,) = blocks["PROP/TYPE16"].values()
    layers, total = _layers(blocks), cells(own[3], [10, 10, 20, 20, 10, 10])[2]
    faces = [z + side * t for z, t, _, _ in layers for side in (-0.5, 0.5)]
    assert max(faces) - min(faces) == pytest.approx(total, rel=1e-12)
    (density,) = {rho for _, _, rho, _ in layers}
    assert density * total * 60.0**2 == pytest.approx(float(mass.sum()), rel=1e-4)  # it is not quite plane
    assert density * total == pytest.approx(run.fabric.area_mass_g_per_mm2, rel=1e-4)
    assert prepared.model.n_nodes == len(blocks["NODE"][0])


def test_its_shells_and_warp_are_the_models(frame, blocks):
    model = frame[1].model
    nodes = np.array(table(blocks["NODE"][0], [10, 20, 20, 20]))
    assert np.allclose(nodes[:, 1:], model.position(), atol=1e-12)
    ((part, rows),) = blocks["SHELL"].items()
    shells = np.array(table(rows, 10), int)
    assert (shells[:, 1:] - 1 == model.mesh.cells).all() and (shells[:, 0] == np.arange(1, len(shells) + 1)).all()
    prop, material, *_ = cells(blocks["PART"][part][1], [10, 10, 10, 20])
    (number,) = blocks["PROP/TYPE16"]
    own = blocks["PROP/TYPE16"][number]
    assert prop == number and material in blocks["MAT/LAW158"]
    warp = cells(own[4], [20, 20, 20, 10, 10, 10, 10])
    assert warp[:3] == pytest.approx([-np.sqrt(0.5), np.sqrt(0.5), 0.0], abs=1e-5) and warp[3:5] == [0, 1]
    assert cells(own[1], 10)[:3] == [12, 4, 2]


def test_its_fibres_are_nearly_straight(frame, blocks):
    """LAW158 measures a crimped fibre: over the layer's strain e it is sqrt((1 + e)^2 + h^2) - (1 + S) long."""
    functions = functions_of(blocks)
    for own in blocks["MAT/LAW158"].values():
        crimp, other, coupling, stiff, _ = cells(own[2], 20)
        height = np.sqrt((1 + crimp) ** 2 - 1)
        assert crimp == other and coupling < 1e-6
        for strain in (-0.1, 0.001, 0.02):
            longer = np.sqrt((1 + strain) ** 2 + height**2) - (1 + crimp)
            assert longer == pytest.approx(strain, rel=2e-4)
        for line in own[4:6]:
            x, y = functions[int(cells(line, [10, 10, 20])[0])]
            assert stiff >= 9.99 * np.max(np.abs(np.diff(y) / np.diff(x)))


def test_each_needle_goes_with_the_frame(frame, blocks):
    _, prepared, _, _, _ = frame
    rig, functions = prepared.rig, functions_of(blocks)
    groups = {n: np.array(numbers_of(own[1:])) - 1 for n, own in blocks["GRNOD/NODE"].items()}
    position, moved = prepared.model.position(), {}
    for _, motion, scale in blocks["IMPVEL"].values():
        time, value = (np.array(a) for a in functions[int(motion[:10])])
        inside = np.append(time[time < rig.duration], rig.duration)
        travel = cells(scale, 20)[1] * np.trapezoid(np.interp(inside, time, value), inside)
        for node in groups[int(motion[40:50])]:
            moved[int(node), motion[10:20].strip()] = travel
    p, q = rig.stretches(rig.duration)
    assert {node for node, _ in moved} <= {int(n) for n in rig.held}
    for (node, axis), travel in moved.items():
        stretch = (q if axis == "X" else p) * (1.0 - rig.slack)
        assert travel == pytest.approx(position[node, "XY".index(axis)] * (stretch - 1.0), abs=2e-3)
    members = {int(row[0]) - 1 for row in table(blocks["TH/NODE"][1][2:], 10)}
    assert members == {node for node, _ in moved}


def test_a_guide_accelerates_the_fabric_and_frees_it_of_damping():
    """A free node that starts at rest follows its guide under damping: v' = -a v + guide."""
    time = np.linspace(0.0, 3.0, 301)
    u = 0.4 * np.sin(time) ** 2
    pull = np.array(guide_table(Table(tuple(time), tuple(u)), 5.0).value)
    v = np.zeros(len(time))
    for k in range(len(time) - 1):  # trapezoidal rule
        step = time[k + 1] - time[k]
        v[k + 1] = (v[k] * (1.0 - 2.5 * step) + 0.5 * step * (pull[k] + pull[k + 1])) / (1.0 + 2.5 * step)
    assert np.abs(v - u).max() < 1e-3 * u.max()


def test_nodes_inside_are_guided_by_bands_of_their_places(frame, blocks):
    run, prepared, _, _, _ = frame
    rig, functions = prepared.rig, functions_of(blocks)
    position = prepared.model.position()
    free = set(range(len(position))) - {int(n) for n in rig.held}
    groups = {n: np.array(numbers_of(own[1:])) - 1 for n, own in blocks["GRNOD/NODE"].items()}
    guided, width = {}, [10, 10, 10, 10, 10, 10, 20, 20]
    for own in blocks["GRAV"].values():
        axis = "XY".index(own[1][10:20].strip())
        function, _, _, group, _, _, scale = cells(own[1][:10] + own[1][20:], [width[0], *width[2:]])
        for node in groups[int(group)]:
            guided[int(node), axis] = scale
            assert scale == pytest.approx(position[node, axis], abs=0.01 * np.ptp(position[:, axis]))
        time, value = (np.array(a) for a in functions[int(function)])
        at = 0.6 * rig.duration
        before, now, after = ((1.0 - rig.slack) * rig.stretches(at + s)[1 - axis] for s in (-1.0, 0.0, 1.0))
        expected = (after - 2.0 * now + before) + run.solver.damping_per_ms * 0.5 * (after - before)
        assert np.interp(at, time, value) == pytest.approx(expected, rel=0.01)
    missing = {(n, axis) for n in free for axis in (0, 1)} - set(guided)
    assert all(abs(position[n, axis]) < 0.01 * np.ptp(position[:, axis]) for n, axis in missing)


def test_yarns_of_any_mass_are_guided_by_their_places():
    _, prepared, _, blocks, _ = starter_of("picture-frame", sets=["rig.side=20"], **BEAM)
    position, count = prepared.model.position(), 0
    groups = {n: np.array(numbers_of(own[1:])) - 1 for n, own in blocks["GRNOD/NODE"].items()}
    for own in blocks["GRAV"].values():
        axis, scale = "XY".index(own[1][10:20].strip()), float(own[1][-20:])
        places = position[groups[int(own[1][40:50])], axis]
        assert np.abs(places - scale).max() < 0.01 * np.ptp(position[:, axis])
        count += len(places)
    assert count > 0.9 * 2 * (len(position) - len(prepared.rig.held))


def test_the_guides_of_an_ls_dyna_deck_are_forces():
    """Mass times place times acceleration, and not times velocity."""
    from deck_reader import cards_of, curves_of

    sets = ["rig.side=60", "model.macro.element_size=6"]
    run, prepared, mass, text = deck_text("picture-frame", sets=sets, **SHELL)
    cards = cards_of(text)
    curves, position, rig = curves_of(cards), prepared.model.position(), prepared.rig
    found = {}
    for line in (line for b in cards["LOAD_NODE_POINT"] for line in b):
        node, dof, curve, factor = (int(v) if k < 3 else v for k, v in enumerate(cells(line)))
        assert factor == pytest.approx(mass[node - 1] * position[node - 1, dof - 1], rel=1e-4, abs=1e-9)
        found[dof] = curve
    time, pull = (np.array(a) for a in curves[found[2]])
    gain = run.solver.damping_per_ms
    speed = np.array([rig.stretches(t)[0] for t in time[time <= rig.duration]])
    speed = np.gradient(speed * (1.0 - np.interp(time[: len(speed)], rig.close.time, rig.close.value)), time[1])
    sofar = np.concatenate([[0.0], np.cumsum(0.5 * (pull[1:] + pull[:-1]) * np.diff(time))])[: len(speed)]
    travel = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time[: len(speed)]))])
    assert np.abs(sofar - gain * travel - speed).max() < 0.02 * np.abs(speed).max()


def test_a_strip_moves_one_clamp_at_a_shell_step():
    _, prepared, mass, blocks, engine = starter_of("tensile", "weft", ["rig.width=30", "rig.gauge_length=30"], **SHELL)
    assert "/DT\n" in engine and "NODA" not in engine and len(blocks["IMPVEL"]) == 1 and "GRAV" not in blocks
    (density,) = {rho for _, _, rho, _ in _layers(blocks)}
    thick = cells(next(iter(blocks["PROP/TYPE16"].values()))[3], [10, 10, 20])[2]
    corners = prepared.model.position()[:, :2]
    assert density * thick * np.prod(np.ptp(corners, axis=0)) == pytest.approx(float(mass.sum()), rel=1e-9)


@pytest.mark.parametrize(
    ("kind", "direction", "form"), [("forming", None, SHELL), ("cantilever", "warp", SHELL), ("compaction", None, BEAM)]
)
def test_another_test_is_rejected(kind, direction, form):
    with pytest.raises(InputError, match=rf"deck of {kind} for openradioss: .*; expected .*tensile, picture"):
        starter_of(kind, direction, **form)
