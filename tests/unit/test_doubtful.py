"""Numbers that can be meant but hardly are: a warning names them, of a run and of ``check``, and no others."""

import numpy as np
import pytest
from export_sample import cost, quality, strip

from knittest.base.files import configs_dir
from knittest.base.history import History, Specimen
from knittest.config.loading import resolve
from knittest.config.suspicious_values import find_suspicious_values
from knittest.runs.preflight.model import model_facts
from knittest.runs.run_files import compare_run, references_of
from knittest.runs.specimen import prepare

SLACK = "fabric.reinforcing.slack."


def said(*sets: str, variant: str = "1", scale: str = "meso", **more: str) -> list[str]:
    return find_suspicious_values(resolve(variant=variant, scale=scale, sets=sets, **more))


@pytest.mark.parametrize(
    ("field", "value", "least"),
    [(f"{SLACK}warp", 0.003, 0.02), (f"{SLACK}weft", 0.0199, 0.02), ("fabric.knitting.loop_shortening", 0.02, 0.1)],
)
def test_a_slack_or_draw_in_that_is_next_to_none_is_named_with_what_to_write(field, value, least):
    assert said(f"{field}={value}") == [
        f"{field} = {value:g} % has no effect, expected 0 or at least {least} %: if it is a fraction, write "
        f"{100 * value:g}"
    ]
    assert said(f"{field}=0") == said(f"{field}={least}") == []


def test_shells_have_no_slack_but_a_number_they_do_not_read():
    (only,) = said(f"{SLACK}warp=0.003", scale="macro")
    assert only.startswith(f"the macro model does not use {SLACK}warp, changed from pham2019-v1")


@pytest.mark.parametrize("fabric", sorted((configs_dir() / "fabrics").glob("pham*.yaml")), ids=lambda path: path.stem)
@pytest.mark.parametrize("parameters", ["as-measured", "calibrated", "spin-friction"])
def test_shipped_fabrics_have_nothing_doubtful(fabric, parameters):
    assert said(variant=fabric.stem, parameters=parameters) == []


@pytest.mark.parametrize("scale", ["macro", "meso"])
def test_a_thickness_that_the_yarns_do_not_make_is_named(scale):
    """Two inlays of 0.75 mm and two loop yarns of 0.5 mm make 2.5 mm."""
    sets = ["fabric.thickness={value: 0.9, source: measured}"]
    assert find_suspicious_values(resolve(variant="1", scale=scale, sets=sets)) == [
        "fabric.thickness = 0.9 mm (measured), expected 1.75 to 3.5 mm: the inlays and two knitting yarns make 2.5 mm. "
        "Correct thickness or beam_diameter of the yarns"
    ]
    assert (
        find_suspicious_values(
            resolve(variant="1", scale=scale, sets=["fabric.thickness={value: 1.8, source: measured}"])
        )
        == []
    )


@pytest.mark.parametrize(
    ("scale", "setting", "field", "reason"),
    [
        ("macro", "macro.shear.stiffness=0.05", "macro.shear.stiffness", "kind is table"),
        ("macro", "macro.shear={kind: linear, stiffness: 0.05}", "macro.shear.curve", "kind is linear"),
        ("macro", "macro.shear.unloading_stiffness=2", "macro.shear.unloading_stiffness", "friction_share is 0"),
        ("meso", "reinforcing.law.toe_strain=0.3", "reinforcing.law.toe_strain", "kind is linear"),
        ("meso", "knitting.law={points: [[0, 0], [3, 100]]}", "knitting.law.points", "kind is linear"),
        ("meso", "thickness=2.1", "thickness", "the meso scale uses the diameters of the yarns"),
        ("meso", "area_mass=800", "area_mass", "the meso scale uses the linear densities of the yarns"),
    ],
)
def test_a_number_that_another_choice_switches_off_is_named(scale, setting, field, reason):
    assert said(f"fabric.{setting}", scale=scale) == [f"fabric.{field} is not used: {reason}"]


def test_numbers_that_count_are_not_named_as_unused():
    assert said("fabric.reinforcing.law={kind: toe, toe_strain: 0.3}") == []
    assert said("fabric.thickness=2.1", "fabric.area_mass=800", scale="macro") == []
    assert said("fabric.area_mass=800", test="cantilever", direction="warp") == []


def test_check_says_it():
    run = resolve(variant="1", scale="meso", preset="quick", direction="weft", sets=[f"{SLACK}weft=0.003"])
    assert any("if it is a fraction, write 0.3" in note for note in model_facts(run, prepare(run))["notes"])


def test_a_run_warns_of_it():
    run = resolve(variant="1", test="pull-out", direction="weft", sets=[f"{SLACK}weft=0.003"])
    columns = {"tail_travel_mm": np.zeros(1), "pull_force_n": np.zeros(1)}
    specimen = Specimen(History(strip(2, 2)[0], columns, {}, []), {}, quality(), cost(), {})
    warnings = compare_run(run, [specimen], references_of(run, ())).summary["warnings"]
    assert any("if it is a fraction, write 0.3" in text for text in warnings)
