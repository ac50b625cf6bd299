"""``knittest regress --update-baseline``: what it refuses to loosen, and what it says of runs that round otherwise."""

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from regress_cases import Pretending

from knittest.cli.main import run
from knittest.studies.regress import cases, command
from knittest.studies.regress.cases import Case
from knittest.studies.regress.drift import RUNS

FRAME = Case("picture-frame", "macro", "1", None, "quick", enlarges=True)
TENSILE = Case("tensile", "macro", "1", "warp", "quick")
FORCE = "shear_force_n_at_deg.30"


def scattered(off):
    """Forces of the runs that round differently: 12.3 N, and by turns ``off`` more or less."""
    return {f"{FRAME.name}, rounding {k}": {FORCE: 12.3 + (-1) ** k * off} for k in range(1, RUNS)}


@pytest.fixture
def update(tmp_path, monkeypatch):
    """Updates ``b.json`` with a frame and a tensile test that pretend."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cases, "cases_of", lambda level: [FRAME, TENSILE] if level == "quick" else [])
    count = iter(range(100))

    def call(pool, *more, asked=("--update-baseline",)):
        monkeypatch.setattr(command, "LocalPool", lambda *numbers: pool)
        return run(["regress", "--baseline", "b.json", "--out", f"out{next(count)}", *asked, *more])

    assert call(Pretending(more=scattered(0.1)), "--quiet") == 0
    return call


def entry():
    return json.loads(Path("b.json").read_text())["entries"][FRAME.name]


def test_a_scatter_that_grows_by_more_than_30_percent_is_refused_unless_its_run_is_named(update, capsys):
    """Limit 0.1 % and five times 0.0996 N of 12.3 N: 4.15 %; with twice the scatter 8.2 %. Small steps do not add up: a
    quarter more is stored; a quarter more of that is 56 % over what was first stored.
    """
    assert update(Pretending(more=scattered(0.125))) == 0
    assert f"wider: {FORCE} 4.15 % to 5.1" in capsys.readouterr().out
    assert update(Pretending(more=scattered(0.156))) == 5
    assert f"{FORCE} 4.15 % to 6.4" in capsys.readouterr().out
    assert update(Pretending(more=scattered(0.1))) == 0
    capsys.readouterr()
    before = entry()
    wider = Pretending(more=scattered(0.2))
    assert update(wider) == 5
    said = (
        f"FAIL {FRAME.name}: not stored: limits would grow by more than 30 %: {FORCE} 4.15 % to 8.21 %: find the cause"
    )
    assert said in capsys.readouterr().out
    assert entry() == before
    assert update(wider, "--accept-wider", FRAME.name) == 0
    assert f"accepted as requested: {FORCE} 4.15 % to 8.21 %" in capsys.readouterr().out
    assert entry()["scatter"][FORCE] == pytest.approx(2.0 * before["scatter"][FORCE], rel=1e-3)
    assert entry()["accepted"][FORCE] == pytest.approx(0.0821, rel=1e-3)


def test_a_number_or_a_run_that_is_gone_is_named(update, capsys):
    file = Path("b.json")
    data = json.loads(file.read_text())
    data["entries"][TENSILE.name]["results"]["toughness"] = 1.0
    data["entries"]["tensile-of-old"] = data["entries"][TENSILE.name]
    file.write_text(json.dumps(data))
    assert update(Pretending(more=scattered(0.1)), "--junit", "j.xml", asked=()) == 5
    text = capsys.readouterr().out
    assert "FAIL tensile-of-old: in the baseline, but no level runs it any more" in text
    assert "toughness: 1 stored, nan now" in text
    assert "tensile-of-old" in {case.get("name") for case in ET.parse("j.xml").iter("testcase")}
    assert update(Pretending(more=scattered(0.1))) == 5
    text = capsys.readouterr().out
    assert f"FAIL {TENSILE.name}: not stored" in text and "toughness 0.1 % to none, as it is missing" in text
    assert "tensile-of-old: removed, no level runs it any more" in text
    assert set(json.loads(file.read_text())["entries"]) == {FRAME.name, TENSILE.name}


@pytest.mark.parametrize(
    ("status", "code", "said"),
    [
        ("refused", 5, "is no baseline"),
        ("failed", 5, "a run that fails by rounding alone is no baseline"),
        ("crashed", 5, "the process of the run died; finished runs are kept; run the same command again"),
        ("timeout", 5, "stopped at the time limit"),
        ("blocked", 4, "no disk space or memory, or the folder is in use"),
    ],
)
def test_it_is_said_what_became_of_a_run_that_rounds_differently(update, status, code, said, capsys):
    ends = {f"{FRAME.name}, rounding 3": status, f"{FRAME.name}, rounding 5": "refused"}
    if status != "blocked":
        ends.popitem()
    before = entry()
    pool = Pretending(ends=lambda trial: ends.get(trial.label, "completed"), more=scattered(0.1))
    assert update(pool, "--junit", "j.xml") == code
    text = capsys.readouterr().out
    assert f"not stored: {FRAME.name}, rounding 3, the same run with other rounding, {status}: {status} with" in text
    assert said in text and ("limit of a quality check" in text) == (status == "refused")
    assert ("NOT EVALUATED, no disk space or memory" in text) == (code == 4)
    suite = ET.parse("j.xml").getroot().findall("testsuite")[1]
    assert (suite.get("errors"), suite.get("failures")) == (("1", "0") if code == 4 else ("0", "1"))
    assert entry() == before


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--accept-wider", FRAME.name], f"--accept-wider {FRAME.name}: needs --update-baseline"),
        (["--update-baseline", "--accept-wider", "frame"], "--accept-wider frame: expected one of picture-frame-macro"),
    ],
)
def test_what_cannot_be_accepted_is_bad_input(update, options, said, capsys):
    pool = Pretending()
    assert update(pool, *options, asked=()) == 2
    assert said in capsys.readouterr().err and pool.asked == []
