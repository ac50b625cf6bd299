"""The benchmark of another solver with programs that stand in for it: decks, programs, time history, table, compare."""

import json
import os
import re
import sys

import numpy as np
import pandas as pd
import pytest
from radioss_reader import blocks_of, history_text, table

from benchmarks import other_solver
from knittest.cli.main import run

STRIP = (
    "tensile", "--variant", "1", "--scale", "macro", "--preset", "quick", "--direction", "warp", "--set",
    "rig.width=30", "--set", "rig.gauge_length=40",
)  # fmt: skip
#: force of the stand-in over that of knittest
RATIO = 0.9
#: keeps what it was given, so that the test sees it
PROGRAM = """#!{python}
import pathlib, shutil, sys
name = sys.argv[2].removesuffix("_000{number}.rad")
pathlib.Path("{part}.seen").write_text(pathlib.Path(sys.argv[2]).read_text())
if {number}:
    shutil.copy("{history}", name + "T01")
"""


def _history(folder, factor):
    """Time history of the moving clamp, of all its nodes alike, with ``factor`` times the force of the run."""
    curve = pd.read_csv(folder / "shells/curve.csv")
    starter = blocks_of((folder / "shells-deck/tensile-warp_0000.rad").read_text())
    nodes = [int(row[0]) for row in table(starter["TH/NODE"][1][2:], 10)]
    time = np.linspace(0.0, curve["time_ms"].iloc[-1], 401)
    force = factor * np.interp(time, curve["time_ms"], curve["force_n"])
    impulse = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(time))])
    values = np.zeros((len(time), len(nodes), 4))
    values[:, :, 1] = np.interp(time, curve["time_ms"], curve["displacement_mm"])[:, None]
    values[:, :, 3] = -impulse[:, None] / len(nodes)
    return history_text(time, [(0, [1, 2, 620, 621], nodes, values)])


@pytest.mark.skipif(os.name != "posix", reason="stand-ins are scripts")
def test_a_deck_is_run_and_compared(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(other_solver, "CASES", {"shells": (STRIP, (0.4, 0.8, 1.2))})
    monkeypatch.delenv(other_solver.VARIABLE, raising=False)
    assert other_solver.rows("shells", tmp_path) == []
    assert "is not set: wrote" in capsys.readouterr().out
    history = tmp_path / "history"
    history.write_text(_history(tmp_path, RATIO))
    (tmp_path / "solver/exec").mkdir(parents=True)
    for number, part in enumerate(("starter", "engine")):
        program = tmp_path / f"solver/exec/{part}_linux64_gf"
        program.write_text(PROGRAM.format(python=sys.executable, part=part, number=number, history=history))
        program.chmod(0o755)
        program.with_name(program.name + "_sp").write_text("single precision")
    monkeypatch.setenv(other_solver.VARIABLE, str(tmp_path / "solver"))
    found = other_solver.rows("shells", tmp_path)
    assert len(found) == 3
    for line in found:
        assert float(re.findall(r"[\d.]+", line)[-1]) == pytest.approx(RATIO, abs=0.002), line
    deck = tmp_path / "shells-deck"
    assert (deck / "starter.seen").read_text().startswith("#RADIOSS STARTER")
    assert (deck / "engine.seen").read_text().startswith("#RADIOSS ENGINE")
    capsys.readouterr()
    words = ["compare", str(tmp_path / "shells"), "--against", str(deck / "tensile-warpT01"), "--json"]
    assert run(words) == 0
    said = json.loads(capsys.readouterr().out)
    assert "OpenRadioss, tensile-warpT01" in json.dumps(said) and said["rating"] is not None


def test_a_folder_without_the_solver_is_rejected(tmp_path):
    with pytest.raises(SystemExit, match=r"no exec/starter_\*"):
        other_solver.solver("starter", tmp_path)
