"""The quick level of the regression runs every test, scale and shipped variant, with all quality checks."""

import pytest

from knittest.base.kinds import kinds
from knittest.config.loading import resolve
from knittest.config.sources import NUMBERED
from knittest.studies.regress.cases import Case, cases_of

Combination = tuple[str, str, str, str | None]


def combinations() -> set[Combination]:
    """Test, scale, variant and direction of all runs that the shipped presets offer."""
    return {
        (kind.name, scale, variant, direction)
        for kind in kinds().values()
        for scale in kind.scales
        for variant in NUMBERED
        for direction in (("warp", "weft") if kind.directional else (None,))
    }


def quick_cases() -> list[Case]:
    return cases_of("quick")


def test_the_quick_level_runs_every_test_scale_variant_and_direction():
    default = [case for case in quick_cases() if case.parameters is None]
    covered = {(case.test, case.scale, case.variant, case.direction) for case in default}
    assert sorted(combinations() - covered, key=str) == []


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
