"""Elliptic sections of inlays: area conserved at the packing, one card, what does not fit the cell."""

from math import pi

import numpy as np
import pytest
from fabric_cases import points_of

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.export.keywords import KeywordFile
from knittest.fabric import relaxation
from knittest.fabric.cell import CellSpec
from knittest.fabric.relaxation import relaxed_cell
from knittest.fabric.strip import strip
from knittest.fabric.topology import draw
from knittest.kernels.flattening import HIGH, LENGTH, PRODUCT, STIFF
from knittest.models.boundary import Boundary
from knittest.models.meso import build_meso, build_meso_cell
from knittest.models.tool import plane
from knittest.runs.deck.beam_parts import add_yarns

#: mass over fibre volume of 1200 tex whose fibres have 0.784 mm2
DENSITY = 1.53


def with_sections(variant="1", ratio=(2.0, 1.5), packing=(0.9, 0.8), density=DENSITY, **more):
    """Fabric of a ``variant`` whose warp and weft have sections of these ratios and packings."""
    name = "fabric.reinforcing.section"
    given = {f"{name}.shape": "ellipse", f"{name}.fibre_density": density} | more
    for field, pair in (("width_to_height", ratio), ("packing", packing)):
        given |= {f"{name}.{field}.{d}": value for d, value in zip(("warp", "weft"), pair, strict=True)}
    return resolve(variant=variant, sets=[f"{key}={value}" for key, value in given.items()]).fabric


def test_the_area_is_that_of_the_fibres_at_the_packing():
    yarn = with_sections().reinforcing
    for direction, ratio, packing in (("warp", 2.0, 0.9), ("weft", 1.5, 0.8)):
        width, height = yarn.section_mm(direction)
        assert width / height == pytest.approx(ratio)
        assert 0.25 * pi * width * height == pytest.approx(1200e-6 / (1e-3 * DENSITY) / packing)


def test_circles_are_what_a_card_without_sections_has():
    fabric = resolve(variant="1").fabric
    assert fabric.reinforcing.section is None
    assert fabric.reinforcing.section_mm("warp") == (0.75, 0.75)
    spec = CellSpec.of(fabric)
    assert spec.half_axes["weft"] == (0.375, 0.375) and spec.radius["warp"] == 0.375


def test_a_load_area_beyond_the_fibres_is_refused_with_the_density_that_would_do():
    with pytest.raises(InputError, match=r"section.fibre_density.*0.6 mm2, less than.*at most 1.53 g/cm3"):
        with_sections(density=2.0)


def test_a_section_that_leaves_the_loop_no_room_is_refused_with_the_ratio_that_would_do():
    """Courses of V2 are 2.439 mm apart: loops of 0.5 mm leave 1.939 mm."""
    with pytest.raises(InputError, match=r"width_to_height.weft.*2.11 x 0.527.*2.44 mm .*expected at most 3.39"):
        with_sections("2", ratio=(2.0, 4.0), packing=(0.9, 0.9))
    assert with_sections("2", ratio=(2.0, 3.38), packing=(0.9, 0.9))


def test_a_cell_of_ellipses_has_its_thickness_and_conserves_the_loop():
    """V1 of 1.49 x 0.74 mm (packing 0.9): 2.20 mm, measured 2.22 +- 0.08; yarns in each other by less than 0.5 %."""
    fabric = with_sections(ratio=(2.0, 2.0), packing=(0.9, 0.9))
    cell = relaxed_cell(fabric)
    assert cell.thickness == pytest.approx(2.20, abs=0.03)
    assert cell.deepest < 5e-3 and abs(cell.length_error) < 1e-3
    low, high = cell.faces
    assert high - low < resolve(variant="1").fabric.thickness.value + 0.2
    middle = points_of(cell, "weft")[:, 2].max() - points_of(cell, "warp")[:, 2].min()
    assert middle > sum(fabric.reinforcing.section_mm(d)[1] for d in ("warp", "weft")) / 2.0 * 0.99


def test_sections_that_lock_are_refused_with_the_packing_that_would_do(monkeypatch):
    """Tried smaller until one relaxes; with less patience, for here no force need come to rest."""
    monkeypatch.setattr(relaxation, "PATIENT", 3000)
    fabric = with_sections(ratio=(1.5, 1.5), packing=(0.5, 0.5))
    with pytest.raises(
        InputError, match=r"1.73 x 1.15 mm warp, .*the yarns lock .*packing of the inlays (1.\d+) times as large"
    ) as error:
        relaxed_cell(fabric)
    factor = float(str(error.value).split("section.packing of the inlays ")[1].split()[0])
    assert relaxed_cell(with_sections(ratio=(1.5, 1.5), packing=(0.5 * factor, 0.5 * factor)))


def test_a_model_of_yarns_has_the_sections_of_its_inlays():
    """Half axes at every node of warp and weft, heights across the chain and, nearly, the fabric; loops are round."""
    fabric = with_sections(ratio=(2.0, 2.0), packing=(0.9, 0.9))
    run = resolve(variant="1", test="tensile", scale="meso").model_copy(update={"fabric": fabric})
    paths = strip(relaxed_cell(fabric), 2, 2, run.model.meso.elements_per_loop, 8)
    draws = {s: draw(fabric, run.variability, s, 2, 0) for s in ("warp", "weft", "knit")}
    model = build_meso(run, paths, draws)
    group, part = model.group, model.group.part
    width, height = fabric.reinforcing.section_mm("warp")
    inlay = part < 2
    assert np.sqrt(group.square[inlay]) == pytest.approx(0.5 * width)
    assert group.excess[inlay] == pytest.approx(0.25 * (height**2 - width**2))
    assert group.radius[inlay] == pytest.approx(0.5 * height) and group.bound[inlay] == pytest.approx(0.5 * width)
    assert (group.excess[~inlay] == 0.0).all() and (group.bound[~inlay] == group.radius[~inlay]).all()
    up, chord = group.upright.T, np.diff(model.nodes.position[:, :-1].T, axis=0)
    along = chord / np.linalg.norm(chord, axis=1, keepdims=True)
    within = inlay[:-1] & (group.chain[1:] == group.chain[:-1])
    assert np.linalg.norm(up[inlay], axis=1) == pytest.approx(1.0)
    assert np.abs(np.sum(up[:-1] * along, axis=1)[within]).max() < 0.15  # half of the turn from element to element
    assert up[inlay, 2].min() > 0.95


def test_circles_carry_no_sections():
    run = resolve(variant="1", test="tensile", scale="meso")
    paths = strip(relaxed_cell(run.fabric), 1, 1, run.model.meso.elements_per_loop, 8)
    draws = {s: draw(run.fabric, run.variability, s, 1, 0) for s in ("warp", "weft", "knit")}
    group = build_meso(run, paths, draws).group
    assert group.excess.size == group.upright.size == 0 and (group.bound == group.radius).all()


FLATTENING = "fabric.reinforcing.section.flattening"


def flat_model(**more):
    """Periodic cell of circles of the fibres at a packing of 0.9 that flatten, of variant 1."""
    fabric = with_sections(ratio=(1.0, 1.0), packing=(0.9, 0.9), **{f"{FLATTENING}.modulus": 2.0} | more)
    run = resolve(variant="1", test="cell", preset="quick").model_copy(update={"fabric": fabric})
    return build_meso_cell(run, relaxed_cell(fabric), 1, 1)


def test_a_cell_that_flattens_has_shapes_of_its_own_nodes_and_images_follow():
    model = flat_model()
    shape, ghost, inlay = model.group.shape, model.images.ghost, model.group.part < 2
    radius = np.sqrt(1200e-6 / (1e-3 * DENSITY) / 0.9 / pi)
    assert shape[HIGH][inlay] == pytest.approx(radius) and shape[PRODUCT][inlay] == pytest.approx(radius**2)
    assert (model.group.excess[inlay] < 0.0).all()  # else contacts would take them for circles that stay
    own = inlay & (model.group.owned > 0.0)
    assert shape[STIFF][own] == pytest.approx(4.0 * radius**2 * 2.0)
    assert (shape[STIFF][ghost] == 0.0).all() and (shape[STIFF][~inlay] == 0.0).all()
    # lengths of the cell's nodes are those of its yarns
    warp = own & (model.group.part == 0)
    assert shape[LENGTH][warp].sum() == pytest.approx(np.linalg.norm(model.reference[1]), rel=0.02)


def test_shapes_are_part_of_the_state():
    model = flat_model()
    group, before = model.group, model.state()
    rest = group.shape.copy()
    group.shape[HIGH] *= 0.9
    group.square[:], group.excess[:] = 0.4, -0.1
    flat = model.state()
    model.restore(before)
    assert (group.shape == rest).all() and group.excess == pytest.approx(0.0, abs=1e-11)
    model.restore(flat)
    assert group.shape[HIGH] == pytest.approx(0.9 * rest[HIGH])
    assert (group.square == 0.4).all() and (model.tracker.contacts.excess == -0.1).all()


def test_tools_do_not_press_sections_that_flatten():
    model = flat_model()
    with pytest.raises(InputError, match=r"rigid tools do not flatten.*section.flattening"):
        Boundary(model, 1e-4).add_tool(plane((0.0, 0.0, -2.0), (0.0, 0.0, 1.0)))


@pytest.mark.parametrize(("modulus", "exponent"), [(3.0, 1), (2.0, 3)])
def test_sections_and_patches_have_one_law(modulus, exponent):
    patch = "fabric.contact.patch.compaction"
    given = {f"{FLATTENING}.modulus": modulus, f"{FLATTENING}.exponent": exponent}
    given |= {f"{patch}.reinforcing": 2.0, f"{patch}.knitting": 5.0}
    with pytest.raises(InputError, match=r"section.flattening.*2 MPa, 1.: expected the same law"):
        with_sections(ratio=(1.0, 1.0), packing=(0.9, 0.9), **given)
    same = given | {f"{FLATTENING}.modulus": 2.0, f"{FLATTENING}.exponent": 1}
    assert with_sections(ratio=(1.0, 1.0), packing=(0.9, 0.9), **same).reinforcing.section.flattening.exponent == 1


def test_a_deck_does_not_write_ellipses_as_circles():
    with pytest.raises(InputError, match=r"deck: elliptic yarn sections .* leave out fabric.reinforcing.section"):
        add_yarns(KeywordFile(), flat_model())
