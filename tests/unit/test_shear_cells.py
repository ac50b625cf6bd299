"""Cells with inlays of the measured heights: what is asked of them, what is shown of them, and that none is stale."""

from dataclasses import replace
from math import pi

import pytest

from docs import stored_runs, validation_sections
from docs.shear_cells import CIRCLE, ELLIPSE, HEIGHTS, ROUND, USUAL, Case, cases, equal, pairs
from docs.stored_runs import StoredRun
from docs.validation_sections import sections_part, verdict
from knittest.config.loading import resolve
from knittest.materials.yarn_section import sections

REFUSED = "overlap of yarns that carries no force 11.90 % is above 10 %"


def fabric(case):
    return resolve(test="cell", variant=case.variant, scale="meso", preset="quick", sets=list(case.sets)).fabric


@pytest.mark.parametrize("variant", list(HEIGHTS))
@pytest.mark.parametrize("shape", [ROUND, ELLIPSE, 0.9, 0.75])
def test_inlays_have_the_measured_height_the_fibres_and_the_stiffness_of_their_yarns(variant, shape):
    """1200 tex at 1.53 g/cm3; ellipses of fewer fibres are 1.25 times as wide as high."""
    plain, given = fabric(Case(variant, USUAL)), fabric(Case(variant, USUAL, shape))
    for direction in ("warp", "weft"):
        width, height = given.reinforcing.section_mm(direction)
        assert height == pytest.approx(HEIGHTS[variant], abs=1e-3)
        if isinstance(shape, float):
            assert 0.25 * pi * width * height * shape == pytest.approx(1.2 / 1.53, rel=1e-3)
        else:
            assert width / height == pytest.approx(1.25 if shape == ELLIPSE else 1.0)
    for one, other in zip(sections(plain), sections(given), strict=True):
        assert (one.axial, one.bending, one.torsion) == pytest.approx((other.axial, other.bending, other.torsion))


def test_equal_inlays_are_those_of_variant_1():
    own, alike = fabric(Case("1", USUAL)).reinforcing, fabric(equal(Case("2", USUAL))).reinforcing
    assert sections(fabric(Case("1", USUAL)))[0].bending == sections(fabric(equal(Case("2", USUAL))))[0].bending
    assert own.crimp_fraction == alike.crimp_fraction and own.bending_stiffness_n_mm2 == alike.bending_stiffness_n_mm2


def made(case, force, refused=()):
    shear = {f"cell_shear_n_per_mm_at_deg.{a}": force * int(a) for a in ("10", "20", "30")}
    parts = {f"{n}.{a}": 0.1 for n in (*validation_sections.SHOWN, "normal_n") for a in ("10", "20", "30")}
    options = {"variant": case.variant, "sets": list(case.sets)}
    results = {"cell_thickness_at_rest_mm": 2.0} | shear | parts
    return StoredRun(options, {}, results, {}, {}, list(refused), [], "c", "2026", "x")


def test_refused_cells_have_no_ratio_and_say_by_which_gate():
    runs = [made(c, 1.2 if c.variant == "2" else 1.0, [REFUSED] if c.shape == 0.9 else ()) for c in cases()]
    table = sections_part(runs)[1].splitlines()
    lost = [line for line in table if "packing 0.9)" in line]
    told = "V1: overlap that carries no force; V2: overlap that carries no force"
    assert lost and all(told in line and "1.20" not in line for line in lost)
    passed = next(line for line in table if line.startswith(f"| {CIRCLE} | - | 48, 12"))
    assert "| 1.20 (1.20) | 1.20 (1.20) | 1.20 (1.20) | **FAILED** at 10, 20, 30 deg |" in passed
    assert len(table) == len(list(pairs())) + 2


def test_a_refused_cell_with_equal_inlays_leaves_the_ratio_of_both_own():
    runs = [made(c, 0.9 if c.variant == "2" else 1.0, [REFUSED] if c.equal else ()) for c in cases()]
    line = next(line for line in sections_part(runs)[1].splitlines() if line.startswith(f"| {CIRCLE} | - | 48, 12"))
    assert line.endswith("| 0.90 | 0.90 | 0.90 | passed |")


@pytest.mark.parametrize(
    ("ratios", "told"),
    [((0.9, 0.99, 0.7), "passed"), ((0.9, 1.0, 1.2), "**FAILED** at 20, 30 deg"), ((0.9, float("nan"), 0.9), "20")],
)
def test_variant_2_is_to_lie_below_at_every_angle(ratios, told):
    assert told in verdict(ratios)


@pytest.mark.parametrize("run", stored_runs.load(validation_sections.FILE), ids=lambda run: run.command)
def test_no_stored_cell_is_stale(run):
    assert run.stale() == [], f"run benchmarks/shear_sections.py again: {run.command}"
    assert "-dirty" not in run.commit and (run.refused or run.results)


def test_all_cells_are_stored():
    stored = {
        (run.options["variant"], tuple(run.options["sets"])) for run in stored_runs.load(validation_sections.FILE)
    }
    assert stored == {(case.variant, case.sets) for case in cases()}
    assert replace(next(iter(cases())), variant="2").name != next(iter(cases())).name
