"""A cantilever of yarns turns its sections until it is at rest, with progress, and gives up where nothing improves."""

from types import SimpleNamespace

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.laboratory.cantilever import yarns
from knittest.solve.relax import Relaxation
from knittest.solve.state import Observer


class Shares(Observer):
    """Keeps the shares of progress."""

    def __init__(self) -> None:
        self.heard: list[float] = []

    def settling(self, fraction: float) -> None:
        """Hear a share."""
        self.heard.append(fraction)


def at_rest(monkeypatch, residual) -> tuple[Relaxation, list[float], list[int]]:
    """Relaxation of a strip whose residual is that of each turn, progress, and steps between the turns."""
    asked: list[int] = []
    rubbed: list[int] = []

    class Course:
        dt, overlaps, rubs = 1e-3, None, False
        sections = SimpleNamespace(limited=lambda curvature, most: curvature)

        def __init__(self, *_) -> None:
            self.done = Relaxation()

        def settle(self, steps: int, look=None) -> np.ndarray:
            asked.append(steps)
            return np.zeros(9)

        def judge(self, moments) -> None:
            self.done.residual = residual(len(asked) - 2)
            self.done.converged = self.done.residual < yarns.BALANCED

        def turn(self, *_) -> None:
            pass

        def rub(self) -> None:
            rubbed.append(len(asked) - 2)

        def carried(self) -> float:
            return 1.0

    model = SimpleNamespace(
        state=dict, restore=lambda state: None, fields=dict, position=lambda: np.zeros((1, 3)), n_nodes=1
    )
    mounting = SimpleNamespace(flat=np.zeros((1, 3)), moment=lambda now: 1.0, curvature=lambda now: 1.0)
    for name, value in {
        "_Course": Course, "_mounting": lambda prepared: mounting, "_bend": lambda *_: None,
        "_angle": lambda *_: 40.0, "_tips": lambda *_: [0],
    }.items():  # fmt: skip
        monkeypatch.setattr(yarns, name, value)
    run = resolve(variant="1", scale="meso", test="cantilever", preset="quick", direction="warp")
    prepared = SimpleNamespace(facts={"overhang_mm": 100.0, "width_mm": 25.0}, model=model)
    observer = Shares()
    found = yarns.yarns_to_rest(prepared, run, SimpleNamespace(), observer)
    assert rubbed in ([], [yarns.RUBBING])
    return found.relaxation, observer.heard, asked[2:]


def test_a_strip_that_comes_to_rest_late_gets_the_turns_it_needs(monkeypatch):
    found, shares, steps = at_rest(monkeypatch, lambda turn: 0.5 * 0.9**turn)
    assert found.converged and len(steps) == 44
    assert set(steps) == {yarns.BETWEEN}
    assert (
        shares[0] == pytest.approx(2.0 * yarns.FIRST)
        and shares == sorted(shares)
        and shares[-1] == pytest.approx(1.0, abs=0.02)
    )


def test_a_strip_that_no_turn_improves_is_given_up(monkeypatch):
    found, _, steps = at_rest(monkeypatch, lambda turn: 0.1 if turn < 5 else 0.02)
    assert not found.converged and len(steps) == yarns.RUBBING + yarns.STALLED


def test_turns_are_bounded(monkeypatch):
    found, _, steps = at_rest(monkeypatch, lambda turn: 0.1 - 1e-4 * turn)
    assert not found.converged and len(steps) == yarns.MOST_TURNS
