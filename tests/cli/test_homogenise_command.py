"""``knittest homogenise`` with real shells: a material that is known comes through card and shells within 5 %."""

import sys
from pathlib import Path

import pytest

from knittest.cli.main import run as knittest
from knittest.studies.homogenise import command
from knittest.studies.trials.pool import LocalPool

sys.path.append(str(Path(__file__).parents[1] / "unit"))
from homogenise_cases import BENDING, Formulas, outcome

#: a smaller frame and a narrower strip of 8 yarns on 19.5 mm
SMALL = ["--set", "picture-frame.rig.side=25", "--set", "tensile.rig.width=20", "--set", "cantilever.rig.overhang=120"]


def test_shells_reproduce_a_known_material(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(command, "LocalPool", lambda workers, threads: Formulas(shells=LocalPool(1, 1)))
    assert knittest(["homogenise", "--variant", "2", *SMALL, "--out", "h"]) == 0
    found = outcome(tmp_path)
    assert found["status"] == "reproduced" and found["largest_deviation_pct"] < 2.5 and len(found["check"]) == 18
    bending = {row["test"]: row for row in found["check"] if row["quantity"] == "bending stiffness"}
    assert bending["cantilever warp"]["shells"] == pytest.approx(BENDING["warp"], rel=0.01)
    said = capsys.readouterr()
    assert "picture-frame, macro: completed" in said.err and "reproduced within 5 %" in said.out
    assert (tmp_path / "h/homogenise.png").is_file()


@pytest.mark.full
def test_yarns_of_variant_1_and_shells_agree(tmp_path):
    """Minutes: the tests of yarns at preset quick."""
    assert knittest(["homogenise", "--variant", "1", "--out", str(tmp_path / "h"), "--quiet"]) == 0
    assert outcome(tmp_path)["largest_deviation_pct"] < 5.0
