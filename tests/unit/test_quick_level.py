"""The quick level of the regression runs every test, scale and shipped variant, with all quality checks."""

from dataclasses import replace

import pytest

from knittest.base.kinds import Regression, kinds
from knittest.config.loading import resolve
from knittest.config.sources import NUMBERED
from knittest.studies.regress.cases import Case, cases_of

Combination = tuple[str, str, str, str | None]


def combinations(tests=None, variants=NUMBERED) -> set[Combination]:
    """Test, scale, variant and direction of all runs that the shipped presets offer."""
    return {
        (kind.name, scale, variant, direction)
        for kind in (kinds() if tests is None else tests).values()
        for scale in kind.scales
        for variant in variants
        for direction in (("warp", "weft") if kind.directional else (None,))
    }


def quick_cases() -> list[Case]:
    return cases_of("quick")


def covered() -> set[Combination]:
    """The combinations that the quick level runs with the default parameter set."""
    cases = (case for case in quick_cases() if case.parameters is None)
    return {(case.test, case.scale, case.variant, case.direction) for case in cases}


def test_the_quick_level_runs_every_test_scale_variant_and_direction():
    assert sorted(combinations() - covered(), key=str) == []


def test_a_new_test_or_variant_without_a_run_is_missing():
    new = {"tear": replace(kinds()["tensile"], name="tear", regression=Regression())}
    assert {one[0] for one in combinations({**kinds(), **new}) - covered()} == {"tear"}
    assert {one[2] for one in combinations(variants=(*NUMBERED, "3")) - covered()} == {"3"}


@pytest.mark.parametrize("case", quick_cases(), ids=lambda case: case.name)
def test_a_reduced_run_is_smaller_and_nothing_else(case: Case):
    """Mesh, speed, damping and the limits of all quality checks are those of the preset."""
    sets = kinds()[case.test].regression.sets
    given = {"test": case.test, "variant": case.variant, "scale": case.scale, "direction": case.direction}
    held = tuple(one for one in case.sets if one.startswith("rig.blank_holder_force="))  # decides the preset's speed
    preset = resolve(**given, preset="quick", parameters=case.parameters, sets=(*sets, *held))
    reduced = case.trial().run
    assert case.preset == "quick" and not case.trial().run.accept_limits
    assert (reduced.solver, reduced.model, reduced.fabric) == (preset.solver, preset.model, preset.fabric)
    assert all(one.startswith("rig.") for one in case.sets)
    assert bool(case.sets) == bool(case.label)
