"""Right interlacing passes; every yarn in a wrong place is named."""

import numpy as np
import pytest
from fabric_cases import points_of, relaxed, start_cell, with_points

from knittest.base.errors import NumericalError
from knittest.fabric.cell import Cell
from knittest.fabric.loop import points_on
from knittest.fabric.topology import check_topology, crossings, stitch_codes


def check(cell: Cell) -> None:
    check_topology(cell, start_cell(cell.spec))


def under_weft(cell: Cell) -> int:
    return sum((c.over, c.under) == (2, 0) for c in crossings(cell))


@pytest.mark.parametrize("crimp", [0.0, 0.006])
@pytest.mark.parametrize("variant", ["V1", "V2"])
def test_plain_knit_passes(variant: str, crimp: float) -> None:
    cell = relaxed(variant, crimp)
    check(cell)
    assert stitch_codes(cell) == {(0, 0): "OUUO"}


def test_slack_arcs_may_dip_behind_the_weft_below() -> None:
    tight, slack = relaxed("V2", 0.0, 12.9), relaxed("V2", 0.0, 13.9)
    assert (under_weft(tight), under_weft(slack)) == (0, 2)
    check(slack)


@pytest.mark.parametrize("shift", [0.9, -0.3])
def test_legs_pushed_through_the_neighbouring_loop(shift: float) -> None:
    """Needle arcs lifted or lowered so that they lie on the wrong side of the next course."""
    cell = relaxed("V1")
    knit = points_of(cell, "knit").copy()
    middle = len(knit) // 2
    knit[middle - 12 : middle + 13, 2] += 2.0 * shift
    if shift < 0:
        knit[:, 2] = -knit[:, 2]
    with pytest.raises(NumericalError, match=r"course 1, wale 1 is not interlaced as its stitches: .*, expected OUUO"):
        check(with_points(cell, "knit", knit))


def test_one_leg_passed_through_another_yarn() -> None:
    cell = relaxed("V1")
    knit = points_of(cell, "knit").copy()
    knit[len(knit) // 2 + 4 : len(knit) // 2 + 16, 2] -= 2.0
    with pytest.raises(NumericalError, match=r"course 1, wale 1 is not interlaced as its stitches: .*, expected OUUO"):
        check(with_points(cell, "knit", knit))


@pytest.mark.parametrize(
    ("system", "height", "message"),
    [
        ("weft", -2.0, r"the weft (of course 1 )?does not lie in front of the (warp|sinker arcs of course 1)"),
        ("weft", 3.0, "the weft of course 1 does not lie behind the legs of course 1"),
        ("warp", -2.0, "the warp of wale 1 does not lie in front of the sinker arcs of course 1"),
        ("warp", 3.0, "the weft does not lie in front of the warp"),
    ],
)
@pytest.mark.parametrize("variant", ["V1", "V2"])
def test_inlay_in_a_wrong_layer(variant: str, system: str, height: float, message: str) -> None:
    cell = relaxed(variant)
    with pytest.raises(NumericalError, match=message):
        check(with_points(cell, system, points_of(cell, system) + np.array([0.0, 0.0, height])))


@pytest.mark.parametrize("variant", ["V1", "V2"])
@pytest.mark.parametrize(
    ("system", "height", "part"), [("weft", 2.5, "behind the legs"), ("warp", -2.5, "in front of the sinker arcs")]
)
def test_inlay_on_the_wrong_side_of_one_strand_only(variant: str, system: str, height: float, part: str) -> None:
    cell = relaxed(variant)
    line = points_on(points_of(cell, system), cell.of(system)[0].period, 400)
    finer = with_points(cell, system, line)
    own = cell.spec.systems.index(system)
    over, under = (0, own) if system == "weft" else (own, 0)
    met = next(c for c in crossings(finer) if (c.over, c.under) == (over, under))
    place = met.under_place if under == own else met.over_place
    line[np.abs(np.arange(400) - place) < 6, 2] += height
    with pytest.raises(NumericalError, match=f"the {system} of .* does not lie {part} of course 1"):
        check(finer)


def test_weft_pulled_behind_a_slack_arc() -> None:
    """The weft behind the dipped sinker arcs just where they cross, in its layer everywhere else."""
    cell = relaxed("V2", 0.0, 13.9)
    weft = points_on(points_of(cell, "weft"), cell.of("weft")[0].period, 400)
    finer = with_points(cell, "weft", weft)
    dips = [weft[int(c.over_place), 0] for c in crossings(finer) if (c.over, c.under) == (2, 0)]
    weft[np.abs(weft[:, :1] - dips).min(axis=1) < 0.05, 2] -= 2.5
    with pytest.raises(NumericalError, match="the weft of course 1 does not lie in front of the sinker arcs"):
        check(finer)
