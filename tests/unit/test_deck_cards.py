"""Cards of a deck and the closed forms behind its materials, without a model."""

import numpy as np
import pytest
from deck_reader import cards_of, curves_of

from knittest.base.errors import InputError
from knittest.export.keywords import KeywordFile, number
from knittest.models.tool import Table, ramp
from knittest.runs.deck.deck_parts import add_curve
from knittest.runs.deck.yarn_sections import cable_law


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (1e20, "1e20"), (-1.23456789e-5, "-1.2346e-5"), (1.23456789e-5, "1.23457e-5"),
        (0.000371258123, "3.71258e-4"), (123456789.25, "123456789"), (0.1, "0.1"), (-141.4213562373095, "-141.42136"),
    ],
)  # fmt: skip
def test_a_number_keeps_the_digits_that_its_columns_hold(value, text):
    assert number(value, 10) == text
    assert float(number(value, 16)) == pytest.approx(value, rel=1e-8, abs=0.0)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_number_that_is_none_is_refused(value):
    with pytest.raises(InputError, match="finite"):
        number(value, 10)


def test_cards_lie_in_their_columns():
    deck = KeywordFile()
    deck.keyword("PART", "a, b")
    deck.card("pid secid mid", 1, None, 3)
    deck.rows("nid:8 x:16", [(7, -0.25)])
    deck.numbers(range(1, 11))
    block = cards_of(deck.text())["PART"][0]
    assert block[:3] == ["a; b", f"{1:>10}{'':10}{3:>10}", f"{7:>8}{'-0.25':>16}"]
    assert block[3:] == ["".join(f"{n:>10}" for n in range(1, 9)), f"{9:>10}{10:>10}"]


def test_a_number_of_an_entity_that_does_not_fit_is_refused():
    with pytest.raises(InputError, match=r"nid = 123456789 .* 8 columns"):
        KeywordFile().card("nid:8", 123456789)


@pytest.mark.parametrize("slack", [0.0, 0.003])
def test_cable_and_beam_together_follow_the_law_beyond_slack(slack):
    """A toe and slack; within slack only the beam's share is left."""
    knee, slope, held = np.array([0.0, 0.004]), np.array([1000.0, 2000.0]), 30.0
    strain, force = cable_law(knee, slope, slack, held, 0.02)
    assert strain[0] == 0.0 and strain[-1] == 0.02 and (np.diff(strain) > 0.0).all() and (force >= 0.0).all()
    for e in np.linspace(slack * 1.04, 0.02, 40):
        law = 1000.0 * max(e - slack, 0.0) + 2000.0 * max(e - slack - 0.004, 0.0)
        assert np.interp(e, strain, force) + held * e == pytest.approx(law, rel=1e-9)
    assert np.interp(0.9 * slack, strain, force) == 0.0


def test_a_curve_goes_on_beyond_the_end_and_moves_as_far_as_its_table():
    """The target lets a curve fall to 0 where it ends."""
    deck, table = KeywordFile(), ramp(0.5, 2.0)
    number_of = add_curve(deck, "velocity", table, 3.0)
    time, value = (np.array(a) for a in curves_of(cards_of(deck.text()))[number_of])
    assert time[0] == 0.0 and time[-1] == pytest.approx(3.03) and value[-1] == 2.0
    inside = np.append(time[time < 3.0], 3.0)
    assert np.trapezoid(np.interp(inside, time, value), inside) == pytest.approx(table.integral(3.0), rel=1e-9)


def test_a_curve_that_jumps_has_rising_times():
    deck = KeywordFile()
    add_curve(deck, "step", Table((0.0, 1.0, 1.0, 2.0), (0.0, 0.0, 5.0, 5.0)), 2.0)
    time, value = curves_of(cards_of(deck.text()))[1]
    assert (np.diff(time) > 0.0).all() and np.interp(1.5, time, value) == 5.0 and np.interp(0.5, time, value) == 0.0
