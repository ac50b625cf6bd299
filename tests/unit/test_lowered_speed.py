"""Shares of energies that exceed their limits, and the speed at which a test restarts."""

from contextlib import nullcontext
from math import sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from knittest.base.history import Quality
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.laboratory.biaxial.test import Biaxial
from knittest.laboratory.quality_checks import kinetic_ratios
from knittest.laboratory.restart import (
    CONTACTS,
    DAMPING,
    KINETIC,
    LIMITS,
    SPEED,
    check_speed,
    has_configured_speed,
    make_row_check,
    with_result_speed,
)
from knittest.runs.specimen import LoweredSpeed
from knittest.solve.state import TooFastError

ALL = tuple(LIMITS)


def frame() -> Run:
    return resolve(variant="1", scale="meso", preset="quick", test="picture-frame")


def quality(kinetic: float = 0.0, damping: float = 0.0, contacts: float = 0.0, failures: int = 1) -> Quality:
    return Quality(
        kinetic, 0.0, 0.0, 0.0, 0.0, False, ("failed",) * failures, damping_over_work_max=damping,
        contact_damping_over_work_max=contacts,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("shares", "restarts", "lower", "text"),
    [
        ({"kinetic": 0.1}, ALL, sqrt(0.25), "kinetic energy 10.0 % of the work exceeds the limit of 5 %"),
        ({"damping": 0.1}, ALL, 0.25, "damping 10.0 % of the work"),
        ({"contacts": 0.1}, ALL, 0.25, "damping of contacts 10.0 % of the work"),
        ({"kinetic": 0.4, "damping": 0.06, "failures": 2}, ALL, sqrt(0.0625), "40.0 % .* and damping 6.0 %"),
        ({"kinetic": 0.1, "damping": 0.1, "failures": 2}, (KINETIC,), sqrt(0.25), "kinetic energy"),
    ],
)
def test_the_speed_brings_every_share_to_half_of_its_limit(
    shares: dict[str, Any], restarts: tuple[str, ...], lower: float, text: str
) -> None:
    with pytest.raises(TooFastError, match=text) as error:
        check_speed(frame(), restarts, quality(**shares))
    assert error.value.share == pytest.approx(lower)


@pytest.mark.parametrize(
    ("shares", "restarts"),
    [
        ({"kinetic": 0.049}, ALL),
        ({"kinetic": 0.1}, ()),
        ({"damping": 0.1}, (KINETIC,)),
        ({"kinetic": 0.1, "failures": 2}, ALL),  # fails by something else, too
    ],
)
def test_no_restart_where_it_would_not_help(shares: dict[str, Any], restarts: tuple[str, ...]) -> None:
    check_speed(frame(), restarts, quality(**shares))


def test_damping_of_contacts_lowers_the_speed_once() -> None:
    assert LoweredSpeed(1.0).restarts == (KINETIC, DAMPING, CONTACTS)
    assert LoweredSpeed(0.5).restarts == (KINETIC, DAMPING)
    assert LoweredSpeed(0.1).restarts == ()


class State:
    """A simulation of two rows at an ``angle`` [deg]."""

    def __init__(self, angle: float, kinetic: float, contacts: float) -> None:
        energies = {
            "kinetic_ratio": kinetic, "external_mj": 1.0, "damping_mj": 0.0, "contact_damping_mj": contacts,
            "hourglass_mj": 0.0, "internal_knit_mj": 1.0,
        }  # fmt: skip
        self.rows, self.energy_rows = [{"angle": angle}], [energies | {"external_mj": 2.0}, energies]


@pytest.mark.parametrize(
    ("angle", "kinetic", "contacts", "stops"),
    [(9.0, 0.2, 0.0, False), (10.0, 0.2, 0.0, True), (10.0, 0.04, 0.09, False), (10.0, 0.04, 0.11, True)],
)
def test_rows_are_checked_from_the_first_angle_on(angle: float, kinetic: float, contacts: float, stops: bool) -> None:
    """Damping over the largest work so far, 2 mJ."""
    check, state = make_row_check(frame(), ALL, "angle", 9.5), State(angle, kinetic, contacts)
    if stops:
        with pytest.raises(TooFastError):
            check(state)  # type: ignore[arg-type]
    else:
        check(state)  # type: ignore[arg-type]


def test_the_speed_of_results() -> None:
    run = frame()
    assert with_result_speed(run, {SPEED: 1.5}).solver.speed == 1.5
    assert with_result_speed(run, {}).solver.speed == run.solver.speed
    assert has_configured_speed(run, {SPEED: run.solver.speed}) and has_configured_speed(run, {})
    assert not has_configured_speed(run, {SPEED: np.nextafter(run.solver.speed, 0.0)})


@pytest.mark.parametrize(("variant", "share"), [("1", 2.0), ("weft-only", 0.1)])
def test_loops_that_carry_the_force_are_checked_by_the_work_done_on_them(variant: str, share: float) -> None:
    """Loops release energy, so that hardly any is spent while the work is 0.02 mJ."""
    run = resolve(variant=variant, scale="meso", preset="quick", test="picture-frame")
    energies = {"kinetic_mj": [0.001, 0.002], "external_mj": [-0.02, 0.01], "kinetic_ratio": [1.0, 2.0]}
    found = kinetic_ratios(run, {name: np.array(values) for name, values in energies.items()})
    assert found[-1] == pytest.approx(share)


@pytest.mark.parametrize(("strain", "failed", "stops"), [(1.2, 0.0, True), (1.2, 1.0, False), (0.8, 0.0, False)])
def test_a_biaxial_test_is_checked_up_to_its_first_failure(strain: float, failed: float, stops: bool) -> None:
    """From a quarter of the strain on, 1 % of 4 %; yarns that break ring."""
    run: Any = resolve(variant="1", scale="meso", preset="quick", test="biaxial", direction="warp")
    prepared: Any = SimpleNamespace(restarts=ALL)
    check, state = Biaxial().make_row_check(run, prepared), State(10.0, 0.2, 0.0)
    state.rows = [{"strain_pct": strain, "failed_warp": failed}]
    with pytest.raises(TooFastError) if stops else nullcontext():
        check(state)  # type: ignore[arg-type]
