"""The error of a result from two repeats, and the other mesh of every test."""

import math
from typing import Any

import pytest

from knittest.base.errors import InputError
from knittest.base.kinds import kinds
from knittest.config.loading import resolve
from knittest.config.presets import PRESETS
from knittest.config.run import RUNS
from knittest.laboratory.halved_setting import diagnostic_results
from knittest.laboratory.numerical_error import (
    SHELLS,
    YARNS,
    Repeat,
    mesh_factor,
    numerical_errors,
    remesh,
    sheet_sides,
)

EXACT, INERTIA, COARSENESS = 100.0, 2.0, 0.5


def result(speed: float, length: float) -> dict[str, float | None]:
    """A result with errors of second order: ``INERTIA`` at speed 1, ``COARSENESS`` with elements of length 1."""
    return {"peak_force_n": EXACT + INERTIA * speed**2 - COARSENESS * length**2}


@pytest.mark.parametrize(("length", "ratio", "finer"), [(2.0, 2.0, False), (1.5, 1.5, False), (0.5, 2.0, True)])
def test_errors_of_second_order_are_covered_three_times(length: float, ratio: float, finer: bool) -> None:
    found = numerical_errors(result(1, 1), Repeat(result(0.5, 1)), Repeat(result(1, length)), ratio, finer)
    assert found["peak_force_n"]["error"] == pytest.approx(3.0 * (INERTIA + COARSENESS))


@pytest.mark.parametrize(("half", "mesh", "factor"), [(1.05, 1.1, 4.0), (1.1, 1.15, 2.4)])
def test_an_error_of_first_order_is_still_covered(half: float, mesh: float, factor: float) -> None:
    """Of the speed by 2: |change| is half of it; of a mesh with a ratio of 1.5 by 2.4 / 2."""
    found = numerical_errors({"n": 1.1}, Repeat({"n": half}), Repeat({"n": mesh}), 1.5, False)
    assert found["n"]["error"] == pytest.approx(factor * 0.05)
    assert mesh_factor(2.0, False) == 1.0 and mesh_factor(2.0, True) == 4.0


@pytest.mark.parametrize("finer", [False, True])
@pytest.mark.parametrize("ratio", [1.3, 1.5, 2.0, 2.25, 2.5])
def test_an_error_of_first_order_is_covered_at_every_ratio(ratio: float, finer: bool) -> None:
    """c h: on a coarser mesh the result changes by c h (r - 1), on a finer one by c h (1 - 1 / r)."""
    change = 1.0 - 1.0 / ratio if finer else ratio - 1.0
    assert mesh_factor(ratio, finer) * change >= 1.0 - 1e-12


def test_the_changes_stand_beside_the_error_under_the_name_of_the_mesh() -> None:
    half, mesh = Repeat({"mu_paper": 0.147}), Repeat({"mu_paper": 0.1515})
    row = numerical_errors({"mu_paper": 0.15}, half, mesh, 2.0, False)["mu_paper"]
    assert row["half_speed_pct"] == pytest.approx(-2.0) and row["coarser_mesh_pct"] == pytest.approx(1.0)
    assert row["error"] == pytest.approx(4.0 * 0.003 + 0.0015) and set(row) == {
        "half_speed_pct", "coarser_mesh_pct", "error",
    }  # fmt: skip
    assert "finer_mesh_pct" in numerical_errors({"mu_paper": 0.15}, half, mesh, 2.0, True)["mu_paper"]
    from_zero = numerical_errors({"n": 0.0}, Repeat({"n": 0.0}), Repeat({"n": 2.0}), 2.0, False)["n"]
    assert from_zero == {"half_speed_pct": 0.0, "coarser_mesh_pct": None, "error": 2.0}


@pytest.mark.parametrize(
    ("value", "half", "mesh", "reason"),
    [
        (math.nan, Repeat({"n": 1.0}), Repeat({"n": 1.0}), "the run has no number"),
        (1.0, Repeat({"n": math.nan}), Repeat({"n": 1.0}), "no number at half the speed"),
        (1.0, Repeat({"n": 1.0}), Repeat({}), "no number on the other mesh"),
        (1.0, Repeat({}, "refused: kinetic"), Repeat({"n": 1.0}), "refused: kinetic"),
        (1.0, Repeat({"n": 1.0}), Repeat({}, "failed: torn"), "failed: torn"),
    ],
)
def test_an_error_that_cannot_be_told_is_none_with_the_reason(
    value: float, half: Repeat, mesh: Repeat, reason: str
) -> None:
    row = numerical_errors({"n": value}, half, mesh, 2.0, False)["n"]
    assert row["error"] is None and row["reason"] == reason


def test_what_says_how_well_a_run_went_has_no_error() -> None:
    results = dict.fromkeys((*diagnostic_results(), "overhang_mm"), 1.0)
    assert list(numerical_errors(results, Repeat(results), Repeat(results), 2.0, False)) == ["overhang_mm"]


#: what is as coarse as it may be: waves of tests in which no yarn is pulled straight have 4 beams, the least, and
#: specimens of 10 shells a side would keep less than 8
FINER = {
    *(
        (test, "meso", "any")
        for test in ("picture-frame", "cantilever", "forming", "bias-extension", "cell", "compaction")
    ),
    *((test, "macro", "quick") for test in ("bias-extension", "biaxial")),
}


def chosen(
    test: str, scale: str, preset: str = "quick", variant: str = "1", direction: str = "warp", **more: Any
) -> Any:
    along = direction if "direction" in RUNS[test].model_fields["rig"].annotation.model_fields else None
    return resolve(variant=variant, test=test, scale=scale, preset=preset, direction=along, **more)


@pytest.mark.parametrize(("test", "scale"), [(test, scale) for test in RUNS for scale in kinds()[test].scales])
def test_every_preset_of_every_test_has_another_mesh_within_the_bounds(test: str, scale: str) -> None:
    for preset in PRESETS:
        for variant, direction in (("1", "warp"), ("2", "weft")):
            run = chosen(test, scale, preset, variant, direction=direction)
            found = remesh(run)
            assert RUNS[test].model_validate(found.other.model_dump()) == found.other
            low, high = SHELLS if scale == "macro" else YARNS
            assert low - 1e-9 <= found.ratio <= high
            same = found.other.model.model_copy(update={scale: getattr(run.model, scale)})
            assert found.other.model_copy(update={"model": same}) == run
            assert found.finer == ((test, scale, preset) in FINER or (test, scale, "any") in FINER)
            if scale == "macro":
                size = found.other.model.macro.element_size
                along, across = (side / size for side in sheet_sides(run))
                assert across == pytest.approx(round(across))
                assert abs(along - round(along)) < 0.05 * along
                longer = size / run.model.macro.element_size
                assert found.ratio == pytest.approx(1.0 / longer if found.finer else longer, rel=0.1)


@pytest.mark.parametrize("test", ["tensile", "picture-frame", "cantilever", "friction", "forming"])
def test_the_models_have_as_many_shells_as_the_ratio_says(test: str) -> None:
    from knittest.runs.specimen import prepare

    found = remesh(chosen(test, "macro"))
    shells, other = (len(prepare(run).model.mesh.cells) for run in (found.run, found.other))
    # rows in clamps and the two of the friction strip's ends are not counted
    assert (shells / other) ** 0.5 == pytest.approx(found.ratio, rel=0.04)


@pytest.mark.parametrize(
    ("sets", "other", "finer"),
    [
        (["rig.width=10"], "5 mm", True),
        (["rig.width=25", "model.macro.element_size=5"], "8.33 mm", False),
        (["rig.width=100"], "16.7 mm", False),
        (["rig.gauge_length=35"], "6.25 mm", True),
    ],
)
def test_a_strip_of_few_shells_is_made_finer(sets: list[str], other: str, finer: bool) -> None:
    found = remesh(chosen("tensile", "macro", sets=sets))
    assert (found.other_value, found.finer) == (other, finer)


@pytest.mark.parametrize(
    ("loop", "wave", "other", "finer"),
    [(30, 8, "22 and 6", False), (16, 4, "24 and 6", True), (256, 64, "192 and 48", False), (16, 8, "24 and 12", True)],
)
def test_beams_stay_even_and_within_their_bounds(loop: int, wave: int, other: str, finer: bool) -> None:
    sets = [f"model.meso.elements_per_loop={loop}", f"model.meso.elements_per_wave={wave}"]
    found = remesh(chosen("tensile", "meso", sets=sets))
    assert (found.other_value, found.finer) == (other, finer)


def test_length_and_width_need_not_fit_alike_for_a_near_mesh() -> None:
    """22.5 by 5 shells: 14 by 3 rather than 9 by 2, 2.4 times as large."""
    found = remesh(chosen("tensile", "macro", sets=["rig.gauge_length=225"]))
    assert found.other_value == "16.7 mm" and remesh(found.run, finer=True).other_value == "6.25 mm"


def test_where_no_mesh_fits_it_says_so() -> None:
    with pytest.raises(InputError, match="no other mesh fits"):
        remesh(
            chosen("tensile", "macro", sets=["rig.width=7.4", "rig.gauge_length=2000", "model.macro.element_size=5"])
        )
