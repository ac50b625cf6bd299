"""Loops without inlays: a path of both strains ends where they have locked."""

from pathlib import Path

import numpy as np
import pytest

from knittest.laboratory.cell.test import Cell
from knittest.solve.state import SILENT
from knittest.studies.homogenise.plan import PlannedTest, Request, cell_run, strains_at_end

CONFIGS = Path(__file__).parents[2] / "configs" / "fabrics"


@pytest.mark.parametrize("angle", [22.5, 45.0])
def test_a_path_of_loops_ends_at_its_force_and_passes(angle):
    """They lock along one combination of both strains, as their yarn hardly stretches: at the same on either path."""
    request = Request(fabric=CONFIGS / "jersey.yaml", preset="quick", source="cell")
    run, cell = cell_run(request, PlannedTest("biaxial", angle=angle)), Cell()
    prepared = cell.prepare(run)
    history, cost = cell.solve(prepared, run, SILENT)
    assert 1.0 <= history.curve["warp_n_per_mm"].max() < 1.4  # a row later
    warp, weft = 0.01 * history.curve["path_pct"][-1] * np.array(strains_at_end(run))
    assert warp + 0.5 * weft == pytest.approx(0.246, rel=0.02)
    assert cell.assess(run, prepared, history, cost).failures == ()
