"""Pieces of loops: strain at given forces, contraction, defaults of their tests; inlays that a strip counts."""

from types import SimpleNamespace

import numpy as np
import pytest
from export_sample import cost, quality, strip

from knittest.base.files import configs_dir
from knittest.base.history import History, Specimen
from knittest.config.loading import resolve
from knittest.laboratory.biaxial.test import TAUT_SHARE, BiaxialTest
from knittest.laboratory.cantilever import meso_strip
from knittest.laboratory.cantilever.test import Cantilever
from knittest.laboratory.forming.test import Forming
from knittest.laboratory.quality_checks import _lasting_overlap, _recovery_rows
from knittest.laboratory.strips import inlays_across, modelled_width, whole_repeats, yarns_across
from knittest.laboratory.tensile.test import knit_results
from knittest.models.contact_tracker import PORTION, SMALL_PORTION, ContactTracker
from knittest.runs.run_files import compare_run, references_of
from knittest.solve.relaxation import Relaxation
from knittest.solve.state import SimulationCost


def strip_of(variant, *sets, direction="warp", test="tensile"):
    return resolve(variant=variant, test=test, scale="meso", preset="quick", direction=direction, sets=list(sets))


def history():
    """A strip 10 mm wide and 40 mm long along y, pulled by 20 %, that contracts by a tenth."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(0.0, 10.0, 21), np.linspace(0.0, 40.0, 41)))
    share = np.linspace(0.0, 1.0, 101)
    frames = [
        SimpleNamespace(time=s, position=np.column_stack([(1.0 - 0.1 * s) * x, (1.0 + 0.2 * s) * y, 0.0 * x]))
        for s in (0.0, 0.5, 1.0)
    ]
    curve = {"time_ms": share, "strain_pct": 20.0 * share, "force_n": 10.0 * 2.0 * 0.2 * share}
    return SimpleNamespace(curve=curve, frames=frames)


def test_strain_at_forces_and_contraction_of_a_strip_that_stretches_evenly():
    found = knit_results(history(), {"width_mm": 10.0}, axis=1)
    at = {name: value for name, value in found.items() if name.startswith("strain_pct_at")}
    assert list(at) == [f"strain_pct_at_n_per_mm.{force}" for force in (0.01, 0.02, 0.05, 0.1, 0.2)]
    assert at["strain_pct_at_n_per_mm.0.2"] == pytest.approx(10.0, abs=0.2)
    assert found["largest_force_n_per_mm"] == pytest.approx(0.4)
    assert found["strain_at_largest_force_pct"] == pytest.approx(20.0)
    assert found["contraction_pct"] == pytest.approx(10.0)


def test_a_strip_without_inlays_along_it_is_pulled_farther_and_more_slowly():
    along, across = strip_of("weft-only"), strip_of("weft-only", direction="weft")
    assert along.pulls_loops and not across.pulls_loops
    assert (along.rig.max_strain, along.solver.speed) == (40.0, 0.5)
    assert across.rig.max_strain == strip_of("1").rig.max_strain == 4.0
    stated = strip_of("weft-only", "rig.max_strain=25", "solver.speed=1.5")
    assert (stated.rig.max_strain, stated.solver.speed) == (25.0, 1.5)


@pytest.mark.parametrize(
    ("variant", "sets", "loops"),
    [("jersey", (), True), ("weft-only", (), False), ("weft-only", ("rig.ratio=0",), True), ("1", (), False)],
)
def test_a_square_without_inlays_in_the_strained_directions_runs_until_its_loops_are_taut(variant, sets, loops):
    run = strip_of(variant, "rig.side=10", *sets, test="biaxial")
    assert run.pulls_loops == loops
    assert (run.rig.max_strain, run.solver.speed) == ((40.0, 0.2) if loops else (4.0, 2.0))
    rig = BiaxialTest(run, np.zeros(1, np.int64), 1, np.full(2, 10.0))
    assert rig.locks == loops and rig.locked_share == TAUT_SHARE


def test_a_strip_of_loops_that_does_not_fail_is_compared():
    """It has no fracture strain, so that no peak lies beyond a failure."""
    run, curve = strip_of("jersey"), {"time_ms": np.arange(3.0), "strain_pct": np.arange(3.0), "force_n": np.ones(3)}
    specimen = Specimen(History(strip(2, 2)[0], curve, {"time_ms": np.arange(3.0)}, []), {}, quality(), cost(), {})
    assert "unjudged" not in compare_run(run, [specimen], references_of(run, ())).summary


def test_loops_are_softer_than_their_legs_side_by_side():
    """Half of the yarn of a loop twists. With EI / GJ = 1 only its length counts."""
    fabric = strip_of("jersey", "fabric.knitting.torsion_ratio=1").fabric
    legs = 2.0 * fabric.knitting.bending_stiffness_n_mm2 * fabric.density_per_mm.of("warp")
    assert fabric.yarn_bending_n_mm("warp") == pytest.approx(legs * 2.0 * fabric.course_spacing / fabric.loop_length_mm)
    softer = strip_of("jersey", "fabric.knitting.torsion_ratio=0.2").fabric
    assert softer.yarn_bending_n_mm("warp") == pytest.approx(fabric.yarn_bending_n_mm("warp") / 3.0)


@pytest.mark.parametrize(("variant", "speed"), [("weft-only", 0.1), ("0-90-0", 0.2), ("1", 0.2)])
def test_blanks_whose_loops_carry_a_direction_are_formed_slowly(variant, speed):
    run = resolve(variant=variant, test="forming", scale="meso", preset="quick")
    assert run.solver.speed == speed


def test_a_strain_that_the_fabric_file_states_stands(tmp_path):
    text = (configs_dir() / "fabrics" / "jersey.yaml").read_text(encoding="utf-8")
    path = tmp_path / "f.yaml"
    path.write_text(text + "rigs: {tensile: {max_strain: 90}}\n", encoding="utf-8")
    assert resolve(fabric=path, test="tensile", scale="meso", direction="warp").rig.max_strain == 90.0


@pytest.mark.parametrize(
    ("variant", "asked", "wales", "inlays"),
    [
        ("1", 13, 13, 13),
        ("warp-every-second-wale", 13.6, 14, 7),  # 6.8 repeats
        ("warp-every-second-wale", 12.4, 12, 6),  # 6.2 repeats
        ("warp-every-second-wale", 1.5, 2, 1),
    ],
)
def test_a_strip_has_whole_repeats_of_its_inlays(variant, asked, wales, inlays):
    """Thirteen wales with seven inlays would carry and bend as fourteen do, on the width of thirteen."""
    run = strip_of(variant, f"rig.width={asked / 0.28}")
    assert yarns_across(run, "warp") == wales
    assert inlays_across(run, "warp") == inlays
    assert modelled_width(run, "warp") == pytest.approx(wales / 0.28)
    assert inlays / modelled_width(run, "warp") == pytest.approx(run.fabric.inlay_density_per_mm("warp"))


def test_a_rare_inlay_is_in_the_strip(tmp_path):
    """Seven wales of a repeat of eight would hold none, so that loops alone would carry."""
    path = file_with_pattern(tmp_path, ".......x")
    run = resolve(fabric=path, test="tensile", scale="meso", preset="quick", direction="warp", sets=["rig.width=25"])
    assert (yarns_across(run, "warp"), inlays_across(run, "warp")) == (8, 1)


@pytest.mark.parametrize(("pattern", "side", "wales"), [("xx", 25.0, 7), ("x.", 25.0, 8), ("x...", 20.0, 4)])
def test_squares_have_whole_repeats_of_their_inlays(tmp_path, pattern, side, wales):
    """Wales of 100 / 28 mm: 7.0 or 5.6 of them."""
    fabric = resolve(fabric=file_with_pattern(tmp_path, pattern), test="biaxial", scale="meso", direction="warp").fabric
    assert whole_repeats(fabric, "warp", side) == wales


def file_with_pattern(folder, pattern):
    text = (configs_dir() / "fabrics" / "warp-every-second-wale.yaml").read_text(encoding="utf-8")
    assert "x." in text
    path = folder / "f.yaml"
    path.write_text(text.replace("pattern: x.", f'pattern: "{pattern}"'), encoding="utf-8")
    return path


def test_a_strip_without_inlays_has_the_width_of_its_wales():
    run = strip_of("jersey", f"rig.width={13 / 0.28}")
    assert inlays_across(run, "warp") == 0
    assert modelled_width(run, "warp") == pytest.approx(13 / 0.28)


@pytest.mark.parametrize(("variant", "direction", "times"), [("jersey", "warp", 4), ("weft-only", "weft", 1)])
def test_a_cantilever_without_inlays_along_it_settles_longer(variant, direction, times, monkeypatch):
    run, steps = strip_of(variant, "rig.width=12", "rig.overhang=12", direction=direction, test="cantilever"), []
    prepared = Cantilever().prepare(run)

    def relax(*args, **_):
        steps.append(args[5])
        return Relaxation(1, 1)

    monkeypatch.setattr(meso_strip, "relax", relax)
    meso_strip._StripRelaxation(prepared, run, SimulationCost(), None).settle(100)
    assert steps == [100 * times]


@pytest.mark.parametrize(("variant", "mounted"), [("weft-only", 3.0), ("1", 0.0)])
def test_pressing_soft_loops_by_the_holder_is_part_of_their_mounting(variant, mounted):
    sets = (
        "rig.blank_length=40", "rig.blank_width=40", "rig.stamp.kind=hemisphere", "rig.stamp.hemisphere.radius=8",
        "rig.die.clearance=5", "rig.holder.clearance=5", "rig.depth=5", "rig.blank_holder_force=5",
    )  # fmt: skip
    run = resolve(variant=variant, test="forming", scale="meso", preset="quick", sets=sets)
    assert Forming().prepare(run).rig.mounted_at == mounted


@pytest.mark.parametrize(
    ("soft", "depth", "portion"),
    [(False, 1e-3, PORTION), (True, 1e-6, SMALL_PORTION), (True, 4e-3, 2e-3), (True, 0.1, PORTION)],
)
def test_contacts_of_soft_yarns_found_late_get_half_of_what_the_others_have(soft, depth, portion):
    """Two contacts of yarns of 0.5 mm, one pressed to a ``depth`` over the radius, one open."""
    contacts = SimpleNamespace(
        reach=np.array([1.0, 1.0]),
        piece=np.zeros((2, 2), np.int64),
        offset=np.array([[1.0 - 0.5 * depth, 1.2], [0.0, 0.0], [0.0, 0.0]]),
    )
    group = SimpleNamespace(compliant=soft, images=None, radius=np.full(1, 0.5))
    tracker = SimpleNamespace(group=group, contacts=contacts, count=2, recovering=1)
    assert ContactTracker.portion(tracker) == pytest.approx(portion)


def test_overlap_of_soft_yarns_counts_when_it_stays_longer_than_its_recovery():
    """A tenth of the radius takes 500 portions of 5 steps, 1 ms of steps of 0.4 us: 5 rows of 0.2 ms and two."""
    history, cost = SimpleNamespace(energies={"time_ms": 0.2 * np.arange(20)}), SimpleNamespace(time_step=4e-4)
    run = strip_of("jersey")
    soft, stiff = (SimpleNamespace(model=SimpleNamespace(compliant=one)) for one in (True, False))
    assert _recovery_rows(run, soft, history, cost) == 7
    assert _recovery_rows(run, stiff, history, cost) == 2
    overlap = np.where(np.arange(20) // 3 == 1, 15.0, 0.0)
    assert _lasting_overlap(overlap, 2).max() == 15.0
    assert _lasting_overlap(overlap, 4).max() == 0.0
    assert _lasting_overlap(np.full(3, 15.0), 7).max() == 15.0
