"""Blocks of docs/python.md run as they stand; what they leave is what the command leaves."""

import json
import re
from pathlib import Path

import pandas
import pytest

import knittest
from knittest.cli.main import run as command
from knittest.errors import InputError, RefusedWarning

PAGE = Path(__file__).parents[2] / "docs/python.md"


def blocks() -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.M | re.S)


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """Names that the blocks of the page leave, run one after the other in one folder."""
    names: dict[str, object] = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MPLBACKEND", "agg")
        patch.chdir(tmp_path_factory.mktemp("python"))
        for block in blocks():
            exec(compile(block, str(PAGE), "exec"), names)
        names["run"].folder = names["run"].folder.resolve()
    return names


def test_every_block_runs(told):
    assert len(blocks()) == 5 and told["run"].status == "completed"


def test_the_call_is_the_command(told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = (
        "tensile --variant 2 --scale macro --preset quick --direction warp --no-pictures --no-frames --quiet --out a"
    )
    assert command(words.split()) == 0
    ours = told["run"]
    assert (ours.folder / "config.yaml").read_text() == (tmp_path / "a/config.yaml").read_text()
    assert ours.results == json.loads((tmp_path / "a/summary.json").read_text())["results"]
    pandas.testing.assert_frame_equal(ours.curve, knittest.load("a").curve)
    with pytest.raises(InputError, match="has no frames"):
        knittest.load("a").show()


def test_a_refused_run_warns(tmp_path):
    with pytest.warns(RefusedWarning, match="not compared with the experiment: .*energ"):
        run = knittest.tensile(
            1, scale="macro", preset="quick", direction="warp", out=tmp_path / "r", pictures=False, frames=False,
            quiet=True, set={"solver.max_kinetic_ratio": 1e-9},
        )  # fmt: skip
    assert not run.quality_checks and run.quality_checks.refused and run.results["peak_force_n"] > 0
