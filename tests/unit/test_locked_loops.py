"""Loops that are called locked under a draw-in: by what, and with the largest draw-in that is not."""

from types import SimpleNamespace

import pytest

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.solve import settled_cell


def at(draw_in: float, jams: float, restless: float) -> SimpleNamespace:
    """Cell of loops whose yarn takes all that is drawn in beyond ``jams``, and finds no rest beyond ``restless``."""
    stretch = 1e-4 + 0.1 * draw_in + max(draw_in - jams, 0.0)
    return SimpleNamespace(residual=0.12 if draw_in > restless else 0.004, stretch=stretch, conforming="")


def run_of(draw_in: float) -> Run:
    return resolve(variant="1", test="cell", preset="quick", sets=[f"fabric.knitting.draw_in={draw_in}"])


@pytest.mark.parametrize(
    ("jams", "restless", "said", "most"),
    [
        (0.01, 9.0, "their yarn stretches by 60 % of it", 1.0 / 0.6),
        (9.0, 0.015, r"nothing comes to rest \(forces out of balance 12 % of those of contacts\)", 1.5),
    ],
)
def test_a_refusal_says_by_what_the_loops_are_called_locked(jams: float, restless: float, said: str, most: float):
    """The draw-in that would do is found to 0.05 %: with 0.1 d + d - 1 % = 0.5 d at 1.67 %."""
    with pytest.raises(InputError, match=f"draw_in = 2 %: the loops lock, {said}; expected at most") as refused:
        settled_cell._as_stated(run_of(2.0), lambda share: at(share, jams, restless))
    assert most - 0.05 <= float(str(refused.value).split()[-2]) <= most


def test_loops_whose_yarn_hardly_stretches_are_not_called_locked():
    """However often their legs touch; what they stretch by without a draw-in does not count."""
    assert settled_cell._as_stated(run_of(2.0), lambda share: at(share, 9.0, 9.0)).stretch == pytest.approx(2.1e-3)
    assert settled_cell._as_stated(run_of(0.01), lambda share: at(share, 9.0, 9.0)).stretch > 1e-4
    assert settled_cell._as_stated(run_of(0.0), lambda share: at(share, 9.0, 9.0)).stretch == pytest.approx(1e-4)
