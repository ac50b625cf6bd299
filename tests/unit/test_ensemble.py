"""Specimens of an ensemble that run in processes of their own."""

from types import SimpleNamespace as Stub

import pytest

from knittest.base.progress import Progress
from knittest.config.loading import resolve
from knittest.runs.options import RunOptions
from knittest.studies.trials import ensemble
from knittest.studies.trials.record import Record

YARNS = {"test": "tensile", "variant": "2", "direction": "warp", "preset": "quick"}


class Folder:
    """A run folder that remembers what was logged."""

    def __init__(self, path):
        self.specimens, self.logged = path / "specimens", []

    def log(self, event, **fields):
        self.logged.append((event, fields["number"]))


@pytest.fixture
def begun(monkeypatch):
    """Numbers that were begun elsewhere, with the processes and threads that were asked for."""
    found = []

    class Pool:
        def __init__(self, *shares):
            found.append(shares)

        def run(self, trials, place, *rest):
            for trial in trials:
                found.append((trial.specimen, place(trial).name))
                yield Record(trial.key, "completed", seconds=1.0)

        def close(self):
            found.append("closed")

    monkeypatch.setattr(ensemble, "LocalPool", Pool)
    return found


def run_ahead(folder, threads, monkeypatch, *, scale="meso", specimens=4, kept=(), found=None):
    monkeypatch.setattr(ensemble.numba, "get_num_threads", lambda: threads)
    run = resolve(scale=scale, specimens=specimens, **YARNS)
    state = Stub(finished=lambda number: {} if number in kept else None, found=found)
    ensemble.run_ahead(run, Stub(folder=folder, checkpoints=state), RunOptions(), Progress(quiet=True))


def test_those_that_are_left_and_not_begun_here(begun, tmp_path, monkeypatch):
    folder = Folder(tmp_path)
    run_ahead(folder, 8, monkeypatch, kept=(0,), found=(2, None))
    assert begun == [(2, 1), (1, "0001"), (3, "0003"), "closed"]
    assert folder.logged == [("specimen", 1), ("specimen", 3)]


def test_no_more_at_a_time_than_there_are_threads(begun, tmp_path, monkeypatch):
    run_ahead(Folder(tmp_path), 3, monkeypatch)
    assert begun[0] == (3, 1) and len(begun) == 6


@pytest.mark.parametrize(
    "case",
    [{"threads": 1}, {"scale": "macro"}, {"specimens": 1}, {"kept": (0, 1, 2)}, {"kept": (0, 1), "found": (2, None)}],
)
def test_none_where_this_process_is_as_good(begun, tmp_path, monkeypatch, case):
    run_ahead(Folder(tmp_path), case.pop("threads", 8), monkeypatch, **case)
    assert begun == []
