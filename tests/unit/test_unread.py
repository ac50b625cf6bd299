"""Numbers changed from a shipped fabric that the scale of a run does not read are named, and no others."""

import pytest

from knittest.base.files import configs_dir
from knittest.config.loading import resolve
from knittest.config.suspicious_values import unused_change_warning
from knittest.config.templates import copy_as_assumed, fabric_template
from knittest.runs.preflight.model import model_facts
from knittest.runs.specimen import prepare

OWN_CARD = [
    f"fabric.macro.{field}.{direction}=1.7"
    for field in ("fracture_strain", "bending_stiffness") for direction in ("warp", "weft")
]  # fmt: skip


def note(*sets: str, **more) -> str:
    return unused_change_warning(resolve(**({"variant": "1", "scale": "macro", "sets": list(sets)} | more)))


def test_densities_of_shells_are_named_with_what_to_do():
    assert note("fabric.warp_density=26", "fabric.weft_density=27") == (
        "the macro model does not use fabric.warp_density, fabric.weft_density, changed from pham2019-v1, whose "
        "material card (fabric.macro) it has: derive a card from these yarns by knittest homogenise, or use --scale "
        "meso"
    )
    assert "fabric.contact.friction_coefficient" in note("fabric.contact.friction_coefficient=0.1")


@pytest.mark.parametrize("sets", [(), ("fabric.area_mass=800", "fabric.thickness=2.1"), ("rig.width=40",)])
def test_nothing_is_said_where_all_is_read(sets):
    assert note(*sets) == "" == note(*sets, scale="meso")


def test_yarns_do_not_read_the_card():
    bent = note("fabric.macro.bending_stiffness.warp=9", scale="meso")
    changed = "fabric.macro.bending_stiffness.warp, changed from pham2019-v1"
    assert bent == f"the meso model does not use {changed}: use --scale macro"
    assert note("fabric.warp_density=26", scale="meso") == ""


def test_a_card_of_ones_own_is_not_that_of_the_yarns():
    assert note("fabric.warp_density=26", "fabric.macro.fracture_strain.warp=1.7", direction="warp") == ""
    assert note("fabric.warp_density=26", "fabric.macro.bending_stiffness.warp=9") != ""  # no strip of them is bent
    own_curve = "fabric.macro.tension.warp=pham2019/curves/tensile-v2-warp.csv"
    assert note("fabric.warp_density=26", own_curve, direction="warp") == "" == note(own_curve, scale="meso")


def test_a_copy_with_sets_of_its_own_is_compared_with_what_is_shipped(tmp_path):
    """Such a set is none of the shipped fabric's: that must not end a run at its very end."""
    text = (configs_dir() / "fabrics" / "pham2019-v1.yaml").read_text()
    path = tmp_path / "copy.yaml"
    path.write_text(
        text.replace("  spin-friction:", "  mine:").replace("warp_density: {value: 28", "warp_density: {value: 26")
    )
    own = {"variant": None, "fabric": path}
    assert "fabric.warp_density" in note(**own, parameters="mine")


def test_stiffness_in_the_plane_which_no_shipped_card_has_makes_no_own_card():
    in_plane = [f"fabric.macro.in_plane_bending.{d}=4" for d in ("warp", "weft")]
    assert "fabric.warp_density" in note("fabric.warp_density=26", *in_plane, test="forming")


def test_a_fabric_started_from_a_shipped_one_is_compared_with_it(tmp_path):
    like = resolve(variant="1", parameters="as-measured").fabric
    text = fabric_template(copy_as_assumed(like, "mine"), like.name)
    assert "derived from the yarns when a run needs them" in text.partition("\nname:")[0]
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    own = {"variant": None, "fabric": path}
    assert note(**own) == ""
    changed = text.replace("warp_density: {value: 28.0", "warp_density: {value: 26.0")
    path.write_text(changed)
    assert note(**own).startswith("the macro model does not use fabric.warp_density, changed from pham2019-v1")
    assert note(**own, scale="meso") == ""
    assert note(*OWN_CARD, **own) == ""


def test_check_says_it_before_a_run():
    run = resolve(variant="1", scale="macro", preset="quick", sets=["fabric.warp_density=26"])
    assert any("fabric.warp_density" in line for line in model_facts(run, prepare(run))["notes"])
