"""Sweeps, calibrations and homogenisations accept looser limits when their command does, and in no other way."""

from pathlib import Path

import pytest

from knittest.base.errors import InputError
from knittest.base.files import configs_dir
from knittest.config.quality_checks import relaxed_limits
from knittest.config.yaml_loader import load_yaml
from knittest.studies.batch.page import results_table
from knittest.studies.batch.plan import plan_of
from knittest.studies.calibrate.problem import problem_of
from knittest.studies.homogenise.plan import PLANNED_TESTS, Request, meso_run
from knittest.studies.trials.trial import Record, relaxed_limits_note

SWEEP = """
base: {test: [tensile], variant: ["1"], direction: [warp], scale: [macro], preset: [quick]}
grid:
  solver.max_kinetic_ratio: [5.0, 50.0]
"""


@pytest.mark.parametrize("accepted", [False, True])
def test_a_calibration_and_a_homogenisation(accepted: bool) -> None:
    problem = problem_of(load_yaml(configs_dir() / "calibrations" / "v1-friction.yaml"), accepted)
    assert [case.run().accept_limits for case in problem.cases] == [accepted] * len(problem.cases)
    request = Request(variant="1", preset="quick", sets=("solver.max_damping=9",), accept_limits=accepted)
    run = meso_run(request, PLANNED_TESTS[0])
    assert len(relaxed_limits(run)) == 1 and run.accept_limits == accepted


def test_a_sweep_and_its_table(tmp_path: Path) -> None:
    path = tmp_path / "sweep.yaml"
    path.write_text(SWEEP)
    for accepted in (False, True):
        plan = plan_of(load_yaml(path), accepted)
        rows = plan.rows()
        runs = [row.trial.run for row in rows if row.trial]
        assert [len(relaxed_limits(run)) for run in runs] == [0, 1] and {run.accept_limits for run in runs} == {
            accepted
        }
    first, second = (row.trial.key for row in rows if row.trial)
    limits = [{"name": "solver.max_kinetic_ratio", "value": 50.0, "preset": 5.0, "unit": "%", "accepted": True}]
    summaries = {first: {"limits": []}, second: {"limits": limits}}
    found = {key: Record(key, "completed", summary=one) for key, one in summaries.items()}
    column = results_table(plan, rows, found)["looser_limits"]
    assert [str(value) for value in column] == ["nan", "solver.max_kinetic_ratio=50.0"]
    assert "--accept-limits: solver.max_kinetic_ratio=50.0" in relaxed_limits_note(found.values())[0]
    assert relaxed_limits_note([found[first]]) == []
    path.write_text(SWEEP.replace("solver.max_kinetic_ratio: [5.0, 50.0]", "accept_limits: [true]"))
    with pytest.raises(InputError, match="use --accept-limits instead"):
        plan_of(load_yaml(path)).rows()
