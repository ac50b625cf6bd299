"""Kinds of compared rows: predicted, tuned, input or assumed, and on which assumed inputs."""

from pathlib import Path
from typing import Any

import pytest

from knittest.base.result_rows import result_rows
from knittest.config.base import Quantity
from knittest.config.loading import resolve
from knittest.config.quality_checks import FROM_YARNS, deciding_fields
from knittest.experiment.comparison import compare_results
from knittest.experiment.origin import (
    assumed_inputs,
    borrowed_curves,
    cell_assumed_inputs,
    cell_row_kind,
    given_results,
    row_kind,
)
from knittest.experiment.tables import PublishedValue
from knittest.runs.preflight.command import borrowed_curve_lines

FORCE, STRAIN, SHEAR = "peak_force_n", "fracture_strain_pct", "shear_force_n_at_deg.10"


def run_of(test: str, variant: str = "1", scale: str = "macro", *sets: str, **chosen: Any) -> Any:
    return resolve(test=test, variant=variant, scale=scale, sets=list(sets), **chosen)


def tensile(variant: str, direction: str, scale: str = "meso", *sets: str, **chosen: Any) -> Any:
    return run_of("tensile", variant, scale, *sets, direction=direction, **chosen)


def changed(one: Any, path: str, value: Any) -> Any:
    """``one`` with the field ``path`` replaced."""
    name, _, rest = path.partition(".")
    return one.model_copy(update={name: changed(getattr(one, name), rest, value) if rest else value})


def assumed(value: float) -> Quantity:
    return Quantity(value=value, source="assumed")


@pytest.mark.parametrize("parameters", ["calibrated", "as-measured"])
@pytest.mark.parametrize("variant", ["1", "2"])
@pytest.mark.parametrize("direction", ["warp", "weft"])
def test_no_force_of_a_strip_is_predicted_where_the_load_area_was_chosen_by_it(variant, direction, parameters):
    """Two readings of the yarn's area were left, and Table 3's forces, all four, decided."""
    run = tensile(variant, direction, parameters=parameters)
    assert row_kind(run, FORCE) == "tuned"
    assert row_kind(run, STRAIN) == ("tuned" if (direction, parameters) == ("warp", "calibrated") else "predicted")


def test_what_the_user_gives_is_no_longer_chosen_by_a_row():
    run = tensile("1", "weft", "meso", "fabric.reinforcing.load_area=0.5")
    assert run.fabric.reinforcing.load_area.chosen_by == [] and row_kind(run, FORCE) == "predicted"


def test_a_prediction_names_the_assumed_numbers_that_decide_it():
    assert assumed_inputs(tensile("1", "weft")) == ("reinforcing.slack.weft",)
    found = assumed_inputs(tensile("2", "weft", parameters="as-measured"))
    assert found == ("reinforcing.crimp.weft", "reinforcing.slack.weft")


def test_thickness_is_tuned_in_variant_1_and_predicted_in_variant_2():
    one, two = (tensile(v, "warp", parameters="as-measured").fabric for v in "12")
    assert (cell_row_kind(one, "thickness_mm"), cell_row_kind(two, "thickness_mm")) == ("tuned", "predicted")
    assert "knitting.beam_diameter" in cell_assumed_inputs(two, "thickness_mm")
    assert cell_row_kind(one, "area_mass_g_m2") == "predicted" and not cell_assumed_inputs(one, "area_mass_g_m2")
    calibrated = tensile("1", "warp").fabric  # its wave is tuned on a strain, its loops are still chosen
    assert cell_row_kind(calibrated, "thickness_mm") == "tuned"


def test_shells_return_their_own_curve_and_another_fabrics_is_assumed():
    run = tensile("1", "warp", "macro")
    assert row_kind(run, FORCE) == "input" and not borrowed_curves(run.fabric)
    mine = changed(run, "fabric.name", "mine")
    fields = ("macro.tension.warp", "macro.tension.weft", "macro.shear")
    assert borrowed_curves(mine.fabric) == dict.fromkeys(fields, "pham2019-v1")
    assert row_kind(mine, FORCE) == "assumed"
    assert assumed_inputs(mine) == ("macro.tension.warp (from pham2019-v1)",)


def test_formed_shells_name_their_contraction_and_bending_unless_they_are_measured():
    """Bending in the plane that is left out is no field of the fabric; guessed it is assumed, given it is not."""
    usual, poisson = run_of("forming"), run_of("forming", "1", "macro", "fabric.macro.poisson=0.1")
    assert "macro.poisson" in assumed_inputs(usual) and "macro.poisson" not in assumed_inputs(poisson)
    fields = {f"macro.in_plane_bending.{d}" for d in ("warp", "weft")}
    given = run_of("forming", "1", "macro", *(f"fabric.{field}=4.0" for field in fields))
    off = run_of("forming", "1", "macro", "rig.in_plane_bending=false")
    assert not fields & set(deciding_fields(off)) and fields <= set(deciding_fields(given)) & set(
        deciding_fields(usual)
    )
    assert not fields & set(assumed_inputs(given)) | fields & set(assumed_inputs(usual))
    guess = given.fabric.macro.in_plane_bending.model_copy(update={"warp": assumed(4.0), "weft": assumed(4.0)})
    assert fields <= set(assumed_inputs(changed(given, "fabric.macro.in_plane_bending", guess)))


def test_a_curve_cut_at_an_assumed_strain_is_assumed():
    other = changed(tensile("1", "weft", "macro"), "fabric.macro.fracture_strain.weft", assumed(1.6))
    assert row_kind(other, FORCE) == row_kind(other, STRAIN) == "assumed"
    warp = changed(tensile("1", "warp", "macro"), "fabric.macro.fracture_strain.weft", assumed(1.6))
    assert row_kind(warp, FORCE) == "input"  # its own


def test_a_strip_of_assumed_yarns_predicts_nothing():
    run = tensile("1", "weft", parameters="as-measured")
    for name in ("youngs_modulus", "load_area", "fracture_strain"):
        for field, value in (("source", "assumed"), ("tuned_on", []), ("chosen_by", [])):
            run = changed(run, f"fabric.reinforcing.{name}.{field}", value)
    run = changed(run, "fabric.reinforcing.crimp.weft", assumed(0.6))
    assert row_kind(run, STRAIN) == "predicted"  # the count of its yarns is measured
    assert row_kind(changed(run, "fabric.weft_density", assumed(28.0)), STRAIN) == "assumed"


@pytest.mark.parametrize(
    ("label", "direction", "kind"),
    [
        ("V1 weft max. tensile force", "weft", "tuned"), ("weft max. tensile force", "weft", "tuned"),
        ("weft peak_force_n = 5800", "weft", "tuned"), ("weft curve corridor.csv", "weft", "tuned"),
        ("weft max. tensile force", "warp", "predicted"), ("V2 weft max. tensile force", "weft", "predicted"),
        ("V1 weft fracture strain", "weft", "predicted"),
    ],
)  # fmt: skip
def test_a_row_is_known_by_its_label(label, direction, kind):
    run = changed(tensile("1", direction), "fabric.reinforcing.load_area.chosen_by", [])
    modulus = Quantity(value=60.0, source="tuned", tuned_on=[label])
    assert row_kind(changed(run, "fabric.reinforcing.youngs_modulus", modulus), FORCE) == kind


@pytest.mark.parametrize(("scale", "field"), [("macro", "macro"), ("meso", "reinforcing")])
def test_bending_is_tuned_on_the_overhang_and_a_given_overhang_is_an_input(scale, field):
    """The template's bending may be another fabric's, a given overhang is the strips' own all the same."""
    search = run_of("cantilever", "1", scale, "rig.mode=overhang", direction="warp")
    given = run_of("cantilever", "1", scale, "rig.overhang=170", direction="warp", parameters="as-measured")
    assert (row_kind(search, "overhang_mm"), row_kind(given, "overhang_mm")) == ("tuned", "input")
    bending = f"fabric.{field}.bending_stiffness.warp"
    other = changed(search, bending, assumed(5.0))
    assert row_kind(other, "overhang_mm") == "assumed" and given_results(other) == ()
    run = changed(run_of("cantilever", "1", scale, direction="warp"), bending, assumed(5.0))
    assert row_kind(run, "overhang_mm") == "input" and given_results(run) == ("overhang_mm",)


def test_a_given_overhang_deviates_from_nothing():
    rows, results = [PublishedValue("overhang_mm", 171.0, 51.0, 9, "mm", "Table 3")], {"overhang_mm": 171.0}
    for given, shown in ((("overhang_mm",), ("-", "given")), ((), ("+0.00 sd", "within 1 sd"))):
        found = compare_results(results, rows, {"overhang_mm": "input"}, given)
        (row,) = result_rows({"results": results, "comparison": found}, refused=False)
        assert (row.experiment, row.kind, row.deviation, row.verdict) == ("171.0 ± 51.0", "input", *shown)


def test_the_default_friction_is_that_of_the_papers_fabrics_only():
    run = run_of("friction")
    assert row_kind(run, "mu_paper") == "input"
    other = changed(run, "fabric.experiment", "mine")
    assert row_kind(other, "mu_paper") == "assumed" and "pham2019" in assumed_inputs(other)[0]
    own = run_of("friction", "1", "macro", "rig.kinetic_coefficient=0.1", "rig.static_coefficient=0.1")
    assert row_kind(changed(own, "fabric.experiment", "mine"), "mu_paper") == "input"


def test_a_frame_of_shells_returns_its_law_and_that_of_yarns_predicts():
    run = run_of("picture-frame")
    assert row_kind(run, SHEAR) == row_kind(run_of("picture-frame", "1", "meso"), SHEAR) == "predicted"
    assert row_kind(changed(run, "fabric.macro.shear.source", "measured"), SHEAR) == "input"
    mine = changed(run, "fabric.name", "mine")
    assert row_kind(mine, SHEAR) == "assumed" and borrowed_curve_lines(run.fabric) == []
    assert (
        borrowed_curve_lines(mine.fabric)[-1] == "macro.shear: its header names pham2019-v1, so it is assumed for mine"
    )


def test_a_curve_without_a_fabric_in_its_head_is_the_fabrics_own(tmp_path: Path):
    curve, run = tmp_path / "shear.csv", run_of("picture-frame")
    for head, found in (("", {}), ("# fabric: pham2019-v1\n", {}), ("# fabric: other\n", {"macro.shear": "other"})):
        curve.write_text(f"# kind: measured\n{head}shear_angle_deg,shear_force_n_per_mm\n0,0\n10,1\n")
        assert borrowed_curves(changed(run, "fabric.macro.shear.curve", str(curve)).fabric) == found


def test_laws_from_a_frame_predict_the_bias_extension_and_uncoupled_shells_return_their_curves():
    weave = run_of("bias-extension", "cao2008-weave", preset="quick")
    assert row_kind(weave, "bias_normalised_force_n_per_mm_at_deg.30") == "predicted"
    for source, found in (("assumed", ("assumed", ("macro.poisson",))), ("measured", ("input", ()))):
        sets = f"fabric.macro.poisson={{value: 0.0, source: {source}, ref: strips}}"
        run = run_of("biaxial", "1", "macro", sets, direction="warp", preset="quick")
        assert (row_kind(run, "biaxial_force_n_per_mm"), assumed_inputs(run)) == found


def test_a_pull_out_names_what_moves_its_forces():
    """Powers of docs/identify.md: friction, bend and set of the loops, geometry; neither crimp nor inlays' EI."""
    run = run_of("pull-out", "1", "meso", direction="weft", parameters="as-measured")
    assert assumed_inputs(run) == (
        "knitting.beam_diameter", "knitting.bending_stiffness", "knitting.degree_of_set", "reinforcing.beam_diameter",
        "contact.friction_coefficient",
    )  # fmt: skip
    assert {"warp_density", "weft_density", "loop_length"} < set(deciding_fields(run))
    shorter = run_of("pull-out", "1", "meso", "fabric.knitting.loop_shortening=1", direction="weft")
    assert set(deciding_fields(shorter)) - set(deciding_fields(run)) == {"knitting.loop_shortening"}


@pytest.mark.parametrize("test", ["picture-frame", "bias-extension", "cell"])
def test_a_test_of_shear_names_patches_that_are_assumed_where_the_fabric_has_them(test):
    """Crossings that resist spin over a patch that nobody measured."""
    patches = [f"contact.patch.radius.{kind}" for kind in ("inlay_inlay", "inlay_loop", "loop_loop")]
    for parameters, named in (("calibrated", []), ("spin-friction", patches)):
        found = assumed_inputs(run_of(test, "1", "meso", parameters=parameters))
        assert [field for field in found if "patch" in field] == named


@pytest.mark.parametrize(("ref", "kind"), [(f"{FROM_YARNS}0123, preset quick", "predicted"), ("another rig", "input")])
def test_rows_of_a_card_that_was_derived_from_the_yarns_are_worth_what_these_are(ref, kind):
    run, yarns = (run_of("picture-frame", "1", scale, "fabric.experiment=null") for scale in ("macro", "meso"))
    for field, value in (("ref", ref), ("source", "derived")):
        run = changed(run, f"fabric.macro.shear.{field}", value)
    assert row_kind(run, SHEAR) == kind
    assert (assumed_inputs(run) == assumed_inputs(yarns)) == (kind == "predicted")
