"""Advice of refusals, followed: each run is refused, follows the number in its reason, and then passes that gate.

Shells of seconds; where a good run is far below a limit, a stricter one is set.
"""

import re

import pytest

from knittest.config.loading import resolve
from knittest.config.quality_checks import SOLVER_CHECKS
from knittest.config.run import Run
from knittest.runs.specimen import run_specimen

CASES = {
    "speed": ("tensile", "ke_over_ie_max", ["solver.speed=10"]),
    "step": ("tensile", "energy_error_max", ["solver.max_energy_error=0.02"]),
    "damping": ("tensile", "damping_over_work_max", ["solver.damping=20"]),
    "damping of a frame": ("picture-frame", "damping_over_work_max", ["rig.side=60", "solver.damping=1"]),
}


def refusals(test: str, sets: list[str]) -> tuple[str, ...]:
    direction = None if test == "picture-frame" else "warp"
    run = resolve(variant="1", scale="macro", preset="quick", test=test, direction=direction, sets=sets)
    return run_specimen(run).quality.failures


def advice(failures: tuple[str, ...], label: str) -> str:
    (reason,) = (text for text in failures if text.startswith(label))
    (setting,) = re.findall(r"((?:solver|output)\.\w+=[\d.e+-]+)", reason)
    return setting


@pytest.mark.parametrize("name", CASES)
def test_advice_is_true(name: str) -> None:
    test, key, sets = CASES[name]
    (label,) = (gate.label for gate in SOLVER_CHECKS if gate.key == key)
    setting = advice(refusals(test, sets), label)
    assert not [text for text in refusals(test, [*sets, setting]) if text.startswith(label)]


def test_more_samples_are_enough() -> None:
    setting = advice(refusals("tensile", ["output.samples=20"]), "5 samples lie")
    assert refusals("tensile", [setting]) == ()


def test_a_slower_test_is_enough_where_rows_cannot_be_closer() -> None:
    sets = ["rig.width=20", "rig.gauge_length=20", "solver.speed=4"]
    reason = next(text for text in refusals("tensile", sets) if "samples lie between" in text)
    settings = re.findall(r"--set (\S+)", reason)
    assert settings[0].startswith("solver.speed=")
    assert not [text for text in refusals("tensile", [*sets, *settings]) if "samples lie between" in text]


@pytest.mark.parametrize(("gauge", "speed", "refused"), [(50, 2.0, True), (20, 0.5, False)])
def test_a_peak_that_is_not_resolved_in_time_is_seen(gauge: int, speed: float, refused: bool) -> None:
    """Both lose more than 1 % of the force that the shells were given; at the speed of the advice they return it."""
    found = run_specimen(narrow(gauge, f"solver.speed={speed}"))
    texts = found.quality.failures if refused else found.quality.warnings
    (reason,) = (text for text in texts if "uncertain by" in text)
    assert found.results["peak_force_n"] < 0.99 * 2328.0
    (setting,) = re.findall(r"--set (\S+)", reason)
    slower = run_specimen(narrow(gauge, setting))
    assert not [text for text in (*slower.quality.failures, *slower.quality.warnings) if "uncertain by" in text]
    assert slower.results["peak_force_n"] == pytest.approx(2328.0, rel=0.01)


def narrow(gauge: int, setting: str) -> Run:
    """A strip of variant 1, 20 mm wide, its clamps ``gauge`` [mm] apart."""
    sets = ["rig.width=20", f"rig.gauge_length={gauge}", setting]
    return resolve(variant="1", scale="macro", test="tensile", direction="warp", sets=sets)
