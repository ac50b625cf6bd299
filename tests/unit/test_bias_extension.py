"""Bias extension: pin-jointed kinematics, force, zones and mesh in closed form; yarns cut on the bias."""

from math import sqrt

import numpy as np
import pytest
from pydantic import ValidationError

from knittest.base.errors import InputError
from knittest.base.history import Frame
from knittest.config.loading import resolve
from knittest.fabric.strip import YarnPath, cells_for_bias_strip, cut_on_the_bias, rotate_to_bias
from knittest.kernels.contact import spline_weights
from knittest.laboratory.bias_extension.config import BiasExtensionRig
from knittest.laboratory.bias_extension.strip import BiasStrip, BiasYarns, bias_mesh, diamond_counts
from knittest.laboratory.bias_extension.test import BiasExtension
from knittest.laboratory.bias_extension.zones import HALF, MIDDLE, RIGID, is_inner_middle, zones
from knittest.laboratory.strips import YarnStrip

STRIPS = [BiasStrip(200.0, 100.0), BiasStrip(310.0, 100.0)]


def pin_jointed(points: np.ndarray, strip: BiasStrip, angle: float) -> np.ndarray:
    """Places (n, 2) of ``points`` when the middle is sheared by ``angle`` [rad]: each yarn turns where it is free.

    A net of yarns that keep their length moves as r = f(xi) + g(eta), xi and eta along its yarns.
    """
    lead = (points[:, 0] + points[:, 1]) / sqrt(2.0), (points[:, 1] - points[:, 0]) / sqrt(2.0)
    reach, turned = strip.middle / (2.0 * sqrt(2.0)), 0.25 * np.pi + 0.5 * angle
    straight, free = (np.array([np.cos(a), np.sin(a)]) for a in (0.25 * np.pi, turned))
    found = np.zeros((len(points), 2))
    for along, mirror in zip(lead, (1.0, -1.0), strict=True):
        inside = np.clip(along, -reach, reach)
        moved = inside[:, None] * free + (along - inside)[:, None] * straight
        found += moved * [mirror, 1.0]
    return found


@pytest.mark.parametrize("strip", STRIPS)
def test_the_angle_is_that_of_yarns_that_keep_their_length(strip):
    """gamma = 90 deg - 2 acos((L0 + d) / (sqrt(2) L0)) is what the moved clamp of such a net travels."""
    for gamma in (0.1, 0.5, 0.9):
        ends = pin_jointed(np.array([[0.0, 0.5 * strip.length], [0.0, -0.5 * strip.length]]), strip, gamma)
        travel = ends[0, 1] - ends[1, 1] - strip.length
        assert strip.angle(travel) == pytest.approx(gamma, rel=1e-9)
        middle = strip.length - strip.width
        assert 0.5 * np.pi - 2.0 * np.arccos((middle + travel) / (sqrt(2.0) * middle)) == pytest.approx(gamma)
        assert strip.travel(gamma) == pytest.approx(travel)
    assert strip.angle(strip.longest * (1.0 - 1e-12)) == pytest.approx(0.5 * np.pi, abs=1e-5)


@pytest.mark.parametrize("strip", STRIPS)
def test_the_force_is_the_power_of_both_zones(strip):
    """F dd = S(gamma) dgamma A + S(gamma / 2) dgamma / 2 B, with the areas counted in a fine grid."""
    x = (np.arange(400) + 0.5) / 400.0 - 0.5
    grid = np.column_stack([np.tile(x * strip.width, 400), np.repeat(x * strip.length, 400)])
    cell = strip.length * strip.width / len(grid)
    areas = [cell * int((zones(grid, strip) == zone).sum()) for zone in (MIDDLE, HALF, RIGID)]
    assert areas == pytest.approx([*strip.areas, 0.5 * strip.width**2], rel=0.02)
    law, gamma, h = lambda g: 0.1 * g**1.5 + 0.3 * g**4, 0.6, 1e-6
    rate = (strip.travel(gamma + h) - strip.travel(gamma - h)) / (2.0 * h)
    power = law(gamma) * strip.areas[0] + 0.5 * law(0.5 * gamma) * strip.areas[1]
    found = strip.force(*(np.array([v]) for v in (law(gamma), law(0.5 * gamma), gamma)))
    assert found == pytest.approx([power / rate], rel=1e-6)


def test_the_force_of_a_linear_law():
    """6.46 N at 20 deg of 0.1 N/mm per rad in 200 x 100 mm, by hand: 1e4 x 0.1 x (0.34907 + 0.17453) / 81.116."""
    angle = np.deg2rad([20.0])
    assert STRIPS[0].force(0.1 * angle, 0.05 * angle, angle) == pytest.approx([6.455], rel=1e-3)
    assert STRIPS[0].travel(angle[0]) == pytest.approx(15.85, abs=5e-3)


@pytest.mark.parametrize("strip", STRIPS)
def test_the_normalised_force_is_the_recursion_of_cao_et_al(strip):
    """F_sh = ((H / W - 1) F (cos gamma/2 - sin gamma/2) - W F_sh(gamma / 2) cos gamma/2) / ((2H - 3W) cos gamma)."""
    gamma = np.deg2rad(np.linspace(0.0, 50.0, 2001))
    law = 0.02 + 0.1 * gamma + 0.5 * gamma**4  # with a force at rest, as friction leaves
    force = strip.force(law, np.interp(0.5 * gamma, gamma, law), gamma)
    found = strip.normalised_force(force, gamma)
    assert found == pytest.approx(law / np.cos(gamma), rel=1e-6)
    length, width = strip.length, strip.width
    half = np.interp(0.5 * gamma, gamma, found)
    lever = np.cos(0.5 * gamma) - np.sin(0.5 * gamma)
    by_recursion = (length / width - 1.0) * force * lever - width * half * np.cos(0.5 * gamma)
    by_recursion /= (2.0 * length - 3.0 * width) * np.cos(gamma)
    assert found == pytest.approx(by_recursion, rel=1e-5)


def test_a_curve_that_begins_later_is_normalised_as_if_level_before():
    strip, gamma = STRIPS[0], np.deg2rad(np.linspace(1.0, 40.0, 400))
    law = 0.05 + 0.1 * gamma
    force = strip.force(law, 0.05 + 0.05 * gamma, gamma)
    assert strip.conjugate(force, gamma)[200:] == pytest.approx(law[200:], rel=0.02)


def test_a_short_strip_has_no_middle():
    with pytest.raises(InputError, match="180 mm long and 100 mm wide: expected at least 2 times the width"):
        BiasStrip(180.0, 100.0)
    with pytest.raises(ValidationError, match="twice the width, 200 mm"):
        BiasExtensionRig(gauge_length=180.0, width=100.0)


def test_the_middle_is_read_in_its_inner_half():
    strip = STRIPS[0]
    points = np.array([[0.0, 0.0], [0.0, 24.0], [0.0, 26.0], [24.0, 0.0], [26.0, 0.0], [0.0, 60.0], [13.0, 13.0]])
    assert is_inner_middle(points, strip).tolist() == [True, True, False, True, False, False, False]


@pytest.mark.parametrize(("length", "width", "size"), [(200.0, 100.0, 10.0), (230.0, 115.0, 5.0), (260.0, 100.0, 12.0)])
def test_the_mesh_fills_the_strip_along_its_yarns(length, width, size):
    points, cells = bias_mesh(length, width, size)
    corners = points[cells][:, :, :2]
    one, other = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    areas = 0.5 * (one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
    assert areas.min() > 0.4 * size**2 and areas.max() < 1.5 * size**2
    assert areas.sum() == pytest.approx(length * width)
    assert np.abs(points).max(axis=0) == pytest.approx([0.5 * width, 0.5 * length, 0.0])
    sides = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    kept, count = np.unique(sides, axis=0, return_counts=True)
    assert count.max() == 2  # a side of two shells, or on the edge of the strip
    rim = np.abs(points[kept[count == 1]][:, :, :2]) / [0.5 * width, 0.5 * length]
    assert (np.isclose(rim, 1.0).all(axis=1)).any(axis=1).all()
    along, across = diamond_counts(length, width, size)
    assert along / across == pytest.approx(length / width, rel=0.08)


@pytest.mark.parametrize("strip", [STRIPS[0], BiasStrip(300.0, 100.0)])
def test_the_zones_end_where_shells_do(strip):
    """So the net of yarns moves no shell but evenly: opposite sides of its squares stay parallel."""
    points, cells = bias_mesh(strip.length, strip.width, 10.0)
    moved = pin_jointed(points[:, :2], strip, 0.6)[cells]
    centre = zones(points[cells].mean(axis=1), strip)
    for zone, angle in ((MIDDLE, 0.6), (HALF, 0.3), (RIGID, 0.0)):
        for at in np.flatnonzero(centre == zone):
            start = points[cells[at]][:, :2]
            change = np.linalg.lstsq(np.column_stack([start, np.ones(4)]), moved[at], rcond=None)
            assert np.abs(np.column_stack([start, np.ones(4)]) @ change[0] - moved[at]).max() < 1e-9
            warp, weft = np.array([[-1.0, 1.0], [1.0, 1.0]]) / sqrt(2.0) @ change[0][:2]
            assert np.hypot(*warp) == pytest.approx(1.0) and np.hypot(*weft) == pytest.approx(1.0)
            assert np.arcsin(warp @ weft) == pytest.approx(angle, abs=1e-9)


PITCH, STEPS = (2.0, 3.0), 4  # of wales and courses [mm]; elements a pitch
LEAST = {"warp": 4, "weft": 4, "knit": 4}


def straight(length: float, width: float) -> tuple[list[YarnPath], int, int]:
    """Straight inlays of a piece about the origin, large enough for a strip on the bias."""
    n_wales, n_courses = cells_for_bias_strip(length, width, PITCH)
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
        whole = rotate_to_bias(next(p for p in paths if (p.system, p.index) == (path.system, path.index)).points)
        assert path.points == pytest.approx(whole[path.first : path.first + len(path.points)])
        assert path.uncut_path.points == pytest.approx(whole) and paths[0].uncut_path is paths[0]


def test_a_yarn_that_leaves_the_strip_and_comes_back_is_two():
    wave = np.column_stack([np.linspace(-40.0, 40.0, 161), 12.0 * np.sin(np.linspace(0.0, 25.0, 161)), np.zeros(161)])
    flat = wave @ np.array([[0.5**0.5, -(0.5**0.5), 0.0], [0.5**0.5, 0.5**0.5, 0.0], [0.0, 0.0, 1.0]])
    assert rotate_to_bias(flat) == pytest.approx(wave)
    found = cut_on_the_bias([YarnPath("knit", 0, flat)], 20.0, 60.0, {"knit": 1})
    assert len(found) > 3 and len({path.first for path in found}) == len(found)


def frames(strip: BiasStrip, angle: float, slide: float = 0.0) -> tuple[BiasYarns, Frame, Frame]:
    """Yarns of a strip, as cut and moved as pin-jointed ones by ``angle``, the warps slid by ``slide`` [mm] along y."""
    paths, n_wales, n_courses = straight(strip.length, strip.width)
    found = cut_on_the_bias(paths, strip.length, strip.width, LEAST)
    yarns = BiasYarns(YarnStrip([], {}, {}), found, n_wales, n_courses)
    start = np.concatenate([path.points for path in found])
    of_warp = np.concatenate([np.full(len(path.points), path.system == "warp") for path in found])
    moved = np.column_stack([pin_jointed(start[:, :2], strip, angle), start[:, 2]])
    moved[of_warp, 1] += slide
    return yarns, *(Frame(0.0, 0.0, 0.0, position, {}) for position in (start, moved))


def test_a_cut_yarn_ends_half_as_far_from_its_line_as_with_its_control_points_kept():
    count = np.arange(81.0)
    wave = np.stack([0.5 * count - 20.0, np.zeros(81), np.sin(0.5 * np.pi * count + 0.3)], axis=1)
    (piece,) = cut_on_the_bias([YarnPath("weft", 0, wave)], 25.0, 25.0, {"weft": 4})
    whole, end = rotate_to_bias(wave), np.array(spline_weights.py_func(1.5))
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
    crossings = yarns.crossings(small())
    zone = zones(crossings.places(start), strip)
    assert len(zone) > 200 and np.abs(crossings.angles(start)).max() < 1e-12
    # pitches that lie across the line between two zones have a part of both
    for of, angle in ((MIDDLE, 0.5), (HALF, 0.25), (RIGID, 0.0)):
        assert np.median(crossings.angles(moved)[zone == of]) == pytest.approx(angle, abs=1e-9)
    assert crossings.slip(start, moved).max() < 1e-9


def test_yarns_that_slide_are_seen():
    strip = BiasStrip(60.0, 30.0)
    yarns, start, moved = frames(strip, 0.0, slide=0.3)
    crossings = yarns.crossings(small())
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
