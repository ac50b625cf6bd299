"""Largest force: its frame, its resolution in time, and settings that give enough rows of energies."""

from types import SimpleNamespace

import numpy as np
import pytest

from knittest.base.history import History
from knittest.config.loading import resolve
from knittest.laboratory.quality_checks import _advise_more_rows
from knittest.laboratory.tensile.test import unresolved_peak
from knittest.runs.checkpoints import specimen_of, specimen_state
from knittest.runs.specimen import prepare
from knittest.solve.simulation import is_new_peak, simulate

#: shells that tear at once, and yarns that break one by one
SETS = {
    "macro": [],
    "meso": ["rig.width=10", "rig.gauge_length=10", "solver.ramp=0.1", "solver.speed=1"],
}


def pulled(scale: str, direction: str = "warp") -> History:
    run = resolve(variant="2", scale=scale, preset="quick", direction=direction, sets=SETS[scale])
    prepared = prepare(run)
    return simulate(prepared.model, prepared.rig, run.solver, run.output)[0]


@pytest.mark.parametrize(("scale", "direction"), [("macro", "warp"), ("macro", "weft"), ("meso", "warp")])
def test_the_frame_shows_the_largest_force_and_nothing_torn_by_it(scale, direction):
    history = pulled(scale, direction)
    top = int(np.argmax(history.curve["force_n"]))
    frame = history.peak_frame
    assert history.first_failure is not None
    assert frame.force >= 0.99 * history.curve["force_n"][top] and frame.force <= history.curve["force_n"][top]
    assert np.count_nonzero(frame.fields["alive"] <= 0.0) == 0  # here the first break is the peak
    assert frame.time == pytest.approx(history.curve["time_ms"][top], rel=0.01)
    torn = history.frames[-1].fields["alive"] <= 0.0
    force = frame.fields[f"force_{direction}" if scale == "macro" else "axial_force"]
    assert torn.any() and force[torn].min() > 0.5 * force.max()  # what tears later still pulls


@pytest.mark.parametrize(
    ("force", "kept", "new"),
    [(0.0, 0.0, False), (-1.0, 0.0, False), (1e-9, 0.0, True), (100.0, 100.0, False), (100.09, 100.0, False),
     (100.11, 100.0, True), (99.0, 100.0, False)],
)  # fmt: skip
def test_a_frame_is_kept_for_each_tenth_of_a_percent(force, kept, new):
    assert is_new_peak(force, kept) is new


def test_a_kept_specimen_still_knows_its_frame(tmp_path):
    from export_sample import cost, quality, shell_history

    from knittest.base.history import Specimen

    history = shell_history()
    history.peak = 1
    specimen = Specimen(history, {"peak_force_n": 1.0}, quality(), cost(), {}, {})
    again = specimen_of(specimen_state(specimen, frames=True)).history
    assert again.peak == 1 and again.peak_frame.force == history.frames[1].force
    assert specimen_of(specimen_state(specimen, frames=False)).history.peak is None


@pytest.mark.parametrize(("passage", "share"), [(0.0, 1.5 * 0.01), (0.02, 1.5 * 0.01), (0.1, 0.05)])
def test_a_peak_is_uncertain_by_what_the_force_gains_in_a_sample_or_a_passage(passage, share):
    """F = t up to 1 ms, samples of 0.01 ms: 1.5 of them, or half a passage of a wave, over 1 ms."""
    time = np.linspace(0.0, 1.2, 121)
    force = np.where(time <= 1.0 + 1e-9, time, 0.0)
    assert unresolved_peak({"time_ms": time, "force_n": force}, passage) == pytest.approx(share, rel=1e-6)
    assert np.isnan(unresolved_peak({"time_ms": time, "force_n": 0.0 * force}, passage))


@pytest.mark.parametrize(
    ("sets", "ramp_ms", "setting"),
    [
        # 4 of 50 rows: 1.5 x 10 of 188 are enough
        (["output.samples=50", "solver.speed=2"], 0.1, "--set output.samples=188"),
        # rows of 20 steps are 200 at most
        (["output.samples=400", "solver.speed=2"], 0.1, "--set solver.speed=1.1"),
        (["output.samples=100", "solver.speed=2"], 0.1, "--set solver.speed=1.1 --set output.samples=334"),
        # all of it while the rig starts up
        (["output.samples=400", "solver.speed=2"], 0.5, "--set solver.speed=0.71"),
    ],
)  # fmt: skip
def test_more_rows_come_of_samples_or_else_of_a_longer_test(sets, ramp_ms, setting):
    """A test of 1 ms; steps of 0.25 us, in chunks of 20, are 200 rows at most."""
    run = resolve(test="tensile", variant="1", scale="macro", direction="warp", sets=[*sets, f"solver.ramp={ramp_ms}"])
    share = 0.08 if "output.samples=50" in sets else 0.045
    times = 0.2 + share * np.linspace(0.25, 1.0, 4)
    history = SimpleNamespace(energies={"time_ms": np.append(0.2, times)})
    prepared = SimpleNamespace(duration=1.0, model=SimpleNamespace(chunk=20), rig=SimpleNamespace(relaxed_rows=0))
    found = _advise_more_rows(run, prepared, history, SimpleNamespace(time_step=2.5e-4), slice(1, 5))
    assert found == setting
