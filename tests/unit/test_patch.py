"""The patch of a crossing: levers by pressure, radii by lateral compaction, what a fabric file may say."""

import numpy as np
import pytest
from scipy.integrate import dblquad, quad

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.materials.yarn_section import EVEN, Patch, fabric_patch, lever_share, patch_radius
from knittest.models.meso import yarn_contact
from knittest.pose import Body, Chain, YarnContact, section

CARD, LINE = section(1e4, 5.0, 0.2, 1e-3), np.column_stack([np.arange(4.0), np.zeros(4), np.zeros(4)])


def fabric(patch: str, *more: str):
    return resolve(
        test="picture-frame", variant="2", scale="meso", preset="quick", sets=[f"fabric.contact.patch={patch}", *more]
    )


@pytest.mark.parametrize(
    ("exponent", "known"), [(0.0, 2.0 / 3.0), (0.5, 3.0 * np.pi / 16.0), (1.0, 8.0 / 15.0), (3.0, None)]
)
def test_the_lever_of_a_pressure(exponent, known):
    """Integral of p r over that of p on a disc; even, Hertz's, Winkler's."""
    moment = quad(lambda r: r * r * (1.0 - r * r) ** exponent, 0.0, 1.0)[0]
    force = quad(lambda r: r * (1.0 - r * r) ** exponent, 0.0, 1.0)[0]
    assert lever_share(exponent) == pytest.approx(moment / force, rel=1e-6)
    assert known is None or lever_share(exponent) == pytest.approx(known, rel=1e-12)


@pytest.mark.parametrize("heights", [None, (0.3, 0.5)])
@pytest.mark.parametrize("exponent", [1, 3])
def test_the_radius_carries_its_force(exponent, heights):
    """Pressure of two foundations in a row, place by place, summed up over the ellipse: the force."""
    (r1, r2), (e1, e2), force = (0.4, 0.25), (3.0, 0.7), 0.2
    h1, h2 = heights or (2.0 * r1, 2.0 * r2)
    radius = patch_radius(force, (r1, r2), (e1, e2), exponent, heights)
    depth = radius**2 / (2.0 * np.sqrt(r1 * r2))

    def pressure(y: float, x: float) -> float:
        """u = u1 + u2 with p = e1 (u1 / h1)^m = e2 (u2 / h2)^m."""
        u = max(depth - x * x / (2.0 * r1) - y * y / (2.0 * r2), 0.0)
        first = h1 * (1.0 / e1) ** (1.0 / exponent)
        second = h2 * (1.0 / e2) ** (1.0 / exponent)
        return (u / (first + second)) ** exponent

    a, b = np.sqrt(2.0 * r1 * depth), np.sqrt(2.0 * r2 * depth)
    total = 4.0 * dblquad(pressure, 0.0, a, 0.0, lambda x: b * np.sqrt(max(1.0 - (x / a) ** 2, 0.0)), epsrel=1e-6)[0]
    assert total == pytest.approx(force, rel=1e-4)
    assert np.pi * radius**2 == pytest.approx(np.pi * a * b, rel=1e-12)


def test_radii_of_a_fabric_file_become_levers_by_kind():
    patch = fabric_patch(fabric("{radius: {inlay_inlay: 0.9, inlay_loop: 0.6, loop_loop: 0.3}}").fabric)
    assert patch is not None
    assert patch.most == pytest.approx(EVEN * np.array([[0.9, 0.9, 0.6], [0.9, 0.9, 0.6], [0.6, 0.6, 0.3]]))
    assert patch.least == pytest.approx(EVEN * 0.3)


@pytest.mark.parametrize("exponent", [1, 3])
def test_compaction_of_a_fabric_file_becomes_a_law_of_the_force(exponent):
    text = f"{{compaction: {{exponent: {exponent}, reinforcing: 5, knitting: 2}}}}"
    run = fabric(text)
    patch = fabric_patch(run.fabric)
    assert patch is not None
    expected = lever_share(exponent) * patch_radius(0.01, (0.375, 0.25), (5.0, 2.0), exponent)
    for pair in ((0, 2), (2, 1)):
        assert patch.coefficient[pair] * 0.01 ** (0.5 / (exponent + 1.0)) == pytest.approx(expected, rel=1e-12)
        assert patch.most[pair] == pytest.approx(EVEN * np.sqrt(0.375 * 0.25))
    law = yarn_contact(run).law(0.25, 0.0)
    assert law.softening == exponent


def test_patches_of_elliptic_sections_are_those_of_their_flat_flanks():
    """1.49 x 0.74 mm (packing 0.9, twice as wide as high): radius of curvature a^2 / b = 4 b, no wider than 2 a."""
    both, twice = "{warp: 0.9, weft: 0.9}", "{warp: 2, weft: 2}"
    section = f"{{shape: ellipse, fibre_density: 1.53, packing: {both}, width_to_height: {twice}}}"
    found = fabric("{compaction: {reinforcing: 5, knitting: 2}}", f"fabric.reinforcing.section={section}").fabric
    (width, height), patch = found.reinforcing.section_mm("warp"), fabric_patch(found)
    assert patch is not None
    flat = patch_radius(0.01, (2.0 * height, 0.25), (5.0, 2.0), 1, (height, 0.5))
    assert patch.coefficient[0, 2] * 0.01**0.25 == pytest.approx(lever_share(1) * flat, rel=1e-12)
    assert patch.most[0, 1] == pytest.approx(EVEN * 0.5 * width) and patch.most[2, 2] == pytest.approx(EVEN * 0.25)


def test_a_fabric_file_without_a_patch_has_none():
    assert fabric_patch(fabric("null").fabric) is None


@pytest.mark.parametrize(
    ("make", "message"),
    [(lambda: Patch.disc(-0.5), "most of a patch"), (lambda: Patch.disc(np.nan), "most of a patch"),
     (lambda: Patch(np.ones((2, 2)), np.array([[0.0, 1.0], [0.5, 0.0]])), "symmetric table"),
     (lambda: Patch(np.ones((1, 1)), np.ones((1, 1)), 2), "exponent of a patch: 2"),
     (lambda: Patch(np.ones((2, 2)), np.ones((2, 2))).levers(3), "2 rows for 3 parts"),
     (lambda: Body.of_chains([Chain(LINE, CARD)], YarnContact(1.0, 0.0, 0.3, patch=Patch.disc(0.5))), "with a patch")],
)  # fmt: skip
def test_what_is_no_patch_of_a_posed_body_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_a_disc_is_that_of_all_crossings():
    levers = Patch.disc(0.6).levers(2)
    assert levers.shape == (2, 2, 2) and (levers[1] == pytest.approx(0.4)) and (levers[0] > 1e9).all()


@pytest.mark.parametrize(
    ("patch", "message"),
    [("{}", "either radius or compaction"),
     ("{radius: {inlay_inlay: 1.3, inlay_loop: 0.5, loop_loop: 0.5}}", "must be at most 1.22 mm"),
     ("{radius: {inlay_inlay: 0.5, inlay_loop: 0.5}}", "loop_loop"),
     ("{compaction: {exponent: 2, reinforcing: 5, knitting: 2}}", "exponent = 2: expected 1 or 3"),
     ("{compaction: {reinforcing: 0, knitting: 2}}", "must be greater than 0 MPa"),
     ("{radius: {inlay_inlay: 0.5, inlay_loop: 0.5, loop_loop: 0.5}, compaction: {reinforcing: 5, knitting: 2}}",
      "either radius or compaction")],
)  # fmt: skip
def test_what_is_no_patch_is_refused(patch, message):
    with pytest.raises(InputError, match=message):
        fabric(patch)
