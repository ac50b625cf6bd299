"""Tests on fabrics without a warp in every wale and a weft in every course: angles, edges, crossings, pulled inlays."""

from functools import cache

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.base.history import Frame, History, Mesh
from knittest.config.loading import resolve
from knittest.config.structure import direction_of
from knittest.laboratory.base import PreparedSpecimen
from knittest.laboratory.bias_extension.strip import cut_bias_yarns, strip_of
from knittest.laboratory.bias_extension.test import BiasExtension
from knittest.laboratory.bias_extension.zones import material_points
from knittest.laboratory.compaction.test import (
    PILING_SHARE,
    CompactionTest,
    largest_closing,
    piled_height,
    pressure_locking_warning,
)
from knittest.laboratory.forming.results import SIDES, draw_in
from knittest.laboratory.forming.rig import count_swapped_crossings
from knittest.laboratory.forming.test import Forming, allowed_depth
from knittest.laboratory.friction.rig import force_shares
from knittest.laboratory.picture_frame.rig import SOFT_START, start_up_angle
from knittest.laboratory.picture_frame.test import PictureFrame, measure_wrinkles
from knittest.laboratory.pull_out.test import PullOut
from knittest.laboratory.strips import cut_piece, material_angles, yarn_nodes
from knittest.models.contact_tracker import DEPTH_SHARE, PORTION, SMALL_PORTION
from knittest.models.meso import build_meso, has_compliant_loops

ANGLE = 0.3


def run_of(test: str, variant: str, *sets: str, **options: str):
    return resolve(variant=variant, scale="meso", preset="quick", test=test, sets=sets, **options)


@cache
def square(variant: str) -> tuple:
    """Picture frame of 20 mm of a fabric: its run and its specimen."""
    run = run_of("picture-frame", variant, "rig.side=20")
    return run, PictureFrame().prepare(run)


def blank(variant: str) -> tuple:
    """Run of a forming test, and a piece of 6 by 6 stitches."""
    run = run_of("forming", variant)
    piece = cut_piece(run, 6, 6)
    return run, build_meso(run, piece.paths, piece.draws)


def frame(position: np.ndarray) -> Frame:
    return Frame(0.0, 0.0, 0.0, position, {})


def sheared(position: np.ndarray, angle: float) -> np.ndarray:
    """Positions moved with a picture frame whose diagonal along y is pulled."""
    p, q = np.cos(0.5 * angle) + np.sin(0.5 * angle), np.cos(0.5 * angle) - np.sin(0.5 * angle)
    return position * [q, p, 1.0]


@pytest.mark.parametrize("variant", ["1", "0-90-0", "weft-only", "weft-every-second-course", "jersey", "seed"])
def test_material_sheared_with_its_frame_has_the_angle_of_the_frame(variant):
    run, prepared = square(variant)
    mesh, start = prepared.model.mesh, prepared.model.position()
    for angle in (0.0, ANGLE):
        found, place = material_angles(run, mesh, frame(sheared(start, angle)))
        assert found == pytest.approx(angle, abs=2e-3) and place.shape == (len(found), 2)
    assert np.abs(place).max() < 20.0 and np.abs(place.mean(axis=0)).max() < 2.0


def test_angles_of_loops_see_every_stitch_between_the_edges():
    run, prepared = square("weft-only")  # 6 x 6 stitches that repeat after 2 wales
    angles, _ = material_angles(run, prepared.model.mesh, frame(prepared.model.position()))
    assert len(angles) == (5 - 2) * (5 - 1)


@pytest.mark.parametrize("variant", ["jersey", "weft-only"])
def test_wrinkles_are_measured_without_one_system_of_inlays(variant):
    prepared = square(variant)[1]
    start = prepared.model.position()
    risen = start + np.outer(np.cos(np.pi * start[:, 0] / 10.0), [0.0, 0.0, 1.0])
    history = History(prepared.model.mesh, {}, {}, [frame(start), frame(risen)])
    found = measure_wrinkles(history.frames[1], history, 20.0)
    assert found.amplitude == pytest.approx(1.0, abs=0.1)
    seen = np.isfinite(found.height)
    assert 0.4 < seen.mean() < 0.6  # the square stands on a corner in its map
    assert np.abs(found.height - np.cos(np.pi * found.x / 10.0))[seen].mean() < 0.1


@pytest.mark.parametrize(
    ("sets", "message"),
    [
        (("rig.side=10",), "rig.side: 3 wales and 3 courses are too few, expected at least 4 and 3.*rig.side=15"),
        (("model.meso.knitting=false",), "model.meso.knitting = false.*read from the loops; set it to true"),
    ],
)
def test_a_piece_that_shows_no_shear_is_refused(sets, message):
    with pytest.raises(InputError, match=message):
        PictureFrame().check_run(run_of("picture-frame", "weft-only", *sets))
    PictureFrame().check_run(run_of("picture-frame", "0-90-0", *sets))


@pytest.mark.parametrize("variant", ["weft-only", "warp-every-second-wale", "0-90-0"])
def test_a_strip_on_the_bias_shows_shear_by_its_loops_or_crossings(variant):
    run = run_of("bias-extension", variant, "rig.width=25", "rig.gauge_length=50")
    yarns = cut_bias_yarns(run, strip_of(run))
    start = np.concatenate([path.points for path in yarns.paths])
    history = History(Mesh("beams", *(np.zeros(0, int),) * 2, (), *(np.zeros(0),) * 2), {}, {}, [frame(start)])
    material = material_points(run, history)
    assert len(material.places) > 40
    assert material.angles(frame(sheared(start, ANGLE))) == pytest.approx(ANGLE, abs=2e-3)
    assert (material.slip is None) == (variant != "0-90-0")
    BiasExtension().check_run(run)


@pytest.mark.parametrize("variant", ["jersey", "weft-only", "0-90-0", "warp-every-second-wale"])
def test_the_edges_of_a_blank_are_those_of_its_first_layers_or_of_its_loops(variant):
    model = blank(variant)[1]
    start = model.position() - 0.5 * model.position().max(axis=0)
    edge = draw_in(model.mesh, frame(start), frame(0.9 * start))
    counts = dict(zip(SIDES, np.bincount(edge.side), strict=True))
    assert (counts["weft_low"], counts["weft_high"]) == (6, 6)
    warps = {"0-90-0": (6, 6), "warp-every-second-wale": (3, 3)}.get(variant, (5, 6))  # else arcs, the cut ones without
    assert {counts["warp_low"], counts["warp_high"]} <= set(warps)
    for side in SIDES:
        assert edge.middle(side) == pytest.approx(1.07, abs=0.25)


@pytest.mark.parametrize(
    ("variant", "system", "crossings"),
    [("0-90-0", "warp", 6), ("weft-every-second-course", "warp", 3), ("warp-every-second-wale", "weft", 3)],
)
def test_crossings_that_swap_their_sides_are_counted_in_all_layers(variant, system, crossings):
    run, model = blank(variant)
    mesh, start = model.mesh, model.position()
    nodes = np.unique(mesh.cells[mesh.yarn == mesh.yarn[mesh.part == mesh.part_names.index(system)][0]])
    moved = start.copy()
    moved[nodes, 2] += 5.0 if variant != "warp-every-second-wale" else -5.0
    assert count_swapped_crossings(run, mesh, frame(start), frame(start)) == 0
    assert count_swapped_crossings(run, mesh, frame(start), frame(moved)) == crossings


def test_a_blank_without_inlays_has_a_largest_depth_of_tools():
    run = run_of("forming", "jersey")
    assert allowed_depth(run) == pytest.approx(125.0 * run.fabric.knitting.beam_diameter_mm)
    Forming().check_run(run)


def test_the_pulled_inlay_is_that_nearest_to_the_middle():
    run = run_of("pull-out", "warp-every-second-wale", "rig.width=25", direction="warp")
    prepared: PreparedSpecimen = PullOut().prepare(run)  # 7 wales, inlays in 0, 2, 4 and 6
    x = prepared.model.position()[int(prepared.facts["tail_node"]), 0]
    assert x == pytest.approx(4.5 * run.fabric.wale_spacing, abs=0.3)


def test_a_pull_out_needs_an_inlay_away_from_the_clamps():
    layers = 'fabric.layers=[{direction: warp, pattern: "x..."}, {direction: weft}]'
    with pytest.raises(InputError, match=r"rig.width = 18 mm has 5 wales, expected at least 7.*rig.width=25"):
        PullOut().check_run(run_of("pull-out", "two-yarns", layers, direction="warp"))


def test_loads_of_layers_add_up_by_direction():
    cells = np.array([[0, 1], [2, 3], [4, 5], [6, 7]])
    parts = ("weft1", "warp", "weft2", "knit")
    mesh = Mesh("beams", cells, np.arange(4), parts, np.arange(4), np.ones(4))
    history = History(mesh, {}, {}, [], tool_force=[np.repeat([1.0, 2.0, 3.0, 4.0], 2)])
    assert force_shares(history) == pytest.approx({"weft": 40.0, "warp": 20.0, "knit": 40.0})
    assert [direction_of(part) for part in parts] == ["weft", "warp", "weft", "knit"]


def test_thin_loops_and_those_that_carry_a_direction_are_soft():
    assert all(square(variant)[1].model.compliant for variant in ("0-90-0", "weft-only"))
    fabrics = [run_of("picture-frame", "1", *sets).fabric for sets in ((), ("fabric.layers=[{direction: warp}]",))]
    assert [has_compliant_loops(fabric) for fabric in fabrics] == [False, True]


@pytest.mark.parametrize("variant", ["1", "90-0-90-0", "0-90-0", "weft-only", "seed"])
def test_needles_hold_the_arcs_of_the_first_and_last_course(variant):
    """Thick layers of 90-0-90-0 draw the sinker arcs of the first course in to its side."""
    prepared = square(variant)[1]
    model, held = prepared.model, set(prepared.rig.held.tolist())
    rows = yarn_nodes(model.mesh, "knit")
    assert [len(held & set(row[1:-1].tolist())) for row in rows[1:-1]] == [0] * (len(rows) - 2)
    assert len(held & set(rows[0][1:-1].tolist())) == 6 and len(held & set(rows[-1][1:-1].tolist())) in (5, 6)


def plates_on(variant: str) -> tuple:
    """Run of a compaction test, and its plates 4 mm apart."""
    run = run_of("compaction", variant)
    return run, CompactionTest(run, (-1.9, 1.9), np.full(2, 10.0), np.zeros(1), np.zeros(0, np.int64))


def test_plates_close_to_the_piled_yarns_of_a_rib_slowly():
    run, rig = plates_on("rib")
    piled, speed = piled_height(run.fabric), run.solver.speed_mm_per_ms
    assert largest_closing(run.fabric, 4.0) > 4.0 - piled and rig.locks
    slow = [t for t in np.linspace(0.0, rig.duration, 500) if 4.0 - rig.closing.integral(t) < piled]
    assert np.interp(slow, rig.closing.time, rig.closing.value) == pytest.approx(PILING_SHARE * speed)
    _, firm = plates_on("1")
    assert firm.closing.value[-1] == pytest.approx(speed) and not firm.locks


def test_fabric_that_locks_says_at_which_pressure():
    run, _ = plates_on("rib")
    assert "locks at 60 kPa" in pressure_locking_warning(run, 60.0)[0] and not pressure_locking_warning(run, 1000.0)


def test_late_contacts_of_pressed_soft_yarns_get_a_share_of_the_mean_depth():
    tracker = square("weft-only")[1].model.tracker
    tracker.settle()
    tracker.recovering = 1
    gap = np.linalg.norm(tracker.contacts.offset[:, : tracker.count], axis=0)
    radius = tracker.group.radius[tracker.contacts.piece[:, : tracker.count]].min(axis=0)
    found = []
    for depth in (0.0, 0.01, 0.5):
        tracker.contacts.reach[: tracker.count] = gap + depth * radius
        found.append(tracker.portion())
    assert found == pytest.approx([SMALL_PORTION, DEPTH_SHARE * 0.01, PORTION])


@pytest.mark.parametrize("speed", [3.0, 0.3])
def test_frame_accelerates_soft_yarns_up_to_an_angle_at_any_speed(speed):
    found = [start_up_angle(run_of("picture-frame", v, f"solver.speed={speed}")) for v in ("90-0-90-0", "1")]
    assert found[0] >= 0.999 * SOFT_START and (found[1] < SOFT_START or speed == 3.0)
