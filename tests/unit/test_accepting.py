"""Sweeps, calibrations and homogenisations accept looser limits when their command does, and in no other way."""

from pathlib import Path

import pytest

from knittest.base.errors import InputError
from knittest.base.files import configs_dir
from knittest.config.gates import loosened
from knittest.config.yaml_loader import load_yaml
from knittest.studies.batch.page import results_table
from knittest.studies.batch.plan import plan_of
from knittest.studies.calibrate.problem import problem_of
from knittest.studies.homogenise.plan import PIECES, Request, yarn_run
from knittest.studies.trials.trial import Record, looser_note

SWEEP = """
base: {test: [tensile], variant: ["1"], direction: [warp], scale: [macro], preset: [quick]}
grid:
  solver.max_kinetic_ratio: [5.0, 50.0]
"""


def swept(folder: Path, text: str = SWEEP) -> Path:
    path = folder / "sweep.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("accepted", [False, True])
def test_a_sweep(accepted: bool, tmp_path: Path) -> None:
    plan = plan_of(load_yaml(swept(tmp_path)), accepted)
    runs = [row.trial.run for row in plan.rows() if row.trial]
    assert [len(loosened(run)) for run in runs] == [0, 1]
    assert [run.accept_limits for run in runs] == [accepted, accepted]


def test_a_sweep_over_acceptance_is_refused(tmp_path: Path) -> None:
    text = SWEEP.replace("solver.max_kinetic_ratio: [5.0, 50.0]", "accept_limits: [true]")
    with pytest.raises(InputError, match="use --accept-limits instead"):
        plan_of(load_yaml(swept(tmp_path, text))).rows()


def test_the_table_of_a_sweep_names_looser_limits(tmp_path: Path) -> None:
    plan = plan_of(load_yaml(swept(tmp_path)), True)
    rows = plan.rows()
    keys = [row.trial.key for row in rows if row.trial]
    limits = [{"name": "solver.max_kinetic_ratio", "value": 50.0, "preset": 5.0, "unit": "%", "accepted": True}]
    records = {
        keys[0]: Record(keys[0], "completed", summary={"limits": []}),
        keys[1]: Record(keys[1], "completed", summary={"limits": limits}),
    }
    column = results_table(plan, rows, records)["looser_limits"]
    assert [str(value) for value in column] == ["nan", "solver.max_kinetic_ratio=50.0"]
    assert looser_note(records.values()) == [
        "limits looser than the preset's, accepted by --accept-limits: solver.max_kinetic_ratio=50.0"
    ]
    assert looser_note([records[keys[0]]]) == []


@pytest.mark.parametrize("accepted", [False, True])
def test_a_calibration_and_a_homogenisation(accepted: bool) -> None:
    problem = problem_of(load_yaml(configs_dir() / "calibrations" / "v1-friction.yaml"), accepted)
    assert [case.run().accept_limits for case in problem.cases] == [accepted] * len(problem.cases)
    request = Request(variant="1", preset="quick", sets=("solver.max_damping=9",), accept_limits=accepted)
    run = yarn_run(request, PIECES[0])
    assert len(loosened(run)) == 1 and run.accept_limits == accepted
