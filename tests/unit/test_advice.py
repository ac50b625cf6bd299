"""Advice of refusals: numbers from the rules, and where no number is known none."""

import re

import numpy as np
import pytest

from knittest.base.units import round_down
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.laboratory.quality_checks import TARGET_SHARE, advice_for
from knittest.models.chains import longest_step


def run_of(test: str = "tensile", *sets: str, scale: str = "macro") -> Run:
    direction = None if test in ("picture-frame", "forming") else "warp"
    return resolve(variant="1", scale=scale, preset="quick", test=test, direction=direction, sets=sets)


def number(text: str, field: str) -> float:
    """Number that ``text`` gives for ``field``."""
    found = re.search(rf"{re.escape(field)}=([\d.e+-]+)", text)
    assert found, text
    return float(found[1])


@pytest.mark.parametrize(
    ("value", "rounded"),
    [(0.4, 0.4), (0.449, 0.44), (0.0129, 0.012), (1.0, 1.0), (0.3, 0.3), (137.0, 130.0), (7.0, 7.0)],
)
def test_advice_is_rounded_to_the_safe_side(value: float, rounded: float) -> None:
    assert round_down(value) == pytest.approx(rounded, rel=1e-12)


def test_inertia_goes_with_the_square_of_the_speed_and_errors_with_the_step() -> None:
    run = run_of("tensile", "solver.speed=2", "solver.safety=0.8")
    text = advice_for(run, "ke_over_ie_max", 48.0, 5.0)
    assert number(text, "solver.speed") == round_down(2.0 * np.sqrt(TARGET_SHARE * 5.0 / 48.0)) == 0.54
    assert "square of the speed" in text and "rerun with --set solver.speed=" in text
    assert number(advice_for(run, "energy_error_max", 8.0, 2.0), "solver.safety") == 0.14
    assert number(advice_for(run, "penetration_over_radius_max", 50.0, 25.0), "solver.safety") == 0.47


def test_a_loss_is_part_of_the_work_that_it_is_held_against() -> None:
    """D / W = s makes D / (W - D) = s / (1 - s), which goes with the damping: 80 % to 3.5 % takes 1 / 110."""
    run = run_of("tensile", "solver.damping=10", "solver.speed=2")
    assert number(advice_for(run, "damping_over_work_max", 80.0, 5.0), "solver.damping") == 0.09
    assert number(advice_for(run, "contact_damping_over_work_max", 10.0, 5.0), "solver.speed") == 0.65
    assert number(advice_for(run, "hourglass_over_internal_max", 10.0, 5.0), "model.macro.element_size") == 3.5


def test_a_free_blank_is_sent_to_what_was_measured_to_pass() -> None:
    run = run_of("forming", "solver.damping=0.05", "solver.speed=0.19")
    for key in ("damping_over_work_max", "drag_over_weight"):
        text = advice_for(run, key, 15.0, 5.0)
        preset = run_of("forming").solver
        assert (number(text, "solver.damping"), number(text, "solver.speed")) == (preset.damping, preset.speed)
    assert number(advice_for(run_of("forming"), "damping_over_work_max", 7.0, 5.0), "solver.damping") < preset.damping
    text = advice_for(run_of("forming", scale="meso"), "drag_over_weight", 100.0, 10.0)
    assert text.startswith("lower solver.damping (now ") and "solver.speed (now " in text
    held = run_of("forming", "rig.blank_holder_force=1", "solver.damping=0.05")
    assert number(advice_for(held, "drag_over_weight", 20.0, 10.0), "solver.damping") == round_down(0.05 * 0.35**2)


def test_a_blank_that_folds_into_bands_is_held_in_the_plane_before_its_shells_are_made_finer() -> None:
    """At 100 N shells of 6, 5, 3, 2 mm hold 5.0, 5.1, 5.7, 8.1 % by hourglass control, 3.7 % at 6 mm in-plane."""
    free = run_of("forming", "rig.blank_holder_force=100", "rig.in_plane_bending=false")
    text = advice_for(free, "hourglass_over_internal_max", 5.03, 5.0)
    assert "--set rig.in_plane_bending=true" in text
    assert "element_size" not in text
    finer = advice_for(run_of("forming"), "hourglass_over_internal_max", 10.0, 5.0)
    assert number(finer, "model.macro.element_size") == round_down(6.0 * 0.35)


def test_of_yarns_the_field_is_named_and_no_value_that_nobody_tried() -> None:
    run = run_of(scale="meso")
    text = advice_for(run, "penetration_over_radius_max", 50.0, 25.0)
    assert text.endswith("raise fabric.contact.normal_stiffness (now 1000)")
    text = advice_for(run_of("picture-frame", scale="meso"), "ke_over_ie_max", 21.0, 5.0)
    assert text == "it grows with the square of the speed: lower solver.speed (now 3)"


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_nothing_is_advised_where_nothing_is_known(value: float) -> None:
    assert advice_for(run_of(), "ke_over_ie_max", value, 5.0) == ""
    assert advice_for(run_of(), "beyond_law", 7.0, 5.0) == ""


def test_the_blank_decides_the_presets_speed_and_damping() -> None:
    """A flange that its weight alone keeps down must not be dragged; one that is held may be drawn faster."""
    free, held = run_of("forming").solver, run_of("forming", "rig.blank_holder_force=100").solver
    assert (free.speed, free.damping, held.speed, held.damping) == (0.05, 0.006, 0.19, 0.05)
    assert run_of("forming", "solver.speed=0.1").solver.speed == 0.1
    assert run_of("forming", "rig.blank_holder_force=0").solver == free


def test_the_longest_step_adds_the_most_mass_that_is_allowed() -> None:
    load, mass = np.array([4.0, 1.0, 0.25]), np.ones(3)  # steps of 1, 2 and 4
    assert longest_step(load, mass, 1.0, 9.0) == pytest.approx(2.0, rel=1e-9)  # 4 + 1 + 1 = 2 * 3
    assert longest_step(load, mass, 5.0 / 3.0, 9.0) == pytest.approx(np.sqrt(5.6), rel=1e-9)  # 5.6 + 1.4 + 1 = 8
