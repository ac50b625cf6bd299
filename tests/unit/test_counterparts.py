"""Counterparts of a fabric's numbers in knittest check: each beside its counterpart, judged by a stated tolerance."""

import json
from math import pi, sqrt

import pytest

from knittest.cli.main import run
from knittest.config.base import Quantity
from knittest.config.loading import resolve
from knittest.config.templates import copy_as_assumed
from knittest.fabric.relaxation import relaxed_cell
from knittest.runs.preflight.command import counterparts
from knittest.runs.preflight.measured_counterparts import Counterpart, summary_line, table_cells
from knittest.runs.preflight.measured_counterparts import test_counterparts as of_tests
from knittest.runs.preflight.yarn_counterparts import cell_counterparts, cell_mass


def fabric_with(*sets: str, variant: str = "1", **asked):
    return resolve(variant=variant, scale="macro", parameters="as-measured", sets=sets, **asked).fabric


def of(rows: list[Counterpart], name: str, origin: str = "") -> Counterpart:
    """The one row of that name whose counterpart comes from there."""
    (row,) = [r for r in rows if r.name == name and origin in r.origin]
    return row


def in_tests(*sets: str) -> list[Counterpart]:
    return list(of_tests(fabric_with(*sets)))


@pytest.mark.parametrize(
    ("setting", "name", "origin", "verdict"),
    [
        ("fabric.macro.fracture_strain.warp=1.521", "warp fracture strain", "Table 3", "agrees"),
        ("fabric.macro.fracture_strain.warp=1.519", "warp fracture strain", "Table 3", "differs"),
        ("fabric.macro.fracture_strain.warp=1.57", "warp fracture strain", "curve", "agrees"),
        ("fabric.macro.fracture_strain.warp=1.56", "warp fracture strain", "curve", "differs"),
        ("fabric.macro.fracture_strain.warp=1.64", "warp fracture strain", "curve", "differs"),
        ("fabric.macro.bending_stiffness.warp=5.3", "warp bending stiffness", "overhang 171 mm", "agrees"),
        ("fabric.macro.bending_stiffness.warp=5.31", "warp bending stiffness", "overhang 171 mm", "differs"),
        ("fabric.area_mass=860", "area mass", "Table 2", "agrees"),
        ("fabric.area_mass=870", "area mass", "Table 2", "differs"),
        ("fabric.thickness=2.1", "thickness", "Table 2", "differs"),
        ("fabric.weft_density=30", "weft density", "Table 2", "differs"),
        ("fabric.weft_density=30", "warp density", "Table 2", "agrees"),
        ("fabric.loop_length=15.2", "loop length", "Table 2", "differs"),
        ("fabric.macro.tension.warp=pham2019/curves/tensile-v2-weft.csv", "warp curve, largest force", "width", "no"),
    ],
)
def test_a_number_is_judged_by_the_fabrics_own_test(setting, name, origin, verdict):
    row = of(in_tests(setting), name, origin)
    assert row.verdict.startswith(verdict), row


def test_what_tests_say_in_closed_form():
    rows = in_tests()
    assert of(rows, "warp bending stiffness").found == pytest.approx(824.2e-6 * 9.81e-3 * 85.5**3, rel=1e-12)
    assert of(rows, "warp curve, largest force").found == pytest.approx(5820 / 50)
    assert of(rows, "weft curve, largest force").stated == pytest.approx(5744 / 50)
    assert of(rows, "warp fracture strain", "Table 3").origin == "Table 3: 1.6 ± 0.3 %"
    assert all(row.verdict == "agrees" for row in rows)


def test_without_tests_and_yarns_nothing_is_invented():
    rows = counterparts(resolve(variant="cao2008-weave", scale="macro").fabric)
    assert of(rows, "warp fracture strain", "experiment").origin == "the fabric names no experiment"
    assert {r.verdict for r in rows} == {"agrees", "no counterpart"}
    none = [r for r in rows if r.verdict == "no counterpart"]
    assert all(r.found is None and r.difference is None and r.as_json()["difference_pct"] is None for r in none)
    assert of(rows, "thickness").origin == "the yarns are not described"


def test_a_bundle_of_even_yarns_is_their_sum():
    """28 yarns over 100 mm of 59.3 GPa on 0.784 mm2 that all break at 1 %: 130.2 N/mm, at 1.6 % with 0.6 % of crimp."""
    rows = counterparts(fabric_with("fabric.reinforcing.fracture_strain.sd=0"))
    assert of(rows, "warp curve, largest force", "bundle").found == pytest.approx(0.28 * 59300 * 0.784 * 0.01)
    assert of(rows, "weft fracture strain", "bundle").found == pytest.approx(100 * (1.006 * 1.01 - 1.0))
    assert of(rows, "warp bending stiffness", "side by side").found == pytest.approx(0.28 * 18.1)


def test_a_bundle_of_scattered_yarns_is_weaker():
    """Daniels (1945): the largest of e (1 - F(e)) for a sd of 15 % is 0.727, at 0.80 of the mean."""
    found = counterparts(fabric_with())
    assert of(found, "warp curve, largest force", "bundle").found == pytest.approx(0.727 * 130.2, rel=0.01)
    assert of(found, "warp fracture strain", "bundle").found == pytest.approx(0.6 + 0.80 * 1.006, abs=0.03)
    strong = counterparts(fabric_with("fabric.reinforcing.youngs_modulus=100"))
    assert of(strong, "warp curve, largest force", "bundle").verdict == "differs"


def test_thickness_mass_and_crimp_beside_the_relaxed_cell():
    fabric = fabric_with()
    cell = relaxed_cell(fabric)
    rows = list(cell_counterparts(fabric, cell))
    assert of(rows, "thickness").found == cell.thickness and of(rows, "thickness").verdict == "agrees"
    straight = 280 * 1.2 * (2 + cell.crimp("warp") + cell.crimp("weft")) + 14.4 * 230 / (100 / 28) ** 2
    assert of(rows, "area mass").found == pytest.approx(straight, rel=1e-3)
    assert 1e6 * cell_mass(fabric, cell) / (100 / 28) ** 2 == pytest.approx(of(rows, "area mass").found)
    assert of(rows, "area mass").verdict == "differs"  # 936 for 824.2 measured: known, and said
    assert of(rows, "warp crimp").found == 100 * cell.crimp("warp") and of(rows, "warp crimp").verdict == "agrees"
    assert of(rows, "loop length").found == pytest.approx(14.4, rel=1e-3)
    thick = fabric.model_copy(update={"thickness": fabric.thickness.model_copy(update={"value": 2.4})})
    assert of(list(cell_counterparts(thick, cell)), "thickness").verdict == "differs"
    scattered = thick.thickness.model_copy(update={"sd": 0.3})
    thick = fabric.model_copy(update={"thickness": scattered})
    assert of(list(cell_counterparts(thick, cell)), "thickness").verdict == "agrees"


def test_a_cell_that_locks_is_a_reason_and_no_error():
    rows = counterparts(fabric_with("fabric.loop_length=8.2"))
    assert of(rows, "thickness", "no relaxed cell").verdict == "no counterpart"


def test_the_verdict_is_the_tolerances():
    row = Counterpart("a", "b", "mm", 1.0, "measured", 2.0, "c", 1.0)
    assert (row.verdict, row.difference) == ("agrees", -0.5)
    assert Counterpart("a", "b", "mm", 1.0, "measured", 2.01, "c", 1.0).verdict == "differs"
    lines = table_cells([row, Counterpart("a", "b", "mm", 1.0, "assumed", None, "why")])
    assert "-50.0 %" in lines[1] and "agrees" in lines[1] and lines[2][-4:] == ("-", "-", "no counterpart", "why")
    assert summary_line([row]) == "  1 agree, 0 differ; 0 without counterpart"


def test_numbers_of_one_other_fabric_do_not_agree_with_each_other():
    """A strip's fracture strain and yarns of variant 1 agree in any fabric that has both."""
    start = copy_as_assumed(resolve(variant="1", parameters="as-measured").fabric, "mine")
    bundle = ("warp curve, largest force", "bundle")
    row = of(counterparts(start), *bundle)
    assert (row.verdict, row.owner, row.difference) == ("taken over", "pham2019-v1", pytest.approx(0.23, abs=0.01))
    assert "agrees" not in {row.verdict for row in counterparts(start)}
    own = {name: Quantity(value=getattr(start, name).value, source="measured") for name in ("thickness", "loop_length")}
    rows = counterparts(start.model_copy(update=own))
    assert of(rows, "thickness").verdict == of(rows, "loop length", "densities").verdict == "agrees"
    assert of(rows, *bundle).verdict == "taken over"
    assert summary_line([row]).endswith("; 1 not checked: value and counterpart both come from pham2019-v1")


def test_fibres_of_the_shipped_inlay_do_not_fit_into_its_circle():
    """0.784 mm2 in a circle of 0.75 mm, the diameter of the paper's model; the loops' 0.136 mm2 fit into 0.5 mm."""
    rows = counterparts(fabric_with())
    assert of(rows, "reinforcing packing").found == 0.6 and of(rows, "reinforcing packing").verdict == "differs"
    assert of(rows, "reinforcing packing").stated == pytest.approx(0.784 / (pi * 0.75**2 / 4))
    assert of(rows, "knitting packing").stated == pytest.approx(0.136 / (pi * 0.5**2 / 4))
    assert of(rows, "knitting packing").verdict == "agrees"


def test_a_loop_length_stands_beside_that_of_a_plain_knit():
    """Stitches per area times the loop length squared are 20 (Munden): 16.0 mm at a spacing of 100/28 mm each way."""
    row = of(counterparts(fabric_with()), "loop length", "densities")
    assert row.found == pytest.approx(sqrt(20) * 100 / 28) and row.verdict == "agrees"
    long = of(counterparts(fabric_with("fabric.loop_length=22")), "loop length", "densities")
    assert long.verdict == "differs"


def test_check_shows_the_table_and_gives_it_as_json(capsys):
    command = ["check", "tensile", "--variant", "2", "--scale", "macro", "--preset", "quick", "--no-time"]
    assert run(command) == 0
    said = capsys.readouterr().out
    assert (
        "25 agree, 2 differ: reinforcing packing, thickness; 0 without counterpart" in said and "  time  " not in said
    )
    assert run([*command, "--json", "--direction", "weft"]) == 0
    found = json.loads(capsys.readouterr().out)
    (model,) = found["models"]
    assert (model["direction"], model["elements"], "estimate" in model) == ("weft", 110, False)
    (row,) = [r for r in found["counterparts"] if r["quantity"] == "thickness" and r["from"] == "relaxed cell"]
    assert row["verdict"] == "differs" and row["in_file"] == 2.63 and row["difference_pct"] > 5


def test_spread_of_half_normal_slack_lengthens_the_bundle():
    """A slack of scale s adds up to its mean, s sqrt(2 / pi), to the strain at the largest force."""
    taut, slack = (
        of(counterparts(fabric_with(f"fabric.reinforcing.slack.weft={s}")), "weft fracture strain", "bundle").found
        for s in (0.0, 0.3)
    )
    assert 0.5 * 0.3 * sqrt(2 / pi) < slack - taut < 2.0 * 0.3 * sqrt(2 / pi)


def test_numbers_of_a_rig_stand_beside_what_its_test_measures():
    rigs = {"friction": {"warp": {"kinetic_coefficient": 0.1, "travel": 5.0}}, "forming": {"kinetic_coefficient": 0.2}}
    fabric = resolve(variant="1", scale="macro").fabric.model_copy(update={"rigs": rigs})
    found = {row.name: row for row in of_tests(fabric) if row.field.startswith("rigs.")}
    assert list(found) == ["warp kinetic coefficient", "weft kinetic coefficient"]
    assert {row.field for row in found.values()} == {"rigs.friction.warp.kinetic_coefficient"}
    assert [(row.stated, row.source) for row in found.values()] == [(0.1, "stated"), (0.1, "assumed")]


def test_options_of_a_test_are_heard_and_those_of_another_refused(capsys):
    words = ["--variant", "1", "--preset", "quick", "--no-time", "--json"]
    assert run(["check", "biaxial", *words, "--scale", "macro", "--direction", "warp", "--ratio", "1e3"]) == 2
    assert "rig.ratio" in capsys.readouterr().err
    assert run(["check", "forming", *words, "--ratio", "1"]) == 2
    assert "--ratio: forming has no such option" in capsys.readouterr().err
    assert run(["check", "forming", *words, "--blank-holder-force", "0"]) == 0
