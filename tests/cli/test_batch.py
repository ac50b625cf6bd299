"""``knittest batch`` as a process sees it, and what it writes."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

from knittest.base.files import PACKAGE, configs_dir
from knittest.cli.main import run
from knittest.config.loading import resolve
from knittest.studies.batch import command
from knittest.studies.batch.command import BatchOptions, run_batch
from knittest.studies.trials import overview
from knittest.studies.trials.trial import Record, trial_of

BASE = "base: {variant: 1, scale: macro, preset: quick, direction: warp"
FAST = BASE + ", set: {solver.speed: 4}}\n"
#: only a signal writes a checkpoint; at 0.03 m/s a run takes some three seconds
UNHURRIED = BASE + ", set: {output.checkpoint_interval: 1000}}\n"


@pytest.fixture
def sweep(tmp_path, monkeypatch):
    """Writes a sweep into an empty working folder."""
    monkeypatch.chdir(tmp_path)

    def write(text):
        (tmp_path / "s.yaml").write_text(text)
        return tmp_path / "runs" / "batch-s"

    return write


class Pretending:
    """A pool whose trials end as ``ends`` says, with a peak force of ten times the width."""

    def __init__(self, ends=lambda trial: "completed"):
        self.asked, self._ends = [], ends

    def run(self, trials, place, limit, options, watch):
        for trial in trials:
            watch(trial, 0.0)
            self.asked.append(trial.key)
            yield self._record(trial)

    def _record(self, trial):
        status, width = self._ends(trial), trial.run.rig.width
        if status not in ("completed", "refused"):
            return Record(trial.key, status, f"{status} of {width:g}")
        results = {"peak_force_n": 10.0 * width, "fracture_strain_pct": {"mean": 2.0, "sd": 0.5, "values": [1.5, 2.5]}}
        row = {"quantity": "peak_force_n", "simulated": 10.0 * width, "experiment_mean": 400.0, "experiment_sd": 50.0,
               "deviation_sd": 0.1, "kind": "input", "source": "Table 3"}  # fmt: skip
        rest = {"quality": {"ke_over_ie_max": 0.01}, "cost": {"wall_s": 1.0, "threads": 1}}
        return Record(trial.key, status, summary={"results": results, "comparison": [row], "refused": [], **rest})

    def close(self):
        pass


def batch(pool, monkeypatch, **options) -> int:
    monkeypatch.setattr(command, "_pool", lambda _: pool)
    return run_batch(Path("s.yaml"), BatchOptions(**options), lambda _: False).exit_code


def ledger(folder) -> dict[str, str]:
    path = folder / "ledger.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    assert len({line["key"] for line in lines}) == len(lines)
    return {line["key"]: line["status"] for line in lines}


def test_a_sweep_runs_once_and_leaves_a_table_and_a_picture(sweep, capsys):
    folder = sweep(
        BASE
        + "}\nrange: {rig.width: {low: 20, high: 40, steps: 2}}\npoints: [{solver.speed: 0.5}, {solver.speed: 8.0}]"
    )
    assert run(["batch", "s.yaml", "--workers", "2", "--parquet"]) == 3
    said = capsys.readouterr()
    assert "[4/4] " in said.err and "2 completed: the run ended and passed all quality checks" in said.out
    table = pd.read_csv(folder / "results.csv")
    assert list(table["status"]) == ["completed", "refused"] * 2 and list(table["rig.width"]) == [20, 20, 40, 40]
    assert table["peak_force_n"][2] == pytest.approx(2.0 * table["peak_force_n"][0], rel=0.03)
    assert table["peak_force_n_deviation_sd"].abs().max() < 1.0 or table["peak_force_n_deviation_sd"][1:].isna().any()
    assert (table["threads"] == 1).all() and "kinetic energy over work" in table["reason"][1]
    assert pd.read_parquet(folder / "results.parquet").shape == table.shape
    for place in table["folder"]:
        manifest = json.loads((folder / place / "manifest.json").read_text())
        assert manifest["status"] == "completed" and (folder / place / "curve.csv").is_file()
        assert not list((folder / place).glob("*.png")) and not (folder / place / "report.html").exists()
    assert (folder / "overview.png").read_bytes().startswith(b"\x89PNG")
    before = {p: p.stat().st_mtime_ns for p in folder.rglob("summary.json")}
    assert run(["batch", "s.yaml", "--quiet"]) == 3
    assert before == {p: p.stat().st_mtime_ns for p in folder.rglob("summary.json")} and len(before) == 4


def test_the_table_has_every_run_whatever_became_of_it(sweep, monkeypatch, capsys):
    folder = sweep(FAST + "grid: {rig.width: [20, 30, 40, 50], rig.max_strain: [3.0, 4.0]}\n")
    ends = {20: "completed", 30: "refused", 40: "timeout", 50: "crashed"}
    pool = Pretending(lambda trial: ends[trial.run.rig.width])
    assert batch(pool, monkeypatch) == 3
    table = pd.read_csv(folder / "results.csv")
    assert (
        list(table["run"]) == list(range(1, 9)) and dict(zip(table["rig.width"], table["status"], strict=True)) == ends
    )
    assert list(table["peak_force_n"].dropna()) == [200, 200, 300, 300]
    assert set(table["fracture_strain_pct"].dropna()) == {2.0} and set(table["fracture_strain_pct_sd"].dropna()) == {
        0.5
    }
    assert table["reason"][4] == "timeout of 40" and table["wall_s"].notna().sum() == 4
    out = capsys.readouterr().out
    assert all(f"     2 {status}: " in out for status in ends.values())
    again = Pretending()
    assert batch(again, monkeypatch) == 3  # refused ones stay so
    assert sorted(again.asked) == sorted(key.removeprefix("trials/") for key in table["folder"][4:])
    sweep(FAST + "grid: {rig.width: [20, 60]}\n")
    third = Pretending()
    assert batch(third, monkeypatch) == 0
    assert len(third.asked) == 1  # 20 mm with the default strain of 4 % is known
    assert len(pd.read_csv(folder / "results.csv")) == 2


def test_shards_are_disjoint_and_together_all(sweep, monkeypatch):
    folder = sweep(FAST + "range: {rig.width: {low: 20, high: 60, steps: 11}}\n")
    shares = []
    for number in (1, 2, 3):
        pool = Pretending()
        assert batch(pool, monkeypatch, shard=(number, 3)) == 0
        shares.append(pool.asked)
        open_ones = (pd.read_csv(folder / "results.csv")["status"] == "open").sum()
        assert open_ones == 11 - sum(map(len, shares))
    assert sorted(map(len, shares)) == [3, 4, 4] and len(set().union(*shares)) == 11
    rest = Pretending()
    assert batch(rest, monkeypatch) == 0 and rest.asked == []


def test_a_scheduler_out_of_reach_leaves_nothing(sweep, capsys, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("knittest.studies.trials.pool.CONNECT_LIMIT", 1)
    sweep(FAST)
    assert run(["batch", "s.yaml", "--dask", "tcp://127.0.0.1:1"]) == 2
    assert "--dask tcp://127.0.0.1:1: no scheduler answers" in capsys.readouterr().err
    assert not Path("runs").exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=["ctrl-c", "kill"])
def test_the_same_command_goes_on_where_it_was_stopped(sweep, tmp_path, number):
    folder = sweep(UNHURRIED + "points: [{rig.width: 20, solver.speed: 4.0}, {rig.width: 30, solver.speed: 0.01}]\n")
    command = [sys.executable, "-m", "knittest.cli.main", "batch", "s.yaml", "--workers", "1"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "cwd": tmp_path}
    process = subprocess.Popen(command, env=os.environ | {"PYTHONPATH": str(PACKAGE.parent)}, **pipes)
    while process.poll() is None and not (ledger(folder) and list(folder.glob("trials/*/run.lock"))):
        time.sleep(0.02)
    time.sleep(1.5)
    worker = json.loads(next(folder.glob("trials/*/run.lock")).read_text())["pid"]
    process.send_signal(number)
    _, error = process.communicate(timeout=60)
    assert process.returncode == (75 if number == signal.SIGINT else -signal.SIGKILL)
    assert number == signal.SIGKILL or "run the same command again to resume" in error
    end = time.monotonic() + 20.0
    while Path(f"/proc/{worker}").exists():
        assert time.monotonic() < end
        time.sleep(0.05)
    assert len(list(folder.glob("trials/*/checkpoint-0*.npz"))) == 1
    assert number == signal.SIGKILL or "open" in set(pd.read_csv(folder / "results.csv")["status"])
    first = ledger(folder)
    assert len(first) == 1
    process = subprocess.Popen(command, env=os.environ | {"PYTHONPATH": str(PACKAGE.parent)}, **pipes)
    _, error = process.communicate(timeout=120)
    assert process.returncode in (0, 3), error
    assert "[2/2]" in error and "[1/2]" not in error
    assert len(ledger(folder)) == 2 and first.items() <= ledger(folder).items()
    log = [json.loads(line) for path in folder.glob("trials/*/log.jsonl") for line in path.open()]
    assert [line["event"] for line in log].count("started") == 2
    assert [line["at_ms"] > 0.0 for line in log if line["event"] == "resumed"] == [True]


def test_very_many_runs_need_yes(sweep, capsys, monkeypatch):
    text = "sample: {n: 10000, fields: {rig.width: {low: 20, high: 60}}}\n"
    sweep(FAST + text + "range: {solver.damping: {low: 1, high: 2, steps: 1000}}")
    began = time.monotonic()
    assert run(["batch", "s.yaml"]) == 2
    assert "s.yaml: 10,000,000 runs, more than 10,000: confirm with --yes" in capsys.readouterr().err
    assert time.monotonic() - began < 10.0 and not Path("runs").exists()
    sweep(FAST + "grid: {rig.width: [20, 30]}\n")
    monkeypatch.setattr(command, "LARGE_SWEEP", 1)
    monkeypatch.setattr(command, "_pool", lambda _: Pretending())
    assert run(["batch", "s.yaml", "--quiet"]) == 2 and run(["batch", "s.yaml", "--quiet", "--yes"]) == 0


@pytest.mark.parametrize("study", ["batch", "calibrate", "uncertainty", "homogenise"])
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["none.yaml"], "none.yaml: no such file"),
        (["s.yaml", "--workers", "0"], "0 is not in the range"),
        (["s.yaml", "--out", "s.yaml"], "is a file, expected a folder"),
        (["s.yaml", "--out", "full"], "holds thesis.tex, but no "),
    ],
)
def test_bad_commands_of_studies_run_nothing(sweep, capsys, study, arguments, said):
    text = {"calibrate": "calibrations/v1-friction", "uncertainty": "uncertainty/shear-order"}.get(study)
    sweep(FAST if text is None else (configs_dir() / f"{text}.yaml").read_text())
    Path("full").mkdir()
    Path("full/thesis.tex").touch()
    if study == "homogenise":
        arguments = ["--variant", "1", *arguments[1:]] if arguments[0] == "s.yaml" else ["--fabric", *arguments]
    assert run([study, *arguments]) == 2
    assert said in capsys.readouterr().err
    assert not Path("runs").exists() and [path.name for path in Path("full").iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--shard", "3/2"], "expected the number of the share and of all shares"),
        (["--shard", "0/2"], "expected the number of the share and of all shares"),
        (["--dask", "tcp://127.0.0.1:1", "--workers", "2"], "leave it out with --dask"),
    ],
)
def test_options_that_do_not_fit_run_nothing(sweep, capsys, arguments, said):
    sweep(FAST)
    assert run(["batch", "s.yaml", *arguments]) == 2
    assert said in capsys.readouterr().err and not Path("runs").exists()


def test_the_overview_counts_and_names_the_runs():
    shown = SimpleNamespace(heads=[], running=[], ended=lambda text, record: shown.heads.append(text))
    shown.draw = lambda head, running, share: (shown.heads.append(head), setattr(shown, "running", running))
    view = overview.Overview(3, quiet=True)
    view._display = shown
    trial = trial_of(resolve(variant="1", scale="macro"), "a strip")
    view.begin(1)
    for share, text in ((None, "compiling kernels"), (0.5, " 50 %")):
        view._drawn = 0.0
        view.watch(trial, share)
        assert text in shown.running[0] and "a strip" in shown.running[0]
    view.ended(trial, Record(trial.key, "timeout", "not finished after 2 s", seconds=2.0))
    assert "[2/3] timeout: not finished after 2 s (2.0 s): a strip" in shown.heads
    assert "2/3 runs (1 timeout, 1 finished before)" in shown.heads[-1] and shown.running == []


def test_the_line_of_a_rejected_run_is_short_and_has_the_reason_first():
    reasons = [f"quality check {number} exceeds its limit: rerun with another setting" for number in range(9)]
    record = Record("key", "refused", "; ".join(reasons), seconds=12.3)
    line = overview.outcome_line("tensile v1 warp " + " ".join(f"field{n}=1.234" for n in range(20)), record)
    assert line.startswith("refused: quality check 0 exceeds its limit: rerun with another setting; quality check 1")
    assert " ... (12.3 s): tensile v1 warp field0" in line and len(line) <= 150
