"""Import of overhang lengths: stiffness by Eq. 2 against the numbers of the paper, units, angles and readings."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from strip_reading import refused

from knittest.cli.main import run
from knittest.config.fabric import YARN_LEVEL
from knittest.config.loading import resolve
from knittest.experiment.lab_table import ReadOptions
from knittest.experiment.origin import row_kind
from knittest.experiment.tables import published_rows
from knittest.laboratory.cantilever.lab_files import LAB as CANTILEVER
from knittest.laboratory.cantilever.lab_files import STANDARD_ANGLE, standard_overhang_ratio
from knittest.laboratory.cantilever.test import given_overhang, stiffness_by_overhang
from knittest.materials.heavy_elastica import chord_angle
from knittest.runs.preflight.measured_counterparts import test_counterparts as of_tests
from knittest.runs.run_files import references_of


def given(mass=824.2, width=50.0, **more):
    """Options of a user; sizes that are None are not stated."""
    sizes = {"area_mass_g_m2": mass, "strip_width_mm": width, **more}
    return ReadOptions(sizes={name: size for name, size in sizes.items() if size is not None})


V1 = given()


@pytest.fixture
def read(tmp_path):
    """Reads strips from the text of a file."""

    def strips(text, stated=V1, name="a.csv"):
        (tmp_path / name).write_text(text, encoding="utf-8")
        return CANTILEVER.read(tmp_path / name, stated)

    return strips


def fabric_part(out):
    return yaml.safe_load((out / "fabric.yaml").read_text())


def test_stiffness_is_that_of_the_paper_in_the_right_unit(read):
    """Table 3 of Pham et al. (2019), V1 warp: 171 mm give 2.53e3 mN cm2 for the strip of 50 mm, 5.05 N mm per width."""
    (strip,) = read("Überhang [mm]\n171\n")
    assert strip.stiffness == pytest.approx(5.05, abs=0.005)
    assert CANTILEVER.results([strip], "warp").found["bending_stiffness_mncm2"] == pytest.approx([2.53e3], rel=2e-3)
    assert any("-" in line for line in CANTILEVER.lines([strip]) if line.startswith("sd"))


def test_readings_of_a_strip_are_averaged_and_units_kept(read):
    text = "Flächengewicht;0,8242;kg/m²\nProbenbreite;5;cm\nProbe;Überhanglänge\n;cm\n1;17,0\n1;17,2\n2;16,0\n2;16,2\n"
    one, two = read(text, ReadOptions())
    assert (one.overhang, two.overhang) == pytest.approx((171.0, 161.0)) and (one.width, one.area_mass) == (50.0, 824.2)
    assert len(CANTILEVER.results([one, two], "warp").found["overhang_mm"]) == 2
    assert [s.overhang for s in read("overhang [mm]\n171\n161\n")] == [171.0, 161.0]


@pytest.mark.parametrize("angle", [30.0, 45.0])
def test_an_overhang_at_another_angle_becomes_that_at_41_deg(angle):
    """The heavy elastica of the same strip meets 41.5 deg at the overhang that is found."""
    stiffness, weight, factor = 3.0, 8e-6, standard_overhang_ratio(angle)
    low, high = 50.0, 400.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if chord_angle(middle, weight, stiffness) < angle else (low, middle)
    assert chord_angle(low * factor, weight, stiffness) == pytest.approx(STANDARD_ANGLE, abs=0.01)
    assert (factor > 1.0) == (angle < STANDARD_ANGLE) and standard_overhang_ratio(STANDARD_ANGLE) == 1.0


def test_the_angle_is_stated_or_that_of_the_standard(read):
    text = "plane angle;45;deg\noverhang [mm]\n171\n"
    (strip,) = read(text)
    assert strip.overhang == pytest.approx(171.0 * standard_overhang_ratio(45.0)) and strip.overhang < 171.0
    assert "by the heavy elastica" in "".join(CANTILEVER.lines([strip]))
    words = r"angle of the plane 45 deg, but --plane-angle is 41\.5 deg"
    refused(words, read, text, given(plane_angle_deg=41.5))


FACES = "area mass [g/m2];830\nstrip;overhang face [mm];overhang back [mm]\n1;165;120\n2;160;\n3;170;125\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("overhang\n171\n", ":1: column 'overhang' has no unit of length"),
        ("bending length [mm]\n85\n", ":1: a bending length is half the overhang"),
        ("Probe;Biegelänge [cm]\n1;8,5\n", "half the overhang"),
        ("overhang [mm]\n171\nabc\n", ":3: 'abc' is not a number"),
        ("overhang [mm];note\n;none\n", ":2: no overhang|no overhang lengths"),
        ("overhang [mm]\n1.71\n", ":2: overhang 1.71 mm: implausible, expected 5 to 1000 mm"),
        ("overhang [mm]\n171\n17.2\n168\n", r"a\.csv: specimen a-2: overhang 17\.2 mm and the median of the other 2"),
        ("Probe;overhang [mm]\n1;171\n1;17,2\n", "specimen a-1: overhang"),
        ("overhang [mm]\n171,5\n", ":2: 2 cells below 1 columns; export with a delimiter that is not the decimal mark"),
        ("force;travel\n1;2\n", "no header row names an overhang length"),
        (FACES, r":4: 1 of 2 readings: ends and faces differ"),
    ],
)
def test_refused_with_the_row(read, text, words):
    refused(words, lambda: CANTILEVER.lines(read(text, given(None if text == FACES else 824.2))))


def test_an_area_mass_must_be_known(read):
    text = "overhang [mm]\n171\n"
    refused(r"states no area mass: give --area-mass \[g/m2\]", read, text, ReadOptions())
    refused(r"--area-mass 0\.8: implausible.*it looks like kg/m2: 800 g/m2", read, text, given(0.8))
    results = CANTILEVER.results(read(text, given(width=None)), "warp")
    assert "bending_stiffness_mncm2" not in results.found  # of a strip of no known width


def test_the_table_and_the_part_of_the_fabric(read, tmp_path):
    out = tmp_path / "mine"
    strips = read("overhang [mm]\n171\n165\n177\n")
    assert CANTILEVER.write(strips, out, "warp", ["a.csv"]) == "mine"
    names = ("overhang_mm", "bending_stiffness_n_mm_per_width", "bending_stiffness_mncm2", "strip_width_mm")
    overhang, per_width, of_strip, width = published_rows(out, "mine", "warp", names)
    assert (overhang.mean, overhang.sd, overhang.n) == (171.0, 6.0, 3)
    assert per_width.mean == pytest.approx(np.mean([s.stiffness for s in strips]), rel=1e-5)
    assert (of_strip.mean, of_strip.unit) == (pytest.approx(per_width.mean * 500.0, rel=1e-5), "mN cm2")
    field = fabric_part(out)["macro"]["bending_stiffness"]["warp"]
    assert width.mean == 50.0 and field["source"] == "derived" and "824.2 g/m2" in field["ref"]
    assert field["value"] == pytest.approx(per_width.mean)
    refused("has the same curves, imported as warp", CANTILEVER.write, strips, out, "weft", ["a.csv"])
    stated = read("overhang [mm]\n171\n165\n", name="weft.csv")
    words = r"weft\.csv: the file name states weft, but --direction is warp"
    refused(words, CANTILEVER.write, stated, out, "warp", ["weft.csv"])


def test_the_area_mass_of_the_overhangs_is_the_fabrics(read, tmp_path, monkeypatch):
    """A strip of 700 g/m2 and its own B meets the plane at its own overhang, not with another fabric's mass."""
    monkeypatch.chdir(tmp_path)
    out = Path("data/mine")
    CANTILEVER.write(read("overhang [mm]\n171\n165\n", given(700.0)), out, "warp", ["a.csv"])
    mass = {"value": 700.0, "source": "measured", "ref": "stated with mine: cantilever-warp"}
    assert fabric_part(out)["area_mass"] == mass
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    found = resolve(test="cantilever", scale="macro", variant="mine", direction="warp")
    overhang, mass = given_overhang(found), found.fabric.area_mass_g_per_mm2
    assert mass == pytest.approx(700e-6)
    stiffness = found.fabric.macro.bending_stiffness_n_mm.warp
    assert chord_angle(overhang, mass * 9.81e-3, stiffness) == pytest.approx(STANDARD_ANGLE, abs=0.1)
    rows = {row.quantity: row for row in references_of(found, ()).rows}
    own = stiffness_by_overhang(found, overhang, STANDARD_ANGLE)
    assert rows["bending_stiffness_eq2_n_mm_per_width"].mean == pytest.approx(own, rel=0.01)
    assert row_kind(found, "bending_stiffness_eq2_n_mm_per_width") == "input"
    # another mass in the fabric file is seen by the check
    for stated, verdict in ((700, "agrees"), (824.2, "differs")):
        fabric = resolve(scale="macro", variant="mine", sets=[f"fabric.area_mass={stated}"]).fabric
        (row,) = [r for r in of_tests(fabric) if r.field == "area_mass"]
        assert (row.verdict, row.found, row.stated) == (verdict, 700.0, stated) and "mine, 2 strips" in row.origin


def test_overhangs_of_two_masses_are_not_one_fabric(read, tmp_path):
    out = tmp_path / "mine"
    for mass, direction in ((700.0, "warp"), (720.0, "weft")):
        strips = read(f"overhang [mm]\n{mass - 540}\n165\n", given(mass, None), f"{direction}.csv")
        CANTILEVER.write(strips, out, direction, [f"{direction}.csv"])
    assert fabric_part(out)["area_mass"]["value"] == 710.0
    other = read("overhang [mm]\n150\n165\n", given(900.0, None))
    words = r"a\.csv: .*area mass 900 g/m2, but .*cantilever-warp has 700"
    refused(words, CANTILEVER.write, other, out, "weft", ["a.csv"])


def test_a_mass_that_no_assumed_yarns_make_starts_a_fabric_of_shells(read, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    CANTILEVER.write(read("overhang [mm]\n90\n95\n", given(250.0, None)), Path("data/mine"), "warp", [])
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    fabric = resolve(scale="macro", variant="mine").fabric
    assert fabric.area_mass.value == 250.0 and all(getattr(fabric, name) is None for name in YARN_LEVEL)
    assert "The yarns of pham2019-v1 do not fit this area mass" in Path("configs/mine.yaml").read_text()


def test_both_stiffnesses_per_width_stand_beside_that_of_the_tests():
    """Table 3 of Pham et al. (2019), V1 warp: 2530 mN cm2 of 50 mm are 5.06 N mm per width."""
    run = resolve(test="cantilever", variant="1", scale="macro", direction="warp", sets=["rig.width=20"])
    found = {row.quantity: row for row in references_of(run, ()).rows}
    assert "bending_stiffness_mncm2" not in found
    assert found["bending_stiffness_eq2_n_mm_per_width"].mean == pytest.approx(5.06)
    root = found["bending_stiffness_n_mm_per_width"]
    assert (root.mean, root.unit, root.scaled) == (pytest.approx(5.06), "N mm", "that of the strip over its width")
    assert row_kind(run, root.quantity) == row_kind(run, "bending_stiffness_eq2_n_mm_per_width")
