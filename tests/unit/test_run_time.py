"""The time that knittest check tells: steps expected until a strip fails, and the time of steps that were run."""

from types import SimpleNamespace

import pytest

from knittest.cli.main import run as command
from knittest.config.loading import resolve
from knittest.laboratory.tensile.test import failure_strain
from knittest.runs.preflight import model
from knittest.runs.preflight.model import Estimate, expected_share
from knittest.runs.specimen import SERIAL_BELOW, prepare, threads_for


def shells(*sets: str, test: str = "tensile", **asked):
    direction = {"direction": "warp"} if test == "tensile" else {}
    return resolve(test=test, variant="1", scale="macro", preset="quick", sets=sets, **direction, **asked)


def lasting(duration: float) -> SimpleNamespace:
    """A prepared model whose rig moves so long [ms]."""
    return SimpleNamespace(rig=SimpleNamespace(duration=duration))


def test_a_strip_of_shells_is_expected_to_fail_at_its_fracture_strain():
    """200 mm at 0.5 m/s to 4 %: 0.25 ms of ramp and 16 ms; 1.6 % is reached at 0.25 + 6.4 ms."""
    run = shells()
    assert prepare(run).rig.duration == pytest.approx(16.25)
    assert expected_share(run, prepare(run)) == pytest.approx((0.25 + 6.4) / 16.25)
    assert expected_share(shells("rig.max_strain=1.61"), lasting(6.69)) == pytest.approx(6.65 / 6.69, abs=1e-3)


def test_a_strip_of_yarns_fails_with_its_last_yarns():
    """Table 1: 1.00 ± 0.15 %, and the wave of 0.6 % is pulled straight before; 0.2 % of slack comes to it."""
    run = resolve(variant="1", scale="meso", parameters="as-measured", direction="weft")
    assert failure_strain(run) == pytest.approx(1.00 + 2 * 0.15 + 0.6)
    loose = resolve(
        variant="1", scale="meso", parameters="as-measured", direction="weft",
        sets=["fabric.reinforcing.slack.weft=0.2", "fabric.reinforcing.slack.warp=1"],
    )  # fmt: skip
    assert failure_strain(loose) == pytest.approx(2.1)
    assert expected_share(resolve(variant="1", scale="meso", sets=["rig.max_strain=1.2"]), lasting(1.0)) == 1.0


def test_a_test_that_nothing_ends_takes_all_its_steps_and_small_models_one_thread():
    assert expected_share(shells(test="picture-frame"), lasting(3.0)) == 1.0
    assert threads_for(SERIAL_BELOW - 1) == 1 and threads_for(SERIAL_BELOW) >= 1


def test_seconds_are_the_sum_of_the_stages_that_are_printed():
    one = Estimate(1000, 4000, 1e-3, 200, 2, 3, 2.0, rest_s=0.5, mounting_steps=1500, growth=2.0, may_restart=True)
    assert list(one.stages.values()) == [2.0, 0.5, 1.5, 2.0] and one.specimens_s == 18.0
    assert one.seconds == one.as_json()["seconds"] == 22.0 and one.as_json()["steps_at_most"] == 4000
    assert one.text() == (
        "about 22 s on 2 threads: 3 specimens x (geometry 2 s, initial equilibrium 0.5 s, relaxation after mounting "
        "1.5 s (at most 1500 steps), test 2 s (1000 steps of 1 ms x 2, from 200 steps)), program start, pictures and "
        "report 4 s; a restart at a lower speed comes on top"
    )
    assert Estimate(1, 1, 1.0, 1, 1, 1, 0.0, compiled_s=120.0).text().endswith("; kernels: 2 min, now in the cache")


@pytest.mark.parametrize(("seconds", "text"), [(89.0, "89 s"), (91.0, "1.5 min"), (5500.0, "1.5 h")])
def test_units_of_durations_are_readable(seconds, text):
    assert model.duration_text(seconds) == text


def test_a_frame_of_yarns_has_all_its_stages():
    """Relaxation before the test and after the mounting, and steps that take longer as contacts move."""
    run = resolve(test="picture-frame", variant="1", scale="meso", preset="quick", sets=["rig.side=20"])
    found = model.estimate(run, prepare(run), 0.1)
    assert found is not None and found.growth > 1.0 and found.mounting_steps == 20000
    assert all(seconds > 0.0 for seconds in found.stages.values())
    assert model.estimate(shells(), prepare(shells())).growth == 1.0


class Ticking:
    """A rig whose samples come every 40 steps of 0.5 ms simulated; each takes 0.1 s by the clock."""

    duration, coordinate, force, mounted_at, averaged_from, marks, locks = 1e9, "x", "f", 0.0, 1e9, (), False
    locked_share = 1.0

    def is_finished(self, force: float, peak: float, broken: bool) -> bool:
        return broken


def timed(monkeypatch, seconds: float, broken_at: int = 10**9) -> model._TimedRig:
    """Estimate when each sample takes ``seconds`` of wall time and the specimen fails at sample ``broken_at``."""
    now = [0.0]
    monkeypatch.setattr(model, "clock", SimpleNamespace(perf_counter=lambda: now[0]))
    brief = model._TimedRig(Ticking())
    brief.step = 0.5
    for k in range(1, 1000):
        now[0] += seconds
        model._Stopwatch(brief.times).progress(0.0, 20.0 * k, 0.0, 0.0)
        if brief.is_finished(0.0, 0.0, k >= broken_at):
            return brief
    raise AssertionError("never over")


@pytest.mark.parametrize(
    ("seconds", "steps"),
    [(0.1, 200), (0.001, 20000), (0.4, 120), (20.0, 40)],  # half a second; a hundred steps; no more than ten seconds
)
def test_enough_steps_and_seconds_are_timed_but_no_more(monkeypatch, seconds, steps):
    brief = timed(monkeypatch, seconds)
    assert brief.timed == steps and brief.step_s == pytest.approx(seconds / 40)


def test_what_lies_before_the_first_step_is_told_apart_and_a_failure_ends_the_timing(monkeypatch):
    """The first sample is taken after 7 s and 40 steps of 0.1 s in all."""
    brief = timed(monkeypatch, 0.1)
    assert brief.before(brief.times[0][1] - 7.1) == pytest.approx(7.0)
    assert brief.before(brief.times[0][1]) == 0.0
    assert timed(monkeypatch, 0.001, broken_at=5).timed == 160


def test_of_a_test_in_static_equilibrium_no_time_is_told(capsys):
    assert (
        command(
            ["check", "cantilever", "--variant", "1", "--scale", "macro", "--preset", "quick", "--direction", "warp"]
        )
        == 0
    )
    assert "  time                   no estimate: the number of steps" in capsys.readouterr().out


def test_the_estimate_is_that_of_the_run():
    """Steps within 3 % of those that the run takes; its time hangs on what else the machine does."""
    from knittest.runs.specimen import run_specimen

    run = shells()
    found = model.estimate(run, prepare(run))
    assert found is not None and found.steps_timed >= 100 and found.threads == 1 and found.seconds_per_step > 0.0
    assert found.steps_expected == pytest.approx(run_specimen(run).cost.steps, rel=0.03)
    assert found.steps_at_most > 2 * found.steps_expected


def test_steps_are_timed_however_many_a_run_has():
    """A thousandth of the step: rows of the run itself would have a thousand times its steps."""
    run = shells("solver.safety=1e-6")
    found = model.estimate(run, prepare(run))
    assert found.steps_at_most > 1e9 and found.steps_timed < 1e5
