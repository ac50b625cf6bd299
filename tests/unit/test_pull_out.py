"""Pull-out: what is pulled and held, and what its curve says of a crossing."""

from types import SimpleNamespace

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.base.history import Frame, History, Mesh
from knittest.config.loading import resolve
from knittest.fabric.strip import YarnPath
from knittest.laboratory.pull_out.sliding import SLIDES, sliding
from knittest.laboratory.pull_out.test import REST, PullOut, PullOutTest, clamp_difference, nodes_of, with_tail


def quick(*sets: str, direction: str = "weft"):
    """Run of yarns of variant 1 at quick."""
    return resolve(variant="1", preset="quick", test="pull-out", direction=direction, sets=sets)


def pulled(length: float, travel: float, friction: float, pitch: float = 4.0) -> dict[str, np.ndarray]:
    """Curve of an inlay, ``length`` embedded, held by ``friction`` a crossing; it stretches by 0.2 mm."""
    way = np.linspace(0.0, travel, 4001)
    tail = np.maximum(way - 0.2, 0.0)
    embedded = length - tail
    held = friction * embedded / pitch
    return {"tail_travel_mm": tail, "embedded_mm": embedded, "pull_force_n": np.minimum(way / 0.2, 1.0) * held}


def test_friction_of_a_crossing_from_a_force_that_falls_with_the_embedded_length():
    found = sliding(pulled(40.0, 12.0, 0.05), 4.0)
    assert found.per_crossing == pytest.approx(0.05, rel=1e-4)
    assert found.peak == pytest.approx(10 * 0.05, rel=2e-3) and found.at_rest == pytest.approx(10 * 0.05, rel=2e-3)
    assert found.way == pytest.approx(11.8 - SLIDES)
    # two whole pitches, the last ones: 28.2 to 36.2 mm embedded
    assert found.mean == pytest.approx(0.05 * 32.2 / 4.0, rel=1e-3)


def test_a_force_that_comes_back_every_pitch_has_its_mean_over_whole_ones():
    curve = pulled(40.0, 12.0, 0.05)
    curve["pull_force_n"] = curve["pull_force_n"] * (1.0 + np.sin(2.0 * np.pi * curve["tail_travel_mm"] / 4.0) ** 2)
    assert sliding(curve, 4.0).per_crossing == pytest.approx(0.075, rel=4e-3)


def test_an_inlay_that_hardly_slides_has_no_friction():
    found = sliding(pulled(40.0, 3.0, 0.05), 4.0)
    assert np.isnan(found.mean) and np.isnan(found.per_crossing) and found.way == pytest.approx(2.8 - SLIDES)
    assert np.isnan(sliding(pulled(40.0, 0.1, 0.05), 4.0).at_rest)


def paths(n_wales: int = 6, n_courses: int = 6) -> list[YarnPath]:
    """Straight inlays of the pitches of variant 1 and a flat zigzag for each row of loops, in any order."""
    pitch, found = 100.0 / 28.0, []
    for c in range(n_courses):
        x = np.linspace(0.0, n_wales * pitch, 25)
        found.append(YarnPath("weft", c, np.column_stack([x, np.full(25, (c + 0.5) * pitch), np.zeros(25)])))
        found.append(YarnPath("knit", c, np.column_stack([x, np.full(25, (c + 0.6) * pitch), np.ones(25)])))
    for w in range(n_wales):
        y = np.linspace(0.0, n_courses * pitch, 25)
        found.append(YarnPath("warp", w, np.column_stack([np.full(25, (w + 0.5) * pitch), y, np.zeros(25)])))
    return found


@pytest.mark.parametrize("direction", ["warp", "weft"])
@pytest.mark.parametrize("clamped", ["sides", "far"])
def test_clamps_hold_the_piece_but_not_the_inlay(direction, clamped):
    run, size = quick(f"rig.clamped={clamped}", direction=direction), (600.0 / 28.0, 600.0 / 28.0)
    nodes = nodes_of(run, paths(), size)
    order = ["warp", "weft", "knit"]
    points = np.concatenate([p.points for p in sorted(paths(), key=lambda p: (order.index(p.system), p.index))])
    axis = 1 if direction == "warp" else 0
    assert points[nodes.pulled[0], axis] == pytest.approx(size[0]) and points[nodes.tail, axis] == 0.0
    own = points[nodes.tail, 1 - axis]
    assert own == pytest.approx(3.5 * 100.0 / 28.0) and points[nodes.pulled[0], 1 - axis] == own
    held = points[nodes.held]
    along, across = held[:, axis], held[:, 1 - axis]
    on_it = (across == own) & (held[:, 2] == 0.0)
    pitch = 100.0 / 28.0 + 1e-9
    if clamped == "sides":
        assert ((across <= pitch) | (across >= size[0] - pitch)).all() and not on_it.any()
        assert np.isclose(across, 0.5 * pitch).any() and np.isclose(across, size[0] - 0.5 * pitch).any()
    else:
        assert along.max() <= pitch and nodes.tail not in nodes.held
    assert len(held) > 50


def test_the_piece_rests_then_the_end_is_drawn_by_the_travel():
    run = quick()
    rig = PullOutTest(run, 0, np.array([3]), np.array([0]), 20.0)
    assert rig.speed.integral(REST) == 0.0
    assert rig.speed.integral(rig.duration) == pytest.approx(run.rig.travel)
    row = rig.channels(rig.duration, SimpleNamespace(reaction=np.array([0.7, -0.6])))
    assert row["pull_force_n"] == 0.7 and row["clamp_force_n"] == 0.6
    early = [mark * rig.duration for mark in rig.marks]
    assert [rig.speed.integral(t) for t in early[1:]] == pytest.approx(list(np.linspace(0.0, 1.0, 17)[1:]), abs=2e-3)


def test_the_free_end_is_followed_through_the_frames():
    curve = {"time_ms": np.array([5.0, 10.0]), "displacement_mm": np.array([0.0, 2.0])}
    curve |= {"pull_force_n": np.array([0.0, 2.0]), "clamp_force_n": np.array([0.0, 1.9])}
    frames = [
        Frame(t, 0.0, 0.0, np.array([[0.0, 0.0, 0.0], [x, 0.0, 0.0]]), {}) for t, x in ((0, 0.1), (5, 0.3), (10, 2.0))
    ]
    mesh = Mesh("beams", np.zeros((0, 2), np.int64), np.zeros(0), (), np.zeros(0), np.zeros(0))
    history = with_tail(History(mesh, curve, {}, frames), {"tail_node": 1.0, "embedded_mm": 20.0}, 0)
    assert history.curve["tail_travel_mm"] == pytest.approx([0.0, 1.7])
    assert history.curve["embedded_mm"] == pytest.approx([20.0, 18.3])
    assert clamp_difference(history) == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("sets", "said"),
    [
        (("rig.width=12",), r"rig.width = 12 mm has 3 weft yarns; expected at least 5.*rig.width=18"),
        (("rig.length=10",), r"rig.travel = 8 mm: expected at most 6.43 mm.*rig.length = 10 mm"),
        (("model.meso.contact=false",), "model.meso.contact = false"),
    ],
)
def test_pieces_without_a_pull_out_are_refused(sets, said):
    with pytest.raises(InputError, match=said):
        PullOut().refuse(quick(*sets))
