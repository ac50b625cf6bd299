"""Forming: a hemisphere against symmetry and the pin-jointed net; forces, balance and wrinkles of a holder."""

from types import SimpleNamespace

import numpy as np
import pytest
from chebyshev import net_shear

from knittest.base.errors import InputError
from knittest.base.history import Frame
from knittest.config.loading import resolve
from knittest.laboratory.base import fabric_laminate
from knittest.laboratory.forming.report import FormingReport
from knittest.laboratory.forming.results import draw_in, measure_mid_surface
from knittest.laboratory.forming.test import _wrinkles, drag_ratio, shear_field
from knittest.laboratory.forming.tool_check import tools_of
from knittest.materials.laminate import limit_membrane
from knittest.models.in_plane import _largest_tangent
from knittest.runs.specimen import prepare, run_specimen

RADIUS = 40.0
DOME = [
    "rig.stamp.kind=hemisphere", f"rig.stamp.hemisphere.radius={RADIUS}", "rig.blank_length=210",
    "rig.blank_width=210", "rig.depth=32", "model.macro.element_size=6", "solver.speed=0.8", "solver.ramp=8",
    "output.frames=4",
]  # fmt: skip


def dome(force, *more):
    return resolve(variant="1", scale="macro", test="forming", sets=[*DOME, f"rig.blank_holder_force={force}", *more])


@pytest.fixture(scope="module")
def even():
    """A blank without unevenness, so that nothing but the fabric's own symmetry decides."""
    run = dome(100, "rig.imperfection=0", "solver.speed=0.4")
    return run, run_specimen(run)


def test_a_hemisphere_draws_all_four_sides_alike(even):
    """Variant 1 has as many warps as wefts: warp and weft sides within 2 %, opposite sides the same."""
    history = even[1].history
    edge = draw_in(history.mesh, history.frames[0], history.frames[-1])
    sides = {side: edge.middle(side) for side in ("weft_low", "warp_low", "weft_high", "warp_high")}
    assert sides["weft_low"] > 5.0
    assert sides["weft_low"] == pytest.approx(sides["weft_high"], rel=1e-3)
    assert sides["warp_low"] == pytest.approx(sides["warp_high"], rel=1e-3)
    assert sides["weft_low"] == pytest.approx(sides["warp_low"], rel=0.02)


def test_tools_of_the_frames_touch_the_blank_as_it_lies(even):
    """The nodes next to the stamp lie half the thickness off the sphere that it is drawn as."""
    run, specimen = even
    bodies = {body.name: body for body in FormingReport().bodies(run, specimen)}
    assert set(bodies) == {"stamp", "die", "holder"}
    blank, half = specimen.history.frames[-1].position, 0.5 * specimen.facts["thickness_mm"]
    lowest = bodies["stamp"].points[:, 2].min() + bodies["stamp"].offset[-1, 2]
    apart = np.linalg.norm(blank - [0.0, 0.0, lowest + RADIUS], axis=1).min() - RADIUS
    assert apart == pytest.approx(half, abs=0.05 * half)
    assert bodies["stamp"].offset[0, 2] == pytest.approx(0.0, abs=1e-6)
    assert abs(bodies["holder"].offset[:, 2]).max() < half


def test_shear_on_the_hemisphere_is_that_of_the_pin_jointed_net(even):
    run, specimen = even
    mesh, last = specimen.history.mesh, specimen.history.frames[-1]
    start = specimen.history.frames[0].position[mesh.cells].mean(axis=1)
    place = last.position[mesh.cells].mean(axis=1)
    thickness = specimen.facts["thickness_mm"]
    gap = tools_of(run, thickness).stamp.distance(place + np.array([0.0, 0.0, last.coordinate]))
    on_bias = np.abs(np.abs(start[:, 0]) - np.abs(start[:, 1])) < 1.0
    touching = on_bias & (gap < 0.55 * thickness) & (np.abs(start[:, 0]) < RADIUS)
    along = np.abs(start[touching, 0])
    distance, expected = net_shear(RADIUS + 0.5 * thickness, 1.2 * RADIUS)
    found = np.rad2deg(np.abs(last.fields["shear_angle"][touching]))
    assert along.max() >= 0.6 * RADIUS
    # a net does not stretch
    assert max(last.fields[f"strain_{d}"].max() for d in ("warp", "weft")) < 0.005
    assert found == pytest.approx(np.rad2deg(np.interp(along, distance, expected)), abs=0.6)


def test_forces_and_energies_of_a_draw_balance(even):
    _, specimen = even
    curve = specimen.history.curve
    late = curve["stamp_travel_mm"] > 4.0
    assert curve["holder_force_n"][late].mean() == pytest.approx(100.0, rel=0.01)
    assert specimen.quality.failures == ()
    assert specimen.quality.energy_error_max < 0.005
    ends = {name: curve[f"{name}_force_n"][-200:].mean() for name in ("stamp", "holder", "die", "floor")}
    assert ends["die"] + ends["floor"] == pytest.approx(ends["stamp"] + ends["holder"], rel=0.02)


def test_a_holder_keeps_wrinkles_down_and_pulls_the_yarns():
    free, held = (run_specimen(dome(force)).results for force in (0, 100))
    assert free["max_wrinkle_height_mm"] > 2.0 * held["max_wrinkle_height_mm"]
    # a plate that dishes would lift as a whole, without waves
    assert free["rim_wave_count"] >= 4 and held["rim_wave_count"] == 0
    assert free["rim_wave_height_mm"] > 2.0 > held["rim_wave_height_mm"]
    assert held["max_yarn_force_n"] > free["max_yarn_force_n"]


def small_blank(scale):
    return prepare(small(scale)).model


def small(scale):
    sets = ["rig.blank_length=60", "rig.blank_width=60", "rig.stamp.kind=hemisphere", "rig.stamp.hemisphere.radius=10",
            "rig.die.clearance=5", "rig.holder.clearance=5", "rig.depth=8"]  # fmt: skip
    return resolve(variant="1", scale=scale, test="forming", preset="quick", sets=sets)


def test_the_edges_of_yarns_are_where_they_are_cut():
    """Also when they have settled, so that no two ends lie on one line; drawn inwards by a tenth."""
    model = small_blank("meso")
    start = model.position() + np.random.default_rng(1).uniform(-0.1, 0.1, (model.n_nodes, 3))
    frames = [Frame(0.0, 0.0, 0.0, position, {}) for position in (start, 0.9 * start)]
    edge = draw_in(model.mesh, *frames)
    assert np.bincount(edge.side).tolist() == [17, 17, 17, 17]
    assert np.abs(edge.drawn - 3.0).max() < 0.1
    assert edge.middle("warp_high") == pytest.approx(3.0, abs=0.1)


def test_shear_angles_have_one_sign_on_both_scales():
    """A blank sheared by 0.2 so that warps lean to +x, where warp and weft close up: arctan 0.2."""
    for scale in ("macro", "meso"):
        model = small_blank(scale)
        leaning = model.position()
        leaning[:, 0] += 0.2 * leaning[:, 1]
        model.nodes.position[:, : model.n_nodes] = leaning.T
        angle, _ = shear_field(small(scale), model.mesh, Frame(0.0, 0.0, 0.0, leaning, model.fields()))
        assert np.median(angle) == pytest.approx(np.rad2deg(np.arctan(0.2)), abs=0.2), scale


def test_stiffness_in_compression_counts_for_the_step():
    """The bound behind the step sees what resists being pushed more than pulled."""
    laminates = [limit_membrane(fabric_laminate(dome(0)), 0.05)._replace(compression=np.full(2, c)) for c in (1.0, 5e3)]
    assert _largest_tangent(laminates[1], 0) > 3.0 * _largest_tangent(laminates[0], 0)


def test_the_blank_of_the_paper_has_its_element_count():
    """Table 4: 27,512 shells, variant 1, within 2 %."""
    prepared = prepare(resolve(variant="1", scale="macro", test="forming", preset="paper"))
    assert len(prepared.model.mesh.cells) == pytest.approx(27512, rel=0.02)


def test_fabric_on_the_floor_is_no_wrinkle():
    """A T drawn to its depth: all of the bottom on the floor, the flange on the die but for one node 2 mm up."""
    run = resolve(variant="1", scale="macro", test="forming", preset="quick", sets=["rig.imperfection=0"])
    prepared = prepare(run)
    thickness, depth = prepared.facts["thickness_mm"], run.rig.depth
    tools, start = tools_of(run, thickness), prepared.model.position()
    now = start.copy()
    now[tools.die.distance(start) > 0.51 * thickness, 2] = -depth - run.rig.die.floor_gap  # over the opening
    bump = int(np.argmax(start[:, 0] + start[:, 1]))
    now[bump, 2] += 2.0
    history = SimpleNamespace(mesh=prepared.model.mesh, frames=[Frame(0.0, 0.0, 0.0, start, {})])
    found = _wrinkles(measure_mid_surface(history, Frame(1.0, depth, 0.0, now, {}), tools, thickness, depth), thickness)
    assert found["max_wrinkle_height_mm"] == pytest.approx(2.0, abs=1e-3)
    assert found["wrinkle_height_p95_mm"] == pytest.approx(0.0, abs=1e-3)
    assert 0.0 < found["wrinkled_area_pct"] < 0.1
    assert found["off_stamp_area_pct"] > 99.0


@pytest.mark.parametrize(("force", "damping", "share"), [(0, 0.05, 0.968), (0, 0.005, 0.0968), (100, 0.05, 0.0085)])
def test_damping_drags_by_its_rate_and_speed_over_what_presses_the_blank(force, damping, share):
    """At 0.19 m/s 0.05 / ms are 0.968 g; a holder of 100 N presses a hundred times the blank's weight."""
    sets = [f"rig.blank_holder_force={force}", f"solver.damping={damping}", "solver.speed=0.19"]
    run = resolve(variant="1", scale="macro", test="forming", preset="quick", sets=sets)
    assert drag_ratio(run, prepare(run)) == pytest.approx(share, rel=0.02)


def test_a_holder_too_light_for_the_step_is_refused():
    light = ["rig.blank_holder_force=100", "rig.holder.mass=0.005"]
    with pytest.raises(InputError, match=r"rig.holder.mass = 0.005 kg is too small.*0.2 of the blank's 0.0\d+ kg"):
        prepare(resolve(variant="1", scale="macro", test="forming", preset="quick", sets=light))
