"""Wrap of yarns round each other: closed forms of the determinant, reading of the middle loops, what is said."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_gates import PREPARED, ROWS, history, judged, run_of

from knittest.base.errors import NumericalError
from knittest.base.history import (
    UNIQUE,
    InitialEquilibrium,
    equilibrium_line,
    equilibrium_numbers,
    equilibrium_rows,
    with_common_names,
)
from knittest.laboratory.quality_checks import Span, assess
from knittest.models.chains import Chain, build_chains
from knittest.models.crossings import Curve, initial_equilibrium, least_wrap_ratio, wrap_ratio
from knittest.pose import YarnContact, round_section
from knittest.solve.guards import check_balance
from knittest.solve.state import SimulationCost

SECTION = round_section(modulus=2e3, diameter=0.5, density=1.5e-3)
X, Y, UP = np.eye(3)
APART = 0.49


def curve(height: float, along: np.ndarray, curvature: float = 0.0, speed: float = 1.0, gains: float = 0.0) -> Curve:
    """A curve over the origin that bends upwards by ``curvature``, run through at a ``speed`` that ``gains``."""
    bend = speed**2 * curvature * UP + gains * along
    return Curve((height * UP)[:, None], (speed * along)[:, None], bend[:, None])


def arc(
    radius: float, along: np.ndarray, lowest: float, up: float, place: tuple[float, float] = (0.0, 0.0)
) -> np.ndarray:
    """Points (41, 3) on an arc of 140 deg about ``place``, from its ``lowest`` or (``up`` -1) highest point."""
    turn = np.deg2rad(np.linspace(-70.0, 70.0, 41))[:, None]
    rise = lowest + up * radius * (1.0 - np.cos(turn))
    return np.array([*place, 0.0]) + radius * np.sin(turn) * along + rise * UP


def hooked(radii: tuple[float, float], place: tuple[float, float] = (0.0, 0.0)) -> list[Chain]:
    """Two arcs that hang in each other: the upper one bends down round the lower one, which bends up round it."""
    return [
        Chain(arc(radii[0], X, 0.5 * APART, -1.0, place), SECTION, 1),
        Chain(arc(radii[1], Y, -0.5 * APART, 1.0, place), SECTION, 1),
    ]


def wraps(*chains: Chain) -> float:
    """Least wrap of the loops in the middle of ``chains`` of a warp and loops."""
    model = build_chains(list(chains), ("warp", "knit"), YarnContact(50.0, 0.0, 0.0, 0.0))
    model.prepare()
    found = initial_equilibrium(model)
    assert found is not None
    return found.wrap


@pytest.mark.parametrize("angle", [15.0, 40.0, 90.0])
def test_straight_lines_give_the_square_of_the_sine(angle: float):
    turned = np.cos(np.deg2rad(angle)) * X + np.sin(np.deg2rad(angle)) * Y
    (found,) = wrap_ratio(curve(1.0, X), curve(0.0, turned))
    assert found == pytest.approx(np.sin(np.deg2rad(angle)) ** 2, rel=1e-12)


@pytest.mark.parametrize(("over", "found"), [(-1 / 1.2, 0.5), (1 / 1.2, 1.5), (-1 / 0.6, 0.0), (-1 / 0.5, -0.2)])
def test_an_arc_round_a_rod_is_1_less_distance_over_radius(over: float, found: float):
    """Over the rod 0.6 mm away, bent down round it or up from it; about its own axis it has no one closest point."""
    assert wrap_ratio(curve(0.6, X, over), curve(0.0, Y))[0] == pytest.approx(found, abs=1e-12)
    assert wrap_ratio(curve(0.0, Y), curve(0.6, X, over))[0] == pytest.approx(found, abs=1e-12)


def test_arcs_that_wrap_each_other_give_the_product_however_they_are_run_through():
    """Radii 1.5 and 0.8 mm, 0.6 mm apart, at right angles, (1 - 0.4) (1 - 0.75); leaning by 60 deg, 1/4 less."""
    upper, lower = curve(0.6, X, -1 / 1.5), curve(0.0, Y, 1 / 0.8)
    assert wrap_ratio(upper, lower)[0] == pytest.approx(0.6 * 0.25, rel=1e-12)
    faster = curve(0.6, X, -1 / 1.5, speed=3.0, gains=2.0)
    assert wrap_ratio(faster, curve(0.0, Y, 1 / 0.8, speed=0.2))[0] == pytest.approx(0.6 * 0.25, rel=1e-12)
    leaning = curve(0.0, 0.5 * X + np.sqrt(0.75) * Y, 1 / 0.8)
    assert wrap_ratio(upper, leaning)[0] == pytest.approx(0.6 * 0.25 - 0.25, rel=1e-12)


def test_it_is_the_determinant_of_the_squared_distance_of_two_arcs():
    """Second differences of half the squared distance, along both arcs."""
    upper, lower = curve(0.6, X, -1 / 1.5), curve(0.0, 0.5 * X + np.sqrt(0.75) * Y, 1 / 0.8)
    step = 1e-3

    def half(s: float, t: float) -> float:
        at = [
            one.place[:, 0] + np.sin(k * way) / k * one.along[:, 0] + (1.0 - np.cos(k * way)) / k * UP
            for one, k, way in ((upper, -1 / 1.5, s), (lower, 1 / 0.8, t))
        ]
        return 0.5 * float(np.sum((at[0] - at[1]) ** 2))

    table = np.array([[half(i * step, j * step) for j in (-1, 0, 1)] for i in (-1, 0, 1)]) / step**2
    ss, tt = table[2, 1] - 2 * table[1, 1] + table[0, 1], table[1, 2] - 2 * table[1, 1] + table[1, 0]
    st = 0.25 * (table[2, 2] - table[2, 0] - table[0, 2] + table[0, 0])
    assert wrap_ratio(upper, lower)[0] == pytest.approx(ss * tt - st**2, abs=1e-5)


@pytest.mark.parametrize("radii", [(2.0, 2.0), (1.5, 3.0), (3.0, 1.5)])
def test_loops_of_a_model_give_their_closed_form(radii: tuple[float, float]):
    """Splines of 41 nodes on arcs of 140 deg cut them by a fifteen-hundredth of the radius."""
    assert wraps(*hooked(radii)) == pytest.approx((1 - APART / radii[0]) * (1 - APART / radii[1]), rel=5e-3)


def test_only_loops_that_cross_each_other_in_the_middle_count():
    """Neither tighter ones at the edge, nor a loop round a straight warp, nor legs side by side; without any, none."""
    middle, line = hooked((2.0, 2.0)), np.linspace(-2.0, 2.0, 21)[:, None]
    edge = [one for x in (-9.0, 9.0) for y in (-9.0, 9.0) for one in hooked((1.2, 1.2), (x, y))]
    round_warp = [
        Chain(line * Y + [3.0, 0.0, 0.0], SECTION, 0),
        Chain(arc(1.0, X, APART, -1.0, (3.0, 0.0)), SECTION, 1),
    ]
    legs = [Chain(line * Y + [-3.0 + x, 0.0, 0.0], SECTION, 1) for x in (0.0, APART)]
    expected = (1 - APART / 2.0) ** 2
    assert wraps(*middle, *edge, *round_warp, *legs) == pytest.approx(expected, rel=5e-3)
    assert math.isnan(wraps(*round_warp, *legs))


def test_a_model_without_loops_has_none():
    model = build_chains(hooked((2.0, 2.0)), ("warp", "weft"), YarnContact(50.0, 0.0, 0.0, 0.0))
    model.prepare()
    assert math.isnan(least_wrap_ratio(model, "knit", np.ones(model.n_nodes, np.bool_)))


def rest_of(found: float) -> InitialEquilibrium:
    return InitialEquilibrium(0.2, 2.2, 0.004, {"knit-knit": 0.1}, found)


@pytest.mark.parametrize(("found", "shown", "close"), [(0.038, "0.038", True), (0.14, "0.14", False)])
def test_rows_and_the_line_say_it_and_what_helps_where_loops_snap(found: float, shown: str, close: bool):
    numbers = equilibrium_numbers(rest_of(found), 4.0, 16.3, 0.01)
    assert numbers["loop_wrap"] == found
    told = dict(equilibrium_rows(numbers))["loop wrap ratio"]
    assert told.startswith(f"{shown} (1: straight yarns crossing at a right angle; 0: contact point not unique)")
    assert ("below 0.05 the contact points of loops jump" in told) == close
    assert told.endswith("use less loop shortening (loop_shortening) or a longer loop") == close
    assert equilibrium_line(numbers) == "thickness 2.20 mm, loop tension 0.2 N"


def test_rests_that_were_stored_without_it_are_still_read():
    old = {"tension": 0.2, "thickness": 2.2, "residual": 0.004, "normal_force": {"knit-knit": 0.1}}
    numbers = equilibrium_numbers(InitialEquilibrium(**old), 4.0, 16.3)
    assert "loop_wrap" not in numbers and "loop wrap ratio" not in dict(equilibrium_rows(numbers))
    assert (InitialEquilibrium(**old).warnings, InitialEquilibrium(**old).advice) == ((), "")
    both = with_common_names([numbers, equilibrium_numbers(rest_of(0.2), 4.0, 16.3)])
    unknown = json.loads(json.dumps(both[0]).replace("NaN", "null"))
    assert dict(equilibrium_rows(unknown))["loop wrap ratio"] == "unknown" and "wrap" not in equilibrium_line(unknown)


@pytest.mark.parametrize(("found", "close"), [(UNIQUE - 1e-6, True), (UNIQUE, False), (-0.02, True), (math.nan, False)])
def test_a_run_whose_loops_wrap_closely_is_warned_of_and_not_refused(found: float, close: bool):
    quality = judged(replace(history(), rest=rest_of(found)))
    assert quality.failures == () and len(quality.warnings) == close
    assert not close or quality.warnings[0].startswith(
        f"loop wrap ratio {found:.3g}: below 0.05 the contact points of loops jump"
    )


@pytest.mark.parametrize(
    ("column", "advice"),
    [
        ("kinetic_ratio", "solver.speed="), ("energy_error", "solver.safety="),
        ("damping_mj", "solver.damping="), ("contact_damping_mj", "solver.speed="),
    ],
)  # fmt: skip
def test_loops_that_snap_are_not_sent_to_speed_or_step(column: str, advice: str):
    """The speed that the rules name let one of four such cells pass."""
    whole = history().energies["external_mj"] if column.endswith("_mj") else np.ones(ROWS)
    off = history(**{column: 0.2 * whole})
    (usual,) = judged(replace(off, rest=rest_of(0.137))).failures
    (snapping,) = judged(replace(off, rest=rest_of(0.038))).failures
    assert advice in usual and "wrap" not in usual
    assert "solver." not in snapping and "; loop wrap ratio 0.038: half the time step made" in snapping
    assert snapping.endswith("use less loop shortening (loop_shortening) or a longer loop")


def test_what_helps_is_said_once_where_several_gates_refuse():
    off = history(kinetic_ratio=np.full(ROWS, 0.2), energy_error=np.full(ROWS, 0.2))
    first, second = judged(replace(off, rest=rest_of(0.038))).failures
    assert first.count("longer loop") == 1 and second == "energy error 20.00 % is above 2 %"
    usual = judged(replace(off, rest=rest_of(0.137))).failures
    assert all("--set" in one for one in usual) and "solver." in usual[1]


def test_other_gates_keep_their_advice():
    found = replace(history(), rest=rest_of(0.038))
    (told,) = assess(run_of(), PREPARED, found, SimulationCost(penetration_max=0.5), Span()).failures
    assert told.startswith("penetration over radius") and "rerun with" in told and "wrap" not in told


@pytest.mark.parametrize(("found", "helps"), [(0.038, "longer loop"), (0.137, "solver.speed"), (None, "solver.speed")])
def test_energy_from_nothing_says_what_helps(found: float | None, helps: str):
    row = {"external_mj": 10.0, "balance_error_mj": -1.0, "energy_error": 0.1}
    run = SimpleNamespace(
        energy_rows=[row], kinetic_scale=0.1, time=1.0, model=SimpleNamespace(count_failed=lambda: np.zeros(3)),
        rest=None if found is None else rest_of(found),
    )  # fmt: skip
    with pytest.raises(NumericalError, match=rf"energy is created\); .*{helps}$"):
        check_balance(run)
