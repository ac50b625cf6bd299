"""Resolution of a peak in time, and settings that give enough rows of energies: closed forms."""

from types import SimpleNamespace

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.laboratory.judging import _more_rows
from knittest.laboratory.tensile.test import unresolved_peak


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
    prepared = SimpleNamespace(duration=1.0, model=SimpleNamespace(chunk=20))
    found = _more_rows(run, prepared, history, SimpleNamespace(time_step=2.5e-4), slice(1, 5))
    assert found == setting
