"""Warnings about what a model takes for itself."""

from types import SimpleNamespace

import numpy as np

from knittest.measure import _losses


def warned(damping: float, hourglass: float, first_failure: int | None = None) -> list[str]:
    energies = {
        "time_ms": np.array([0.0, 1.0, 2.0]), "external_mj": np.array([0.0, 100.0, 200.0]),
        "internal_warp_mj": np.array([0.0, 30.0, 60.0]), "internal_weft_mj": np.array([0.0, 20.0, 40.0]),
        "damping_mj": np.array([0.0, 1.0, damping]), "hourglass_mj": np.array([0.0, 1.0, hourglass]),
    }  # fmt: skip
    return _losses(SimpleNamespace(energies=energies, first_failure=first_failure))


def test_damping_and_hourglass_control_above_a_tenth_are_named():
    assert warned(19.0, 9.0) == []
    assert warned(30.0, 9.0) == ["damping took 15 % of the work, more than 10 %"]
    assert warned(19.0, 12.0) == ["hourglass control holds 12 % of the internal energy, more than 10 %"]


def test_what_happens_after_the_first_failure_is_not_judged():
    assert warned(150.0, 90.0, first_failure=2) == []
