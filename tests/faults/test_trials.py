"""Processes that die, hang or cannot run a trial: what is finished stays, the rest runs again, the reason is kept."""

import json
import os
import shutil
import signal

import pytest
from restart_cases import resumed_at
from trial_cases import SLOW, gone, meanwhile, process_in, trial

from knittest.base.errors import InputError, NumericalError, ResourceError
from knittest.runs.options import RunOptions
from knittest.studies.trials import child as child_module
from knittest.studies.trials import pool as pool_module
from knittest.studies.trials import worker
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.runner import TrialRunner
from knittest.studies.trials.trial import Ledger, Record, read_ledgers

QUIET = RunOptions(quiet=True, frames=False, pictures=False)


def run(folder, trials, limit=120.0, pool=None, tell=None) -> dict[str, Record]:
    options = {} if tell is None else {"tell": tell}
    with TrialRunner(folder, pool or LocalPool(1), limit=limit, **options) as runner:
        return {record.key: record for record in runner.run(trials)}


class Counting:
    """A pool that runs nothing and counts what it was asked for."""

    def __init__(self, status="completed"):
        self.asked, self.status = [], status

    def run(self, trials, place, limit, options, watch):
        for one in trials:
            self.asked.append(one.key)
            yield Record(one.key, self.status, limit=limit, summary={"results": {}, "refused": []})

    def close(self):
        pass


def test_a_killed_process_loses_nothing_and_its_trial_runs_again_to_the_same_bits(tmp_path):
    quick, slow = trial(20.0), trial(50.0, 0.3)  # a second, a checkpoint each tenth
    place = tmp_path / "trials" / slow.key
    killer = meanwhile(lambda: os.kill(process_in(place, checkpoint=True), signal.SIGKILL))
    records = run(tmp_path, [quick, slow])
    killer.join()
    assert records[slow.key].status == "completed"
    assert records[slow.key].earlier == ("crashed: its process was killed by SIGKILL",)
    assert records[quick.key].earlier == () and records[quick.key].status == "refused"
    alone = run(tmp_path / "alone", [slow])[slow.key]
    assert alone.earlier == () and alone.results == records[slow.key].results
    assert [at > 0.0 for at in resumed_at(place)] == [True]  # from its checkpoint
    with TrialRunner(tmp_path, Counting(), limit=120.0) as runner:
        assert {r.key: r.status for r in runner.run([quick, slow])} == {k: r.status for k, r in records.items()}
    ledger = (tmp_path / "ledger.jsonl").read_text().splitlines()
    assert sorted(json.loads(line)["key"] for line in ledger) == sorted(records)


def test_a_process_that_always_dies_is_given_up_and_tried_again_by_the_next_command(tmp_path, monkeypatch):
    monkeypatch.setattr(child_module, "ATTEMPTS", 1)
    slow = trial(50.0, SLOW)
    killer = meanwhile(lambda: os.kill(process_in(tmp_path / "trials" / slow.key), signal.SIGSEGV))
    record = run(tmp_path, [slow])[slow.key]
    killer.join()
    assert record.status == "crashed" and "SIGSEGV" in record.reason and record.results == {}
    again = Counting()
    assert run(tmp_path, [slow], pool=again)[slow.key].status == "completed"
    assert again.asked == [slow.key]


def test_a_process_that_hangs_is_killed_at_the_limit_and_the_others_go_on(tmp_path, monkeypatch):
    monkeypatch.setattr(child_module, "GRACE", 0.3)
    hanging, quick = trial(50.0, SLOW), trial(20.0)
    stopper = meanwhile(lambda: os.kill(process_in(tmp_path / "trials" / hanging.key), signal.SIGSTOP))
    records = run(tmp_path, [hanging, quick], limit=8.0)
    stopper.join()
    assert records[hanging.key].status == "timeout" and records[hanging.key].reason == "not finished after 8 s"
    assert records[quick.key].status == "refused"
    same, longer = Counting(), Counting()
    run(tmp_path, [hanging, quick], limit=8.0, pool=same)
    run(tmp_path, [hanging, quick], limit=60.0, pool=longer)
    assert same.asked == [] and longer.asked == [hanging.key]


def test_closing_ends_a_process_that_does_not_listen(tmp_path, monkeypatch):
    for module in (child_module, pool_module):
        monkeypatch.setattr(module, "GRACE", 0.3)
    hanging = trial(50.0, SLOW)
    pool = LocalPool(1)
    pids = []

    def stop():
        pids.append(process_in(tmp_path / "trials" / hanging.key))
        os.kill(pids[0], signal.SIGSTOP)
        pool.close()

    closer = meanwhile(stop)
    records = list(pool.run([hanging], lambda _: tmp_path / "trials" / hanging.key, 60.0, QUIET, lambda *_: None))
    closer.join()
    assert gone(pids[0]) and [record.status for record in records] == ["crashed"]


def test_refused_input_and_gates_are_records_with_their_reason(tmp_path):
    unscaled, fast = trial(20.0, 4.0, "solver.target_step=1"), trial(20.0)
    records = run(tmp_path, [unscaled, fast])
    assert records[unscaled.key].status == "invalid" and "no mass scaling" in records[unscaled.key].reason
    assert records[fast.key].status == "refused" and "kinetic energy over work" in records[fast.key].reason
    assert records[fast.key].summary["results"]["peak_force_n"] > 0 and records[fast.key].results == {}


@pytest.mark.parametrize(
    ("error", "status", "settled"),
    [
        (NumericalError("yarn 3 blows up"), "failed", True),
        (InputError("bad"), "invalid", True),
        (ResourceError("disk full"), "blocked", False),
        (type("Worse", (InputError,), {})("worse"), "invalid", True),
        (MemoryError(), "blocked", False),
        (ZeroDivisionError("oh"), "error", True),
    ],
)
def test_what_goes_wrong_in_a_trial_has_a_status(tmp_path, monkeypatch, error, status, settled):
    def fail(*_):
        raise error

    monkeypatch.setattr("knittest.runs.execute.execute", fail)
    monkeypatch.setattr(worker, "_load_kernels", lambda *_: None)
    record = worker.perform(worker.Task(trial(), tmp_path / "x", QUIET), lambda *_: None)
    assert record.status == status and record.settled is settled
    assert str(error) in record.reason and record.reason


def test_a_damaged_ledger_line_is_told_and_its_trial_found_in_its_folder_or_run_again(tmp_path):
    trials = [trial(width) for width in (20.0, 30.0, 40.0)]
    records = run(tmp_path, trials)
    ledger = tmp_path / "ledger.jsonl"
    first, second, third = ledger.read_bytes().splitlines(keepends=True)
    spoiled = second.replace(b'"peak_force_n": ', b'"peak_force_n": 1', 1)
    assert spoiled != second
    ledger.write_bytes(first + spoiled + b"\xff\x00{]\n" + third[: len(third) // 2])
    keys = [json.loads(line)["key"] for line in (first, second, third)]
    shutil.rmtree(tmp_path / "trials" / keys[2])
    told, pool = [], Counting("refused")
    again = run(tmp_path, trials, pool=pool, tell=told.append)
    assert [text.partition(": damaged line")[0] for text in told] == [f"{ledger}:{n}" for n in (2, 3, 4)]
    assert pool.asked == [keys[2]]
    assert again[keys[1]].summary == records[keys[1]].summary
    told.clear()
    assert set(read_ledgers(tmp_path, told.append)) == set(keys)
    assert len(told) == 3  # the torn line was ended, so the next one is whole


def test_the_key_follows_config_code_and_data(monkeypatch, tmp_path):
    base = trial()
    assert trial().key == base.key
    assert trial(51.0).key != base.key
    slower_clock = base.run.output.model_copy(update={"checkpoint_interval": 5.0})
    from knittest.studies.trials import trial as module

    assert module.trial_of(base.run.model_copy(update={"output": slower_clock})).key == base.key
    monkeypatch.setattr(module, "code_digest", lambda: "other")
    assert trial().key != base.key
    monkeypatch.undo()
    monkeypatch.setattr(module, "sha256_files", lambda paths: {p.name: "other" for p in paths})
    assert trial().key != base.key


def test_changed_code_stops_the_trials(tmp_path, monkeypatch):
    monkeypatch.setattr(child_module, "code_digest", lambda: "other")
    with pytest.raises(ResourceError, match="changed while"):
        run(tmp_path, [trial()])


def test_a_ledger_is_of_one_process_runs_each_trial_once_and_keeps_settled_records(tmp_path):
    pool, ledger = Counting(), tmp_path / "ledger.jsonl"
    with Ledger(ledger), pytest.raises(ResourceError, match="another process runs this study"):
        run(tmp_path, [trial()], pool=pool)
    run(tmp_path, [trial(), trial(), trial(20.0)], pool=pool)
    assert len(pool.asked) == 2
    with Ledger(ledger) as open_ledger:
        for status in ("crashed", "completed", "timeout"):
            open_ledger.add(Record("a", status))
    assert read_ledgers(tmp_path, print)["a"].status == "completed"
