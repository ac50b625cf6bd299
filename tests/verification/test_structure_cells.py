"""Cells of any stitches and layers: they relax to their structure, mirrored and repeated ones alike; wrong ones are
refused.
"""

import re
from dataclasses import replace

import numpy as np
import pytest
from fabric_cases import (
    FOUR_LAYERS,
    STRUCTURES,
    THIN_WEFT,
    layer,
    points_of,
    relaxed_structure,
    start_cell,
    structure,
    with_points,
)
from scipy.spatial import cKDTree

from knittest.base.errors import InputError, NumericalError
from knittest.fabric.cell import Cell, CellSpec
from knittest.fabric.loop import points_on
from knittest.fabric.relaxation import LockedLoopError, _relax_stepwise, relax_cell, start_curves, yarn_arrays
from knittest.fabric.strip import centre_lines
from knittest.fabric.topology import check_topology, crossings, stitch_codes

#: how a loop passes the foot, head, head and foot of the course above, which is knit or purl
CODES = {"k": "OUUO", "p": "UOOU"}
MIRROR, UP = np.array([1.0, 1.0, -1.0]), np.array([0.0, 0.0, 1.0])


def check(cell: Cell) -> None:
    check_topology(cell, start_cell(cell.spec))


def overlap(cell: Cell) -> float:
    """Largest penetration of two yarns of the tiled fabric over the smaller radius [-], brute force.

    Splines through the nodes lie up to 3 % of a radius outside of the polygons that touch.
    """
    paths = centre_lines(cell, 4, 4, finer=4)
    trees, worst = [cKDTree(path.points) for path in paths], -np.inf
    for a in range(len(paths)):
        for b in range(a):
            radii = [cell.spec.radius[paths[k].system] for k in (a, b)]
            worst = max(worst, (sum(radii) - trees[a].query(paths[b].points)[0].min()) / min(radii))
    return worst


def bending_energies(cell: Cell) -> dict[str, float]:
    """Bending energy [N mm] of each yarn system in the cell per stitch."""
    yarns = yarn_arrays(cell.spec, start_curves(cell.spec))
    x, c = np.vstack([one.points for one in cell.curves]), yarns.chain
    curvature = x[yarns.before] + yarns.before_shift - 2.0 * x + x[yarns.after] + yarns.after_shift - yarns.rest
    step = np.array([one.length / len(one.points) for one in cell.curves])
    energy = 0.5 * yarns.bending[c] / step[c] ** 3 * (curvature**2).sum(axis=1)
    stitches = np.prod(cell.spec.repeat)
    return {
        s: sum(energy[c == k].sum() for k, one in enumerate(cell.curves) if one.system == s) / stitches
        for s in cell.spec.systems
    }


def assert_alike(one: Cell, other: Cell) -> None:
    """Same thickness, lengths and energies per stitch, to 0.1 %."""
    assert one.thickness == pytest.approx(other.thickness, rel=1e-3)
    assert one.loop_length == pytest.approx(other.loop_length, rel=1e-4)
    for system in one.spec.systems[1:]:
        lengths = (cell.length(system) / np.prod(cell.spec.repeat) for cell in (one, other))
        assert next(lengths) == pytest.approx(next(lengths), rel=1e-4)
    assert bending_energies(one) == pytest.approx(bending_energies(other), rel=1e-3, abs=2e-6)


@pytest.mark.parametrize("name", STRUCTURES)
def test_every_structure_relaxes(name: str) -> None:
    """Touching yarns overlap by less than 1 % of a radius, loops have their length, every loop its interlacing."""
    cell, spec = relaxed_structure(name), STRUCTURES[name]
    assert cell.deepest < 5e-3 and -0.04 < overlap(cell) < 0.01
    assert abs(cell.length_error) < 1e-3 and abs(cell.loop_length / spec.loop_length - 1.0) < 1e-3
    (wales, courses), rows = spec.repeat, spec.stitches
    above = {(c, w): rows[(c + 1) % len(rows)][w % len(rows[0])] for c in range(courses) for w in range(wales)}
    assert stitch_codes(cell) == {place: CODES["k" if side > 0 else "p"] for place, side in above.items()}
    middle = [np.mean([one.points[:, 2].mean() for one in cell.of(inlays.name)]) for inlays in spec.layers]
    assert middle == sorted(middle), "the layers do not lie in their order from back to face"


WRONG = [
    ("rib", "kk"), ("garter", "k/k"), ("seed", "kk/kk"), ("rib", "pk"), ("garter", "p/k"), ("seed", "pk/kp"),
    ("jersey", "p"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "stitches"), WRONG)
def test_curves_of_other_stitches_are_refused(name: str, stitches: str) -> None:
    cell = relaxed_structure(name)
    with pytest.raises(NumericalError, match="is not interlaced as its stitches"):
        check(replace(cell, spec=structure(stitches=stitches)))


@pytest.mark.parametrize("stitches", ["kp", "k/p", "kp/pk"])
def test_curves_of_jersey_are_refused_in_other_stitches(stitches: str) -> None:
    plain = relax_cell(structure(stitches=re.sub("p", "k", stitches)))
    with pytest.raises(NumericalError, match=r"as OUUO, expected UOOU"):
        check(replace(plain, spec=structure(stitches=stitches)))


def test_a_mirrored_jersey_is_refused() -> None:
    cell = relaxed_structure("jersey")
    with pytest.raises(NumericalError, match=r"course 1, wale 1 .* as UOOU, expected OUUO"):
        check(with_points(cell, "knit", MIRROR * points_of(cell, "knit")))


def test_courses_that_are_not_interlaced_are_refused() -> None:
    """One course of garter lifted off the other."""
    cell = relaxed_structure("garter")
    lifted = with_points(cell, "knit", points_of(cell, "knit", 1) + 5.0 * UP, 1)
    with pytest.raises(NumericalError, match=r"course 1, wale 1 .* as no crossings, expected UOOU"):
        check(lifted)


@pytest.mark.parametrize(
    ("name", "system", "height", "message"),
    [
        ("rib with weft", "weft", 3.0, "the weft of course 1 does not lie behind the legs of course 1"),
        ("rib with weft", "weft", -3.0, "the weft of course 1 does not lie in front of the"),
        ("0/90/0 on rib", "weft1", 4.0, "the warp does not lie in front of the weft1|weft1 .* behind the legs"),
        ("90/0/90/0", "weft1", -2.0, "the weft1 does not lie in front of the warp1"),
        ("90/0/90/0", "warp2", -1.5, "the warp2 does not lie in front of the weft1"),
        ("90/0/90/0", "weft2", 3.0, "the weft2 of course 1 does not lie behind the legs of course 1"),
        ("rib 3x1 with weft", "weft", -3.0, "the weft of course 1 does not lie in front of the"),
    ],
)
def test_inlays_in_a_wrong_place_are_refused(name: str, system: str, height: float, message: str) -> None:
    cell = relaxed_structure(name)
    with pytest.raises(NumericalError, match=message):
        check(with_points(cell, system, points_of(cell, system) + height * UP))


@pytest.mark.parametrize(
    ("name", "number"),
    [*(("rib with weft", k) for k in range(4)), ("rib with weft in every second course", 0), ("rib 3x1 with weft", 5)],
)
def test_a_weft_that_passes_one_leg_on_the_wrong_side_is_refused(name: str, number: int) -> None:
    cell = relaxed_structure(name)
    points = points_on(points_of(cell, "weft"), cell.of("weft")[0].period, 400 * cell.spec.repeat[0])
    finer = with_points(cell, "weft", points)
    own = next(k for k, one in enumerate(finer.curves) if one.system == "weft")
    met = [c for c in crossings(finer) if own in (c.over, c.under)]
    place, side = (met[number].over_place, -1.0) if met[number].over == own else (met[number].under_place, 1.0)
    points[np.abs(np.arange(len(points)) - place) < 6, 2] += 2.5 * side
    with pytest.raises(NumericalError, match="the weft of course 1 does not lie"):
        check(finer)


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (structure(layer("weft")), "nothing lies behind the weft of course 1, .* expected a layer of warp behind it"),
        (structure(layer("warp")), "nothing lies in front of the warp of wale 1, .* a layer of weft in front of it"),
        (structure(layer("weft", pattern="x.")), "nothing lies behind the weft of course 1"),
        (structure(layer("warp", diameter=0.6), stitches="kp"), "the warp of wale 1"),
        (structure(*FOUR_LAYERS[1:], loop_length=16.4), "nothing lies behind the weft1 of course 1"),
    ],
    ids=["weft", "warp", "weft in every second course", "warp in rib", "0/90/0 on plain knit"],
)
def test_a_loose_inlay_is_refused_with_what_would_hold_it(spec: CellSpec, message: str) -> None:
    with pytest.raises(InputError, match=rf"fabric\.layers: .*{message}") as error:
        relax_cell(spec)
    assert "falls out of the fabric" in str(error.value)
    stitches = "[k, p], garter, holds a warp" if "the warp" in message else "[kp], rib 1x1, holds a weft"
    assert f"that hold it on this side (fabric.stitches = {stitches} on both sides)" in str(error.value)


@pytest.mark.parametrize(("name", "length"), [("rib", 12.5), ("90/0/90/0", 14.7)])
def test_loops_too_short_are_refused_with_the_shortest_that_works(name: str, length: float) -> None:
    spec = STRUCTURES[name]
    with pytest.raises(InputError, match=f"fabric.loop_length = {length} mm is too short") as error:
        relax_cell(replace(spec, loop_length=length))
    shortest = float(re.findall(r"a longer loop, such as ([\d.]+) mm", str(error.value))[0])
    assert length < shortest < spec.loop_length
    assert relax_cell(replace(spec, loop_length=shortest)).deepest < 5e-3
    with pytest.raises(LockedLoopError):
        _relax_stepwise(replace(spec, loop_length=0.97 * shortest), 1.0)


@pytest.mark.parametrize("name", ["jersey", "rib", "rib with weft", "garter", "seed", "90/0/90/0"])
def test_the_fabric_seen_from_the_back_is_the_same(name: str) -> None:
    """All knit stitches purl and the layers in reverse order: the mirrored cell."""
    cell, spec = relaxed_structure(name), STRUCTURES[name]
    stitches = tuple(tuple(-side for side in row) for row in spec.stitches)
    mirrored = relax_cell(replace(spec, stitches=stitches, layers=spec.layers[::-1]))
    assert mirrored.faces == pytest.approx(tuple(-z for z in cell.faces[::-1]), abs=2e-3)
    assert_alike(cell, mirrored)


def test_rib_looks_the_same_from_both_sides() -> None:
    """Turned about the wale, knit wales are purl ones: the mirrored curve, moved by a wale, is the curve."""
    spec, (curve,) = STRUCTURES["rib"], relaxed_structure("rib").of("knit")
    half = len(curve.points) // 2
    moved = np.roll(MIRROR * curve.points, -half, axis=0)
    moved[:, 0] -= spec.wale
    moved[half:, 0] += 2.0 * spec.wale
    assert np.abs(moved - curve.points).max() < 0.02 * spec.knit_diameter


@pytest.mark.parametrize(
    ("single", "doubled"),
    [
        ("biaxial", structure(layer("warp", pattern="xx"), layer("weft", pattern="xx"))),
        ("jersey", structure(stitches="kk/kk")),
        ("rib", structure(stitches="kpkp")),
        ("rib with weft", structure(replace(THIN_WEFT, pattern=(True, True)), stitches="kp/kp")),
        ("garter", structure(stitches="kk/pp")),
        ("seed", structure(stitches="kpkp/pkpk")),
    ],
)
def test_a_doubled_repeat_changes_nothing(single: str, doubled: CellSpec) -> None:
    assert_alike(relaxed_structure(single), relax_cell(doubled))
