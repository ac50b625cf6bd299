"""Threads of a run follow how long its steps take."""

import numba
import pytest

from knittest.solve.pace import PAUSE, SHARE, TRIES, Pace


class Machine:
    """A clock, and the seconds ``takes`` of a step by threads."""

    def __init__(self, **takes: float) -> None:
        self.time, self.takes = 0.0, {int(k[1:]): v for k, v in takes.items()}

    def __call__(self) -> float:
        return self.time


def run(machine: Machine, pace: Pace, chunks: int, steps: int = 20) -> list[int]:
    """Threads of each of ``chunks``."""
    seen: list[int] = []

    def step(count: int) -> None:
        seen.append(numba.get_num_threads())
        machine.time += count * machine.takes[seen[-1]]

    for _ in range(chunks):
        pace.advance(step, steps)
    return seen


@pytest.fixture(autouse=True)
def any_number(monkeypatch):
    """Numba takes any number of threads, also on a machine of two cores."""
    from knittest.kernels import threading

    set_to = [7]
    monkeypatch.setattr(threading.config, "NUMBA_NUM_THREADS", 16)
    monkeypatch.setattr(numba, "set_num_threads", lambda n: set_to.__setitem__(0, n))
    monkeypatch.setattr(numba, "get_num_threads", lambda: set_to[0])


def test_the_fastest_is_taken_after_each_was_tried():
    machine = Machine(_1=4e-3, _2=2.5e-3, _4=1.5e-3)
    seen = run(machine, Pace(4, machine), 12)
    assert seen == [1] * TRIES + [2] * TRIES + [4] * TRIES + [4] * 3


def test_fewer_threads_are_taken_where_more_bring_little():
    machine = Machine(_1=4e-3, _2=2.0e-3, _4=1.9e-3)
    assert run(machine, Pace(4, machine), 10)[-1] == 2


def test_threads_that_wait_for_their_cores_are_tried_once_and_left():
    machine = Machine(_1=1e-3, _2=8e-3, _4=15e-3)
    assert run(machine, Pace(4, machine), 8) == [1, 1, 1, 2, 4, 1, 1, 1]


def test_it_is_tried_again_when_the_machine_has_changed_and_costs_little():
    machine = Machine(_1=2e-3, _2=16e-3)
    pace = Pace(2, machine)
    run(machine, pace, TRIES + 1)
    spent = machine.time
    machine.takes[2] = 0.5e-3
    seen = run(machine, pace, 1)
    while seen[-1] == 1 and machine.time < 100.0:
        seen += run(machine, pace, 1)
    assert max(PAUSE, spent / SHARE) <= machine.time - spent < max(PAUSE, spent / SHARE) + 0.2
    assert run(machine, pace, TRIES + 3)[-1] == 2
    assert pace.usual_threads == 1


def test_chunks_of_other_lengths_are_compared_by_the_step():
    machine = Machine(_1=3e-3, _2=2e-3)
    pace = Pace(2, machine)
    run(machine, pace, TRIES, steps=5)
    assert run(machine, pace, TRIES + 1)[-1] == 2


def test_a_single_step_is_no_trial():
    machine = Machine(_1=1e-3, _4=1e-3)
    assert run(machine, Pace(4, machine), 3, steps=1) == [4, 4, 4]


def test_one_thread_is_one():
    machine = Machine(_1=1e-3)
    pace = Pace(1, machine)
    assert run(machine, pace, 5) == [1] * 5
    assert pace.usual_threads == 1
