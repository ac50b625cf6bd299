"""Loops that are called locked under a draw-in: by what, and with the largest draw-in that is not."""

from types import SimpleNamespace

import pytest

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.solve import settled_cell


def at(draw_in: float, free: float, jams: float, restless: float) -> SimpleNamespace:
    """Cell of loops that touch at ``free`` places, one more beyond ``jams``, and no rest beyond ``restless``."""
    return SimpleNamespace(
        residual=0.12 if draw_in > restless else 0.004, touching=free + (draw_in > jams), conforming=""
    )


def run_of(draw_in: float) -> Run:
    return resolve(variant="1", test="cell", preset="quick", sets=[f"fabric.knitting.draw_in={draw_in}"])


@pytest.mark.parametrize(
    ("jams", "restless", "said", "most"),
    [
        (0.01, 9.0, "they touch each other at 3 places a cell and cross at 2", 1.0),
        (9.0, 0.015, r"nothing comes to rest \(forces out of balance 12 % of those of contacts\)", 1.5),
    ],
)
def test_a_refusal_says_by_what_the_loops_are_called_locked(jams: float, restless: float, said: str, most: float):
    """The draw-in that would do is found to 0.05 %."""
    with pytest.raises(InputError, match=f"draw_in = 2 %: the loops lock, {said}; expected at most") as refused:
        settled_cell._as_stated(run_of(2.0), lambda share: at(share, 2.0, jams, restless))
    assert most - 0.05 <= float(str(refused.value).split()[-2]) <= most


def test_loops_that_touch_as_often_free_of_draw_in_are_not_called_locked():
    assert settled_cell._as_stated(run_of(2.0), lambda share: at(share, 4.0, 9.0, 9.0)).touching == 4.0
    with pytest.raises(InputError, match="at 5 places a cell"):
        settled_cell._as_stated(run_of(2.0), lambda share: at(share, 4.0, 0.01, 9.0))
