"""The shipped fabrics against the paper's tables and the arithmetic behind the derived numbers."""

import pandas as pd
import pytest

from knittest.base.errors import InputError
from knittest.base.files import configs_dir, data_dir
from knittest.config.base import Quantity
from knittest.config.loading import resolve
from knittest.laboratory.base import shear_curve
from knittest.materials.shear import last_angle

GRAVITY = 9.81  # m/s2
OVERHANG = {("1", "warp"): 171, ("1", "weft"): 151, ("2", "warp"): 178, ("2", "weft"): 194}  # mm, Table 3
DIRECTIONS = ("warp", "weft")


@pytest.fixture(params=["1", "2"])
def variant(request):
    return request.param


@pytest.fixture
def fabric(variant):
    return resolve(variant=variant, parameters="as-measured").fabric


def quantities(model, path=""):
    for name in type(model).model_fields:
        value = getattr(model, name)
        if isinstance(value, Quantity):
            yield f"{path}{name}", value
        elif hasattr(type(value), "model_fields"):
            yield from quantities(value, f"{path}{name}.")


def test_a_weave_without_yarns_is_a_fabric_of_the_macro_scale():
    """Shells need no loops; what is not given is marked as assumed, the shear law as tuned on one laboratory."""
    fabric = resolve(variant="cao2008-weave", scale="macro", test="picture-frame").fabric
    assert fabric.knitting is None and fabric.macro.shear.source == "tuned" and "UML" in fabric.macro.shear.ref
    for path, quantity in quantities(fabric):
        assert quantity.source == "assumed" or path in ("area_mass", "thickness"), path
        assert quantity.ref, path
    with pytest.raises(
        InputError, match="needs loop_length, reinforcing, knitting: add what is missing to the fabric file, or use"
    ):
        resolve(variant="cao2008-weave", test="picture-frame", scale="meso")


def test_every_number_states_source_and_reference(variant):
    for parameters in ("as-measured", "calibrated"):
        for path, quantity in quantities(resolve(variant=variant, parameters=parameters).fabric):
            tuned = ("tuned",) if parameters == "calibrated" else ()
            assert quantity.source in ("measured", "derived", "assumed", *tuned) and quantity.ref, path


def test_the_shear_law_is_predicted_and_reaches_the_end_of_the_frame_test(variant):
    """No shear force is published: the law is that of a frame of yarns, marked as simulated wherever it is shown."""
    run = resolve(variant=variant, scale="macro", test="picture-frame")
    curve = shear_curve(run)
    assert run.fabric.macro.shear.source == "predicted" and curve.kind == "simulated"
    assert f"pham2019-v{variant}" in curve.source
    assert last_angle(run.fabric, curve) > run.rig.max_angle


def test_table_2(variant, fabric):
    table = pd.read_csv(data_dir() / "pham2019" / "table2-fabrics.csv", comment="#", dtype={"variant": str})
    rows = table[table.variant == variant]
    printed = sorted(rows["mean"].astype(float))
    ours = (fabric.warp_density, fabric.weft_density, fabric.loop_length, fabric.area_mass, fabric.thickness)
    assert sorted(q.value for q in ours) == printed


def test_load_areas_follow_from_tex_and_densities(fabric):
    carbon_and_polyamide = 800e-6 / 1.76e-3 + 376e-6 / 1.14e-3  # g/mm over g/mm3
    glass_and_polyamide = 136e-6 / 2.55e-3 + 94e-6 / 1.14e-3
    assert fabric.reinforcing.load_area.value == pytest.approx(carbon_and_polyamide, rel=2e-3)
    assert fabric.knitting.load_area.value == pytest.approx(glass_and_polyamide, rel=2e-3)


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_bending_stiffness_follows_from_overhang(variant, fabric, direction):
    overhang = OVERHANG[variant, direction] * 1e-3
    per_width = GRAVITY * fabric.area_mass.value * 1e-3 * (overhang / 2) ** 3 * 1e3  # N mm, Eq. 2
    per_yarn = per_width / fabric.density_per_mm.of(direction)
    assert getattr(fabric.macro.bending_stiffness, direction).value == pytest.approx(per_width, rel=2e-3)
    assert getattr(fabric.reinforcing.bending_stiffness, direction).value == pytest.approx(per_yarn, rel=5e-3)


def test_fabric_strength_is_in_reach_of_its_yarns(fabric):
    """facts.md's check of the load area: E A times 1.00 % gives 465 N a yarn, above the 410 to 416 N of Table 3."""
    yarn = fabric.reinforcing
    force = yarn.youngs_modulus_mpa * yarn.load_area_mm2 * yarn.fracture_strain_fraction
    assert force == pytest.approx(465, abs=1)


def test_a_fabric_file_and_the_file_of_a_test_are_not_mistaken_for_each_other():
    fabric, test = configs_dir() / "fabrics/pham2019-v1.yaml", configs_dir() / "rigs/tensile.yaml"
    with pytest.raises(InputError, match=r"pham2019-v1\.yaml: this is a fabric file, .* give it as --fabric "):
        resolve(config=fabric)
    with pytest.raises(InputError, match=r"tensile\.yaml: this is the file of a test, .* give it as --config "):
        resolve(fabric=test)
