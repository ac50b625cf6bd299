"""A frame starts from rest after its mounting, and its fabric moves with it: no inertia and no vibration."""

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.laboratory.picture_frame.test import PictureFrame
from knittest.solve.observer import SILENT


@pytest.mark.parametrize("scale", ["meso", "macro"])
def test_a_fabric_moves_with_its_frame(scale):
    """The kinetic energy is that of evenly sheared fabric while the frame comes up to its rate, and after it."""
    sets = ["rig.side=15", "output.samples=60", "rig.max_angle=6"]
    sets += ["model.macro.element_size=2.5", "solver.speed=3", "solver.ramp=1"] if scale == "macro" else []
    run = resolve(variant="1", test="picture-frame", scale=scale, preset="quick", sets=sets)
    test = PictureFrame()
    prepared = test.prepare(run)
    history, _ = test.solve(prepared, run, SILENT)
    energies = history.energies
    own = prepared.rig.carried(energies, prepared.model.mass, history.frames[0].position)
    moving = own > 0.02 * own.max()
    assert energies["kinetic_mj"][moving] == pytest.approx(own[moving], rel=0.05)
    assert energies["time_ms"][0] > prepared.rig.mounted_at
    assert abs(energies["external_mj"][0]) < 1e-3 * energies["external_mj"][-1]
    assert np.abs(energies["damping_mj"]).max() < 0.05 * energies["external_mj"][-1]
