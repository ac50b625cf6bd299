"""Numbers that go wrong stop a run within one chunk, with the entity and the time; each is made to go wrong here."""

import json
import re
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest
from restart_cases import MACRO

from knittest.base.errors import NumericalError
from knittest.cli.main import run as knittest
from knittest.config.loading import resolve
from knittest.export.files import read_arrays
from knittest.models import contact_tracker
from knittest.runs.specimen import prepare, run_specimen
from knittest.solve import guards
from knittest.solve.guards import check_motion
from knittest.solve.simulation import simulate
from knittest.solve.state import Observer

MESO = [
    "rig.width=10", "rig.gauge_length=10", "solver.ramp=0.1", "output.frames=1",
    "fabric.knitting.degree_of_set.value=1",
]  # fmt: skip
#: chunks before something goes wrong
QUIET = 30


def posed(scale):
    run = resolve(variant="2", scale=scale, preset="quick", direction="warp", sets=MESO if scale == "meso" else [])
    prepared = prepare(run)
    if scale == "meso":
        prepared.model.prestressed = False  # the rest before the test has no chunks to look at
    return run, prepared


class Watcher(Observer):
    """Only notes the state of a failure."""

    saved = None

    def visit_failure(self, take):
        self.saved = take()


def run_until_wrong(scale, spoil, every_chunk=False):
    """Call ``spoil(model)`` after the chunk number :data:`QUIET`; returns the message and what was seen."""
    run, prepared = posed(scale)
    model, watcher = prepared.model, Watcher()
    advance, calls = model.advance, []

    def spoiling(steps, time, dt, motions, tally, scratch):
        advance(steps, time, dt, motions, tally, scratch)
        if steps > 1:
            calls.append(time + steps * dt)
            if len(calls) == QUIET or (every_chunk and len(calls) > QUIET):
                spoil(model)

    model.advance = spoiling
    with pytest.raises(NumericalError) as caught:
        simulate(model, prepared.rig, run.solver, run.output, watcher)
    chunk = model.chunk * 0.9 * model.critical_step
    return str(caught.value), SimpleNamespace(
        snapshot=watcher.saved, spoilt=calls[QUIET - 1], chunk=chunk, time=watcher.saved.time, calls=len(calls)
    )


def put_nan(model):
    model.nodes.velocity[1, 40] = np.nan


def put_infinity(model):
    model.nodes.position[0, 40] = np.inf


def kick(model):
    """Make a free node in the middle fast."""
    free = np.flatnonzero(model.nodes.inv_mass[: model.n_nodes])
    model.nodes.velocity[2, free[model.n_nodes // 3]] = 1e5


def collapse_beam(model):
    i = int(np.flatnonzero(model.beams.alive)[20])
    model.nodes.position[:, i + 1] = model.nodes.position[:, i] + 1e-4


def collapse_shell(model):
    model.nodes.position[:, model.mesh.cells[33]] = model.nodes.position[:, model.mesh.cells[33][:1]]


def outrun(model):
    model.tracker.speed = 1e4


def pierce(model):
    c = int(np.flatnonzero(model.tracker.contacts.line[: model.tracker.count] == 0.0)[3])
    model.tracker.contacts.offset[:, c] = 1e-3


@pytest.mark.parametrize(
    ("scale", "spoil", "said"),
    [
        ("macro", put_nan, r"not finite at .* node 40 of shell \d+"),
        ("meso", put_nan, r"not finite at .* node 40 of warp yarn 2"),
        ("macro", put_infinity, r"not finite at .* node 40 of shell \d+"),
        ("meso", put_infinity, r"not finite at .* node 40 of warp yarn 2"),
        ("macro", kick, r"diverges at .* node \d+ of shell \d+"),
        ("meso", kick, r"diverges at .* node \d+ of (warp|weft|knit) yarn \d+"),
        ("meso", collapse_beam, r"a beam of warp yarn 1 \(node 20\) has collapsed to 0\.\d % of its length at"),
        ("macro", collapse_shell, r"shell 33 has collapsed to 0\.0 % of its area at"),
        ("meso", outrun, r"node \d+ of .* yarn \d+ moves .* mm in one step"),
        ("meso", pierce, r"yarn \d+ and .* yarn \d+ pass through each other \(node \d+\) at"),
    ],
)
def test_it_stops_in_the_same_chunk(scale, spoil, said):
    message, wrong = run_until_wrong(scale, spoil)
    assert re.search(said, message), message
    assert wrong.calls == QUIET
    assert wrong.time - wrong.spoilt < 1.01 * wrong.chunk
    assert f"{wrong.time:.5f} ms" in message


@pytest.mark.parametrize(("released", "stops"), [(0.0, True), (-5.0, True), (0.9, True), (1.1, False)])
def test_what_a_resting_specimen_lets_go_of_may_move_it(released, stops):
    """Motion may hold twice the work (none here), 20 times the energy at clamp speed, and twice what was released."""
    nodes = SimpleNamespace(position=np.zeros((3, 1)), velocity=np.zeros((3, 1)))
    model = SimpleNamespace(nodes=nodes, n_nodes=1, mass=np.ones(1), name_of=lambda node: "yarn 1")
    run = SimpleNamespace(kinetic=2.4, kinetic_scale=0.02, time=1.0, model=model)
    with pytest.raises(NumericalError, match="diverges") if stops else nullcontext():
        check_motion(run, 0.0, lambda: released)
    run.kinetic = 0.39
    check_motion(run, 0.0, lambda: pytest.fail("asked without need"))


def test_yarns_that_blow_up_while_they_settle_stop_the_run():
    sets = [s for s in MESO if "degree_of_set" not in s]
    run = resolve(variant="2", scale="meso", preset="quick", direction="warp", sets=sets)
    blow_up(run, prepare(run), r"diverged after \d+ steps, first at node \d+ of \w+ yarn \d+")


@pytest.mark.parametrize("scale", ["macro", "meso"])
def test_too_large_a_step_blows_up_and_is_stopped(scale):
    blow_up(*posed(scale), r"(diverges|not finite|collapsed|in one step|critical time step).* (node|shell) \d+")


def blow_up(run, prepared, said):
    prepared.model.critical_step *= 6.0
    with pytest.raises(NumericalError, match=said):
        simulate(prepared.model, prepared.rig, run.solver, run.output)


def test_contacts_that_are_far_too_stiff_for_the_step(monkeypatch):
    def stiffen(model):
        model.law = model.law._replace(normal=400.0 * model.law.normal)

    monkeypatch.setattr(guards, "LEAST_SHARE", 0.9)
    message, _ = run_until_wrong("meso", stiffen)
    assert "limit the critical time step to" in message and "yarn" in message


def test_contacts_that_stiffen_shorten_the_step_and_a_resumed_run_does_the_same():
    """Four hundred times the penalty from 0.02 ms on; a run resumed after it takes the same shorter steps."""
    run, _ = posed("meso")
    run = run.model_copy(update={"output": run.output.model_copy(update={"samples": 200})})
    whole, state = stiffening(run, None)
    resumed, _ = stiffening(run, state)
    assert float(state.state["run/step_share"]) < 0.9
    assert whole.curve["force_n"].tobytes() == resumed.curve["force_n"].tobytes()


def stiffening(run, snapshot):
    """History of the strip whose penalty grows at 0.02 ms, on from ``snapshot``, and the first state after 0.04 ms."""
    prepared = prepare(run)
    model, taken = prepared.model, []
    model.prestressed = False
    soft, step = model.law, model.step

    def stepping(steps, time, *rest):
        model.law = soft._replace(normal=400.0 * soft.normal) if time > 0.02 else soft
        step(steps, time, *rest)

    model.step = stepping

    class Taker(Observer):
        def resume_from(self):
            return snapshot

        def visit(self, take):
            if not taken and take().time > 0.04:
                taken.append(take())

    history, cost = simulate(model, prepared.rig, run.solver, run.output, Taker())
    assert cost.time_step < run.solver.safety * model.critical_step
    return history, taken[0] if taken else snapshot


def test_energy_from_nothing_is_stopped_before_it_blows_up():
    def push(model):
        model.nodes.velocity[:] *= 1.1

    message, wrong = run_until_wrong("macro", push, every_chunk=True)
    assert "energy is created" in message and "the energy balance error" in message
    assert wrong.snapshot.state["run/kinetic"] > 0.0


def test_a_failed_run_leaves_its_state(tmp_path, monkeypatch, capsys):
    from knittest.models.fabric_model import FabricModel

    advance = FabricModel.advance

    def spoiling(self, steps, time, *rest):
        advance(self, steps, time, *rest)
        if self.n_nodes > 50 and time > 0.2:
            put_nan(self)

    monkeypatch.setattr(FabricModel, "advance", spoiling)
    folder = tmp_path / "run"
    assert knittest(["tensile", *MACRO, "--quiet", "--threads", "1", "--out", str(folder)]) == 3
    assert "not finite" in capsys.readouterr().err
    state = read_arrays(folder / "checkpoint-failed.npz")
    assert np.isnan(state["model/nodes/velocity"]).any() and state["run/time"] > 0.2
    ended = json.loads((folder / "manifest.json").read_text())
    assert (ended["status"], ended["exit_code"]) == ("failed", 3)


def test_neighbour_lists_that_overflow_grow_and_give_the_same_bits(monkeypatch):
    run, _ = posed("meso")
    roomy = run_specimen(run).history.curve["force_n"]
    make, sizes = contact_tracker._empty_contacts, []

    def cramped(capacity, group):
        sizes.append(capacity)
        return make(1 if capacity == 64 else capacity, group)

    monkeypatch.setattr(contact_tracker, "_empty_contacts", cramped)
    assert run_specimen(run).history.curve["force_n"].tobytes() == roomy.tobytes()
    assert max(sizes) > 64


def test_healthy_runs_keep_their_distance_from_the_limits():
    """A guard that is near its limit in a good run would stop good runs."""
    run, prepared = posed("meso")
    history, _ = simulate(prepared.model, prepared.rig, run.solver, run.output)
    assert history.first_failure is not None
    assert prepared.model.axial_stiffness.max() > prepared.model.shear_stiffness.max() > 0.0
    assert 0.9 < prepared.model.stable_step()[0] / prepared.model.critical_step < 1.3
