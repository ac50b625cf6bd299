"""Stitches and layers in a fabric file: what is refused and how; names, yarns and mass of the layers, and strips."""

import re
from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
import pytest
from fabric_cases import STRUCTURES, relaxed_structure

from knittest.base.errors import InputError
from knittest.base.files import configs_dir
from knittest.config.base import PerDirection
from knittest.config.fabric import Fabric, yarn_area_mass
from knittest.config.loading import resolve
from knittest.fabric.cell import CellSpec
from knittest.fabric.strip import strip, yarn_count
from knittest.materials.yarn_section import sections, systems_of

#: line of fabric.stitches and of the first layer in weft-only.yaml
STITCHES, LAYER = 9, 11
GLASS = "{fibre: E-glass, linear_density: %s}"


def fabric_of(folder: Path, stitches: str = "[kp]", *layers: str) -> Fabric:
    text = (configs_dir() / "fabrics" / "weft-only.yaml").read_text(encoding="utf-8")
    rows = "\n".join(f"  - {one}" for one in layers or ("{direction: weft}",))
    text = text.replace("stitches: [kp]", f"stitches: {stitches}").replace("  - {direction: weft}", rows)
    path = folder / "f.yaml"
    path.write_text(text, encoding="utf-8")
    return resolve(fabric=path, test="tensile", scale="meso").fabric


@pytest.mark.parametrize(
    ("stitches", "message"),
    [
        ("[kq]", "fabric.stitches[0] = 'kq': 'q' is no stitch: expected k (knit) or p (purl)"),
        ("[kp, K]", "fabric.stitches[1] = 'K': 'K' is no stitch: expected k (knit) or p (purl)"),
        (
            "[kp, k]",
            "fabric.stitches[1] = 'k': has length 1 and the first course length 2: expected courses of equal length",
        ),
        (
            "['']",
            "fabric.stitches[0] = '': has length 0 and the first course length 0: expected courses of equal length",
        ),
        ("[]", "fabric.stitches = []: is empty: expected a row of k and p for each course, such as [k]"),
        ("[1]", "fabric.stitches[0] = 1: expected text, found 1"),
    ],
)
def test_wrong_stitches_are_refused_with_what_is_expected(tmp_path: Path, stitches: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        fabric_of(tmp_path, stitches)
    assert f"f.yaml:{STITCHES}: {message}" in str(error.value)


@pytest.mark.parametrize(
    ("layer", "message"),
    [
        ("{direction: wefts}", ".direction = 'wefts': expected warp or weft (did you mean \"weft\"?)"),
        ("{pattern: x.}", ".direction: missing"),
        ("{direction: weft, pattern: xo}", ".pattern = 'xo': expected x for each wale or course with an inlay and . "),
        ("{direction: weft, pattern: '..'}", ".pattern = '..': expected x for each wale or course with an inlay"),
        ("{direction: weft, patern: x.}", '.patern: unknown field (did you mean "pattern"?)'),
        ("{direction: weft, yarn: {fibre: E-glass, linear_density: -3}}", ".yarn.linear_density = -3: must be greater"),
    ],
)
def test_wrong_layers_are_refused_with_what_is_expected(tmp_path: Path, layer: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        fabric_of(tmp_path, "[kp]", layer)
    assert f"f.yaml:{LAYER}: fabric.layers[0]{message}" in str(error.value)


def test_a_repeat_too_large_is_refused(tmp_path: Path) -> None:
    layers = ("{direction: weft, pattern: xx.}", "{direction: weft, pattern: x....}")
    with pytest.raises(InputError, match=r"f.yaml:10: fabric.layers = .*after 2 wales and 15 courses, expected"):
        fabric_of(tmp_path, "[kp]", *layers)
    fabric = fabric_of(tmp_path, "[kp, kp]", "{direction: weft, pattern: x.}", "{direction: weft, pattern: '..x.xx'}")
    assert CellSpec.of(fabric).repeat == (2, 6)


def test_layers_are_named_by_direction_and_counted_where_there_are_several(tmp_path: Path) -> None:
    assert [one.name for one in fabric_of(tmp_path).inlays] == ["weft"]
    fabric = fabric_of(tmp_path, "[kp]", *(f"{{direction: {one}}}" for one in ("weft", "warp", "weft")))
    assert [one.name for one in fabric.inlays] == ["weft1", "warp", "weft2"]
    assert systems_of(fabric) == ("weft1", "warp", "weft2", "knit")
    assert CellSpec.of(fabric).systems == ("knit", "weft1", "warp", "weft2")
    assert [one.name for one in fabric.inlays_along("weft")] == ["weft1", "weft2"]
    assert [one.name for one in resolve(variant="1").fabric.inlays] == ["warp", "weft"]


def test_a_layer_may_have_its_own_yarn(tmp_path: Path) -> None:
    """Diameters of circles of the same fibre grow with the root of the linear density."""
    thin = "{direction: weft, yarn: " + GLASS % "{value: 150, source: assumed}" + "}"
    fabric = fabric_of(tmp_path, "[kp]", "{direction: weft}", "{direction: warp}", thin)
    assert [one.field for one in fabric.inlays] == ["reinforcing", "reinforcing", "layers.2.yarn"]
    assert [one.yarn.linear_density.value for one in fabric.inlays] == [600, 600, 150]
    first, _, third = CellSpec.of(fabric).layers
    assert third.width == pytest.approx(0.5 * first.width, rel=0.02) and third.bending < first.bending
    cards = sections(fabric)
    assert cards[2].radius == pytest.approx(0.5 * third.height) and cards[2].radius < cards[0].radius


def test_one_number_stands_for_both_directions() -> None:
    one, both = PerDirection.model_validate(0.5), PerDirection.model_validate({"warp": 0.5, "weft": 0.5})
    assert one == both and one.warp.value == one.weft.value == 0.5
    stated = PerDirection.model_validate({"value": 0.5, "sd": 0.1, "source": "measured", "ref": "here"})
    assert stated.warp == stated.weft and stated.weft.sd == 0.1
    fabric = resolve(variant="1", sets=["fabric.reinforcing.crimp=0.4"]).fabric
    assert [one.crimp for one in fabric.inlays] == [0.004, 0.004]


def test_mass_is_that_of_the_counted_yarns(tmp_path: Path) -> None:
    """A square metre: 280 courses, two of three with 600 tex, half the 280 wales with 150 tex, 280 x 280 loops."""
    thin = "{direction: warp, pattern: .x, yarn: " + GLASS % "{value: 150, source: assumed}" + "}"
    fabric = fabric_of(tmp_path, "[kp]", "{direction: weft, pattern: xx.}", thin, "{direction: weft, pattern: x.}")
    weft = 280 * (2 / 3 + 1 / 2) * 600e-3 * (1.0 + fabric.inlays[0].crimp)  # g/m2: yarns of 1 m
    warp = 280 * 1 / 2 * 150e-3 * (1.0 + fabric.inlays[1].crimp)
    loops = 280**2 * 14.4e-3 * 100e-3
    assert yarn_area_mass(fabric) == pytest.approx(weft + warp + loops, rel=1e-12)
    assert fabric.area_mass.value == pytest.approx(weft + warp + loops, rel=1e-3)
    assert fabric.inlay_density_per_mm("weft") == pytest.approx(0.28 * 7 / 6)
    assert sum(one.yarn.beam_diameter.value for one in fabric.inlays) + 2 * fabric.knitting.beam_diameter.value == (
        pytest.approx(fabric.thickness.value, rel=1e-3)
    )


def test_a_strip_has_the_inlays_of_its_wales_and_courses() -> None:
    """Five wales with a warp in every second one, from the first on: three, at their places.

    Loops beside a warp are longer than others, and each is cut in its needle arc.
    """
    cell, (wales, courses) = relaxed_structure("two yarns, both in every second"), (5, 4)
    paths = strip(cell, wales, courses, 16, 8)
    found = {s: [p for p in paths if p.system == s] for s in cell.spec.systems}
    assert {s: len(yarns) for s, yarns in found.items()} == {"knit": 4, "warp": 3, "weft": 2}
    assert [yarn_count(cell, "warp", n) for n in range(1, 6)] == [1, 1, 2, 2, 3]
    middle = [p.points[:-1, 0].mean() / cell.spec.wale for p in found["warp"]]
    assert middle == pytest.approx([0.5, 2.5, 4.5], abs=0.05)
    middle = [p.points[:-1, 1].mean() / cell.spec.course for p in found["weft"]]
    assert middle == pytest.approx([0.5, 2.5], abs=0.05)
    for system, count in (("knit", 16 * wales), ("weft", 8 * wales), ("warp", 8 * courses)):
        for path in found[system]:
            along = path.points[:, cell.spec.axis(system)]
            assert len(path.points) == count + 1
            size = courses * cell.spec.course if system == "warp" else wales * cell.spec.wale
            cut = 0.03 * cell.spec.wale if system == "knit" else 1e-3
            assert (along[0], along[-1]) == (0.0, pytest.approx(size, abs=cut))


@pytest.mark.parametrize("name", ["rib with weft", "garter", "seed", "0/90/0 on rib", "rib 3x1 with weft"])
def test_a_strip_repeats_after_the_repeat_of_the_structure(name: str) -> None:
    """Not before: a wale further the loops differ, and so do they a course further in garter and seed."""
    cell = relaxed_structure(name)
    (across, along), n = cell.spec.repeat, 16
    paths = strip(cell, 2 * across, 2 * along, n, 8)
    for path in paths:
        axis = cell.spec.axis(path.system)
        assert path.points[-1, axis] == pytest.approx(2.0 * cell.spec.size[axis], abs=1e-12)
    rows = [p.points for p in paths if p.system == "knit"]
    np.testing.assert_allclose(rows[0][n * across :, 2], rows[0][: n * across + 1, 2], atol=1e-12)
    np.testing.assert_allclose(rows[along] - rows[0], [[0.0, along * cell.spec.course, 0.0]] * len(rows[0]), atol=1e-12)
    radius = 0.5 * cell.spec.knit_diameter
    assert across == 1 or np.abs(rows[0][n:, 2] - rows[0][:-n, 2]).max() > radius
    assert along == 1 or np.abs(rows[1][:, 2] - rows[0][:, 2]).max() > radius


def test_the_mass_of_a_strip_is_the_area_mass_of_its_yarns() -> None:
    """Lengths of the yarns of 6 x 6 stitches times tex, by hand, against densities, crimp and loop length."""
    spec = STRUCTURES["two yarns, both in every second"]
    cell = relaxed_structure("two yarns, both in every second")
    area = {s: pi * cell.spec.radius[s] ** 2 for s in spec.systems}
    lengths = {s: cell.length(s) for s in spec.systems}
    per_cell = 4 * spec.loop_length * area["knit"] + sum(
        2.0 * pitch * (1.0 + one.crimp) * area[one.name]
        for one, pitch in zip(spec.layers, (spec.course, spec.wale), strict=True)
    )
    assert sum(lengths[s] * area[s] for s in area) == pytest.approx(per_cell, rel=2e-3)
    assert replace(spec, layers=()).repeat == (1, 1) and spec.repeat == (2, 2)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("stitches: [kp]", "stitches: kp", "fabric.stitches = 'kp': expected a list, such as [kp], found text 'kp'"),
        ("layers:  # from back to face\n  - {direction: weft}", "layers: weft",
         "fabric.layers = 'weft': expected a list, such as [{direction: ...}], found text 'weft'"),
        ("reinforcing:", "description:", "fabric.layers[0].yarn: missing: yarn of this layer, or fabric.reinforcing"),
        ("knitting:", "description:", "fabric.knitting: missing: yarn of the loops; area_mass and thickness follow"),
        ("knitting:", "knitting: polyester 50 tex\n#", "fabric.knitting = 'polyester 50 tex': expected a mapping such"),
        ("weft_density: {value: 28", "weft_density: {value: 2800", "fabric.weft_density = 2800: implausible"),
    ],
)  # fmt: skip
def test_one_mistake_has_one_message(tmp_path: Path, before: str, after: str, message: str) -> None:
    """Mass, thickness and contact follow from the yarns, so they are no second mistake."""
    text = (configs_dir() / "fabrics" / "weft-only.yaml").read_text(encoding="utf-8")
    assert before in text
    path = tmp_path / "f.yaml"
    wrong = text.replace(before, after) if after != "description:" else re.sub(rf"\n{before}.*", "", text)
    path.write_text(wrong, encoding="utf-8")
    with pytest.raises(InputError) as error:
        resolve(fabric=path, test="tensile", scale="meso")
    assert f": {message}" in str(error.value)
    assert "\n" not in str(error.value)


def test_mass_without_a_loop_length_says_from_what_it_follows(tmp_path: Path) -> None:
    text = (configs_dir() / "fabrics" / "weft-only.yaml").read_text(encoding="utf-8")
    path = tmp_path / "f.yaml"
    path.write_text(re.sub(r"\nloop_length:.*", "\nloop_length:", text), encoding="utf-8")
    with pytest.raises(InputError, match=r"fabric\.area_mass: missing: .*; with loop_length it follows from the yarns"):
        resolve(fabric=path, test="tensile", scale="macro")
