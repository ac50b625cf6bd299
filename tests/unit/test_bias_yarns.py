"""Strips of yarns cut on the bias: pieces of yarn, where they cross, angles and slip there."""

import numpy as np
import pytest
from test_bias_extension import pin_jointed

from knittest.base.history import Frame
from knittest.config.loading import resolve
from knittest.fabric.strip import YarnPath, cells_under, cut_on_the_bias, turned
from knittest.kernels.contact import spline_weights
from knittest.laboratory.bias_extension.strip import BiasStrip, YarnsOnTheBias
from knittest.laboratory.bias_extension.test import BiasExtension
from knittest.laboratory.bias_extension.zones import HALF, MIDDLE, RIGID, zones
from knittest.laboratory.strips import YarnStrip

PITCH, STEPS = (2.0, 3.0), 4  # of wales and courses [mm]; elements a pitch
LEAST = {"warp": 4, "weft": 4, "knit": 4}


def straight(length: float, width: float) -> tuple[list[YarnPath], int, int]:
    """Straight inlays of a piece about the origin, large enough for a strip on the bias."""
    n_wales, n_courses = cells_under(length, width, PITCH)
    size = np.array([n_wales, n_courses]) * PITCH
    paths = []
    for system, axis, count, pitches in (("warp", 1, n_wales, n_courses), ("weft", 0, n_courses, n_wales)):
        for k in range(count):
            points = np.zeros((pitches * STEPS + 1, 3))
            points[:, axis] = np.linspace(-0.5, 0.5, len(points)) * size[axis]
            points[:, 1 - axis] = (k + 0.5) * PITCH[1 - axis] - 0.5 * size[1 - axis]
            paths.append(YarnPath(system, k, points))
    return paths, n_wales, n_courses


def small():
    """Run on a strip of 20 x 40 mm of variant 2."""
    sets = ("rig.width=20", "rig.gauge_length=40")
    return resolve(variant="2", scale="meso", preset="quick", test="bias-extension", sets=sets)


def test_pieces_lie_in_the_strip_and_reach_its_edges():
    paths, *_ = straight(60.0, 30.0)
    found = cut_on_the_bias(paths, 60.0, 30.0, LEAST)
    points = np.concatenate([path.points for path in found])
    assert np.abs(points[:, 0]).max() <= 15.0 and np.abs(points[:, 1]).max() <= 30.0
    # yarns 2 and 3 mm apart, cut at nodes 0.5 and 0.75 mm apart
    assert sum(len(path.points) - 1 for path in found if path.system == "warp") * 0.75 == pytest.approx(900.0, rel=0.08)
    assert sum(len(path.points) - 1 for path in found if path.system == "weft") * 0.5 == pytest.approx(600.0, rel=0.08)
    long = cut_on_the_bias(paths, 60.0, 30.0, {"warp": 20, "weft": 20})
    assert len(long) < len(found) and min(len(path.points) for path in long) >= 21
    for path in found:
        whole = turned(next(p for p in paths if (p.system, p.index) == (path.system, path.index)).points)
        assert path.points == pytest.approx(whole[path.first : path.first + len(path.points)])
        assert path.uncut.points == pytest.approx(whole) and paths[0].uncut is paths[0]


def test_a_yarn_that_leaves_the_strip_and_comes_back_is_two():
    wave = np.column_stack([np.linspace(-40.0, 40.0, 161), 12.0 * np.sin(np.linspace(0.0, 25.0, 161)), np.zeros(161)])
    flat = wave @ np.array([[0.5**0.5, -(0.5**0.5), 0.0], [0.5**0.5, 0.5**0.5, 0.0], [0.0, 0.0, 1.0]])
    assert turned(flat) == pytest.approx(wave)
    found = cut_on_the_bias([YarnPath("knit", 0, flat)], 20.0, 60.0, {"knit": 1})
    assert len(found) > 3 and len({path.first for path in found}) == len(found)


def frames(strip: BiasStrip, angle: float, slide: float = 0.0) -> tuple[YarnsOnTheBias, Frame, Frame]:
    """Yarns of a strip, as cut and moved as pin-jointed ones by ``angle``, the warps slid by ``slide`` [mm] along y."""
    paths, n_wales, n_courses = straight(strip.length, strip.width)
    found = cut_on_the_bias(paths, strip.length, strip.width, LEAST)
    yarns = YarnsOnTheBias(YarnStrip([], {}, {}), found, n_wales, n_courses)
    start = np.concatenate([path.points for path in found])
    of_warp = np.concatenate([np.full(len(path.points), path.system == "warp") for path in found])
    moved = np.column_stack([pin_jointed(start[:, :2], strip, angle), start[:, 2]])
    moved[of_warp, 1] += slide
    return yarns, *(Frame(0.0, 0.0, 0.0, position, {}) for position in (start, moved))


def test_a_cut_yarn_ends_half_as_far_from_its_line_as_with_its_control_points_kept():
    count = np.arange(81.0)
    wave = np.stack([0.5 * count - 20.0, np.zeros(81), np.sin(0.5 * np.pi * count + 0.3)], axis=1)
    (piece,) = cut_on_the_bias([YarnPath("weft", 0, wave)], 25.0, 25.0, {"weft": 4})
    whole, end = turned(wave), np.array(spline_weights.py_func(1.5))
    last = piece.first + len(piece.points) - 1
    for ends, at, beside in ((piece.points[-3:], last, 1), (piece.points[2::-1], piece.first, -1)):
        around = whole[[at - beside, at, at + beside]]
        uncut = np.array(spline_weights.py_func(0.5)) @ around
        kept = end @ whole[[at - 2 * beside, at - beside, at]]
        assert np.linalg.norm(kept - uncut) > 0.1
        assert np.linalg.norm(end @ ends - uncut) == pytest.approx(0.5 * np.linalg.norm(kept - uncut))


def test_angles_at_crossings_are_those_of_the_zones():
    strip = BiasStrip(60.0, 30.0)
    yarns, start, moved = frames(strip, 0.5)
    crossings = yarns.crossings()
    zone = zones(crossings.places(start), strip)
    assert len(zone) > 200 and np.abs(crossings.angles(start)).max() < 1e-12
    # pitches that lie across the line between two zones have a part of both
    for of, angle in ((MIDDLE, 0.5), (HALF, 0.25), (RIGID, 0.0)):
        assert np.median(crossings.angles(moved)[zone == of]) == pytest.approx(angle, abs=1e-9)
    assert crossings.slip(start, moved).max() < 1e-9


def test_yarns_that_slide_are_seen():
    strip = BiasStrip(60.0, 30.0)
    yarns, start, moved = frames(strip, 0.0, slide=0.3)
    crossings = yarns.crossings()
    assert crossings.slip(start, moved) == pytest.approx(0.3) and np.abs(crossings.angles(moved)).max() < 1e-12


def test_a_knit_on_the_bias_has_the_mass_of_the_fabric_and_jaws_that_hold_all_that_reaches_them():
    run = small()
    prepared = BiasExtension().prepare(run)
    model, rig = prepared.model, prepared.rig
    mass = 1e6 * float(model.mass.sum()) / prepared.facts["area_mm2"]
    assert mass == pytest.approx(run.fabric.area_mass.value, rel=0.10)  # less what falls out at the edges
    position, chain = model.position(), model.group.chain
    for side, held in ((-1.0, rig.fixed), (1.0, rig.moving)):
        assert (side * position[held, 1]).min() >= 20.0 - 1e-6
        reaching = set(chain[side * position[:, 1] > 20.0].tolist())
        assert reaching == set(chain[held].tolist())
    assert not set(rig.fixed.tolist()) & set(rig.moving.tolist())
    free = np.array([np.abs(position[chain == k, 1]).min() for k in range(chain.max() + 1)])
    assert free.max() < 20.0  # nothing lies in a jaw alone


def test_a_piece_of_a_loop_row_has_the_stretch_of_its_whole_row(monkeypatch):
    """A part of a loop is not as much longer than its polygon as the loop is."""
    from knittest.models import meso

    seen = []
    stretch = meso.stretch
    monkeypatch.setattr(meso, "stretch", lambda run, path: seen.append(path) or stretch(run, path))
    run = small()
    BiasExtension().prepare(run)
    knit = [path for path in seen if path.system == "knit"]
    assert knit and all((len(path.points) - 1) % run.model.meso.elements_per_loop == 0 for path in knit)
