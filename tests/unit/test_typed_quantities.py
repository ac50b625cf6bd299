"""Types of numbers in kernel units, as a type checker sees them, and names that nobody declared."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CODE = """
from typing import assert_type
from knittest.config.kernel_units import Directed
from knittest.config.run import TensileRun

def numbers(run: TensileRun) -> None:
    assert_type(run.rig.gauge_length_mm, float)
    assert_type(run.fabric.macro.bending_stiffness_n_mm, Directed)
    assert_type(run.solver.target_step_ms, float | None)
    run.rig.gauge_lenght_mm
    run.fabric.area_mass_g_per_m2
"""


def test_a_type_checker_knows_the_numbers_and_refuses_a_wrong_name(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    (tmp_path / "code.py").write_text(CODE)
    command = [sys.executable, "-m", "mypy", "--config-file", str(ROOT / "pyproject.toml"), str(tmp_path / "code.py")]
    said = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stdout.splitlines()
    errors = [line.partition("error: ")[2] for line in said if "error: " in line]
    assert [error.partition(";")[0].split("  ")[0] for error in errors] == [
        '"TensileRig" has no attribute "gauge_lenght_mm"',
        '"Fabric" has no attribute "area_mass_g_per_m2"',
    ]
