"""State of rest of yarns: read in the middle of a specimen, told as numbers, rows and one line, kept by checkpoints."""

import json
import math

import numpy as np
import pytest

from knittest.base.history import (
    InitialEquilibrium,
    equilibrium_line,
    equilibrium_numbers,
    equilibrium_rows,
    with_common_names,
)
from knittest.config.loading import resolve
from knittest.fabric.cell import CellSpec, Munden
from knittest.models.chains import Chain, build_chains
from knittest.models.crossings import initial_equilibrium
from knittest.models.yarn_model import YarnModel
from knittest.pose import YarnContact, round_section

SECTION = round_section(modulus=2e3, diameter=0.5, density=1.5e-3)
REST = InitialEquilibrium(0.2, 2.2, 0.004, {"warp-weft": 0.4, "knit-knit": 0.1})


def grid(draw_in: float = 0.0) -> YarnModel:
    """Loops' yarns along x over warps along y, 0.01 mm into each other, crossing at x, y of -4, 0 and 4 mm; the outer
    ones stick out by 3 mm; the loops' yarn in the middle is drawn in.
    """
    s = np.linspace(-6.0, 6.0, 25)[:, None]
    chains = []
    for part, along, height in ((0, [0.0, 1.0, 0.0], 0.0), (2, [1.0, 0.0, 0.0], 0.49)):
        across = np.array(along)[[1, 0, 2]]
        for at in (-4.0, 0.0, 4.0):
            lift = np.where(np.abs(s) > 5.0, 3.0, 0.0) * [0.0, 0.0, 1.0]
            points = s * along + at * across + lift + [0.0, 0.0, height]
            chains.append(Chain(points, SECTION, part, loop_shortening=draw_in if at == 0.0 else 0.0))
    contact = YarnContact(normal=50.0, tangential=0.0, friction=0.0, damping=0.0)
    model = build_chains(chains, ("warp", "weft", "knit"), contact)
    model.prepare()
    return model


def test_state_of_rest_is_that_of_the_middle():
    """Crossings at the edge bear five times as much, and yarns stick out there: neither counts."""
    model = grid(0.01)
    contacts, n = model.tracker.contacts, model.tracker.count
    place = model.nodes.position[:2, contacts.piece[0, :n]]
    share = np.where(np.abs(place).max(axis=0) < 1.0, 0.3, 1.5)
    assert n >= 9 and (share == 0.3).sum() == 1
    offset = contacts.offset[:, :n]
    contacts.force[:, :n] = share * offset / np.linalg.norm(offset, axis=0)
    found = initial_equilibrium(model, 0.02)
    assert found is not None and found.residual == 0.02
    assert dict(found.normal_force) == {"warp-knit": pytest.approx(0.3)}
    assert found.thickness == pytest.approx(0.99)
    assert found.tension == pytest.approx(SECTION.axial * 0.01 / 0.99, rel=1e-9)


def test_shells_have_none():
    assert initial_equilibrium(object(), 0.0) is None  # type: ignore[arg-type]


def test_numbers_rows_and_the_line_say_the_same():
    numbers = equilibrium_numbers(REST, 4.0, 16.3, 0.01)
    assert numbers["out_of_balance_pct"] == pytest.approx(0.4) and numbers["loop_shortening_pct"] == 1.0
    rows = dict(equilibrium_rows(numbers))
    assert rows["mean normal force of crossings"] == "knit-knit 0.1, warp-weft 0.4 N"
    assert rows["Munden's Kc"] == "4.00 (relaxed plain knits: 5 to 5.3)"
    assert rows["residual contact-force imbalance"] == "0.4 %"
    assert equilibrium_line(numbers) == "thickness 2.20 mm, loop tension 0.2 N"


@pytest.mark.parametrize(("share", "creeps"), [(0.029, False), (0.031, True)])
def test_yarns_that_still_creep_say_what_of_their_rest_is_not_to_be_read(share, creeps):
    numbers = equilibrium_numbers(InitialEquilibrium(0.1, 2.0, share), 4.0, 16.0)
    told = dict(equilibrium_rows(numbers))["residual contact-force imbalance"]
    assert told.startswith(f"{100.0 * share:.2g} %")
    assert ("loop tension and forces of crossings are accurate to about 10 %" in told) == creeps
    assert equilibrium_line(numbers).endswith("N (accurate to about 10 %)") == creeps


def test_slack_loops_and_a_missing_equilibrium_are_named():
    numbers = equilibrium_numbers(InitialEquilibrium(-0.1, 2.0, 3.6), 4.0, 16.0)
    line, rows = equilibrium_line(numbers), dict(equilibrium_rows(numbers))
    assert "negative: the loops are slack; no equilibrium was found" in line and "accurate" not in line
    assert rows["loop tension"] == "-0.1 N (negative: the loops are slack)"
    assert "not reliable" in rows["residual contact-force imbalance"]


def test_what_was_not_settled_says_so_and_no_draw_in_is_none():
    numbers = equilibrium_numbers(InitialEquilibrium(0.0, 2.2, math.nan), 4.0, 16.3)
    rows = dict(equilibrium_rows(json.loads(json.dumps(numbers).replace("NaN", "null"))))
    assert rows["residual contact-force imbalance"] == "not computed: yarns start without contact forces"
    assert equilibrium_line(equilibrium_numbers(InitialEquilibrium(0.0, 2.2, math.nan), 4.0, 16.3)).endswith(
        "N (equilibrium not computed)"
    )
    assert "loop shortening" not in rows and "mean normal force of crossings" not in rows


def test_an_ensemble_has_the_names_of_all_and_shows_means():
    one, other = (
        equilibrium_numbers(REST, 4.0, 16.0),
        equilibrium_numbers(InitialEquilibrium(0.1, 2.0, 0.0, {"warp-weft": 0.2}), 4.0, 16.0),
    )
    alike = with_common_names([one, other])
    assert alike[1]["normal_force_n.knit-knit"] == 0.0 and list(alike[0]) == list(alike[1])
    spread = {k: {"mean": (alike[0][k] + alike[1][k]) / 2, "sd": 0.0, "values": []} for k in one}
    assert dict(equilibrium_rows(spread))["mean normal force of crossings"] == "knit-knit 0.05, warp-weft 0.3 N"


def test_constants_of_munden_are_those_of_the_yarn_that_is_in_the_loop():
    spec = CellSpec.of(resolve(variant="1").fabric)
    free, drawn = Munden.of(spec), Munden.of(spec, 0.02)
    assert free.courses == pytest.approx(spec.loop_length / spec.course)
    assert drawn.courses == pytest.approx(0.98 * free.courses)
    assert drawn.stitches == pytest.approx(0.98**2 * free.stitches)
