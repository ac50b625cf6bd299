"""The soak of benchmarks/soak.py, reduced to a few stops of one case, and that it notices what it is there for."""

import subprocess
import sys

import pytest

from knittest.base.files import PACKAGE

sys.path.insert(0, str(PACKAGE.parent / "benchmarks"))
import soak
import soak_stops
import soak_world
from soak_scenes import SCENES, judged
from soak_world import Case, Whole, World, catches, left_behind

SLEEP = [sys.executable, "-c", "import time; print(flush=True); time.sleep(60)"]


def test_a_few_stops_of_a_strip(capsys):
    """Some ten processes; the numbers of docs/reliability.md come from hundreds over all tests."""
    code = soak.main(["--kills", "1", "--signals", "1", "--scenes", "head", "--only", "tensile of shells", "--kept"])
    told = capsys.readouterr()
    assert code == 0, told.err
    kills, signals, head = told.out.splitlines()[2:]
    assert "SIGKILL" in kills and "| 1 | 1 cases |" in kills and "0 wrong" in kills
    assert "SIGTERM" in signals and "0 wrong" in signals and "slowest answer" in signals
    assert head == "| `| head -1` | 1 | | 1 as left alone, 0 wrong |"


def test_every_case_and_scene_is_there(tmp_path):
    names = [case.name for case in soak_world.cases(tmp_path)]
    assert [name.split()[0] for name in names] == [
        "tensile", "tensile", "picture", "cantilever", "friction", "forming", "batch",
    ]  # fmt: skip
    assert len(SCENES) == 7


def test_a_process_left_behind_is_found_and_ended(tmp_path, monkeypatch):
    monkeypatch.setattr(soak_world, "GONE", 0.3)
    world = World(tmp_path)
    process = subprocess.Popen(SLEEP, env=world.environment("mine"), start_new_session=True, stdout=subprocess.PIPE)
    process.stdout.readline()  # it has its environment
    assert left_behind("other") == []
    assert left_behind("mine") == [process.pid]
    assert process.wait(5.0) < 0
    assert left_behind("mine") == []


def test_who_listens_to_signals():
    work = "import signal, time; signal.signal(10, lambda *a: 0); print(flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", work], stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        assert (catches(process.pid, 10), catches(process.pid, 15)) == (True, False)
        process.kill()


@pytest.mark.parametrize(
    ("code", "content", "said"), [(0, b"1", ""), (1, b"1", "1, not 0"), (0, b"2", "other results")]
)
def test_what_differs_is_told(tmp_path, code, content, said):
    case = Case("strip", ("tensile",), "curve.csv")
    world = World(tmp_path, {"strip": Whole(0, 1.0, {"curve.csv": b"1"})})
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "curve.csv").write_bytes(content)
    wrong = judged(world, case, tmp_path / "out", code, "", "nobody")
    assert [said in text for text in wrong] == [True] * bool(said)


@pytest.mark.parametrize(
    ("work", "said"),
    [
        ("", "ended it with -"),
        ("signal.signal(15, lambda *a: sys.exit(75))", "ended it with 75"),
    ],
)
def test_a_signal_that_is_not_followed_is_told(tmp_path, monkeypatch, work, said):
    monkeypatch.setattr(soak_stops, "SIGNALS", (15,))
    process = subprocess.Popen(
        [sys.executable, "-c", f"import signal, sys, time; {work}\nprint(flush=True); time.sleep(60)"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    process.stdout.readline()  # its handler is set
    tally = soak_stops.Tally()
    dice = soak_stops.random.Random(1)
    assert not soak_stops._signal(process, tmp_path, dice, tally, 0)
    assert len(tally.wrong) == 1 and said in tally.wrong[0]
