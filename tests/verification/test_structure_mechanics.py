"""Fabrics of other structures against closed forms: stiffness of cells along inlays, strength of strips, repeats."""

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.fabric.relaxation import relaxed_cell
from knittest.fabric.topology import bundle_peak, draw
from knittest.models.meso import build_meso_cell
from knittest.pose import PeriodicBody, Table
from knittest.runs.specimen import run_specimen


def pulse(duration: float) -> Table:
    """Speed that begins and ends at 0, whose travel is 1."""
    time = np.linspace(0.0, duration, 41)
    speed = (1.0 - np.cos(2.0 * np.pi * time / duration)) / duration
    return Table(tuple(time), tuple(speed))


def cell_run(variant: str, *sets: str) -> Run:
    return resolve(
        variant=variant,
        test="cell",
        scale="meso",
        preset="quick",
        sets=["rig.path=warp", *(f"fabric.{s}" for s in sets)],
    )


def stress_at(run: Run, strain: tuple[float, float], repeats: tuple[int, int] = (1, 1)) -> np.ndarray:
    """Nominal stress [N/mm] along x and y of the cell stretched by ``strain`` along both, at rest."""
    cell = relaxed_cell(run.fabric)
    body = PeriodicBody(build_meso_cell(run, cell, *repeats), safety=run.solver.safety, threads=1)
    body.stretch(np.diag([*strain, 0.0]), pulse(4.0))
    body.settle(1e-3, 20_000)
    start = body.nominal_stress()
    body.damping = 0.5
    body.advance(4.0)
    body.settle(1e-3, 20_000)
    return np.diag(body.nominal_stress() - start)[:2]


def straight_stress(run: Run, strain: tuple[float, float]) -> np.ndarray:
    """EA times density of the inlays times the strain [N/mm], along x (weft) and y (warp)."""
    stiffness = {"weft": 0.0, "warp": 0.0}
    for one in run.fabric.inlays:
        axial = one.yarn.youngs_modulus_mpa * one.yarn.load_area_mm2
        stiffness[one.direction] += axial * one.share * run.fabric.density_per_mm.of(one.direction)
    return np.array([stiffness["weft"] * strain[0], stiffness["warp"] * strain[1]])


@pytest.mark.parametrize(
    "variant", ["warp-every-second-wale", "weft-every-second-course", "two-yarns", "weft-only", "rib-weft", "90-0-90-0"]
)
def test_a_cell_is_as_stiff_as_its_straight_inlays(variant: str) -> None:
    """Inlays without crimp, pulled by 0.5 % along both: EA times the density that the patterns leave, within 1 %.

    Loops carry less than this: they bend. They also crimp the inlays of the relaxed cell by up to 0.003 %.
    """
    fabric = resolve(variant=variant, scale="meso").fabric
    fields = {one.field for one in fabric.inlays}
    run = cell_run(variant, *(f"{field}.crimp=0" for field in fields))
    strain = (5e-3, 5e-3)
    found, expected = stress_at(run, strain), straight_stress(run, strain)
    for value, wanted in zip(found, expected, strict=True):
        if wanted > 0.0:
            assert value == pytest.approx(wanted, rel=0.01)


def test_a_doubled_repeat_has_the_same_stresses() -> None:
    """Patterns and stitches written twice describe the same fabric: stresses within 0.5 %."""
    once = cell_run("weft-every-second-course")
    twice = cell_run(
        "weft-every-second-course", "stitches=[kk]",
        "layers=[{direction: warp, pattern: xx}, {direction: weft, pattern: x.x.}]",
    )  # fmt: skip
    strain = (2e-3, 2e-3)
    assert stress_at(twice, strain) == pytest.approx(stress_at(once, strain), rel=5e-3)


def test_exchanged_descriptions_turn_the_inlays() -> None:
    """Two yarns in exchanged layers, of equal densities: their stiffnesses are exchanged, within 1 %."""
    first = {"direction": "warp", "yarn": "{fibre: carbon HT, linear_density: 400, crimp: 0}"}
    layers = "[{{direction: warp, yarn: {a}}}, {{direction: weft, yarn: {b}}}]"
    one, other = first["yarn"], "{fibre: E-glass, linear_density: 600, crimp: 0}"
    strain = (1e-3, 1e-3)
    found = stress_at(cell_run("two-yarns", f"layers={layers.format(a=one, b=other)}"), strain)
    turned = stress_at(cell_run("two-yarns", f"layers={layers.format(a=other, b=one)}"), strain)
    assert found[::-1] == pytest.approx(turned, rel=0.01)


@pytest.mark.parametrize(("pattern", "inlays"), [("x", 8), ("x.", 4)])
def test_a_strip_is_as_strong_as_the_bundle_of_its_inlays(pattern: str, inlays: int) -> None:
    """Eight wales without loops, yarns of scattered strength (Daniels, 1945): within 1 %, half of them in every second.

    The crimp of 0.6 % is pulled out before.
    """
    sets = [
        f"fabric.layers=[{{direction: warp, pattern: {pattern}}}, {{direction: weft}}]", "rig.width=28.6",
        "rig.gauge_length=20", "model.meso.knitting=false",
        "fabric.reinforcing.fracture_strain={value: 2.6, sd: 0.2, source: assumed}",
    ]  # fmt: skip
    run = resolve(
        test="tensile", variant="warp-every-second-wale", scale="meso", preset="quick", direction="warp", sets=sets
    )
    found = run_specimen(run)
    assert found.facts["yarns_across"] == inlays
    (warp,) = run.fabric.inlays_along("warp")
    stiffness = warp.yarn.youngs_modulus_mpa * warp.yarn.load_area_mm2
    expected, _ = bundle_peak(draw(run.fabric, run.variability, warp.name, inlays, 0), stiffness)
    assert found.results["peak_force_n"] == pytest.approx(expected, rel=0.01)
    assert found.results["peak_force_n_per_mm"] == pytest.approx(expected / (800.0 / 28.0), rel=0.01)
