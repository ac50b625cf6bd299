"""Means, scatter and corridors of specimens: n - 1, of tested and of simulated ones by the same code."""

from types import SimpleNamespace

import numpy as np
import pytest

from knittest.experiment.statistics import corridor_on, mean_sd
from knittest.export.summary import ensemble_results
from knittest.laboratory.tensile.report import POINTS, _shown, corridor

#: peaks 20, 30, 40 N at 2, 3, 2.5 %: mean 30, sd 10 N with n - 1
PEAKS = ((2.0, 20.0), (3.0, 30.0), (2.5, 40.0))


def specimens(peaks: tuple[tuple[float, float], ...] = PEAKS) -> list[SimpleNamespace]:
    """Straight to the peak, then down."""
    curves = [{"strain_pct": np.array([0.0, x, x + 1.0]), "force_n": np.array([0.0, y, 0.0])} for x, y in peaks]
    return [SimpleNamespace(history=SimpleNamespace(curve=curve)) for curve in curves]


def test_the_corridor_of_simulated_specimens_has_the_sample_deviation() -> None:
    found = corridor(specimens())  # at 2 %: 20, 20, 32 N
    assert (found.n, len(found.strain), found.strain[-1]) == (3, POINTS, 2.0)
    assert found.mean[-1] == pytest.approx(24.0)
    assert found.sd[-1] == pytest.approx(np.sqrt(48.0))  # with n it were the root of 32


def test_the_peaks_of_the_picture_have_the_sample_deviation() -> None:
    peak = _shown(specimens()).peak
    assert (peak.strain_mean, peak.strain_sd) == pytest.approx((2.5, 0.5))
    assert (peak.force_mean, peak.force_sd) == pytest.approx((30.0, 10.0))


def test_one_specimen_has_no_scatter_to_show() -> None:
    x = np.array([0.0, 1.0])
    assert np.isnan(corridor_on(x, [(x, x)]).sd).all()
    assert np.isnan(mean_sd(np.array([5.0]))[1])


def test_results_of_an_ensemble_have_the_sample_deviation() -> None:
    found = ensemble_results([{"peak_force_n": value} for value in (20.0, 30.0, 40.0)])
    assert found["peak_force_n"] == {"mean": 30.0, "sd": 10.0, "values": [20.0, 30.0, 40.0]}
