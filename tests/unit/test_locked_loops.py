"""Loops that are called locked under a draw-in: by what, and with the largest draw-in that is not."""

from types import SimpleNamespace

import pytest

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.solve import relaxed_cell


def at(draw_in: float, jams: float, restless: float) -> SimpleNamespace:
    """Cell of loops that sink in by 40 % of a radius beyond ``jams``, and find no rest beyond ``restless``."""
    return SimpleNamespace(
        residual=0.12 if draw_in > restless else 0.004, depth=0.4 if draw_in > jams else 0.24, conformity_fault=""
    )


def run_of(draw_in: float) -> Run:
    return resolve(variant="1", test="cell", preset="quick", sets=[f"fabric.knitting.loop_shortening={draw_in}"])


@pytest.mark.parametrize(
    ("jams", "restless", "said", "most"),
    [
        (0.01, 9.0, r"yarns penetrate each other by 40 % of the yarn radius .limit 25 %.", 1.0),
        (9.0, 0.015, r"no equilibrium is found .residual contact-force imbalance 12 %, limit \d+ %.", 1.5),
    ],
)
def test_a_refusal_says_by_what_the_loops_are_called_locked(jams: float, restless: float, said: str, most: float):
    """The draw-in that would do is found to 0.05 %."""
    with pytest.raises(InputError, match=f"loop_shortening = 2 %: the loops lock: {said}; expected at most") as refused:
        relaxed_cell._cell_as_stated(run_of(2.0), lambda share: at(share, jams, restless))
    assert most - 0.05 <= float(str(refused.value).split()[-2]) <= most


def test_loops_without_equilibrium_even_without_shortening_are_not_called_locked():
    with pytest.raises(
        InputError, match=r"loop_length = 14.4 mm: no equilibrium .* even without loop shortening"
    ) as no:
        relaxed_cell._cell_as_stated(run_of(2.0), lambda share: at(share, 9.0, -1.0))
    assert "expected at most" not in str(no.value)


def test_loops_that_sink_in_as_the_gate_of_runs_allows_are_not_called_locked():
    """Whatever touches: 24 % of a radius, of 25."""
    assert relaxed_cell._cell_as_stated(run_of(2.0), lambda share: at(share, 9.0, 9.0)).depth == 0.24
    run = run_of(2.0)
    strict = run.model_copy(update={"solver": run.solver.model_copy(update={"max_penetration": 20.0})})
    with pytest.raises(InputError, match="by 24 % of the yarn radius"):
        relaxed_cell._cell_as_stated(strict, lambda share: at(share, 9.0, 9.0))
