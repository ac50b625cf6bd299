"""The state of a simulation at any chunk, put into a freshly built model, goes on to the same bits."""

import numpy as np
import pytest
from fabric_cases import ellipses

from knittest.config.loading import resolve
from knittest.runs.specimen import prepare
from knittest.solve.simulation import simulate
from knittest.solve.state import Observer

SETS = {
    "macro": ["solver.speed=1", "output.frames=3", "output.samples=40"],
    "meso": [
        "rig.width=10", "rig.gauge_length=10", "solver.ramp=0.1", "solver.speed=1", "output.frames=3",
        "output.samples=41",
    ],
}  # fmt: skip
SETS["ellipses"] = [*SETS["meso"], *(f"{field}={value}" for field, value in ellipses().items())]


class Keeper(Observer):
    """Takes a snapshot at the looks ``at``; goes on from ``snapshot``."""

    def __init__(self, at=(), snapshot=None):
        self.at, self.snapshot, self.looks, self.taken, self.went_on = set(at), snapshot, 0, [], []

    def resume_from(self):
        return self.snapshot

    def report_resume(self, fraction, time_ms):
        self.went_on.append((fraction, time_ms))

    def visit(self, take):
        self.looks += 1
        if self.looks in self.at:
            self.taken.append(take())

    def visit_failure(self, take):
        raise AssertionError("the numbers went wrong")


def simulated(case, keeper):
    scale = "macro" if case == "macro" else "meso"
    run = resolve(variant="2", scale=scale, preset="quick", direction="warp", sets=SETS[case])
    prepared = prepare(run)
    history, cost = simulate(prepared.model, prepared.rig, run.solver, run.output, keeper)
    return history, cost.steps


def bits(history):
    arrays = [*history.curve.values(), *history.energies.values(), *history.contacts.values(), history.tool_force]
    arrays += [
        a for f in history.frames for a in (f.position, *f.fields.values(), np.array([f.time, f.coordinate, f.force]))
    ]
    return [array.tobytes() for array in arrays], history.first_failure, str(history.rest)


@pytest.mark.parametrize("case", list(SETS))
def test_it_goes_on_to_the_same_bits_from_anywhere(case):
    alone = Keeper()
    history, steps = simulated(case, alone)
    watched = Keeper(at=[*np.linspace(1, alone.looks, 6, dtype=int), alone.looks - 1])
    assert bits(simulated(case, watched)[0]) == bits(history)  # looking changes nothing
    assert sum(s.state["run/eroded"] > 0.0 for s in watched.taken) >= 1, "none of them after the first failure"
    assert any(s.state["run/row_steps"] > 0 for s in watched.taken), "none of them inside a row"
    for snapshot in watched.taken:
        assert (bits(simulated(case, Keeper(snapshot=snapshot))[0]), steps) == (bits(history), steps)


def test_the_forces_of_tools_are_averaged_across_a_restart():
    """Plates that move and press: their positions, the springs of their contacts and the sums of their forces."""
    sets = ["rig.length=60", "rig.plate_length=30", "rig.travel=0.5", "output.frames=3", "output.samples=41"]
    sets.append("solver.safety=0.5")  # so many steps that rows lie in the averaged part of so short a pull
    run = resolve(variant="1", scale="macro", preset="quick", test="friction", direction="warp", sets=sets)

    def pulled(keeper):
        prepared = prepare(run)
        return simulate(prepared.model, prepared.rig, run.solver, run.output, keeper)[0]

    alone = Keeper()
    history = pulled(alone)
    assert history.tool_force.sum(axis=1) == pytest.approx([2000.0, 2000.0], rel=0.01)
    watched = Keeper(at=[alone.looks // 2, alone.looks - 2, alone.looks - 1])
    pulled(watched)
    for snapshot in watched.taken:
        keeper = Keeper(snapshot=snapshot)
        assert bits(pulled(keeper)) == bits(history)
        ((fraction, time_ms),) = keeper.went_on
        assert time_ms == snapshot.time and 0.4 < fraction <= 1.0
    assert not alone.went_on
