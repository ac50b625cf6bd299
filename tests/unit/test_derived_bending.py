"""Forming derives the bending of the inlays in the plane of the shells: EI of an inlay times the inlays per width."""

import pytest

from knittest.config.base import Quantity
from knittest.config.loading import resolve
from knittest.config.suspicious_values import follows_yarns, unused_change_warning
from knittest.config.templates import new_fabric_text
from knittest.config.yaml_writer import dump
from knittest.experiment.origin import assumed_inputs

EI = "fabric.reinforcing.bending_stiffness.warp=30"


def formed(*sets: str, test: str = "forming", scale: str = "macro", **source):
    return resolve(test=test, scale=scale, preset="quick", sets=sets, **(source or {"variant": "1"}))


def numbers(run) -> tuple[float, float] | None:
    found = run.fabric.macro.in_plane_bending
    return None if found is None else (found.warp.value, found.weft.value)


@pytest.mark.parametrize(
    ("variant", "warp", "weft"),
    [("1", (15.0, 28.0), (12.4, 28.0)), ("2", (28.8, 28.0), (26.2, 41.0))],
)
def test_shipped_fabrics_bend_in_the_plane_by_default(variant, warp, weft):
    """EI [N mm2] times inlays over 100 mm; the source is derived and the reference states the numbers."""
    run = formed(variant=variant)
    assert numbers(run) == pytest.approx([ei * density / 100.0 for ei, density in (warp, weft)])
    found = run.fabric.macro.in_plane_bending.weft
    assert found.source == "derived"
    assert f"{weft[0]:g} N mm2" in found.ref and f"weft_density {weft[1]:g} / 100 mm" in found.ref
    assert found.ref in dump(run)


def test_a_new_fabric_bends_in_the_plane_and_says_what_is_assumed_behind_it(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(new_fabric_text("mine", resolve(variant="1", parameters="as-measured").fabric))
    run = formed(fabric=path)
    assert numbers(run) == pytest.approx((18.1 * 0.28, 12.4 * 0.28))
    assert any(
        line.startswith("macro.in_plane_bending.warp (from reinforcing.bending_stiffness")
        for line in assumed_inputs(run)
    )


@pytest.mark.parametrize("change", [EI, "fabric.warp_density=56"])
def test_the_number_follows_a_changed_yarn_also_in_a_resolved_config(change, tmp_path):
    more = ["fabric.area_mass=1200"] if "density" in change else []
    assert numbers(formed(change, *more)) == pytest.approx((8.4, 3.472))
    path = tmp_path / "config.yaml"
    path.write_text(dump(formed()))
    assert resolve(config=path) == formed()
    assert numbers(resolve(config=path, sets=[change, *more])) == pytest.approx((8.4, 3.472))


def test_a_stated_number_stays_and_so_does_an_edited_one(tmp_path):
    stated = [f"fabric.macro.in_plane_bending.{d}=6" for d in ("warp", "weft")]
    assert numbers(formed(*stated, EI)) == (6.0, 6.0)
    path = tmp_path / "config.yaml"
    path.write_text(dump(formed()).replace("value: 4.2\n", "value: 6.0\n", 1))
    found = resolve(config=path).fabric.macro.in_plane_bending.warp
    assert isinstance(found, Quantity) and found.value == 6.0


def test_a_number_whose_source_was_edited_is_no_longer_derived(tmp_path):
    """Someone who writes "measured" beside the same number means it to stay when the yarn changes."""
    path, text = tmp_path / "config.yaml", dump(formed())
    place = text.rindex("in_plane_bending:")
    path.write_text(text[:place] + text[place:].replace("source: derived", "source: measured", 1))
    assert numbers(resolve(config=path, sets=[EI])) == pytest.approx((4.2, 3.472))


def test_a_number_for_one_direction_leaves_the_other_derived(tmp_path):
    path = tmp_path / "config.yaml"
    path.write_text(dump(formed()))
    run = resolve(config=path, sets=["fabric.macro.in_plane_bending.warp=6", EI.replace(".warp=30", ".weft=24.8")])
    assert numbers(run) == pytest.approx((6.0, 6.944)) and follows_yarns(run.fabric)
    assert not follows_yarns(formed("rig.in_plane_bending=false").fabric)


def test_the_switch_turns_off_a_stated_number_and_one_of_a_resolved_config(tmp_path):
    off, path = "rig.in_plane_bending=false", tmp_path / "config.yaml"
    assert numbers(formed(*(f"fabric.macro.in_plane_bending.{d}=6" for d in ("warp", "weft")), off)) is None
    path.write_text(dump(formed()))
    assert numbers(resolve(config=path, sets=[off])) is None


def test_the_switch_turns_it_off_and_other_tests_and_yarns_have_none():
    assert numbers(formed("rig.in_plane_bending=false")) is None
    assert numbers(formed(scale="meso")) is None
    for test in ("tensile", "bias-extension", "picture-frame", "biaxial"):
        assert numbers(formed(test=test)) is None
    assert numbers(formed(variant="cao2008-weave")) is None


def test_a_changed_yarn_is_read_by_bending_in_the_plane_alone():
    unread = "the macro model does not use fabric.reinforcing"
    assert unused_change_warning(formed(EI)).startswith(f"except for in-plane bending, {unread}")
    assert unused_change_warning(formed(EI, "rig.in_plane_bending=false")).startswith(unread)


def test_inlays_of_one_direction_bend_in_the_plane_and_the_other_direction_as_its_loops():
    """EI of the weft, 1.24281 N mm2, times 28 in 100 mm; a knit without inlays has no value."""
    run = formed(variant="weft-only")
    assert numbers(run) == pytest.approx((run.fabric.yarn_bending_n_mm("warp"), 1.24281 * 0.28), rel=1e-5)
    found = run.fabric.macro.in_plane_bending
    assert found.weft.value > 5.0 * found.warp.value and "loops" in found.warp.ref and "loops" not in found.weft.ref
    assert "macro.in_plane_bending.warp (from knitting.bending_share and" in " ".join(assumed_inputs(run))
    assert numbers(formed(variant="jersey")) is None
