"""Types of numbers in kernel units, of tests and of reports, as a type checker sees them, and names of nothing."""

import subprocess
import sys
from pathlib import Path

import pytest

from knittest.laboratory.base import Test
from knittest.laboratory.report_base import REPORTS, TESTS, Report

ROOT = Path(__file__).parents[2]
CODE = """
from typing import assert_type
from knittest.base.history import History
from knittest.config.base import DirectionalNumber
from knittest.laboratory.friction.config import FrictionRun
from knittest.laboratory.tensile.config import TensileRun
from knittest.laboratory.base import PreparedSpecimen, Test
from knittest.laboratory.report_base import REPORTS, TESTS
from knittest.runs.execute import Outcome
from knittest.studies.trials.trial import Record

def numbers(run: TensileRun) -> None:
    assert_type(run.rig.gauge_length_mm, float)
    assert_type(run.fabric.macro.bending_stiffness_n_mm, DirectionalNumber)
    assert_type(run.solver.target_step_ms, float | None)
    run.rig.gauge_lenght_mm
    run.fabric.area_mass_g_per_m2
    TESTS["tensile"].result
    REPORTS["tensile"].curves

def results(outcome: Outcome, record: Record) -> None:
    assert_type(outcome.summary["cost"]["elements"], int)
    assert_type(outcome.summary["comparison"][0]["deviation_sd"], float)
    assert_type(record.results["peak_force_n"], float)
    outcome.summary["comparision"]
    record.summary["results"]

class Pulled(Test[TensileRun]):
    def results(self, run: FrictionRun, prepared: PreparedSpecimen, history: History) -> dict[str, float]:
        return {}
"""


def test_a_type_checker_knows_numbers_tests_reports_and_summaries(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    (tmp_path / "code.py").write_text(CODE)
    command = [sys.executable, "-m", "mypy", "--config-file", str(ROOT / "pyproject.toml"), str(tmp_path / "code.py")]
    said = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stdout.splitlines()
    errors = [line.partition("error: ")[2] for line in said if "error: " in line]
    assert [error.partition(";")[0].split("  ")[0] for error in errors] == [
        '"TensileRig" has no attribute "gauge_lenght_mm"',
        '"Fabric" has no attribute "area_mass_g_per_m2"',
        '"Test[Any]" has no attribute "result"',
        '"Report[Any]" has no attribute "curves"',
        'TypedDict "Summary" has no key "comparision"',
        'Value of type "Summary | None" is not indexable',
        'Argument 1 of "results" is incompatible with supertype "knittest.laboratory.base.Test"',
    ]


def test_all_tests_and_reports_are_whole() -> None:
    """One that left a part out could not be made."""
    assert all(Test in type(test).__mro__ for test in TESTS.values())
    assert all(Report in type(report).__mro__ for report in REPORTS.values())
    left_out = type("LeftOut", (type(TESTS["tensile"]),), {"results": Test.results})
    with pytest.raises(TypeError, match="abstract"):
        left_out()
