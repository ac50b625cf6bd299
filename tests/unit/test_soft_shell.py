"""Yarns with a soft shell in a fabric file, the paths of their card, and the comparison with measured curves."""

import numpy as np
import pytest

from docs.knits import Measured, deviations, measured
from knittest.base.errors import InputError
from knittest.base.files import structures
from knittest.config.loading import resolve
from knittest.fabric.relaxation import relaxed_cell
from knittest.laboratory.base import PreparedSpecimen
from knittest.models.meso import build_meso_cell
from knittest.runs.deck.differences import deck_differences
from knittest.solve.relaxed_cell import with_rest_spacing
from knittest.studies.homogenise import card
from knittest.studies.homogenise.derived_card import paths_to_run
from knittest.studies.homogenise.plan import KNIT_ANGLES, SOFT_ANGLES, angles_without_inlays

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


def test_the_measured_curves_are_read() -> None:
    found = measured("jersey", "weft")
    assert (found.width, found.length) == (66.6, 32.2)
    assert found.strain[np.argmin(np.abs(found.force - 0.1))] == pytest.approx(0.34694)
