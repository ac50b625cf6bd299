"""Advice of refusals, followed: each run is refused, follows the number in its reason, and then passes that gate.

Shells of seconds; where a good run is far below a limit, a stricter one is set.
"""

import re

import pytest

from knittest.config.gates import GATES
from knittest.config.loading import resolve
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
    (label,) = (gate.label for gate in GATES if gate.key == key)
    setting = advice(refusals(test, sets), label)
    assert not [text for text in refusals(test, [*sets, setting]) if text.startswith(label)]


def test_more_samples_are_enough() -> None:
    setting = advice(refusals("tensile", ["output.samples=20"]), "5 rows of energies")
    assert refusals("tensile", [setting]) == ()
