"""Right interlacing passes; every yarn in a wrong place is named."""

from dataclasses import replace

import numpy as np
import pytest
from fabric_cases import relaxed

from knittest.base.errors import NumericalError
from knittest.fabric.cell import Cell
from knittest.fabric.loop import points_on
from knittest.fabric.topology import KNIT_CODE, check_topology, crossings, knit_code


def under_weft(cell: Cell) -> int:
    return sum((c.over, c.under) == (2, 0) for c in crossings(cell))


@pytest.mark.parametrize("crimp", [0.0, 0.006])
@pytest.mark.parametrize("variant", ["V1", "V2"])
def test_plain_knit_passes(variant: str, crimp: float) -> None:
    cell = relaxed(variant, crimp)
    check_topology(cell)
    code = knit_code(cell)
    assert KNIT_CODE in [code[k:] + code[:k] for k in range(len(code))]


def test_slack_arcs_may_dip_behind_the_weft_below() -> None:
    tight, slack = relaxed("V2", 0.0, 12.9), relaxed("V2", 0.0, 13.9)
    assert (under_weft(tight), under_weft(slack)) == (0, 2)
    check_topology(slack)


@pytest.mark.parametrize("shift", [0.9, -0.3])
def test_legs_pushed_through_the_neighbouring_loop(shift: float) -> None:
    """Needle arcs lifted or lowered so that they lie on the wrong side of the next course."""
    cell = relaxed("V1")
    knit = cell.knit.copy()
    middle = len(knit) // 2
    knit[middle - 12 : middle + 13, 2] += 2.0 * shift
    if shift < 0:
        knit[:, 2] = -knit[:, 2]
    with pytest.raises(NumericalError, match="knitting yarn is not interlaced"):
        check_topology(replace(cell, knit=knit))


def test_one_leg_passed_through_another_yarn() -> None:
    cell = relaxed("V1")
    knit = cell.knit.copy()
    knit[len(knit) // 2 + 4 : len(knit) // 2 + 16, 2] -= 2.0
    with pytest.raises(NumericalError, match="knitting yarn is not interlaced"):
        check_topology(replace(cell, knit=knit))


@pytest.mark.parametrize(
    ("system", "height", "message"),
    [
        ("weft", -2.0, "the weft does not lie in front of the warp"),
        ("weft", 3.0, "the weft does not lie behind the legs"),
        ("warp", -2.0, "the warp does not lie in front of the sinker arcs"),
        ("warp", 3.0, "the weft does not lie in front of the warp"),
    ],
)
@pytest.mark.parametrize("variant", ["V1", "V2"])
def test_inlay_in_a_wrong_layer(variant: str, system: str, height: float, message: str) -> None:
    cell = relaxed(variant)
    moved = getattr(cell, system) + np.array([0.0, 0.0, height])
    with pytest.raises(NumericalError, match=message):
        check_topology(replace(cell, **{system: moved}))


def test_weft_pulled_behind_a_slack_arc() -> None:
    """The weft behind the dipped sinker arcs just where they cross, in its layer everywhere else."""
    cell = relaxed("V2", 0.0, 13.9)
    weft = points_on(cell.weft, cell.periods["weft"], 400)
    finer = replace(cell, weft=weft)
    dips = [weft[int(c.over_place), 0] for c in crossings(finer) if (c.over, c.under) == (2, 0)]
    weft[np.abs(weft[:, :1] - dips).min(axis=1) < 0.05, 2] -= 2.5
    with pytest.raises(NumericalError, match="the weft lies behind loops of another course"):
        check_topology(finer)
