"""Blank: waves along its rim, and bending of yarns in the plane with its warning and its bands."""

from types import SimpleNamespace

import numpy as np
import pytest
from plain import plain

from benchmarks.forming_bands import band_width, difference, sides
from knittest.base.history import Quality
from knittest.config.loading import resolve
from knittest.kernels.biaxial import sample_law
from knittest.kernels.in_plane_blocks import SCRATCH, bend_energy, bend_forces, gather_bends
from knittest.kernels.shell_state import Laminate
from knittest.laboratory.base import fabric_laminate, limited_laminate
from knittest.laboratory.forming import test as forming
from knittest.laboratory.forming.results import WINDOW, rim_waves
from knittest.laboratory.forming.rig import no_bending_note
from knittest.runs.preflight.command import counterparts
from knittest.runs.preflight.model import model_facts, model_lines

SIDE = 100.0


def rim(step: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """Points round a square blank (n, 2) [mm] and the way along it (n,) [mm]."""
    way = np.arange(0.0, 4.0 * SIDE, step)
    side, s = np.divmod(way, SIDE)
    s = s - 0.5 * SIDE
    half = np.full_like(s, 0.5 * SIDE)
    corners = [(s, -half), (half, s), (-s, half), (-half, -s)]
    return np.array([np.column_stack(c)[k] for k, c in ((k, corners[int(q)]) for k, q in enumerate(side))]), way


def test_a_flange_that_lifts_tilts_and_dishes_has_no_waves() -> None:
    points, _ = rim()
    x, y = points.T
    found = rim_waves(points, 30.0 + 0.2 * x - 0.1 * y + 4e-3 * (x**2 + y**2) - 2e-3 * x * y, 0.5)
    assert found.largest < 1e-9 and found.count == 0


@pytest.mark.parametrize("waves", [10, 14])
def test_waves_are_counted_from_crest_to_trough(waves: int) -> None:
    """a sin(2 pi n s / l) has 2 a between crest and trough, less what the mean over a window takes: sinc(n w / l)."""
    points, way = rim()
    length = 4.0 * SIDE
    found = rim_waves(points, 20.0 + 3.0 * np.sin(2.0 * np.pi * waves * way / length), 0.5)
    assert found.count == waves
    assert found.largest == pytest.approx(6.0 * np.sinc(waves * WINDOW / length), rel=0.08)


def test_small_waves_do_not_count_and_a_crest_across_the_start_counts_once() -> None:
    points, way = rim()
    ripple = 0.1 * np.sin(2.0 * np.pi * 20 * way / (4.0 * SIDE))
    found = rim_waves(points, ripple + 3.0 * np.cos(2.0 * np.pi * 10 * way / (4.0 * SIDE)), 0.5)
    assert found.count == 10
    assert rim_waves(points, ripple, 0.5).count == 0


def test_a_crest_stands_over_the_troughs_beside_it_not_over_the_lowest_of_the_rim() -> None:
    """Even waves of 2 a on a rim that is higher on one side, which no paraboloid takes out (cubic in x)."""
    points, way = rim()
    length = 4.0 * SIDE
    uneven = 1.5 * (points[:, 0] / (0.5 * SIDE)) ** 3
    found = rim_waves(points, uneven + np.sin(2.0 * np.pi * 12 * way / length), 0.5)
    assert found.count == 12
    assert np.ptp(found.height) > 1.2 * found.largest
    assert found.largest == pytest.approx(2.0 * np.sinc(12 * WINDOW / length), rel=0.15)


STATED = ("fabric.macro.in_plane_bending.warp=4.2", "fabric.macro.in_plane_bending.weft=3.47")
OFF = ("rig.in_plane_bending=false",)
#: a blank and tools that are small, and made in a second
BLANK, SIZE = 120.0, 12.0
SMALL = (
    f"model.macro.element_size={SIZE}", f"rig.blank_length={BLANK}", f"rig.blank_width={BLANK}", "rig.depth=10",
    "rig.stamp.t.bar_length=56", "rig.stamp.t.bar_width=20", "rig.stamp.t.stem_length=36", "rig.stamp.t.stem_width=20",
    "rig.stamp.t.edge_radius=4", "rig.stamp.t.outer_corner_radius=5", "rig.stamp.t.inner_corner_radius=12",
    "rig.die.clearance=6", "rig.die.edge_radius=4", "rig.holder.clearance=6",
)  # fmt: skip


def blank(*sets: str, scale: str = "macro", variant: str = "1"):
    small = SMALL if scale == "macro" else ()
    return resolve(test="forming", variant=variant, scale=scale, preset="quick", sets=(*small, *sets))


@pytest.fixture(scope="module")
def prepared():
    """Blanks with and without bending of yarns in the plane."""
    return {sets: forming.Forming().prepare(blank(*sets)) for sets in ((), OFF)}


def bent(model, curvature: float) -> tuple[float, float]:
    """Energy [mJ] of yarns in the plane, and their largest force [N], of warps bent along arcs."""
    nodes, shells, bends = model.nodes, model.shells, model.bends
    nodes.position[0] += 0.5 * curvature * nodes.position[1] ** 2
    nodes.force[:] = 0.0
    plain(bend_forces)(0, bends.first.size - 1, 0.0, nodes, shells.fail_time, bends, np.zeros(SCRATCH))
    plain(gather_bends)(0, model.n_nodes, nodes, bends)
    return plain(bend_energy)(nodes, bends), float(np.abs(nodes.force).max())


def test_yarns_of_a_blank_bend_in_the_plane_as_stiffly_as_the_fabric_says(prepared):
    """B k^2 / 2 an area, the blank less half a shell at the ends of the warps; nothing where it is turned off."""
    on, off, curvature, area = prepared[()].model, prepared[OFF].model, 1e-4, BLANK * (BLANK - SIZE)
    energy, force = bent(on, curvature)
    assert energy == pytest.approx(0.5 * 4.2 * curvature**2 * area, rel=0.01) and force > 0.0
    assert on.bends.stiffness[1].sum() == pytest.approx(3.472 * area, rel=1e-4)
    assert off.bends.alive.size == 0 and off.critical_step > on.critical_step


def test_a_blank_whose_yarns_do_not_bend_in_the_plane_says_so_before_and_after_the_run(prepared, monkeypatch):
    """In knittest check and as a warning, with the switch that turns it on."""
    (note,) = prepared[OFF].notes
    assert note.endswith("use --set rig.in_plane_bending=true") and prepared[()].notes == ()
    run = blank(*OFF)
    assert any(note in line for line in model_lines(run, model_facts(run, prepared[OFF])))
    passed = Quality(0.0, 0.0, 0.0, 0.0, 0.0, True, ())
    monkeypatch.setattr(forming, "assess", lambda *_: passed)
    history = SimpleNamespace(contacts={"tool_penetration_max_um": np.zeros(1)})
    found = [forming.Forming().assess(run, prepared[sets], history, None).warnings for sets in (OFF, ())]
    assert found == [(note,), ()]


def test_yarns_bend_by_themselves_and_a_fabric_without_yarns_is_told_where_to_look():
    assert no_bending_note(blank(scale="meso")) == ()
    (note,) = no_bending_note(blank(variant="cao2008-weave"))
    assert "has no inlays" in note and "fabric.macro.in_plane_bending.warp" in note


@pytest.mark.parametrize(("value", "verdict"), [("4.2", "agrees"), ("15.0", "differs"), ("0.28", "differs")])
def test_the_bending_in_the_plane_is_held_against_the_yarns(value, verdict):
    """EI of one yarn, or their density, in the place of the product is found."""
    rows = counterparts(blank(STATED[1], f"fabric.macro.in_plane_bending.warp={value}").fabric)
    (row,) = [r for r in rows if r.name == "warp bending stiffness in the plane"]
    assert (row.verdict, row.found) == (verdict, pytest.approx(4.2))
    assert not [r for r in counterparts(blank(*OFF).fabric) if r.field.startswith("macro.in_plane")]


def test_width_of_bands_and_difference_of_neighbours():
    """Half of the length of a wave across the rim, alike on each mesh; a zigzag of shells is one shell wide."""
    for size in (2.0, 3.0):
        n = round(330.0 / size)
        wave = 20.0 * np.sin(2.0 * np.pi * (np.arange(n) + 0.5) * size / 66.0)
        rim = sides(np.add.outer(wave, wave))
        assert [len(side) for side in rim] == [round(30.0 / size)] * 4
        assert band_width(rim, size) == pytest.approx(33.0)
        # a sine of amplitude A over n steps of a half wave changes by 2 A / n a step in the mean
        assert difference(rim) == pytest.approx(2 * 20.0 / (33.0 / size), rel=0.02)
    zigzag = sides(np.add.outer(np.zeros(60), 10.0 * (-1.0) ** np.arange(60)))
    assert band_width(zigzag[:2], 5.5) == pytest.approx(5.5, rel=0.05) and difference(zigzag[:2]) == 20.0
    assert band_width(sides(np.full((60, 60), 3.0)), 5.5) == np.inf


def test_the_weft_of_a_soft_blank_keeps_a_share_of_its_stiffness_and_breaks_at_its_force():
    """With a law of two strains; a knit without inlays keeps its law."""
    warp, weft = np.linspace(-0.2, 0.25, 19), np.linspace(-0.03, 0.03, 25)
    rows = [
        [100.0 * a, 100.0 * b, 0.05 * a + 2.0 * max(a + 0.2 * b, 0.0) ** 2, 1e3 * b + 0.4 * max(a + 0.2 * b, 0.0) ** 2]
        for a in warp
        for b in weft
    ]
    assumed = {"source": "assumed"}

    def soft(variant: str) -> tuple[Laminate, Laminate]:
        run = blank(variant=variant)
        data = run.model_dump(mode="json")
        both = {d: {"value": v, **assumed} for d, v in (("warp", 50.0), ("weft", 3.0))}
        data["fabric"]["macro"] |= {
            "biaxial": {"points": rows, **assumed}, "fracture_strain": both,
            "bending_stiffness": {d: {"value": 0.01, **assumed} for d in ("warp", "weft")},
            "shear": {"stiffness": {"value": 0.001, **assumed}},
        }  # fmt: skip
        run = type(run).model_validate(data)
        return fabric_laminate(run), limited_laminate(run, 0.05)

    whole, limited = soft("weft-only")
    assert limited.energy_tangents[0, 1] < 0.15 * whole.energy_tangents[0, 1]
    strains = np.array([[0.0, whole.fail_strain[1]]]), np.array([[0.0, limited.fail_strain[1]]])
    forces = [sample_law(one, law)[0, 1] for one, law in zip(strains, (whole, limited), strict=True)]
    assert forces[1] == pytest.approx(forces[0], rel=0.05) and forces[0] == pytest.approx(30.0, rel=0.02)
    assert limited.fail_strain[0] == whole.fail_strain[0]
    whole, limited = soft("jersey")
    assert np.array_equal(limited.energy, whole.energy)
