"""The tensile rig: input curve repeated by shells, bundle formula by yarns, ensembles that repeat their bits."""

import numpy as np
import pytest

from knittest.base.files import data_dir
from knittest.config.loading import resolve
from knittest.experiment.curves import load_curve, scale_to_width
from knittest.fabric.topology import bundle_peak, draw
from knittest.laboratory.strips import yarns_across
from knittest.materials.yarn_section import sections
from knittest.models.boundary import Boundary
from knittest.runs.specimen import prepare, run_specimen

SMALL = ["rig.width=18", "rig.gauge_length=18", "solver.ramp=0.1"]


@pytest.mark.parametrize("direction", ["warp", "weft"])
def test_shells_repeat_their_input_within_one_percent(direction):
    run = resolve(variant="2", scale="macro", direction=direction)
    result = run_specimen(run)
    given = scale_to_width(load_curve(data_dir() / run.fabric.macro.tension[direction]), run.rig.width)
    curve = result.history.curve
    end = int(np.argmax(curve["force_n"]))
    expected = np.interp(curve["strain_pct"][:end], given.x, given.mean)
    judged = curve["strain_pct"][:end] <= given.x[-1]
    error = np.abs(curve["force_n"][:end] - expected)[judged] / given.mean[-1]
    assert error.max() < 0.01
    assert result.results["peak_force_n"] == pytest.approx(given.mean[-1], rel=0.015)
    assert result.quality.failures == ()


@pytest.mark.parametrize("seed", [1, 7])
def test_yarns_without_wave_and_contact_are_a_bundle(seed):
    """max_k EA eps_(k) (n - k + 1) for the same draws (Daniels, 1945).

    The loops push even these yarns off their line by hundredths of a millimetre, which straightens first.
    """
    flat = [f"fabric.reinforcing.crimp.{d}=0" for d in ("warp", "weft")]
    run = resolve(
        variant="1", scale="meso", direction="warp", seed=seed,
        sets=[*flat, "model.meso.contact=false", "variability.mode=random", "rig.gauge_length=50",
              "rig.width=18", "solver.speed=0.25", "output.samples=4000"],
    )  # fmt: skip
    prepared = prepare(run)
    yarn = prepared.model.position()[prepared.model.group.chain == 0]
    excess = np.linalg.norm(np.diff(yarn, axis=0), axis=1).sum() / np.linalg.norm(yarn[-1] - yarn[0]) - 1.0
    assert excess < 3e-4
    result = run_specimen(run)
    draws = draw(run.fabric, run.variability, "warp", 5, 0)
    expected, strain = bundle_peak(draws, sections(run.fabric)[0].axial)
    assert result.results["peak_force_n"] == pytest.approx(expected, rel=0.01)
    assert result.results["fracture_strain_pct"] == pytest.approx(100.0 * (strain + excess), rel=0.005)


@pytest.mark.parametrize("scale", ["macro", "meso"])
@pytest.mark.parametrize("variant", ["1", "2"])
@pytest.mark.parametrize("direction", ["warp", "weft"])
def test_what_lies_between_the_clamps_is_the_gauge_length(variant, direction, scale):
    """Loops reach beyond the ends of warps: seen from the model's middle a clamp held one beam too few."""
    prepared = prepare(resolve(variant=variant, scale=scale, direction=direction, sets=SMALL))
    model, rig = prepared.model, prepared.rig
    boundary = Boundary(model, 1.0)
    rig.constrain(boundary)
    along = model.position()[:, rig.axis]
    held = np.isin(np.arange(model.n_nodes), boundary.drive().motions.node)
    pulled = np.ones(model.n_nodes, bool)
    if scale == "meso":
        pulled = np.isin(model.group.chain, np.flatnonzero(prepared.yarns["system"] == direction))
    ends = along[held & pulled]
    assert ends[ends > rig.middle].min() - ends[ends < rig.middle].max() == pytest.approx(rig.gauge, abs=1e-9)


def small_meso(**options):
    return resolve(variant="2", scale="meso", direction="warp", sets=SMALL, **options)


def test_a_small_strip_breaks_with_contact_and_closes_its_energy_balance():
    result = run_specimen(small_meso())
    assert result.history.curve["failed_warp"][-1] >= yarns_across(small_meso(), "warp", 0) - 1
    assert result.quality.failures == ()
    assert result.quality.energy_error_max < 0.01
    assert result.quality.penetration_over_radius_max < 0.1
    # both clamps feel the same force while nothing has failed
    until = np.argmax(result.history.curve["failed_warp"] > 0) - 50
    ends = result.history.curve["force_moving_n"][until], result.history.curve["force_fixed_n"][until]
    assert ends[0] == pytest.approx(ends[1], rel=0.01)


def test_the_same_seed_gives_the_same_bits():
    run = small_meso(seed=3)
    first, second = (run_specimen(run) for _ in range(2))
    assert first.history.curve["force_n"].tobytes() == second.history.curve["force_n"].tobytes()
    other = run_specimen(small_meso(seed=4))
    assert other.results != first.results


def test_fractional_yarn_counts_alternate_in_an_ensemble():
    run = resolve(variant="2", scale="meso", direction="weft", specimens=4)
    assert [yarns_across(run, "weft", k) for k in range(4)] == [20, 21, 20, 21]
    assert yarns_across(run, "warp", 0) == 14


def test_paper_preset_has_the_papers_element_counts():
    """Table 4: 34,636 beams and 440 shells, variant 1, within 10 %."""
    meso = prepare(resolve(variant="1", scale="meso", preset="paper", direction="warp"))
    assert len(meso.model.mesh.cells) == pytest.approx(34636, rel=0.10)
    macro = prepare(resolve(variant="1", scale="macro", preset="paper", direction="warp"))
    assert len(macro.model.mesh.cells) == 440
