"""End of a relaxation that only rounding moves: not before the residual has come to its least."""

from knittest.solve.relaxation import STALLED, Relaxation, _Rounding

NOISE, QUIET = 1e-9, 0.5e-9


def told(
    rounding: _Rounding, steps: int, residual: float, force: float = QUIET, acts: bool = True, slowest: float = 0.1
):
    """Answer of ``rounding`` after ``steps``."""
    course = Relaxation(steps, residual=residual, history=[(steps, residual, 0.0, slowest)])
    return rounding.is_only_rounding(course, force, acts)


def test_where_nothing_acts_it_is_rest_at_once() -> None:
    assert told(_Rounding(NOISE), 250, 1.0, acts=False)
    assert not told(_Rounding(NOISE), 250, 1.0, force=2.0 * NOISE, acts=False)


def test_under_a_load_the_residual_must_have_stopped_to_fall() -> None:
    rounding, few = _Rounding(NOISE), STALLED[0]
    assert not told(rounding, 1000, 5e-3)
    assert not told(rounding, 1000 + few - 50, 4.9e-3)
    assert not told(rounding, 1000 + few, 1e-3)  # fell again
    assert not told(rounding, 1000 + 2 * few - 50, 1e-3)
    assert told(rounding, 1000 + 2 * few, 2e-3, force=2.0 * NOISE)  # rounding may be above its bound by now


def test_a_slow_mode_has_its_period_and_an_endless_one_ends() -> None:
    rounding, (few, most) = _Rounding(NOISE), STALLED
    told(rounding, 1000, 1e-3)
    assert not told(rounding, 1000 + few, 1e-3, slowest=1e-3)
    assert told(rounding, 1000 + 6300, 1e-3, slowest=1e-3)
    assert not told(rounding, 1000 + most - 50, 1e-3, slowest=1e-6)
    assert told(rounding, 1000 + most, 1e-3, slowest=1e-6)


def test_a_load_that_is_lost_in_rounding_never_comes_to_rest() -> None:
    rounding = _Rounding(NOISE)
    told(rounding, 1000, 0.02)
    assert not told(rounding, 10**6, 0.02)


def test_before_rounding_is_reached_nothing_has_stalled() -> None:
    assert not told(_Rounding(NOISE), 10**6, 1e-3, force=2.0 * NOISE)
