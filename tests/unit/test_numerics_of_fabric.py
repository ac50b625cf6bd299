"""Numerics follow the fabric: beams of thin inlays, and a bias test that starts slowly."""

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.laboratory.bias_extension.test import FASTEST, BiasExtensionTest, strip_of


def waves(*sets, **more):
    return resolve(**{"variant": "1", "test": "picture-frame", "scale": "meso", "preset": "quick"} | more, sets=sets)


@pytest.mark.parametrize("variant", ["1", "2"])
def test_shipped_fabrics_keep_the_beams_of_the_preset(variant):
    assert waves(variant=variant).model.meso.elements_per_wave == 4


def test_thin_inlays_get_beams_of_at_most_one_and_a_third_of_their_height():
    yarn = ("fabric.reinforcing.load_area=0.06", "fabric.reinforcing.linear_density=150")
    thin = [*yarn, "fabric.reinforcing.beam_diameter=0.4", "fabric.thickness=1.8", "fabric.area_mass=344"]
    run = waves(*thin)
    number = run.model.meso.elements_per_wave
    longest = max(run.fabric.wale_spacing, run.fabric.course_spacing) / number
    assert number == 6 and longest / 0.4 < 1.5 and longest * number / (number - 2) / 0.4 > 1.3
    assert waves(*thin, "model.meso.elements_per_wave=4").model.meso.elements_per_wave == 4
    assert resolve(variant="1", test="picture-frame", scale="macro", preset="quick").model.meso.elements_per_wave == 4


@pytest.mark.parametrize(("scale", "fastest"), [("meso", FASTEST), ("macro", 1.0)])
def test_the_clamp_of_a_bias_test_gets_faster_with_its_travel(scale, fastest):
    """v up to the travel x1 of 10 deg, then v x / x1, at most four times v."""
    run = resolve(variant="2", test="bias-extension", scale=scale, preset="quick")
    nodes = np.arange(2)
    rig = BiasExtensionTest(run, strip_of(run), nodes, nodes)
    speed = run.solver.speed_mm_per_ms
    for mark, angle in zip(rig.marks, (10.0, 20.0, 30.0, 40.0), strict=True):
        travel = rig.pull.integral(mark * rig.duration)
        assert np.rad2deg(rig.strip.angle(travel)) == pytest.approx(angle, abs=0.05)
        first = rig.strip.travel(np.deg2rad(10.0))
        now = np.interp(mark * rig.duration, rig.pull.time, rig.pull.value)
        assert now == pytest.approx(speed * min(max(travel / first, 1.0), fastest), rel=0.02)


@pytest.mark.parametrize(
    ("test", "sets", "expected"),
    [
        ("forming", ["rig.blank_holder_force=100"], {"speed": 0.1, "damping": 0.02}),
        ("forming", ["rig.blank_holder_force=100", "solver.speed=0.3"], {"speed": 0.3, "damping": 0.02}),
    ],
)
def test_soft_shells_are_moved_slowly_and_others_as_the_preset_says(test, sets, expected):
    """Soft: with a law of two strains, as there are no inlays in a direction."""
    soft = resolve(variant="weft-only", test=test, scale="macro", preset="quick", sets=sets)
    assert {name: getattr(soft.solver, name) for name in expected} == expected
    usual = resolve(variant="0-90-0", test=test, scale="macro", preset="quick", sets=sets)
    same = resolve(variant="1", test=test, scale="macro", preset="quick", sets=sets)
    assert usual.solver == same.solver and usual.solver != soft.solver
