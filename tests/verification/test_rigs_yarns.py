"""Cantilever and picture frame on yarns: the heavy elastica, balances, friction, inertia that does no work."""

from functools import cache

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.laboratory.cantilever import meso_strip
from knittest.laboratory.picture_frame.test import material_scatter
from knittest.runs.specimen import prepare, run_specimen


def specimen(test, *sets, direction=None):
    return run_specimen(
        resolve(variant="1", scale="meso", preset="quick", test=test, direction=direction, sets=list(sets))
    )


@pytest.mark.parametrize("direction", ["warp", "weft"])
def test_a_strip_of_yarns_bends_as_its_yarns_do(direction):
    """w L^3 / B = 8 with B of the reinforcing yarns alone: 41.5 deg, less what the loops carry; 2 % of overhang are
    1.5 deg.
    """
    bending = {"warp": 15.0, "weft": 12.4}[direction]
    gravity = 1e3 * 8.0042 * bending / (824.2e-6 * (100 / 28) * 90.0**3)
    found = specimen("cantilever", "rig.overhang=90", "rig.width=8", f"rig.gravity={gravity:.3f}", direction=direction)
    assert found.results["chord_angle_deg"] == pytest.approx(41.5, abs=1.5)
    assert found.results["moment_error_pct"] < 1.0
    assert found.quality.failures == ()


def test_yarns_that_slip_on_come_to_rest_with_their_friction(monkeypatch):
    """The strip comes to rest by itself in some turns; friction from the first turn on keeps the angle to 4 %."""
    sets = ("rig.overhang=90", "rig.width=8", "rig.gravity=30")
    free = specimen("cantilever", *sets, direction="weft")
    monkeypatch.setattr(meso_strip, "RUBBING", 0)
    rubbing = specimen("cantilever", *sets, direction="weft")
    assert rubbing.quality.failures == free.quality.failures == ()
    assert rubbing.results["chord_angle_deg"] == pytest.approx(free.results["chord_angle_deg"], rel=0.04)
    assert rubbing.results["chord_angle_deg"] != free.results["chord_angle_deg"]
    assert any("without yarn friction the strip found no equilibrium" in told for told in rubbing.quality.warnings)
    assert not free.quality.warnings


@cache
def sheared(friction):
    return specimen(
        "picture-frame", "rig.side=22", "rig.max_angle=20", f"fabric.contact.friction_coefficient.value={friction}"
    )


@pytest.mark.parametrize("friction", [0.1, 0.5])
def test_a_frame_of_yarns_passes_its_gates(friction):
    """Energy balances, and the motion beside that of the frame is small against the work."""
    assert sheared(friction).quality.failures == ()


def test_more_friction_between_yarns_means_more_shear_force():
    low, high = (sheared(mu).results["shear_force_n_at_deg.10"] for mu in (0.1, 0.5))
    assert high > 1.1 * low > 0.0


def test_crossings_turn_as_the_frame_does():
    """A frame of needles shears the mean crossing as itself."""
    found = sheared(0.5)
    run = resolve(variant="1", scale="meso", preset="quick", test="picture-frame", sets=["rig.side=22"])
    frame, scatter = material_scatter(run, found.history)[-1]
    assert frame == pytest.approx(20.0, abs=0.5)
    assert scatter.mean == pytest.approx(frame, abs=0.1)
    assert 0.0 < scatter.sd < 2.0


def test_evenly_sheared_fabric_keeps_its_kinetic_energy():
    """At a constant shear rate p'^2 + q'^2 is constant, so the inertia of a square does no work."""
    rig = prepare(resolve(variant="1", scale="macro", preset="quick", test="picture-frame", sets=["rig.side=50"])).rig
    corners = 25.0 * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    times = np.linspace(0.3, 0.9, 7) * rig.duration
    kinetic = rig.carried({"time_ms": times}, np.ones(4), corners)
    assert kinetic == pytest.approx(np.full(7, kinetic[0]), rel=1e-3)
    assert kinetic[0] > 0.0


def test_hooked_loops_make_no_energy():
    """Loops without any set and without friction slide along each other's hooks, where closest points jump."""
    found = specimen(
        "picture-frame", "rig.side=22", "rig.max_angle=6", "fabric.contact.friction_coefficient.value=0",
        "fabric.knitting.degree_of_set.value=0",
    )  # fmt: skip
    energies = found.history.energies
    assert energies["balance_error_mj"].min() > -1e-3 * energies["kinetic_mj"].max()
