"""``knittest batch --slurm``: the script, and a share of it run as Slurm would run it."""

import os
import subprocess
from pathlib import Path

import pandas as pd
import pytest

from knittest.base.files import PACKAGE
from knittest.cli.main import run
from knittest.studies.batch import command

SWEEP = """base: {variant: 1, scale: macro, preset: quick, direction: warp}
grid: {rig.width: [25, 30]}
time_limit: 60
"""


@pytest.fixture
def sweep(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.yaml").write_text(SWEEP)
    return tmp_path / "all runs"


def test_a_share_of_the_script_runs(sweep, capsys):
    assert run(["batch", "s.yaml", "--slurm", "2", "--out", "all runs"]) == 0
    script = sweep / "batch.slurm"
    assert capsys.readouterr().out == "sbatch 'all runs/batch.slurm'\n" and not (sweep / "results.csv").exists()
    lines = script.read_text().splitlines()
    assert "#SBATCH --array=1-2" in lines and "#SBATCH --time=0:06:00" in lines  # a run of 60 s, and upkeep
    text = command.write_script(Path("s.yaml"), Path(), 3, 10, 1800.0, (2, 4)).read_text()
    assert "--time=1:05:00" in text and "--cpus-per-task=8" in text  # four runs, two at a time
    assert "--workers 2 --threads 4" in text and "${SLURM_ARRAY_TASK_ID}/3" in text
    environment = {**os.environ, "SLURM_ARRAY_TASK_ID": "2", "PYTHONPATH": str(PACKAGE.parent)}
    subprocess.run(["bash", script], env=environment, check=True, cwd="/", timeout=300)
    assert sorted(pd.read_csv(sweep / "results.csv")["status"]) == ["completed", "open"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["3"], "s.yaml has only 2 runs; expected at most 2 shares"),
        (["2", "--shard", "1/2"], "leave out --dask and --shard"),
    ],
)
def test_what_no_array_can_be_made_of_is_refused(sweep, capsys, arguments, said):
    assert run(["batch", "s.yaml", "--out", "all runs", "--slurm", *arguments]) == 2
    assert said in capsys.readouterr().err and not (sweep / "batch.slurm").exists()
