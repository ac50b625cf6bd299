"""The set spin-friction: what it states, its tables beside calibrated, and that no stored run of them is stale."""

from math import sqrt

import pytest

from docs import stored_runs, validation_sets
from docs.stored_runs import StoredRun, inputs_of
from docs.validation_sets import bending_lines, law_lines, moved, pairs, shear_lines, tension_lines
from knittest.base.files import data_dir
from knittest.config.loading import resolve
from knittest.laboratory.picture_frame.shear_law import deciding_numbers
from knittest.materials.yarn_section import patch_radius

QUALITY, COST = {"ke_over_ie_max": 0.02, "energy_error_max": 0.001}, {"elements": 1, "steps": 1, "cpu_s": 5.0}


def stored(parameters, results, test="tensile", variant="1", direction="warp", sets=()) -> StoredRun:
    """A run with ``results`` of a set."""
    options = {"test": test, "variant": variant, "scale": "meso", "preset": "quick", "direction": direction,
               "parameters": parameters, "specimens": 1, "sets": list(sets)}  # fmt: skip
    inputs = inputs_of(resolve(**options).model_dump(mode="json"))
    return StoredRun(options, inputs, results, QUALITY, COST, [], [], "c" * 40, "2026-11-23T00:00:00", "a cpu")


def both(old, new, **more):
    return [stored("calibrated", old, **more), stored("spin-friction", new, **more)]


@pytest.mark.parametrize("variant", ["1", "2"])
@pytest.mark.parametrize(
    ("scale", "differs"), [("meso", "fabric.contact.patch"), ("macro", "fabric.macro.shear.curve")]
)
def test_spin_friction_is_calibrated_with_patches_and_nothing_else(variant, scale, differs):
    """Yarns differ in the patches alone, shells in the law that they take from such yarns; the default has no patch."""
    old, new = (inputs_of(_config(variant, parameters, scale)) for parameters in ("calibrated", "spin-friction"))
    differing = {path for path in old.keys() | new.keys() if old.get(path) != new.get(path)}
    assert differing and all(path.startswith(differs) for path in differing)
    assert resolve(variant=variant).parameters == "calibrated" and old.get("fabric.contact.patch") is None


@pytest.mark.parametrize("variant", ["1", "2"])
@pytest.mark.parametrize("parameters", ["calibrated", "spin-friction"])
def test_the_law_of_shells_is_that_of_frames_of_the_same_yarns(variant, parameters):
    """The head of the law states what the fabric states now, with the same sources."""
    shells, yarns = (resolve(variant=variant, scale=scale, parameters=parameters).fabric for scale in ("macro", "meso"))
    head = (data_dir() / shells.macro.shear.curve).read_text().split("shear_angle_deg")[0]
    assert f"picture frame of yarns, pham2019-v{variant} ({parameters}), 100 mm" in head
    for name, number in deciding_numbers(yarns).items():
        assert f"# {name}: {number.value:g} ({number.source})\n" in head


def test_laws_of_both_sets_stand_side_by_side():
    """Patches make shells of both variants stiffer at 10 deg, by the spin that friction resists."""
    for line in law_lines():
        v1, new_v1, v2, new_v2, ratio, new_ratio = map(float, line[1:7])
        assert (ratio, new_ratio) == pytest.approx((v2 / v1, new_v2 / new_v1), abs=0.02)
        assert new_v1 > v1 and (new_v2 > v2 or float(line[0]) > 10.0)
        assert line[-1] == ("passed" if new_v2 < new_v1 else "**FAILED**")


def _config(variant, parameters, scale):
    return resolve(variant=variant, scale=scale, parameters=parameters).model_dump(mode="json")


@pytest.mark.parametrize("variant", ["1", "2"])
def test_patches_are_as_wide_as_the_circles_that_touch_and_say_that_they_are_assumed(variant):
    """And yarns as soft as the file says reach them under the force of a crossing at rest, stiffer ones do not."""
    fabric = resolve(variant=variant, scale="meso", parameters="spin-friction").fabric
    inlay, loop = 0.5 * fabric.reinforcing.beam_diameter_mm, 0.5 * fabric.knitting.beam_diameter_mm
    radius = fabric.contact.patch.radius
    kinds = ((radius.inlay_inlay, inlay, inlay, 0.47), (radius.inlay_loop, inlay, loop, 0.72),
             (radius.loop_loop, loop, loop, 1.06))  # fmt: skip
    for card, one, other, modulus in kinds:
        assert card.source == "assumed" and f"{modulus:g} MPa" in card.ref
        assert card.value == pytest.approx(sqrt(one * other), rel=2e-3)
        assert patch_radius(0.013, (one, other), (modulus, modulus), 1.0) == pytest.approx(card.value, rel=5e-3)


def test_a_row_of_a_strip_shows_its_change_in_sd_of_the_experiment():
    """V1 warp: 5820 ± 461 N and 1.6 ± 0.3 %."""
    runs = both(
        {"peak_force_n": 5700.0, "fracture_strain_pct": 1.6}, {"peak_force_n": 5300.0, "fracture_strain_pct": 1.63}
    )
    force, strain = tension_lines(runs)
    assert force[3:] == ["5820 ± 461", "5700", "5300", "-0.868 sd", "passed", "**FAILED**"]
    assert strain[6] == "+0.100 sd"
    assert moved([force, strain]).startswith("The largest change of a row of a strip is -0.868 sd")
    assert "verdicts that turn: 1 warp peak_force_n." in moved([force, strain])
    assert "no verdict on a strip turns" in moved([strain])


def test_bending_is_held_against_the_target_of_its_calibration():
    """V2 warp: 41.5 ± 5.7 deg at 178 mm."""
    runs = both({"chord_angle_deg": 41.4}, {"chord_angle_deg": 47.3}, test="cantilever", variant="2",
                sets=["rig.overhang=178"])  # fmt: skip
    (line,) = bending_lines(runs)
    assert line[2:] == [
        "chord angle at 178 mm [deg]",
        "41.5 ± 5.7",
        "41.40",
        "47.30",
        "+1.035 sd",
        "passed",
        "**FAILED**",
    ]


def test_shear_is_judged_by_variant_2_over_variant_1():
    def forces(value):
        return {f"shear_force_n_at_deg.{angle}": value for angle in validation_sets.ANGLES}

    frames = {"test": "picture-frame", "direction": None}
    runs = both(forces(1.0), forces(2.0), **frames) + both(forces(1.1), forces(1.9), variant="2", **frames)
    line = shear_lines(runs)[0]
    assert line == ["10", "1.000", "2.000", "1.100", "1.900", "1.10", "0.95", "below 1", "passed"]
    equal = both(forces(1.0), forces(2.0), **frames) + both(forces(1.0), forces(2.0), variant="2", **frames)
    assert shear_lines(equal)[0][-1] == "**FAILED**"


def test_a_run_of_one_set_alone_is_refused():
    with pytest.raises(ValueError, match="with one of calibrated, spin-friction only"):
        list(pairs(both({}, {})[1:], "tensile"))


@pytest.mark.parametrize("run", stored_runs.load(validation_sets.FILE), ids=lambda run: run.command)
def test_no_stored_run_of_the_sets_is_stale_or_refused(run):
    assert run.stale() == [] and run.refused == []
    assert "-dirty" not in run.commit
