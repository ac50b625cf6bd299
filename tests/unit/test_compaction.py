"""Compaction: readings, the law of van Wyk, what touches the plates, and their motion."""

from types import SimpleNamespace

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.base.history import Frame, History, Mesh
from knittest.config.loading import resolve
from knittest.laboratory.compaction.report import CompactionReport
from knittest.laboratory.compaction.test import (
    CREEP,
    GAP,
    MOST,
    REST,
    CompactionTest,
    plate_contact_radius,
    plate_force_difference,
    plate_penetration,
    plate_stiffness,
)
from knittest.laboratory.compaction.van_wyk import first_loading, fit, thickness_at, work
from knittest.laboratory.restart import history_from_time


def quick(*sets: str):
    """Run of yarns of variant 1 at quick."""
    return resolve(variant="1", preset="quick", test="compaction", sets=sets)


def pressed(exponent: float) -> tuple[np.ndarray, np.ndarray]:
    """Thickness falling from 2.5 mm, and pressure by the law with k = 40 kPa mm^n, t0 = 2.5 mm."""
    t = np.linspace(2.5, 0.4, 4000)
    return t, 40.0 * (t**-exponent - 2.5**-exponent)


@pytest.mark.parametrize("exponent", [1.5, 3.0, 8.0])
def test_the_law_that_made_a_curve_is_found(exponent):
    law = fit(*pressed(exponent))
    assert law is not None and law.follows
    assert law.exponent == pytest.approx(exponent, rel=2e-3) and law.thickness == pytest.approx(2.5, rel=1e-3)
    assert law.factor == pytest.approx(40.0, rel=0.02)
    assert law.pressure(np.array([1.0]))[0] == pytest.approx(40.0 * (1.0 - 2.5**-exponent), rel=0.01)


def test_a_curve_that_is_no_such_law_has_no_exponent():
    t = np.linspace(2.3, 2.0, 3000)
    kinked = np.where(t > 2.15, 0.1 + (2.3 - t), 0.25 + 4000.0 * (2.15 - t))
    law = fit(t, kinked)
    assert law is None or not law.follows
    assert fit(np.array([2.0, 1.9, 1.8]), np.array([1.0, 2.0, 5.0])) is None  # less than a decade


def test_thickness_is_read_on_the_rising_pressure_only():
    t, p = np.array([2.0, 1.9, 1.8, 1.7, 1.6]), np.array([0.1, 1.0, 0.5, 10.0, 9.0])
    assert first_loading(t, p)[0].tolist() == [2.0, 1.9, 1.7]
    assert thickness_at(t, p, 1.0) == pytest.approx(1.9)
    assert thickness_at(t, p, np.sqrt(10.0)) == pytest.approx(1.8)
    assert np.isnan(thickness_at(t, p, 0.05)) and np.isnan(thickness_at(t, p, 20.0))
    # 1 kPa on the mean over 0.5 mm are 0.5 J/m2
    assert work(np.array([2.0, 1.5, 1.4]), np.array([0.5, 1.5, 0.0])) == pytest.approx(0.5)


def test_a_node_touches_a_plate_where_its_centre_line_would():
    """Crests of a wave: the quadratic spline passes at (P[i-1] + 6 P[i] + P[i+1]) / 8 beside its control point."""
    z = np.array([0.0, 0.4, 0.0, -0.4, 0.0])
    position = np.column_stack([np.arange(5.0), np.zeros(5), z])
    cells = np.column_stack([np.arange(4), np.arange(1, 5)])
    found = plate_contact_radius(position, cells, np.full(5, 0.3))
    assert z[1] + found[1] == pytest.approx((6.0 * 0.4) / 8.0 + 0.3)
    assert z[3] - found[3] == pytest.approx(-(6.0 * 0.4) / 8.0 - 0.3)
    assert found[[0, 2, 4]] == pytest.approx(0.3)


def test_plates_rest_creep_and_close_by_half_the_thickness():
    run = quick()
    rig = CompactionTest(run, (-1.0, 1.2), np.array([10.0, 20.0]), np.zeros(1), np.zeros(0, np.int64))
    assert rig.closing.integral(REST) == 0.0 and rig.start == pytest.approx(2.2 + 2.0 * GAP)
    assert rig.closing.integral(rig.duration) == pytest.approx(MOST * rig.start, rel=1e-9)
    fast = np.interp(REST + 1.0 + 0.9 * CREEP / (0.1 * run.solver.speed), rig.closing.time, rig.closing.value)
    assert fast == pytest.approx(0.1 * run.solver.speed)
    forces = SimpleNamespace(tool_force=np.array([[0.0, 0.0, -1.9], [0.0, 0.0, 2.1]]))
    row = rig.channels(0.0, forces)
    assert row["pressure_kpa"] == pytest.approx(10.0) and row["thickness_mm"] == rig.start  # 2 N on 200 mm2
    assert row["lower_force_n"] == 1.9 and row["upper_force_n"] == 2.1
    assert not rig.is_finished(199.0, 0.0, False) and rig.is_finished(200.0, 0.0, False)  # 1 MPa


def test_plates_are_as_stiff_as_the_step_allows():
    # 4 m / dt^2 is the edge of stability, of which yarns take 4 safety^2 and plates 0.4 times the factor
    for safety in (0.3, 0.7, 0.8):
        assert 4.0 * safety**2 + 0.4 * plate_stiffness(safety) <= 3.6 + 1e-9
    assert plate_stiffness(0.3) == 4.0 and plate_stiffness(0.95) == 1.0


def made(force: np.ndarray) -> History:
    """History of plates of which the upper presses with ``force`` and the lower 4 % less, on 100 mm2."""
    n = len(force)
    time = np.linspace(0.0, 10.0, n)
    curve = {
        "time_ms": time, "compaction_mm": np.linspace(0.0, 0.5, n), "pressure_kpa": 10.0 * 0.98 * force,
        "lower_force_n": 0.96 * force, "upper_force_n": force, "thickness_mm": 2.0 - np.linspace(0.0, 0.5, n),
        "plate_force_n": 0.98 * force,
    }  # fmt: skip
    names = ("kinetic", "internal_warp", "hourglass", "contact", "friction", "external", "balance_error")
    energies = {"time_ms": time, **{f"{name}_mj": np.linspace(0.0, 1.0 + k, n) for k, name in enumerate(names)}}
    energies |= {"kinetic_ratio": np.ones(n), "energy_error": np.ones(n)}
    contacts = {"time_ms": time, "tool_penetration_max_um": np.full(n, 5.0)}
    mesh = Mesh("beams", np.zeros((0, 2), np.int64), np.zeros(0), ("warp",), np.zeros(0), np.zeros(0))
    return History(mesh, curve, energies, [Frame(0.0, 0.0, 0.0, np.zeros((1, 3)), {})], contacts=contacts)


def test_plates_that_press_unlike_or_sink_in_are_seen():
    history = made(np.geomspace(0.001, 100.0, 2001))
    assert plate_force_difference(history, 0.1) == pytest.approx(100.0 * 0.04 / 0.98, rel=1e-6)
    assert plate_penetration(history) == pytest.approx(2.0)  # 5 um into both, of 0.5 mm
    rows = CompactionReport().curve([SimpleNamespace(history=history)])
    assert len(rows["pressure_kpa"]) == 2001 and (np.diff(rows["pressure_kpa"]) > 0.0).all()


def test_energies_count_from_when_the_specimen_is_at_rest():
    history = made(np.ones(101))
    later = history_from_time(history, 5.0)
    assert later.curve["time_ms"][0] == pytest.approx(5.0) and later.energies["time_ms"][0] > 5.0
    assert later.energies["external_mj"][-1] == pytest.approx(3.0)  # half of 6
    assert later.energies["kinetic_mj"][-1] == pytest.approx(1.0)  # as it is
    taken = 0.5 * (2.0 + 3.0 + 4.0 + 5.0)
    assert later.energies["kinetic_ratio"][-1] == pytest.approx(1.0 / taken)
    assert later.energies["energy_error"][-1] == pytest.approx(3.5 / 3.0)
    assert len(later.contacts["time_ms"]) == len(later.energies["time_ms"])


@pytest.mark.parametrize("test", ["compaction", "pull-out"])
def test_shells_have_nothing_to_press_or_to_pull_out(test):
    with pytest.raises(InputError, match=rf"model.scale.*{test}"):
        resolve(variant="1", scale="macro", preset="quick", test=test)
