"""Yarns with a soft shell in a fabric file, the paths of their card, and the comparison with measured curves."""

from pathlib import Path

import numpy as np
import pytest

from docs.knits import Measured, bracket, deviations, measured, strain_at
from knittest.base.errors import InputError
from knittest.base.files import structures
from knittest.config.fabric import Fabric
from knittest.config.loading import resolve
from knittest.fabric.relaxation import relaxed_cell, start_of_relaxation
from knittest.laboratory.base import PreparedSpecimen
from knittest.materials.energy_fit import NoConvexEnergyError
from knittest.models.meso import build_meso_cell
from knittest.runs.deck.differences import deck_differences
from knittest.solve.relaxed_cell import relaxed_fabric, with_rest_spacing
from knittest.studies.homogenise import card
from knittest.studies.homogenise.derived_card import paths_to_run
from knittest.studies.homogenise.plan import KNIT_ANGLES, SOFT_ANGLES, PlannedTest, angles_without_inlays

SHELL = ["soft_shell.outer_diameter=1.2", "soft_shell.rigidity=0.001", "soft_shell.exponent=2.4", "degree_of_set=0"]


@pytest.mark.parametrize("knit", ["jersey", "garter", "rib", "seed"])
def test_the_shipped_knits_have_soft_yarns_and_are_no_structures_to_start_from(knit: str) -> None:
    run = resolve(test="cell", variant=f"acrylic-{knit}", scale="meso", preset="quick", sets=["rig.path=weft"])
    assert run.fabric.has_soft_yarns and run.solver.speed == 8.0 and run.fabric.knitting.degree_of_set.value == 0.0
    assert f"acrylic-{knit}" not in structures()
    sources = [run.fabric.knitting.soft_shell.outer_diameter.source, run.fabric.knitting.beam_diameter.source]
    assert sources == ["tuned", "tuned"]


def test_a_shell_is_for_loops_alone_and_wider_than_its_core() -> None:
    sets = [f"fabric.knitting.{value}" for value in SHELL]
    with pytest.raises(InputError, match="soft_shell: is for fabrics without inlays"):
        resolve(test="cell", variant="weft-only", scale="meso", sets=sets)
    assert resolve(test="cell", variant="jersey", scale="meso", sets=sets).fabric.has_soft_yarns
    narrow = ["fabric.knitting.soft_shell.outer_diameter=0.1", *sets[1:]]
    with pytest.raises(InputError, match="more than the diameter of the core"):
        resolve(test="cell", variant="jersey", scale="meso", sets=narrow)
    for more, text in (
        ("knitting.degree_of_set=0.9", "must be 0 with soft_shell"),
        ("knitting.loop_shortening=1", "excludes loop_shortening, tension and loop_scatter"),
        ("contact.static_friction_coefficient=0.4", "has no effect with knitting.soft_shell"),
    ):
        with pytest.raises(InputError, match=text):
            resolve(test="cell", variant="jersey", scale="meso", sets=[*sets, f"fabric.{more}"])


def test_soft_yarns_are_refused_where_their_contact_is_missing() -> None:
    """Plates see the core alone; beams as long as the core miss the other yarn; blind yarns have no spacing."""
    for test, sets, text in (
        ("friction", [], "plates and tools of a meso test do not touch the shell"),
        ("cell", ["rig.path=compaction"], "plates and tools"),
        ("cell", ["model.meso.contact=false"], "need contact"),
        ("cell", ["model.meso.elements_per_loop=16"], "use at least 35"),
    ):
        with pytest.raises(InputError, match=text):
            with_rest_spacing(resolve(test=test, variant="acrylic-jersey", scale="meso", preset="quick", sets=sets))
    whole = resolve(test="cell", variant="jersey", scale="meso")
    assert with_rest_spacing(whole) is whole


def test_a_deck_of_soft_yarns_is_refused() -> None:
    run = resolve(test="cell", variant="acrylic-jersey", scale="meso", preset="quick")
    model = build_meso_cell(run, relaxed_cell(run.fabric))
    with pytest.raises(InputError, match="a deck cannot hold this contact"):
        deck_differences(run, PreparedSpecimen(model, None))


def test_a_largest_force_is_for_strips_of_loops() -> None:
    with pytest.raises(InputError, match="max_force = 1: is for strips without inlays along them"):
        resolve(test="tensile", variant="1", scale="meso", sets=["rig.max_force=1"])
    assert resolve(test="tensile", variant="jersey", scale="meso", sets=["rig.max_force=0.1"]).rig.max_force == 0.1


def test_the_card_of_a_soft_knit_has_more_and_farther_paths() -> None:
    run = resolve(test="tensile", variant="acrylic-rib", scale="macro", direction="weft")
    assert angles_without_inlays(run.fabric) == SOFT_ANGLES and len(SOFT_ANGLES) == len(KNIT_ANGLES) + 4
    assert angles_without_inlays(resolve(variant="jersey").fabric) == KNIT_ANGLES
    assert not angles_without_inlays(resolve(variant="1").fabric)
    steps = [path.rig.steps[-1] for path in paths_to_run(run) if path.rig.path == "steps"]
    if steps:  # none once the card is in the cache
        assert max(row[1] for row in steps) > 2.5


def test_a_table_ends_at_the_force_of_its_paths() -> None:
    """Paths of an energy that locks: between their ends straight lines lie beyond locking."""
    angles = np.deg2rad(SOFT_ANGLES)
    paths = []
    for angle in angles:
        along = np.linspace(0.0, 1.0, 60)[:, None] * [np.cos(angle), np.sin(angle)]
        combined = np.maximum(along @ [1.0, 0.6] + 0.05, 0.0)
        force = (np.exp(9.0 * combined) - np.exp(0.45))[:, None] * [0.01, 0.006] + 0.02 * along
        last = int(np.argmax(np.abs(force).max(axis=1) > 0.4)) or len(along)
        paths.append((along[:last], force[:last]))
    table, deviation, left_out = card.biaxial_table(paths)
    assert deviation < 0.05 and not left_out
    assert np.nanmax(np.abs(table.force)) < 1.3 * 0.4
    assert table.warp[-1] > 0.2 and table.weft[-1] > 0.2


def paths_of(jump: float = 0.0) -> list[tuple[np.ndarray, np.ndarray]]:
    """Paths of the energy of two springs; the forces of the one at 112.5 deg fall by a share ``jump`` at half way."""
    paths = []
    for angle in SOFT_ANGLES:
        along = np.linspace(0.0, 0.5, 60)[:, None] * [np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))]
        force = along @ np.array([[1.0, 0.5], [0.5, 1.0]])
        if angle == 112.5:
            force[30:] *= 1.0 - jump
        paths.append((along, force))
    return paths


def test_a_law_leaves_out_the_path_on_which_loops_jump() -> None:
    jumping = SOFT_ANGLES.index(112.5)
    optional = [k for k, angle in enumerate(SOFT_ANGLES) if angle not in (0.0, 45.0, 90.0)]
    assert card.optional_paths([PlannedTest("biaxial", angle=angle) for angle in SOFT_ANGLES]) == optional
    few = [1, jumping, len(SOFT_ANGLES) - 1]
    found = card.biaxial_table(paths_of(0.6), few)
    assert found.left_out == (jumping,) and found.deviation < 0.05
    middle = found.table.force[np.argmin(np.abs(found.table.warp)), np.argmin(np.abs(found.table.weft - 0.25))]
    assert middle == pytest.approx([0.125, 0.25], rel=0.1)
    with pytest.raises(NoConvexEnergyError, match="from those of a convex energy"):
        card.biaxial_table(paths_of(0.6), [1])


def test_a_table_ends_before_the_first_gap_of_the_free_contraction() -> None:
    along = 0.1 * np.arange(-2, 11)
    cross = np.where(along < 1e-9, -1.0, -0.2)[:, None] * np.ones((1, 3)) + [0.0, 0.1, 1.2]
    assert card._last_contraction(along, cross) == len(along)
    gap = cross.copy()
    gap[3] = 0.5  # at 10 % of the largest strain the table may have too few rows
    assert card._last_contraction(along, gap) == len(along)
    gap[8] = 0.5
    assert card._last_contraction(along, gap) == 8


def test_a_table_leaves_out_the_corner_where_the_spline_overshoots() -> None:
    warp, weft = np.linspace(-0.5, 0.5, 11), np.linspace(-0.5, 0.5, 11)
    grid = np.stack(np.meshgrid(warp, weft, indexing="ij"), axis=-1)
    force = grid.copy()
    force[3, 9, 0] = force[4, 9, 0]
    assert not card._overshoots(grid, force).any()
    force[1, 9, 0] = 0.3
    found = card._overshoots(grid, force)
    assert np.array_equal(np.argwhere(found), [[0, 9], [0, 10], [1, 9], [1, 10]])


def test_beams_of_soft_yarns_are_short_for_their_core() -> None:
    def elements(knit: str, *sets: str) -> int:
        run = resolve(test="cell", variant=f"acrylic-{knit}", scale="meso", preset="quick", sets=sets)
        return int(run.model.meso.elements_per_loop)

    assert (elements("jersey"), elements("seed")) == (30, 40)
    assert elements("seed", "model.meso.elements_per_loop=34") == 34
    assert elements("seed", "fabric.knitting.beam_diameter=0.4") == 56


def test_bending_of_soft_yarns_is_slow() -> None:
    run = resolve(test="cell", variant="acrylic-garter", scale="meso", preset="quick", sets=["rig.path=bending"])
    assert run.solver.speed == 0.4
    assert resolve(test="cell", variant="jersey", scale="meso", sets=["rig.path=bending"]).solver.speed == 0.05


def unseen_yarn(folder: Path, stitches: str, wales: float = 28.0, courses: float = 38.0) -> Path:
    """File of a fabric of a soft yarn of which no fabric is shipped, without area mass and thickness."""
    text = f"""
name: unseen
warp_density: {{value: {wales}, source: assumed}}
weft_density: {{value: {courses}, source: assumed}}
loop_length: {{value: 13, source: assumed}}
stitches: {stitches}
layers: []
knitting:
  linear_density: {{value: 200, source: assumed}}
  beam_diameter: {{value: 0.7, source: assumed}}
  youngs_modulus: {{value: 0.5, source: assumed}}
  load_area: {{value: 0.2, source: assumed}}
  fracture_strain: {{value: 20, source: assumed}}
  bending_stiffness: {{value: 0.05, source: assumed}}
  torsion_ratio: {{value: 0.1, source: assumed}}
  degree_of_set: {{value: 0, source: assumed}}
  soft_shell:
    outer_diameter: {{value: 1.8, source: assumed}}
    rigidity: {{value: 0.003, source: assumed}}
    exponent: {{value: 2, source: assumed}}
"""
    path = folder / "unseen.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_area_mass_and_thickness_of_soft_yarns_are_derived(tmp_path: Path) -> None:
    fabric = resolve(test="cell", fabric=unseen_yarn(tmp_path, "[k, p]"), scale="meso").fabric
    assert fabric.area_mass.value == pytest.approx(200.0 * 13.0 * 28.0 * 38.0 * 1e-4) == 276.64
    assert (fabric.thickness.value, fabric.thickness.source) == (pytest.approx(3.6), "derived")
    assert fabric.knitting.loose_fibres_mm == pytest.approx(1.1)


@pytest.mark.parametrize("stitches", ["[k]", "[k, p]", "[kp]", "[kp, pk]"])
def test_an_unseen_soft_yarn_relaxes_in_every_stitch(tmp_path: Path, stitches: str) -> None:
    """The spacings follow from the yarn, wherever the relaxation starts."""
    found = []
    for wales, courses in ((28.0, 38.0), (24.0, 46.0)):
        fabric = resolve(test="cell", fabric=unseen_yarn(tmp_path, stitches, wales, courses), scale="meso").fabric
        relaxed = relaxed_fabric(fabric)
        found.append((relaxed.warp_density.value, relaxed.weft_density.value))
        assert relaxed.warp_density.ref == "relaxed fabric" and relaxed_fabric(relaxed) == relaxed
    assert found[1] == pytest.approx(found[0], rel=0.02)


def test_soft_yarns_relax_from_closer_spacings_where_loops_lock_at_the_stated_ones(tmp_path: Path) -> None:
    def fabric_at(wales: float, courses: float) -> Fabric:
        return resolve(test="cell", fabric=unseen_yarn(tmp_path, "[k]", wales, courses), scale="meso").fabric

    wide, usual = fabric_at(22.0, 28.5), fabric_at(28.0, 38.0)
    with pytest.raises(InputError, match="the yarns lock"):
        relaxed_cell(wide)
    assert start_of_relaxation(usual) == usual
    start = start_of_relaxation(wide)
    assert start.wale_spacing < wide.wale_spacing
    assert start.course_spacing / wide.course_spacing == pytest.approx(start.wale_spacing / wide.wale_spacing)


def test_curves_are_compared_at_equal_strain_without_extrapolation() -> None:
    force = np.array([0.05, 0.1, 0.15, 0.2])
    found = Measured(50.0, 30.0, force, 2.0 * force, np.full(4, 0.004), np.zeros(4))
    exact = {"points": [[0.0, 0.0, None], [0.4, 0.2, None]]}
    assert all(row.agrees and abs(row.of_force) < 1e-9 for row in deviations(found, exact))
    stiff = {"points": [[0.0, 0.0, None], [0.34, 0.2, None]]}
    assert [row.agrees for row in deviations(found, stiff)] == [False] * 4
    short = {"points": [[0.0, 0.0, None], [0.2, 0.1, None]]}
    rows = deviations(found, short)
    assert rows[0].agrees and not rows[3].agrees and np.isnan(rows[3].simulated)


def test_measured_strains_are_placed_between_the_cells() -> None:
    force = np.array([0.05, 0.1])
    found = Measured(50.0, 30.0, force, np.array([0.15, 0.2]), np.zeros(2), np.zeros(2))
    held = {"points": [[0.0, 0.0, 0.0], [0.2, 0.2, 0.0]]}
    free = {"points": [[0.0, 0.0, None], [0.6, 0.2, -0.3]]}
    assert strain_at(free, 0.1) == pytest.approx(0.3) and np.isnan(strain_at(free, 0.3))
    assert bracket(found, {"held": held, "free": free}, 0.1) == "between, 50 % free"
    assert (
        bracket(found, {"held": held, "free": {"points": [[0.0, 0.0, 0.0], [0.4, 0.2, 0.0]]}}, 0.05)
        == "softer than both"
    )
    assert (
        bracket(found, {"held": {"points": [[0.0, 0.0, 0.0], [0.7, 0.2, 0.0]]}, "free": free}, 0.05)
        == "stiffer than both"
    )
    assert bracket(found, {"free": free}, 0.1) == "-"


def test_the_measured_curves_are_read() -> None:
    found = measured("jersey", "weft")
    assert (found.width, found.length) == (66.6, 32.2)
    assert found.strain[np.argmin(np.abs(found.force - 0.1))] == pytest.approx(0.34694)
