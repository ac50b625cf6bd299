"""``knittest uncertainty`` with real runs: pulls of shells, of which the coefficient of a face decides the force."""

import csv
import json

import pytest

from knittest.base.files import configs_dir
from knittest.cli.main import run
from knittest.config.yaml_loader import load_yaml
from knittest.studies.uncertainty.problem import problem_of

PULL = """
base: {test: friction, direction: warp, scale: macro, preset: quick, set: {model.macro.element_size: 10}}
fabrics:
  V1: {variant: 1}
parameters:
  rig.kinetic_coefficient: {low: 0.05, high: 0.1, also: [rig.static_coefficient], reason: around the shipped 0.075}
  fabric.macro.bending_stiffness.warp: {low: 4, high: 6, reason: around the shipped 5.05 N mm}
quantities:
  of both faces: {result: mu_paper}
statements:
  as measured: {quantity: of both faces, of: V1, above: 0.14, below: 0.16}
samples: 2
"""
COEFFICIENT = "rig.kinetic_coefficient"


def test_a_small_study_runs_and_goes_on(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pull.yaml").write_text(PULL)
    assert run(["uncertainty", "pull.yaml", "--workers", "1"]) == 0
    folder = tmp_path / "runs/uncertainty-pull"
    rows = list(csv.DictReader((folder / "results.csv").open()))
    assert len(rows) == 8 and {row["V1 status"] for row in rows} == {"completed"}
    for row in rows:  # two faces
        assert float(row["V1 of both faces"]) == pytest.approx(2.0 * float(row[COEFFICIENT]), rel=0.01)
    said = capsys.readouterr()
    assert (
        "finished: 8 runs (8 completed) at 8 points" in said.out and "samples = 2: indices need at least 16" in said.out
    )
    found = json.loads((folder / "uncertainty.json").read_text())
    holds = [0.14 < 2.0 * float(row[COEFFICIENT]) < 0.16 for row in rows[:4]]
    assert found["statements"][0]["holds"] == sum(holds) and (folder / "report.html").exists()
    ran = (folder / "ledger.jsonl").read_bytes()
    assert run(["uncertainty", "pull.yaml", "--workers", "1", "--quiet"]) == 0
    assert (folder / "ledger.jsonl").read_bytes() == ran and capsys.readouterr() == ("", "")


@pytest.mark.parametrize("path", sorted((configs_dir() / "uncertainty").glob("*.yaml")), ids=lambda path: path.name)
def test_shipped_studies_can_be_planned(path):
    problem = problem_of(load_yaml(path))
    assert len(problem.parameters) >= 2 and problem.variables and problem.study.samples >= 16
    allowed = ("fabric.loop_length", "fabric.weft_density", "fabric.area_mass", "fabric.thickness")
    assert all(name.startswith(allowed) for name in problem.differences)  # equal yarns
