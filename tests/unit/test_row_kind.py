"""Kinds of compared rows: predicted, tuned, input or assumed, and on which assumed inputs."""

from pathlib import Path

import pytest

from knittest.base.result_rows import result_rows
from knittest.config.base import Quantity
from knittest.config.gates import FROM_YARNS, deciding
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.experiment.compare import compare_results
from knittest.experiment.origin import (
    assumed_inputs,
    borrowed,
    cell_assumed_inputs,
    cell_row_kind,
    given_results,
    row_kind,
)
from knittest.experiment.tables import PublishedValue
from knittest.runs.preflight.command import taken_over

FORCE, STRAIN = "peak_force_n", "fracture_strain_pct"


def tensile(variant: str, direction: str, scale: str = "meso", **chosen: object) -> Run:
    return resolve(test="tensile", variant=variant, direction=direction, scale=scale, **chosen)


def with_fabric(run: Run, **fields: object) -> Run:
    return run.model_copy(update={"fabric": run.fabric.model_copy(update=fields)})


def with_yarn(run: Run, **fields: object) -> Run:
    return with_fabric(run, reinforcing=run.fabric.reinforcing.model_copy(update=fields))


@pytest.mark.parametrize("parameters", ["calibrated", "as-measured"])
@pytest.mark.parametrize("variant", ["1", "2"])
@pytest.mark.parametrize("direction", ["warp", "weft"])
def test_no_force_of_a_strip_is_predicted_where_the_load_area_was_chosen_by_it(variant, direction, parameters):
    """Two readings of the yarn's area were left, and Table 3's forces, all four, decided."""
    assert row_kind(tensile(variant, direction, parameters=parameters), FORCE) == "tuned"


@pytest.mark.parametrize(
    ("variant", "direction", "parameters", "kind"),
    [
        ("1", "warp", "calibrated", "tuned"), ("1", "weft", "calibrated", "predicted"),
        ("2", "warp", "calibrated", "tuned"), ("2", "weft", "calibrated", "predicted"),
        ("1", "warp", "as-measured", "predicted"), ("2", "weft", "as-measured", "predicted"),
    ],
)  # fmt: skip
def test_strains_are_predicted_unless_the_wave_was_tuned_on_them(variant, direction, parameters, kind):
    assert row_kind(tensile(variant, direction, parameters=parameters), STRAIN) == kind


def test_what_the_user_gives_is_no_longer_chosen_by_a_row():
    run = tensile("1", "weft", sets=["fabric.reinforcing.load_area=0.5"])
    assert run.fabric.reinforcing.load_area.chosen_by == [] and row_kind(run, FORCE) == "predicted"


def test_a_prediction_names_the_assumed_numbers_that_decide_it():
    run = tensile("1", "weft")
    assert assumed_inputs(run) == ("reinforcing.slack.weft",)
    (crimp, slack) = assumed_inputs(tensile("2", "weft", parameters="as-measured"))
    assert (crimp, slack) == ("reinforcing.crimp.weft", "reinforcing.slack.weft")


def test_thickness_is_tuned_in_variant_1_and_predicted_in_variant_2():
    one, two = (tensile(v, "warp", parameters="as-measured").fabric for v in "12")
    assert cell_row_kind(one, "thickness_mm") == "tuned"
    assert cell_row_kind(two, "thickness_mm") == "predicted"
    assert "knitting.beam_diameter" in cell_assumed_inputs(two, "thickness_mm")
    assert cell_row_kind(one, "area_mass_g_m2") == "predicted" and not cell_assumed_inputs(one, "area_mass_g_m2")
    calibrated = tensile("1", "warp").fabric  # its wave is tuned on a strain, its loops are still chosen
    assert cell_row_kind(calibrated, "thickness_mm") == "tuned"


def test_shells_return_their_own_curve_and_another_fabrics_is_assumed():
    run = tensile("1", "warp", "macro")
    assert row_kind(run, FORCE) == "input" and not borrowed(run.fabric)
    mine = with_fabric(run, name="mine")
    assert borrowed(mine.fabric) == {
        "macro.tension.warp": "pham2019-v1", "macro.tension.weft": "pham2019-v1", "macro.shear": "pham2019-v1",
    }  # fmt: skip
    assert row_kind(mine, FORCE) == "assumed"
    assert assumed_inputs(mine) == ("macro.tension.warp (from pham2019-v1)",)


def formed(**sets: float) -> Run:
    settings = [f"fabric.macro.{name.replace('__', '.')}={value}" for name, value in sets.items()]
    return resolve(test="forming", variant="1", scale="macro", sets=settings)


def test_formed_shells_name_their_contraction_unless_it_is_measured():
    """0 is assumed until the user says how much the weft contracts."""
    assert "macro.poisson" in assumed_inputs(formed())
    assert "macro.poisson" not in assumed_inputs(formed(poisson=0.1))


def test_yarns_that_bend_in_the_plane_decide_a_formed_blank_where_the_fabric_has_them():
    """Left out they are no field of the fabric; guessed they are assumed, given they are not."""
    given = formed(in_plane_bending__warp=4.0, in_plane_bending__weft=4.0)
    fields = [f"macro.in_plane_bending.{d}" for d in ("warp", "weft")]
    off = resolve(test="forming", variant="1", scale="macro", sets=["rig.in_plane_bending=false"])
    assert not set(fields) & set(deciding(off)) and set(fields) <= set(deciding(given)) & set(deciding(formed()))
    assert not set(fields) & set(assumed_inputs(given)) | set(fields) & set(assumed_inputs(formed()))
    guess = {d: Quantity(value=4.0, source="assumed") for d in ("warp", "weft")}
    stiff = given.fabric.macro.in_plane_bending.model_copy(update=guess)
    macro = given.fabric.macro.model_copy(update={"in_plane_bending": stiff})
    assert set(fields) <= set(assumed_inputs(with_fabric(given, macro=macro)))


def test_a_curve_cut_at_an_assumed_strain_is_assumed():
    run = tensile("1", "weft", "macro")
    cut = run.fabric.macro.fracture_strain
    guess = cut.model_copy(update={"weft": Quantity(value=1.6, source="assumed", ref="as pham2019-v1")})
    macro = run.fabric.macro.model_copy(update={"fracture_strain": guess})
    other = with_fabric(run, macro=macro)
    assert row_kind(other, FORCE) == row_kind(other, STRAIN) == "assumed"
    assert row_kind(with_fabric(tensile("1", "warp", "macro"), macro=macro), FORCE) == "input"  # the weft's is its own


def test_a_strip_of_assumed_yarns_predicts_nothing():
    run = tensile("1", "weft", parameters="as-measured")
    guess = {
        name: getattr(run.fabric.reinforcing, name).model_copy(
            update={"source": "assumed", "tuned_on": [], "chosen_by": []}
        )
        for name in ("youngs_modulus", "load_area", "fracture_strain")
    }
    wave = run.fabric.reinforcing.crimp
    guess["crimp"] = wave.model_copy(update={"weft": Quantity(value=0.6, source="assumed")})
    other = with_yarn(run, **guess)
    assert row_kind(other, STRAIN) == "predicted"  # the count of its yarns is measured
    other = with_fabric(other, weft_density=Quantity(value=28.0, source="assumed"))
    assert row_kind(other, STRAIN) == "assumed"


@pytest.mark.parametrize(
    ("label", "direction", "kind"),
    [
        ("V1 weft max. tensile force", "weft", "tuned"),
        ("weft max. tensile force", "weft", "tuned"),
        ("weft peak_force_n = 5800", "weft", "tuned"),
        ("weft curve corridor.csv", "weft", "tuned"),
        ("weft max. tensile force", "warp", "predicted"),
        ("V2 weft max. tensile force", "weft", "predicted"),
        ("V1 weft fracture strain", "weft", "predicted"),
    ],
)
def test_a_row_is_known_by_its_label(label, direction, kind):
    run = tensile("1", direction)
    area = run.fabric.reinforcing.load_area.model_copy(update={"chosen_by": []})
    modulus = Quantity(value=60.0, source="tuned", tuned_on=[label])
    assert row_kind(with_yarn(run, load_area=area, youngs_modulus=modulus), FORCE) == kind


@pytest.mark.parametrize(("scale", "field"), [("macro", "macro"), ("meso", "reinforcing")])
def test_bending_is_tuned_on_the_overhang_and_assumed_where_it_is_anothers(scale, field):
    run = resolve(test="cantilever", variant="1", direction="warp", scale=scale, sets=["rig.mode=overhang"])
    assert row_kind(run, "overhang_mm") == "tuned"
    given = resolve(
        test="cantilever",
        variant="1",
        direction="warp",
        scale=scale,
        parameters="as-measured",
        sets=["rig.overhang=170"],
    )
    assert row_kind(given, "overhang_mm") == "input"
    holder = getattr(run.fabric, field)
    stiffness = holder.bending_stiffness.model_copy(update={"warp": Quantity(value=5.0, source="assumed")})
    other = with_fabric(run, **{field: holder.model_copy(update={"bending_stiffness": stiffness})})
    assert row_kind(other, "overhang_mm") == "assumed"


@pytest.mark.parametrize("scale", ["macro", "meso"])
def test_a_given_overhang_is_an_input_whatever_is_assumed_and_deviates_from_nothing(scale):
    """The template's bending is another fabric's, the overhang is the strips' own all the same."""
    run = resolve(test="cantilever", variant="1", direction="warp", scale=scale)
    field = "macro" if scale == "macro" else "reinforcing"
    holder = getattr(run.fabric, field)
    stiffness = holder.bending_stiffness.model_copy(update={"warp": Quantity(value=5.0, source="assumed")})
    run = with_fabric(run, **{field: holder.model_copy(update={"bending_stiffness": stiffness})})
    assert row_kind(run, "overhang_mm") == "input" and given_results(run) == ("overhang_mm",)
    looked_for = run.model_copy(update={"rig": run.rig.model_copy(update={"mode": "overhang"})})
    assert row_kind(looked_for, "overhang_mm") == "assumed" and given_results(looked_for) == ()
    rows = [PublishedValue("overhang_mm", 171.0, 51.0, 9, "mm", "Table 3")]
    results = {"overhang_mm": 171.0}
    for given, shown in (
        (given_results(run), ("171.0 ± 51.0", "-", "input", "given")),
        ((), ("171.0 ± 51.0", "+0.00 sd", "input", "within 1 sd")),
    ):
        found = compare_results(results, rows, {"overhang_mm": "input"}, given)
        (row,) = result_rows({"results": results, "comparison": found}, refused=False)
        assert (row.experiment, row.deviation, row.kind, row.verdict) == shown


def test_the_default_friction_is_that_of_the_papers_fabrics_only():
    run = resolve(test="friction", variant="1", scale="macro")
    assert row_kind(run, "mu_paper") == "input"
    other = with_fabric(run, experiment="mine")
    assert row_kind(other, "mu_paper") == "assumed" and "pham2019" in assumed_inputs(other)[0]
    own = resolve(
        test="friction", variant="1", scale="macro", sets=["rig.kinetic_coefficient=0.1", "rig.static_coefficient=0.1"]
    )
    assert row_kind(with_fabric(own, experiment="mine"), "mu_paper") == "input"


def test_a_frame_of_shells_returns_its_law_and_that_of_yarns_predicts():
    run = resolve(test="picture-frame", variant="1", scale="macro")
    assert row_kind(run, "shear_force_n_at_deg.10") == "predicted"
    assert row_kind(with_fabric(run, name="mine"), "shear_force_n_at_deg.10") == "assumed"
    shear = run.fabric.macro.shear.model_copy(update={"source": "measured"})
    measured = with_fabric(run, macro=run.fabric.macro.model_copy(update={"shear": shear}))
    assert row_kind(measured, "shear_force_n_at_deg.10") == "input"
    assert row_kind(resolve(test="picture-frame", variant="1", scale="meso"), "shear_force_n_at_deg.10") == "predicted"


def test_check_names_the_curves_of_another_fabric():
    run = resolve(test="picture-frame", variant="1", scale="macro")
    assert taken_over(run.fabric) == []
    *_, shear = taken_over(with_fabric(run, name="mine").fabric)
    assert shear == "macro.shear: its header names pham2019-v1, so it is assumed for mine"


def test_a_curve_without_a_fabric_in_its_head_is_the_fabrics_own(tmp_path: Path):
    curve = tmp_path / "shear.csv"
    run = resolve(test="picture-frame", variant="1", scale="macro")
    for head, found in (("", {}), ("# fabric: pham2019-v1\n", {}), ("# fabric: other\n", {"macro.shear": "other"})):
        curve.write_text(f"# kind: measured\n{head}shear_angle_deg,shear_force_n_per_mm\n0,0\n10,1\n")
        shear = run.fabric.macro.shear.model_copy(update={"curve": str(curve)})
        fabric = run.fabric.model_copy(update={"macro": run.fabric.macro.model_copy(update={"shear": shear})})
        assert borrowed(fabric) == found


def test_a_pull_out_names_what_moves_its_forces():
    """Powers of docs/identify.md: friction, bend and set of the loops, geometry; neither crimp nor inlays' EI."""
    run = resolve(test="pull-out", variant="1", direction="weft", parameters="as-measured")
    assert assumed_inputs(run) == (
        "knitting.beam_diameter", "knitting.bending_stiffness", "knitting.degree_of_set", "reinforcing.beam_diameter",
        "contact.friction_coefficient",
    )  # fmt: skip
    assert {"warp_density", "weft_density", "loop_length"} < set(deciding(run))
    drawn_in = resolve(test="pull-out", variant="1", direction="weft", sets=["fabric.knitting.draw_in=1"])
    assert set(deciding(drawn_in)) - set(deciding(run)) == {"knitting.draw_in"}


@pytest.mark.parametrize("test", ["picture-frame", "bias-extension", "cell"])
def test_a_test_of_shear_names_patches_that_are_assumed_where_the_fabric_has_them(test):
    """Crossings that resist spin over a patch that nobody measured."""
    named = {
        parameters: [field for field in assumed_inputs(resolve(test=test, variant="1", scale="meso",
                                                               parameters=parameters)) if "patch" in field]
        for parameters in ("calibrated", "gripping")
    }  # fmt: skip
    kinds_of_crossing = ("inlay_inlay", "inlay_loop", "loop_loop")
    assert named == {"calibrated": [], "gripping": [f"contact.patch.radius.{kind}" for kind in kinds_of_crossing]}


@pytest.mark.parametrize(("ref", "kind"), [(f"{FROM_YARNS}0123, preset quick", "predicted"), ("another rig", "input")])
def test_rows_of_a_card_that_was_derived_from_the_yarns_are_worth_what_these_are(ref, kind):
    run = resolve(test="picture-frame", variant="1", scale="macro", sets=["fabric.experiment=null"])
    shear = run.fabric.macro.shear.model_copy(update={"ref": ref, "source": "derived"})
    run = with_fabric(run, macro=run.fabric.macro.model_copy(update={"shear": shear}))
    yarns = resolve(test="picture-frame", variant="1", scale="meso", sets=["fabric.experiment=null"])
    assert row_kind(run, "shear_force_n_at_deg.20") == kind
    assert (assumed_inputs(run) == assumed_inputs(yarns)) == (kind == "predicted")
