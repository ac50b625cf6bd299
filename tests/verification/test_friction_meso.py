"""Friction of yarns between plates: level, pressure map, penetration, and what overlaps at the start."""

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.laboratory.friction.rig import PRESSED, pressure_map
from knittest.laboratory.friction.test import map_cell
from knittest.runs.specimen import run_specimen
from knittest.solve.state import Observer

#: a small piece under a twentieth of the force: the fall of the plate is 5 % of all work (0.1 % with the strip of the
#: paper), and its drag takes 28 % of the work up to the first rows that are judged, before anything is pulled
FORCE = 100.0
SETS = (
    "rig.width=11", "rig.length=40", "rig.plate_length=18", "rig.plate_width=11", "rig.travel=1.2",
    f"rig.normal_force={FORCE}", "solver.speed=1", "solver.max_kinetic_ratio=10",
    "solver.max_contact_damping=40",
)  # fmt: skip


class Listener(Observer):
    """Hears which yarns overlap."""

    def __init__(self):
        self.heard = []

    def overlaps(self, found):
        self.heard.append(found)


@pytest.fixture(scope="module")
def pulled():
    options = {"variant": "1", "scale": "meso", "preset": "quick", "test": "friction", "direction": "warp"}
    run = resolve(**options, sets=list(SETS), accept_limits=True)
    listener = Listener()
    specimen = run_specimen(run, observer=listener)
    assert len(listener.heard) == 1
    return run, specimen, listener.heard[0]


def test_the_level_is_two_mu_normal_force_although_yarns_carry_it(pulled):
    """F_R = 2 mu F_N (Coulomb), before the first course leaves the plates and gives its compression back."""
    _, specimen, _ = pulled
    assert specimen.results["pull_force_kinetic_n"] == pytest.approx(2.0 * 0.075 * FORCE, rel=0.01)
    assert specimen.results["normal_force_error_pct"] < 1.0
    assert specimen.quality.failures == ()


def test_energies_count_from_the_pull_on_and_the_curve_has_the_pressing(pulled):
    history = pulled[1].history
    assert history.energies["time_ms"][0] >= PRESSED > history.curve["time_ms"][0]
    assert abs(history.energies["external_mj"][0]) < 0.01 * history.energies["external_mj"][-1]


def test_losses_are_over_the_work_of_the_pull_at_least(pulled):
    """The plate that a recovering strip lifts takes work from the sum of all outside forces."""
    run, specimen, _ = pulled
    energies = specimen.history.energies
    least = specimen.results["pull_force_kinetic_n"] * run.rig.travel_mm
    assert energies["energy_input_mj"][-1] >= 0.9 * least
    assert (energies["energy_input_mj"] >= np.abs(energies["external_mj"])).all()


def test_the_pressure_map_adds_up_to_the_normal_force(pulled):
    run, specimen, _ = pulled
    found = pressure_map(specimen.history, map_cell(run))
    assert found.force == pytest.approx([FORCE, FORCE], rel=0.01)
    table = found.table()
    area = map_cell(run) ** 2
    for face in ("back", "face"):
        assert table[f"pressure_{face}_mpa"].sum() * area == pytest.approx(FORCE, rel=0.01)
    under = table["y_mm"] < specimen.history.frames[0].position[:, 1].min() + 18.0 + 1.0
    assert table["pressure_face_mpa"][~under].max() == 0.0, "pressure where no plate is"


def test_the_crowns_of_the_loops_carry_the_plates(pulled):
    results = pulled[1].results
    shares = [results[f"plate_load_on_{part}_pct"] for part in ("warp", "weft", "knit")]
    assert sum(shares) == pytest.approx(100.0)
    assert shares[2] > 99.0


def test_plates_sink_in_less_than_elements_deform(pulled):
    """The deepest node is at its force over its penalty, which the contact table says for every sample."""
    specimen = pulled[1]
    contacts = specimen.history.contacts
    assert contacts["tool_penetration_max_um"].max() == specimen.results["plate_penetration_um"] > 0.0
    assert specimen.results["penetration_over_deformation_pct"] < 100.0
    assert np.all(contacts["penetration_p50_pct"] <= contacts["penetration_p99_pct"])
    assert np.all(contacts["penetration_p99_pct"] <= contacts["penetration_max_pct"])


def test_overlaps_at_the_start_are_listed_and_judged(pulled):
    _, specimen, overlaps = pulled
    assert overlaps == specimen.history.overlaps
    assert overlaps.count > 0
    assert specimen.quality.overlap_at_start == overlaps.largest
    share = float(overlaps.worst[0].split(" by ")[1].removesuffix(" %"))
    assert share == pytest.approx(100.0 * overlaps.largest, abs=0.06)
    assert "warp yarn" in overlaps.worst[0]
    assert "weft yarn" in overlaps.worst[0]
