"""Trials on a Dask cluster of its documented commands: a scheduler and two workers on the loopback interface."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time

import pytest
from restart_cases import resumed_at
from trial_cases import SLOW, meanwhile, process_in, trial

from knittest.base.errors import InputError, ResourceError
from knittest.base.files import PACKAGE
from knittest.studies.trials import pool
from knittest.studies.trials.pool import DaskPool
from knittest.studies.trials.runner import TrialRunner

pytest.importorskip("distributed")


def dask(*arguments) -> subprocess.Popen:
    environment = os.environ | {"PYTHONPATH": str(PACKAGE.parent)}
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *arguments], env=environment, start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


def ended(process: subprocess.Popen) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@pytest.fixture
def cluster(tmp_path):
    """Address, scheduler and workers."""
    address = f"tcp://127.0.0.1:{free_port()}"
    scheduler = dask("scheduler", "--host", "127.0.0.1", "--port", address.rpartition(":")[2], "--no-dashboard")
    options = ("--nworkers", "1", "--nthreads", "1", "--host", "127.0.0.1", "--no-dashboard", "--no-nanny")
    place = ("--local-directory", str(tmp_path / "dask"))
    workers = [dask("worker", address, *options, *place) for _ in range(2)]
    yield address, scheduler, workers
    for process in (*workers, scheduler):
        ended(process)


def parent_of(pid: int) -> int:
    with open(f"/proc/{pid}/stat") as stream:  # noqa: PTH123
        return int(stream.read().rpartition(")")[2].split()[1])


def test_two_workers_share_the_trials_and_a_lost_one_loses_none(tmp_path, cluster):
    address, _, workers = cluster
    slow, others = trial(50.0, SLOW), [trial(width) for width in (20.0, 25.0, 30.0)]
    lost = []

    def lose():
        pid = process_in(tmp_path / "b" / "trials" / slow.key, checkpoint=True)
        worker = next(w for w in workers if w.pid == parent_of(pid))
        ended(worker)
        lost.append((pid, worker))

    killer = meanwhile(lose)
    with TrialRunner(tmp_path / "b", DaskPool(address), limit=120.0) as runner:
        records = {record.key: record for record in runner.run([slow, *others])}
    killer.join()
    assert len(lost) == 1
    assert records[slow.key].status == "completed"
    assert [records[one.key].status for one in others] == ["refused"] * 3
    assert [at > 0.0 for at in resumed_at(tmp_path / "b" / "trials" / slow.key)] == [True]


def test_an_unreachable_scheduler_is_bad_input(monkeypatch):
    monkeypatch.setattr(pool, "CONNECT_LIMIT", 2)
    began = time.monotonic()
    with pytest.raises(InputError, match=r"--dask tcp://127.0.0.1:\d+: no scheduler answers"):
        DaskPool(f"tcp://127.0.0.1:{free_port()}")
    assert time.monotonic() - began < 20.0
    with socket.create_server(("127.0.0.1", 0)) as silent:  # a server of another kind
        for address in ("nonsense", f"tcp://127.0.0.1:{silent.getsockname()[1]}"):
            with pytest.raises(InputError, match="no scheduler answers"):
                DaskPool(address)


def test_a_lost_scheduler_ends_the_batch_and_keeps_what_is_finished(tmp_path, cluster):
    address, scheduler, _ = cluster
    quick, slow = trial(20.0), trial(50.0, SLOW / 4.0)
    done = []

    def lose():
        process_in(tmp_path / "trials" / slow.key, checkpoint=True)
        while not done:
            time.sleep(0.02)
        ended(scheduler)

    killer = meanwhile(lose)
    lost = pytest.raises(ResourceError, match="the scheduler is lost")
    with lost, TrialRunner(tmp_path, DaskPool(address), limit=120.0) as runner:
        for record in runner.run([quick, slow]):
            done.append(record.key)
    killer.join()
    assert done == [quick.key]


def test_a_worker_with_other_code_is_refused(tmp_path, cluster, monkeypatch):
    monkeypatch.setattr(pool, "code_digest", lambda: "other")
    refused = pytest.raises(InputError, match="has another version of knittest")
    with refused, TrialRunner(tmp_path, DaskPool(cluster[0]), limit=60.0) as runner:
        list(runner.run([trial(20.0)]))
