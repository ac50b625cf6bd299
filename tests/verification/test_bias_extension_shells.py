"""Shells of a strip on the bias against pin-jointed yarns: energy at rest, force and angle of the pull."""

import numpy as np
import pytest
from shell_cases import Solid
from test_bias_extension import pin_jointed

from knittest.config.loading import resolve
from knittest.kernels.shell_output import shell_energies
from knittest.kernels.shell_state import build_shells
from knittest.laboratory.base import PreparedSpecimen
from knittest.laboratory.bias_extension.strip import BiasStrip, bias_mesh
from knittest.laboratory.bias_extension.test import WARP, BiasExtension, BiasExtensionTest, ends_of
from knittest.laboratory.bias_extension.zones import material_points, zone_table
from knittest.models.macro import build_sheet
from knittest.pose import linear_laminate
from knittest.solve.state import SILENT

SHEAR = 0.1  # S = SHEAR gamma [N/mm]
STRIP = BiasStrip(200.0, 100.0)


def laminate(ratio: float):
    """Linear, with fibres ``ratio`` times as stiff as the shear; free of drilling, as tests of the laboratory are."""
    return linear_laminate((SHEAR * ratio,) * 2, (0.05, 0.05), SHEAR, 1.0, drilling=0.0)


def test_pin_jointed_yarns_strain_no_shell_and_store_the_work_of_the_clamp():
    points, cells = bias_mesh(STRIP.length, STRIP.width, 12.0)
    solid = Solid(points, build_shells(points, cells, np.array(WARP)), laminate(1e4))
    gamma = np.linspace(0.0, 0.7, 200)
    force = STRIP.force(SHEAR * gamma, 0.5 * SHEAR * gamma, gamma)
    work = np.trapezoid(force, [STRIP.travel(g) for g in gamma])
    solid.place(np.column_stack([pin_jointed(points[:, :2], STRIP, 0.7) - points[:, :2], np.zeros(len(points))]))
    *elastic, control = shell_energies(solid.nodes, solid.shells, solid.laminate)
    assert sum(elastic) == pytest.approx(work, rel=1e-4) and control < 1e-9 * work


@pytest.mark.parametrize(("ratio", "low", "high", "angle"), [(1e2, 0.76, 0.82, 22.3), (1e4, 0.98, 1.0, 29.5)])
def test_stiff_yarns_come_to_the_closed_form(ratio, low, high, angle):
    """Force at 20 deg over that of pin-jointed yarns, and the middle's angle for 30 deg, whose limit both are for ever
    stiffer yarns; soft ones stretch, so that less is sheared. The hourglass control has nothing to hold.
    """
    sets = ("rig.max_angle=31", "solver.speed=0.4", "solver.damping=0.02")
    run = resolve(variant="cao2008-weave", scale="macro", preset="quick", test="bias-extension", sets=sets)
    points, cells = bias_mesh(STRIP.length, STRIP.width, 12.0)
    model = build_sheet(points, cells, laminate(ratio), 7e-4, 1.0, WARP)
    prepared = PreparedSpecimen(model, BiasExtensionTest(run, STRIP, *ends_of(points, STRIP)))
    history, _ = BiasExtension().solve(prepared, run, SILENT)
    near = np.abs(history.curve["shear_angle_deg"] - 20.0) < 1.0
    expected = float(STRIP.force(*(np.deg2rad([a]) for a in (20.0 * SHEAR, 10.0 * SHEAR, 20.0)))[0])
    assert low < history.curve["force_n"][near].mean() / expected < high
    table = zone_table(history, STRIP, material_points(run, history))
    assert np.interp(30.0, table["shear_angle_deg"], table["middle_mean_deg"]) == pytest.approx(angle, abs=0.5)
    assert history.energies["hourglass_mj"][-1] < 0.01 * history.energies["internal_fabric_mj"][-1]
