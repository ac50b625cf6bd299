"""The frame that pictures call "at the largest force" shows that state: the force, and nothing torn yet."""

import numpy as np
import pytest

from knittest.base.history import History
from knittest.config.loading import resolve
from knittest.runs.checkpoints import specimen_of, specimen_state
from knittest.runs.specimen import prepare
from knittest.solve.simulate import is_new_peak, simulate

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
    frame = history.at_peak
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
    assert again.peak == 1 and again.at_peak.force == history.frames[1].force
    assert specimen_of(specimen_state(specimen, frames=False)).history.peak is None
