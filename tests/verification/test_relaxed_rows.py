"""Rows at the ends of which a cell of soft loops is relaxed: no inertia, no damping, and all energy accounted for."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from knittest.base.history import History
from knittest.config.loading import resolve
from knittest.config.settings import parse_set
from knittest.laboratory.cell.test import Cell, unsettled_rows
from knittest.solve.state import SILENT

JERSEY = Path(__file__).parents[2] / "configs" / "fabrics" / "jersey.yaml"


#: fewer than usual, for speed
ROWS = 40


def stretched(*sets: str) -> tuple[History, float]:
    """History and area [mm2] of a cell of jersey stretched by 15 % along its courses, the wales held."""
    usual = ("rig.path=weft", "rig.transverse=held", "rig.max_strain=15")
    run = resolve(
        test="cell", fabric=JERSEY, scale="meso", preset="quick", sets=[parse_set(text) for text in (*usual, *sets)]
    )
    cell = Cell()
    prepared = cell.prepare(run)
    prepared.mount.relaxed_rows = ROWS
    history, cost = cell.solve(prepared, run, SILENT)
    assert cell.assess(run, prepared, history, cost).failures == ()
    return history, float(prepared.facts["area_mm2"])


@pytest.fixture(scope="module")
def smooth() -> tuple[History, float]:
    return stretched("fabric.contact.friction_coefficient=0")


def test_work_is_stored_where_nothing_rubs(smooth):
    """The integral of the force over the strain is the growth of the elastic energy of the loops and contacts."""
    history, area = smooth
    energies, curve = history.energies, history.curve
    stored = energies["internal_knit_mj"] + energies["contact_mj"]
    force, strain = curve["weft_n_per_mm"], 0.01 * curve["strain_pct"]
    half = len(strain) // 2
    work = area * np.trapezoid(force[half:], strain[half:])
    assert stored[-1] - stored[half] == pytest.approx(work, rel=0.005)
    assert energies["relaxation_mj"][-1] < 0.02 * energies["energy_input_mj"][-1]
    assert (energies["kinetic_mj"] > 0.0).any()  # before rows come to rest


def test_the_speed_does_not_matter(smooth):
    """At twice the speed the forces at rest are the same."""
    fast, _ = stretched("fabric.contact.friction_coefficient=0", "solver.speed=0.8")
    at = np.linspace(5.0, 15.0, 11)
    for name in ("weft_n_per_mm", "warp_n_per_mm"):
        slow, quick = (np.interp(at, one.curve["strain_pct"], one.curve[name]) for one in (smooth[0], fast))
        assert quick == pytest.approx(slow, abs=0.02 * slow.max())


def test_rows_that_are_not_at_rest_are_refused(smooth):
    """More than a tenth of them, or the last one."""
    history, _ = smooth
    residual, run = history.contacts["residual_pct"], resolve(test="cell", fabric=JERSEY, scale="meso", preset="quick")
    assert unsettled_rows(run, history) == "" and len(residual) == ROWS
    last, many = residual.copy(), residual.copy()
    last[-1], many[: ROWS // 10 + 1] = 6.0, 6.0
    for wrong in (last, many):
        text = unsettled_rows(run, replace(history, contacts=history.contacts | {"residual_pct": wrong}))
        assert "are not in equilibrium" in text
