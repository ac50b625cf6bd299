"""Strips of loops: strain at given forces, contraction, defaults of their tests; inlays that a strip counts."""

from types import SimpleNamespace

import numpy as np
import pytest

from knittest.base.files import configs_dir
from knittest.config.loading import resolve
from knittest.laboratory.strips import carrying_width, inlays_across
from knittest.laboratory.tensile.test import knit_results


def strip_of(variant, *sets, direction="warp", test="tensile"):
    return resolve(variant=variant, test=test, scale="meso", preset="quick", direction=direction, sets=list(sets))


def history():
    """A strip 10 mm wide and 40 mm long along y, pulled by 20 %, that contracts by a tenth."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(0.0, 10.0, 21), np.linspace(0.0, 40.0, 41)))
    share = np.linspace(0.0, 1.0, 101)
    frames = [
        SimpleNamespace(time=s, position=np.column_stack([(1.0 - 0.1 * s) * x, (1.0 + 0.2 * s) * y, 0.0 * x]))
        for s in (0.0, 0.5, 1.0)
    ]
    curve = {"time_ms": share, "strain_pct": 20.0 * share, "force_n": 10.0 * 2.0 * 0.2 * share}
    return SimpleNamespace(curve=curve, frames=frames)


def test_strain_at_forces_and_contraction_of_a_strip_that_stretches_evenly():
    found = knit_results(history(), {"width_mm": 10.0}, axis=1)
    at = {name: value for name, value in found.items() if name.startswith("strain_pct_at")}
    assert list(at) == [f"strain_pct_at_n_per_mm.{force}" for force in (0.01, 0.02, 0.05, 0.1, 0.2)]
    assert at["strain_pct_at_n_per_mm.0.2"] == pytest.approx(10.0, abs=0.2)
    assert found["largest_force_n_per_mm"] == pytest.approx(0.4)
    assert found["strain_at_largest_force_pct"] == pytest.approx(20.0)
    assert found["contraction_pct"] == pytest.approx(10.0)


def test_a_strip_without_inlays_along_it_is_pulled_farther_and_more_slowly():
    along, across = strip_of("weft-only"), strip_of("weft-only", direction="weft")
    assert along.pulls_loops and not across.pulls_loops
    assert (along.rig.max_strain, along.solver.speed) == (40.0, 0.5)
    assert across.rig.max_strain == strip_of("1").rig.max_strain == 4.0
    stated = strip_of("weft-only", "rig.max_strain=25", "solver.speed=1.5")
    assert (stated.rig.max_strain, stated.solver.speed) == (25.0, 1.5)


def test_a_strain_that_the_fabric_file_states_stands(tmp_path):
    text = (configs_dir() / "fabrics" / "jersey.yaml").read_text(encoding="utf-8")
    path = tmp_path / "f.yaml"
    path.write_text(text + "rigs: {tensile: {max_strain: 90}}\n", encoding="utf-8")
    assert resolve(fabric=path, test="tensile", scale="meso", direction="warp").rig.max_strain == 90.0


@pytest.mark.parametrize(("variant", "wales", "inlays"), [("1", 13, 13), ("warp-every-second-wale", 13, 7)])
def test_the_width_of_a_strip_is_that_of_its_inlays(variant, wales, inlays):
    """Seven inlays in thirteen wales carry as fourteen wales do."""
    run = strip_of(variant, f"rig.width={wales / 0.28}")
    assert inlays_across(run, "warp") == inlays
    share = run.fabric.inlays_along("warp")[0].share
    assert carrying_width(run, "warp") == pytest.approx(inlays / (0.28 * share))


def test_a_strip_without_inlays_has_the_width_of_its_wales():
    run = strip_of("jersey", f"rig.width={13 / 0.28}")
    assert inlays_across(run, "warp") == 0
    assert carrying_width(run, "warp") == pytest.approx(13 / 0.28)
