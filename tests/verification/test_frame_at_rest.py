"""A frame starts from rest after its mounting, and its fabric moves with it: no inertia and no vibration."""

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.laboratory.picture_frame.test import PictureFrame
from knittest.runs.specimen import run_specimen
from knittest.solve.state import SILENT, Observer


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


def test_a_run_resumed_in_its_mounting_gives_the_same_bits():
    """From the last state without a sample: one kept at the end of the mounting would skip the rest."""
    sets = ["rig.side=15", "output.samples=60", "rig.max_angle=0.5", "solver.ramp=0.2"]
    run = resolve(variant="1", test="picture-frame", scale="meso", preset="quick", sets=sets)
    test, kept = PictureFrame(), []

    class Keeper(Observer):
        def visit(self, take):
            if not take().state["samples/time"].size:
                kept.append(take())

    class Resumer(Observer):
        def resume_from(self):
            return kept[-1]

    whole, _ = test.solve(test.prepare(run), run, Keeper())
    resumed, _ = test.solve(test.prepare(run), run, Resumer())
    assert len(kept) > 10
    assert whole.curve["shear_force_n"].tobytes() == resumed.curve["shear_force_n"].tobytes()


def test_energies_of_shells_count_from_the_mounted_frame():
    """An uneven sheet keeps 0.01 mJ of hourglass energy from its mounting, 11 % of the work where checks begin."""
    sets = ["rig.side=60", "rig.max_angle=6", "rig.imperfection=0.5"]
    run = resolve(test="picture-frame", variant="1", scale="macro", preset="quick", sets=sets)
    energies = run_specimen(run).history.energies
    assert np.abs(energies["hourglass_mj"][0]) < 1e-3
    assert np.abs(energies["balance_error_mj"]).max() < 1e-3
