"""Numbers of a config that exclude each other are refused with the field, and those beside them are taken."""

import pytest

from knittest.base.errors import InputError
from knittest.config.fabric import yarn_area_mass
from knittest.config.loading import resolve

YARN = "fabric.reinforcing."
TABLE = YARN + "law={{kind: table, points: {}}}"
#: a steep table and the strain at which it breaks
STEEP = (
    "fabric.reinforcing={{law: {{kind: table, points: [[0, 0], [1, 500], [2, 6000]]}}, load_area: 1.3, "
    "fracture_strain: {}}}"
)
#: kind of test, setting taken, setting refused, field and words of the message
CASES = {
    "yarn stiffer than a tube": (
        "tensile", YARN + "bending_stiffness.warp=3268", YARN + "bending_stiffness.warp=3270",
        "fabric.reinforcing.bending_stiffness.warp = 3270: must be at most 3269 N mm2, that of a thin tube",
    ),
    "loop yarn stiffer than a tube": (
        "tensile", "fabric.knitting={bending_stiffness: 67.4, load_area: 0.03}",
        "fabric.knitting={bending_stiffness: 99, load_area: 0.03}",
        "fabric.knitting.bending_stiffness = 99: must be at most 67.41 N mm2",
    ),
    "toe beyond fracture": (
        "tensile", YARN + "law={kind: toe, toe_strain: 0.99}", YARN + "law={kind: toe, toe_strain: 1.0}",
        "fabric.reinforcing.law.toe_strain = 1.0: must be less than fracture_strain, 1 %",
    ),
    "table ends early": (
        "tensile", TABLE.format("[[0, 0], [1.0, 500]]"), TABLE.format("[[0, 0], [0.99, 500]]"),
        "end at 0.99 %, before fracture_strain = 1 %",
    ),
    "table without slope": (
        "tensile", TABLE.format("[[0, 0], [1, 500], [2, 500]]"), TABLE.format("[[0, 0], [1, 0], [2, 500]]"),
        "the first slope must be above 0",
    ),
    "table of huge stresses": (
        "tensile", TABLE.format("[[0, 0], [50, 26000]]"), TABLE.format("[[0, 0], [1, 1e300]]"),
        "law.points = [[0, 0], [1, 1e+300]]: must be at most 100000 MPa",
    ),
    "table in GPa": (
        "tensile", TABLE.format("[[0, 0], [1, 60]]"), TABLE.format("[[0, 0], [1, 0.5]]"),
        "the steepest slope is 0.05 GPa, expected 5.93 to 593 GPa by youngs_modulus",
    ),
    "table in Pa": (
        "tensile", TABLE.format("[[0, 0], [1, 5900]]"), TABLE.format("[[0, 0], [1, 6000]]"), "is 600 GPa",
    ),
    "crimp as a fraction": (
        "tensile", YARN + "crimp={warp: 0.02, weft: 0}", YARN + "crimp.weft=0.0077",
        "crimp.weft = 0.0077: implausible, expected 0 or at least 0.02 % (it looks like a fraction: 0.77 %)",
    ),
    "toe as a fraction": (
        "tensile", YARN + "law={kind: toe, toe_strain: 0.02}", YARN + "law={kind: toe, toe_strain: 0.003}",
        "law.toe_strain = 0.003: implausible, expected 0 or at least 0.02 % (it looks like a fraction: 0.3 %)",
    ),
    "mounting slack as a fraction": (
        "picture-frame", "rig.mounting_slack=0", "rig.mounting_slack=5e-4",
        "rig.mounting_slack = 0.0005: implausible, expected 0 or at least 0.01 % (it looks like a fraction: 0.05 %)",
    ),
    "load area ten times too large": (
        "tensile", YARN + "load_area=4", YARN + "load_area=7.84",
        "fabric.reinforcing.load_area = 7.84: 1200 tex on 7.84 mm2 are 0.153 g/cm3, expected 0.3 to 9 g/cm3",
    ),
    "too strong for its mass": (
        "tensile", YARN + "fracture_strain=15.4", YARN + "fracture_strain=15.6",
        "fabric.reinforcing.fracture_strain = 15.6: the strength per mass is 6.04 N/tex (7253 N)",
    ),
    "table too strong at its fracture": (
        "tensile", STEEP.format(1), STEEP.format(2), "the strength per mass is 6.5 N/tex",
    ),
    "scatter above the mean": (
        "tensile", "fabric.loop_length={value: 14.4, sd: 14.4, source: user}",
        "fabric.loop_length={value: 14.4, sd: 14.5, source: user}",
        "fabric.loop_length.sd = 14.5: exceeds the value 14.4",
    ),
    "scatter above the mean, one way": (
        "tensile", "fabric.macro.fracture_strain.weft.sd=1.6", "fabric.macro.fracture_strain.weft.sd=1.61",
        "fabric.macro.fracture_strain.weft.sd = 1.61: exceeds the value 1.6",
    ),
    "mass below the yarns'": (
        "tensile", "fabric.area_mass=469", "fabric.area_mass=467",
        "fabric.area_mass = 467: implausible, expected 467.8 to 1871 g/m2: the yarns make 935.7 g/m2",
    ),
    "thinner than its inlays": (
        "tensile", "fabric.thickness=0.75", "fabric.thickness=0.74",
        "fabric.thickness = 0.74: implausible, expected 0.75 to 7.5 mm",
    ),
    "static below kinetic, plates": (
        "friction", "rig.static_coefficient=0.075", "rig.kinetic_coefficient=0.1",
        "rig.static_coefficient: must be at least kinetic_coefficient, 0.1",
    ),
    "static below kinetic, tools": (
        "forming", "rig.kinetic_coefficient=0.05", "rig.static_coefficient=0.05", "static_coefficient = 0.05: must",
    ),
    "static below kinetic, yarns": (
        "tensile", "fabric.contact.static_friction_coefficient=0.3", "fabric.contact.static_friction_coefficient=0.29",
        "fabric.contact.static_friction_coefficient = 0.29: must be at least friction_coefficient",
    ),
    "jaw longer than the gauge": (
        "tensile", "rig.jaw_length=200", "rig={jaw_length: 60, gauge_length: 50}",
        "rig.jaw_length = 60: must be at most rig.gauge_length, 50 mm",
    ),
    "sticking yarns creep": (
        "tensile", "fabric.contact.tangential_ratio=0.01", "fabric.contact.tangential_ratio=0.009",
        "fabric.contact.tangential_ratio = 0.009: the sticking stiffness is 9 N/mm",
    ),
    "nothing can fail": (
        "tensile", "rig.max_strain=1.61", "rig.max_strain=1.6",
        "rig.max_strain = 1.6: must exceed fabric.macro.fracture_strain.warp, 1.6 %, or nothing fails",
    ),
    "shell wider than the strip": (
        "tensile", "model.macro.element_size=50", "model.macro.element_size=51",
        "model.macro.element_size = 51: must be at most rig.width, 50 mm",
    ),
    "overhang longer than the strip": (
        "cantilever", "rig.overhang=299", "rig.overhang=300", "rig.overhang = 300: must be less than rig.length",
    ),
    "uneven blank": (
        "forming", "rig.imperfection=1.1", "rig.imperfection=1.11",
        "rig.imperfection = 1.11: must be less than half the fabric thickness, 1.11 mm",
    ),
    "blank shorter than the stamp": (
        "forming", "rig.blank_length=150", "rig.blank_length=149", "rig.blank_length = 149: must be at least",
    ),
    "blank below the ball": (
        "forming", "rig={stamp: {kind: hemisphere}, blank_width: 100}",
        "rig={stamp: {kind: hemisphere}, blank_width: 99}", "rig.blank_width = 99: must be at least",
    ),
}  # fmt: skip


def resolved(kind: str, setting: str):
    return resolve(
        test=kind, variant="1", scale="macro", direction=None, parameters="as-measured",
        sets=[setting] if setting else [],
    )  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_contradiction_is_refused_and_its_neighbour_taken(case):
    kind, taken, refused, words = CASES[case]
    resolved(kind, taken)
    with pytest.raises(InputError) as error:
        resolved(kind, refused)
    assert words in str(error.value)


def test_yarns_must_be_able_to_break():
    with pytest.raises(InputError, match=r"rig.max_strain = 1: must exceed fabric.reinforcing.fracture_strain, 1 %"):
        resolve(variant="1", scale="meso", sets=["rig.max_strain=1"])
    resolve(variant="1", scale="meso", sets=["rig.max_strain=1.1", "rig.jaw_length=150", "model.macro.element_size=99"])


@pytest.mark.parametrize(
    ("points", "refused"),
    [
        ("[[0, 0], [89, 1000]]", False),
        ("[[0, 0], [89.1, 1]]", True),
        ("[[0, 0], [40, 1001]]", True),
        ("[[0, 0], [40, -1]]", True),
    ],
)
def test_points_of_a_shear_law(points, refused):
    setting = f"fabric.macro.shear={{kind: table, curve: null, source: user, points: {points}}}"
    if not refused:
        resolved("picture-frame", setting)
        return
    with pytest.raises(InputError, match=r"fabric.macro.shear.points = .*: must be at (most|least)"):
        resolved("picture-frame", setting)


def test_mass_of_the_yarns_in_closed_form():
    """28 + 28 inlays of 1200 tex over 100 mm, longer by 0.6 %, and a loop of 14.4 mm, 230 tex, in (100/28 mm)^2."""
    fabric = resolved("tensile", "").fabric
    assert yarn_area_mass(fabric) == pytest.approx(2 * 280 * 1.2 * 1.006 + 14.4 * 230 / (100 / 28) ** 2, rel=1e-12)
