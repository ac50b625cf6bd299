"""The cell at rest under draw-in: balance of its crossings, a stated tension, loops that lock, meshes too coarse."""

from functools import cache

import pytest

from docs.shear_cells import USUAL, Case
from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.runs.specimen import prepare
from knittest.solve.relaxed_cell import mesh_fault, relax_at_shortening, relaxed_contact_cell, with_loop_shortening

MEASURED = [one for one in Case("2", USUAL, 0.9).sets if "section" in one]
LOOPS, FINE = "fabric.knitting.", ("model.meso.elements_per_loop=48", "model.meso.elements_per_wave=12")


@cache
def run_of(*sets: str, variant: str = "1", scale: str = "meso") -> Run:
    return resolve(variant=variant, scale=scale, preset="quick", test="picture-frame", sets=sets)


def test_crossings_of_a_settled_cell_are_in_balance():
    """Weft and legs press the warp onto the sinker arcs: the warp bears as much from either side, a leg half of it."""
    cell = relaxed_contact_cell(run_of(f"{LOOPS}loop_shortening=1"))
    force = {kind: c.normal_force * c.count for kind, c in cell.crossings.items()}
    assert force["warp-weft"] == pytest.approx(force["warp-knit"], rel=0.01)
    assert force["weft-knit"] == pytest.approx(force["warp-weft"], rel=0.05)  # legs lean: not all is along z
    assert cell.residual < 0.01
    assert cell.crossings["knit-knit"].count == pytest.approx(2.0)


def test_more_draw_in_presses_more_and_v2_has_room():
    runs = (run_of(f"{LOOPS}loop_shortening=1", variant=variant) for variant in ("1", "2"))
    tight, loose = ([relax_at_shortening(run, p).tension for p in (0.0, 0.01, 0.02)] for run in runs)
    assert tight == sorted(tight) and loose == sorted(loose)
    assert tight[1] > 5.0 * loose[1] > 0.0


def test_tension_grows_with_draw_in_where_heads_of_loops_come_to_lie_on_each_other():
    """A second crossing of the same pieces was lost: 2.29, 7.63 and 4.00 N at 3, 3.6 and 4 %."""
    tensions = [relax_at_shortening(run_of(f"{LOOPS}loop_shortening=1"), p).tension for p in (0.03, 0.036, 0.04, 0.05)]
    assert tensions == sorted(tensions)


def test_a_stated_tension_is_met_by_a_draw_in():
    run = run_of(f"{LOOPS}tension=0.4")
    cell = relaxed_contact_cell(run)
    assert cell.tension == pytest.approx(0.4, rel=0.01)
    drawn = with_loop_shortening(run).fabric.knitting
    assert drawn.tension is None and drawn.loop_shortening.value == pytest.approx(100.0 * cell.draw_in)
    assert drawn.loop_shortening.source == "derived"


@pytest.mark.parametrize(
    ("field", "said"),
    [("tension=0.01", r"at least 0\.(09|1)"), ("tension=19", "at most 9\\."), ("loop_shortening=10", "at most 3\\.")],
)
def test_a_number_that_no_fabric_can_have_is_refused_with_one_that_would_do(field: str, said: str):
    """Loops of their measured length are under 0.1 N (to a tenth); shortened by 4 % they sink in by over 5 %."""
    with pytest.raises(InputError, match=f"fabric.knitting.{field.split('=')[0]} = .*{said}"):
        with_loop_shortening(run_of(LOOPS + field, "solver.max_penetration=5"))


def test_a_cell_whose_sections_hold_all_fibres_comes_to_rest():
    """V2 in ellipses of its measured height, 1.19 x 0.93 mm, along which its loops bend: it was refused."""
    cell = relaxed_contact_cell(run_of(f"{LOOPS}loop_shortening=1", *FINE, *MEASURED, variant="2"))
    assert cell.residual < 0.01
    assert cell.rest.thickness == pytest.approx(2.74, abs=0.02)


def test_a_specimen_of_loops_that_lock_is_not_made():
    with pytest.raises(InputError, match=r"loop_shortening = 10 %: the loops lock: yarns penetrate .*; expected"):
        prepare(run_of(f"{LOOPS}loop_shortening=10", "rig.side=22", "solver.max_penetration=5"))


def test_yarns_that_do_not_touch_hold_no_tension():
    with pytest.raises(InputError, match=r"model\.meso\.contact = false"):
        with_loop_shortening(run_of(f"{LOOPS}loop_shortening=1", "model.meso.contact=false"))


def test_both_are_refused():
    with pytest.raises(InputError, match="excludes loop_shortening"):
        run_of(f"{LOOPS}loop_shortening=1", f"{LOOPS}tension=0.1")


def test_a_mesh_that_presses_where_fine_ones_do_not_is_refused_with_one_that_would_do():
    """30 beams a loop and 4 a wave press 2.5 times as hard; what is advised passes; nothing is said of other runs."""
    reason = mesh_fault(run_of(f"{LOOPS}loop_shortening=1"))
    assert reason.startswith("contact forces of the relaxed cell are 2.")
    assert "model.meso.elements_per_loop=48 and elements_per_wave=12" in reason
    assert mesh_fault(run_of(f"{LOOPS}loop_shortening=1", *FINE)) == ""
    assert mesh_fault(run_of()) == mesh_fault(run_of(f"{LOOPS}loop_shortening=1", scale="macro")) == ""
    assert with_loop_shortening(run_of()) is run_of()
