"""Yarn cards from a data sheet: numbers in closed form, the table of fibres, measured numbers, what is refused."""

import json
import math
import re
from pathlib import Path

import pytest
import yaml

from knittest.base.errors import InputError
from knittest.base.files import configs_dir
from knittest.cli.main import run
from knittest.config.loading import resolve
from knittest.config.schema import run_schema
from knittest.config.templates import new_fabric_text
from knittest.config.yaml_writer import dump
from knittest.config.yarn import KnittingYarn, ReinforcingYarn
from knittest.config.yarn_card import Blend, blend_of, fibres, is_filled
from knittest.experiment.origin import assumed_inputs

PAGE = (Path(__file__).parents[2] / "docs/yarn-card.md").read_text(encoding="utf-8")
GLASS = {"fibre": "E-glass", "linear_density": 600}
INLAY = "fabric.reinforcing."


def inlay(**more) -> ReinforcingYarn:
    return ReinforcingYarn.model_validate(GLASS | more)


def own_fabric(tmp_path: Path, reinforcing: dict | None = None, **fields):
    """File of a fabric with the yarn cards of glass and polyester, and what is stated besides."""
    data = yaml.safe_load((configs_dir() / "fabrics/pham2019-v1.yaml").read_text())
    for name in ("parameter_sets", "area_mass", "thickness", "experiment", "experiment_variant"):
        del data[name]
    cards = {"reinforcing": reinforcing or GLASS, "knitting": {"fibre": "polyester", "linear_density": "2 x 34 tex"}}
    path = tmp_path / "own.yaml"
    path.write_text(yaml.safe_dump(data | cards | {"name": "own"} | fields))
    return path


def test_numbers_of_a_glass_yarn_in_closed_form():
    """600 tex at 2.55 g/cm3 are 0.2353 mm2; at a packing of 0.6 in a circle of 0.7066 mm."""
    yarn, area = inlay(), 0.6 / 2.55
    diameter = math.sqrt(4 * area / (math.pi * 0.6))
    free = 72.4e3 * area * 0.013**2 / 16
    solid = 72.4e3 * area * diameter**2 / 16
    assert yarn.load_area.value == pytest.approx(area, rel=1e-12)
    assert yarn.beam_diameter.value == pytest.approx(diameter, rel=1e-12)
    assert yarn.youngs_modulus.value == pytest.approx(72.4)
    assert yarn.fracture_strain.value == pytest.approx(0.55 * 4.77)
    assert yarn.bending_stiffness.warp.value == pytest.approx(free + 0.002 * (solid - free), rel=1e-12)
    assert yarn.torsion_ratio.value == pytest.approx(0.82)
    for name in ("load_area", "beam_diameter", "youngs_modulus", "fracture_strain", "torsion_ratio"):
        found = getattr(yarn, name)
        assert found.source == "derived" and f" = {found.value:.6g}" in found.ref, name
    assert {yarn.crimp.warp.source, yarn.slack.weft.source, yarn.packing.source} == {"assumed"}
    assert yarn.efficiency.source == "assumed" and "not measured on this yarn" in yarn.efficiency.ref


def test_an_efficiency_of_the_table_is_an_assumed_input_of_the_strength(tmp_path):
    file = own_fabric(tmp_path, reinforcing={"fibre": "E-glass", "linear_density": 600})
    table = resolve(fabric=file, direction="warp")
    assert {"reinforcing.efficiency"} < set(assumed_inputs(table))
    for stated in ("efficiency=0.5", "fracture_strain=2"):
        assert "reinforcing.efficiency" not in assumed_inputs(
            resolve(fabric=file, direction="warp", sets=[INLAY + stated])
        )
    bent = resolve(fabric=file, test="cantilever", scale="meso", direction="warp")
    assert assumed_inputs(bent) == ("reinforcing.bending_share",) and bent.fabric.area_mass.source == "derived"


def test_the_default_share_of_bending_is_that_of_the_cantilever_tests():
    """The warps of Pham et al. have 18.1 and 29.6 N mm2 (Eq. 2); their yarn is 2/3 carbon and 1/3 PA 6.6 by mass."""
    card = {"fibre": {"carbon HT": 2 / 3, "polyamide": 1 / 3}, "linear_density": 1200}
    free, half = (
        ReinforcingYarn.model_validate(card | {"bending_share": share}).bending_stiffness.warp.value
        for share in (0, 0.5)
    )
    solid = free + 2 * (half - free)
    assert [(ei - free) / (solid - free) for ei in (18.1, 29.6)] == pytest.approx([0.0016, 0.0026], rel=0.03)


def test_a_blend_by_shares_of_mass():
    """60 g of glass are 23.5 cm3, 40 g of polypropylene 44.0 cm3; both carry until the glass fails."""
    card = KnittingYarn.model_validate({"fibre": {"e glass": 0.6, "Polypropylene": 0.4}, "linear_density": 100})
    glass, poly = 60 / 2.55, 40 / 0.91
    assert card.load_area.value == pytest.approx(1e-3 * (glass + poly))
    assert card.youngs_modulus.value == pytest.approx((72.4 * glass + 3.5 * poly) / (glass + poly))
    assert card.fracture_strain.value == pytest.approx(0.55 * 4.77)
    torsion = (72.4 * glass * 0.82 + 3.5 * poly * 0.2) / (72.4 * glass + 3.5 * poly)
    assert card.torsion_ratio.value == pytest.approx(torsion)


def test_fibres_that_fail_before_the_largest_force_do_not_carry():
    """One per cent of carbon fails at 0.975 % strain, where the polyamide has hardly any force."""
    card = KnittingYarn.model_validate({"fibre": {"carbon HT": 0.01, "polyamide": 0.99}, "linear_density": 100})
    assert card.fracture_strain.value == 20.0
    assert card.load_area.value == pytest.approx(1e-3 * 99 / 1.14)
    assert card.youngs_modulus.value == pytest.approx(5.2)


def test_twist_lowers_the_modulus_and_the_strength():
    """tan(helix angle) = pi D twist; D is that of the yarn."""
    plain, turned = inlay(), inlay(twist=120)
    slope = math.pi * plain.beam_diameter.value * 0.12
    assert turned.youngs_modulus.value == pytest.approx(72.4 / (1 + slope**2), rel=1e-12)
    assert turned.fracture_strain == plain.fracture_strain


@pytest.mark.parametrize(
    ("written", "tex"),
    [("4 x 300 tex", 1200), ("4x300", 1200), ("2 × 34 tex", 68), ("680 dtex", 68), ("600", 600), (600.0, 600)],
)
def test_linear_densities(written, tex):
    assert inlay(linear_density=written).linear_density.value == pytest.approx(tex)
    stated = inlay(linear_density={"value": written, "source": "measured", "ref": "sheet"}).linear_density
    assert (stated.value, stated.source, stated.ref) == (pytest.approx(tex), "measured", "sheet")


def test_plies_are_understood_without_a_fibre():
    sets = [f"{INLAY}linear_density=4 x 300 tex"]
    assert resolve(variant="1", sets=sets).fabric.reinforcing.linear_density.value == 1200


@pytest.mark.parametrize(
    ("stated", "needless", "follows"),
    [
        ({"beam_diameter": 0.8}, "packing", "bending_stiffness"),
        ({"fracture_strain": 2.2}, "efficiency", "fracture_strain"),
        ({"bending_stiffness": {"warp": 3.0, "weft": 4.0}}, "bending_share", "bending_stiffness"),
    ],
)
def test_a_measured_number_replaces_the_derived_one_and_what_it_came_from(stated, needless, follows):
    yarn, plain = inlay(**stated), inlay()
    assert getattr(yarn, needless) is None and getattr(plain, needless) is not None
    assert getattr(yarn, follows) != getattr(plain, follows)
    with pytest.raises(ValueError, match=f"excludes {next(iter(stated))}: keep the one that was measured"):
        inlay(**stated, **{needless: 0.5})


def test_one_direction_may_be_measured():
    yarn = inlay(bending_stiffness={"warp": 3.0})
    assert yarn.bending_stiffness.warp.source == "user" and is_filled(yarn.bending_stiffness.weft)


def test_a_resolved_config_is_read_back_and_follows_a_change(tmp_path):
    first = resolve(fabric=own_fabric(tmp_path))
    path = tmp_path / "config.yaml"
    path.write_text(dump(first))
    assert resolve(config=path) == first
    changed = resolve(config=path, sets=[f"{INLAY}linear_density=300", f"{INLAY}efficiency=0.4"]).fabric
    assert changed.reinforcing.load_area.value == pytest.approx(0.3 / 2.55)
    assert changed.reinforcing.fracture_strain.value == pytest.approx(0.4 * 4.77)
    assert changed.area_mass.value < 0.7 * first.fabric.area_mass.value
    measured = resolve(config=path, sets=[f"{INLAY}beam_diameter=0.8"]).fabric.reinforcing
    assert measured.packing is None and measured.beam_diameter.source == "user"


def test_an_edited_number_stays(tmp_path):
    path = tmp_path / "config.yaml"
    text = dump(resolve(fabric=own_fabric(tmp_path)))
    path.write_text(text.replace("value: 72.4\n", "value: 70.0\n", 1))
    assert resolve(config=path, sets=[f"{INLAY}linear_density=500"]).fabric.reinforcing.youngs_modulus.value == 70.0


def test_mass_and_thickness_follow_from_the_yarns_unless_stated(tmp_path):
    fabric = resolve(fabric=own_fabric(tmp_path)).fabric
    assert fabric.area_mass.value == pytest.approx(2 * 280 * 0.6 * 1.006 + 14.4 * 68 / (100 / 28) ** 2)
    inlays, loops = fabric.reinforcing.beam_diameter.value, fabric.knitting.beam_diameter.value
    assert fabric.thickness.value == pytest.approx(2 * inlays + 2 * loops)
    stated = resolve(fabric=own_fabric(tmp_path, thickness=1.9)).fabric
    assert stated.thickness.value == 1.9 and stated.area_mass.source == "derived"
    with pytest.raises(InputError, match=r"fabric.area_mass: missing"):  # a measured yarn makes no mass in silence
        resolve(fabric=own_fabric(tmp_path, thickness=1.9, knitting=resolve(variant="1").fabric.knitting.model_dump()))


@pytest.mark.parametrize(
    ("card", "words"),
    [
        ({"fibre": "E-glas"}, "reinforcing.fibre = 'E-glas': unknown fibre E-glas, expected one of E-gl"),
        ({"fibre": {"E-glass": 0.6, "polypropylene": 0.3}}, "the mass fractions add up to 0.9, expected 1"),
        ({"fibre": {"E-glass": -1}}, "expected the name of a fibre, or names with mass fractions above 0"),
        ({"fibre": {"E-glass": {"value": 1}}}, "expected the name of a fibre, or names with mass fractions above 0"),
        ({"linear_density": "600 den"}, "linear_density = '600 den': expected a number in tex, a text such as"),
        ({"linear_density": None}, "linear_density: missing: mass per length of the yarn"),
        ({"linear_density": 0}, "linear_density = 0: must be greater than 0 tex"),
        ({"packing": 1.2}, "packing = 1.2: must be at most 0.907"),
        (
            {"twist": 500},
            "twist = 500: gives a helix angle of 48 deg at the surface of a yarn of 0.707 mm, expected at ",
        ),
        ({"fibre": None, "twist": 100}, "twist = 100: is used only together with fibre"),
        ({"beam_diameter": 0.5}, "the fibres of 600 tex E-glass fill 120 % of the circle, expected at most 90.7"),
        (
            {"beam_diameter": 2.0},
            "the fibres of 600 tex fill 7.5 % of the circle, expected at least 15 % (at most 1.41",
        ),
        ({"youngs_modulus": 100}, "youngs_modulus = 100: the stiffness per mass is 39.2 N/tex, expected 2.84 to 35.5"),
        (
            {"fracture_strain": 6.5},
            "fracture_strain = 6.5: the strength per mass is 1.85 N/tex, expected 0.0271 to 1.69",
        ),
        ({"load_area": 0.3}, "load_area = 0.3: exceeds the fibre area of 600 tex E-glass, 0.235 mm2"),
    ],
)
def test_cards_that_contradict_themselves_are_refused_with_the_field(tmp_path, card, words):
    given = GLASS | card
    if card.get("fibre", "") is None:
        given = resolve(variant="1").fabric.reinforcing.model_dump(mode="json", exclude_none=True) | card
    path = own_fabric(tmp_path, given, thickness=2, area_mass=420)
    with pytest.raises(
        InputError, match=rf"own.yaml:\d+: fabric\.reinforcing\..*{re.escape(words)}|{re.escape(words)}"
    ):
        resolve(fabric=path)


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        (f"{INLAY}load_area=0.0784", "1200 tex on 0.0784 mm2 are 15.3 g/cm3, expected 0.3 to 9 g/cm3 (0.133 to 4 mm2)"),
        (
            f"{INLAY}beam_diameter=0.075",
            "1200 tex in the circle are 272 g/cm3, expected at most 9 g/cm3 (at least 0.412",
        ),
        (f"{INLAY}youngs_modulus=700", "the stiffness per mass is 457 N/tex, expected at most 450 N/tex"),
        (
            "fabric.loop_length=40",
            "loop_length = 40: implausible at these densities and diameters, expected at most 35.7",
        ),
    ],
)
def test_impossible_yarns_and_loops_are_refused(setting, words):
    with pytest.raises(InputError, match=re.escape(words)):
        resolve(variant="1", parameters="as-measured", sets=[setting])


def test_loops_of_35_tex_do_not_fill_a_circle_of_half_a_millimetre():
    """35 tex of polyester are 0.0254 mm2, 13 % of the circle."""
    loops = [f"fabric.knitting.{one}" for one in ("linear_density=35", "load_area=0.0254", "bending_stiffness=0.01")]
    with pytest.raises(
        InputError, match=r"knitting.beam_diameter = 0.5: the fibres of 35 tex fill 13 % .*at most 0.464 mm"
    ):
        resolve(variant="1", sets=loops)
    assert resolve(variant="1", sets=[*loops, "fabric.knitting.beam_diameter=0.23"])


@pytest.mark.parametrize(("name", "row"), list(fibres().items()), ids=list(fibres()))
def test_the_table_is_that_of_the_page_and_plausible(name, row):
    numbers = " | ".join(f"{value:g}" for value in row[:-1])
    assert f"| {name} | {numbers} |" in PAGE
    assert len(row.source) > 10 and 0.9 <= row.density <= 2.8 and 0.0 < row.efficiency <= 1.0
    assert ReinforcingYarn.model_validate({"fibre": name, "linear_density": 600})


@pytest.mark.parametrize(
    ("name", "tenacity"),
    [
        ("E-glass", 0.75), ("basalt", 0.65), ("polyester", 0.81), ("polyamide", 0.91), ("polypropylene", 0.65),
        ("polyethylene HD", 0.34), ("polyethylene HM", 2.9), ("aramid", 2.0),
    ],
)  # fmt: skip
def test_strength_of_untwisted_yarns_is_that_of_the_sources(name, tenacity):
    """Tenacities [N/tex] of yarns as the sources of the table print them."""
    row = fibres()[name]
    assert row.efficiency * row.failure_strain / 100 * row.modulus / row.density == pytest.approx(tenacity, rel=0.03)


def test_strength_of_filaments_is_that_of_the_sources():
    printed = {"E-glass": 3.45, "S-glass": 4.59, "carbon HT": 3.53, "carbon IM": 5.2, "carbon HM": 4.4, "basalt": 4.2}
    for name, strength in printed.items():
        assert blend_of(name).strength == pytest.approx(strength, rel=0.03), name
    assert fibres()["carbon HT"].efficiency == pytest.approx((5 * math.e) ** -0.2 / math.gamma(1.2), abs=0.005)
    assert isinstance(blend_of("aramid"), Blend)


def test_the_card_of_the_page_is_taken(tmp_path):
    (text,) = re.findall(r"^```yaml\n(reinforcing:.*?)^```$", PAGE, re.M | re.S)
    cards = yaml.safe_load(text)
    fabric = resolve(fabric=own_fabric(tmp_path, **cards)).fabric
    assert fabric.reinforcing.fracture_strain.source == "measured" and fabric.knitting.load_area.source == "derived"


def test_a_new_fabric_of_two_data_sheets_and_what_check_says_of_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["new", "mine", "--reinforcing", "E-glass 600 tex", "--knitting", "polyester, 2 x 34 tex"]) == 0
    fabric = resolve(variant="mine").fabric
    assert fabric.reinforcing == inlay(linear_density="600 tex") and fabric.knitting.linear_density.value == 68
    assert fabric.area_mass.source == fabric.thickness.source == "derived"
    yarns = fabric.reinforcing.beam_diameter.value + 2 * fabric.knitting.beam_diameter.value  # variant 1: 1.75 mm
    assert fabric.loop_length.value == pytest.approx(14.4 * yarns / 1.75, rel=5e-3)
    assert fabric.warp_density.value == fabric.weft_density.value == pytest.approx(28.0 * 1.75 / yarns, rel=5e-3)
    capsys.readouterr()
    check = ["check", "tensile", "--variant", "mine", "--preset", "quick", "--no-time", "--set", "rig.width=20"]
    assert run(check) == 0
    said = capsys.readouterr().out
    printed = PAGE[PAGE.index("derived from the yarns:") :].split("```")[0].strip().splitlines()
    ends = [(line.strip().split(":")[0], line.rpartition(" = ")[2]) for line in printed if " = " in line]
    shown = {line.strip().split(":")[0]: line.rpartition(" = ")[2] for line in said.splitlines()}
    assert len(ends) == 7 and all(shown[name] == end for name, end in ends)
    assert printed[-1].strip(" .,") in said
    assert re.search(r"; \d not checked: value and counterpart both come from pham2019-v1", said)
    assert not re.search(r"assumed .* agrees .* bundle of the yarns", said)
    assert run([*check, "--json", "--set", f"{INLAY}youngs_modulus=60", "--set", f"{INLAY}beam_diameter=0.8"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["derived"]["reinforcing.load_area"]["source"] == "derived"
    rows = {row["quantity"]: row for row in found["counterparts"]}
    assert rows["reinforcing packing"]["in_file"] == pytest.approx(0.6 / 2.55 / (math.pi * 0.8**2 / 4))
    assert rows["reinforcing stiffness"]["in_file"] == pytest.approx(60 / 2.55)
    assert rows["reinforcing stiffness"]["verdict"] == "agrees" and "knitting packing" not in rows


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("600 tex", 'expected a fibre and its linear density, such as "E-glass 600 tex"'),
        ("E-glas 600", "--reinforcing 'E-glas 600': fibre = 'E-glas': unknown fibre E-glas"),
        ("{fibre: E-glass, linear_density: 600, packing: 3}", "packing = 3: must be at most 0.907"),
        ("{fibre: E-glass", "--reinforcing"),
    ],
)
def test_a_data_sheet_that_is_none_is_refused(text, words):
    with pytest.raises(InputError, match=re.escape(words)):
        new_fabric_text("mine", resolve(variant="1").fabric, None, {"reinforcing": text})


def test_editors_accept_a_card_of_two_lines():
    card = run_schema()["$defs"]["ReinforcingYarn"]
    assert {"required": ["fibre", "linear_density"]} in card["anyOf"] and "required" not in card
    assert {"type": "string"} in card["properties"]["linear_density"]["anyOf"]
