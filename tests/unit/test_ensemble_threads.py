"""Specimens of an ensemble that run in processes of their own: how many at a time, and what comes back of them."""

import io
from types import SimpleNamespace as Stub

import pytest

from knittest.base.errors import NumericalError
from knittest.base.progress import Progress
from knittest.config.loading import resolve
from knittest.runs.execute import name_errors
from knittest.studies.trials import parallel
from knittest.studies.trials.parallel import specimen_rounds
from knittest.studies.trials.trial import Record
from knittest.studies.trials.worker import _StandardError

YARNS = {"test": "tensile", "variant": "2", "direction": "warp", "preset": "quick"}


@pytest.mark.parametrize(
    ("left", "threads", "expected"),
    [  # a single last one runs in the process of the command
        (4, 2, [(4, 1)]), (3, 2, [(2, 1)]), (2, 4, [(2, 2)]), (3, 4, [(3, 1)]), (6, 4, [(4, 1), (2, 2)]),
        (1, 4, []), (0, 4, []), (4, 1, []),
    ],
)  # fmt: skip
def test_specimens_at_a_time_and_their_threads(left, threads, expected):
    found = specimen_rounds(range(left), threads)
    assert [(len(numbers), each) for numbers, each in found] == expected
    assert [k for numbers, _ in found for k in numbers] == list(range(sum(n for n, _ in expected)))


class Folder:
    """A run folder that remembers what was logged."""

    def __init__(self, path):
        self.path, self.lock, self.logged = path, 7, []

    def log(self, event, **fields):
        self.logged.append((event, fields))


class Shown(Progress):
    """A progress that remembers what it was told."""

    def __init__(self):
        super().__init__(quiet=True)
        self.phases, self.shares = [], []

    def phase(self, text, *, until_failure=False):
        self.phases.append((text, until_failure))

    def update(self, fraction, *rest):
        self.shares.append(fraction)


@pytest.fixture
def asked(monkeypatch):
    """Pools and specimens that were asked for; the specimen `failing` fails."""
    found = {"pools": [], "specimens": [], "closed": 0, "failing": None}

    class Pool:
        def __init__(self, workers, threads, note, holding):
            found["pools"].append((workers, threads, holding))
            self.note = note

        def run(self, trials, place, limit, options, watch):
            for trial in trials:
                found["specimens"].append((trial.specimen, place(trial)))
                watch(trial, 0.5)
                self.note(trial, "overlap", {"number": trial.specimen, "contacts": 3})
                self.note(trial, "said", {"text": "knittest: a frame is damaged"})
                failed = trial.specimen == found["failing"]
                yield Record(trial.key, "failed", "node 7 flew off") if failed else Record(trial.key, "completed")

        def close(self):
            found["closed"] += 1

    monkeypatch.setattr(parallel, "LocalPool", Pool)
    monkeypatch.setattr(parallel, "compile_missing", lambda *_: False)
    return found


def run_ahead(path, threads, monkeypatch, *, scale="meso", specimens=4, kept=()):
    monkeypatch.setattr(parallel.numba, "get_num_threads", lambda: threads)
    folder, shown = Folder(path), Shown()
    opened = Stub(folder=folder, checkpoints=Stub(is_finished=lambda number: number in kept))
    parallel.run_specimens_in_parallel(resolve(scale=scale, specimens=specimens, **YARNS), opened, shown)
    return folder, shown


def test_those_that_are_left_in_the_folder_of_the_run_which_stays_locked(asked, tmp_path, monkeypatch):
    run_ahead(tmp_path, 2, monkeypatch)
    assert asked["pools"] == [(2, 1, (7,))] and len(asked["specimens"]) == 4
    for done in ("pools", "specimens"):
        asked[done].clear()
    _, shown = run_ahead(tmp_path, 8, monkeypatch, kept=(0,))
    assert asked["pools"] == [(3, 2, (7,))] and asked["closed"] == 2
    assert asked["specimens"] == [(k, tmp_path) for k in (1, 2, 3)]
    assert shown.phases == [("warp: running 3 specimens of 4, 3 at a time", True)]
    assert shown.shares == pytest.approx([1 / 6, 2 / 6, 3 / 6, 4 / 6, 5 / 6, 1.0])


def test_logs_and_words_of_the_processes_are_those_of_the_run_by_specimen(asked, tmp_path, monkeypatch, capsys):
    folder, _ = run_ahead(tmp_path, 2, monkeypatch, specimens=2)
    lines = [("overlap", {"contacts": 3}), ("said", {"text": "knittest: a frame is damaged"})]
    assert folder.logged == [(event, {"number": k, **fields}) for k in range(2) for event, fields in lines]
    shown = [f"knittest: specimen {k} of 2 (warp): a frame is damaged" for k in (1, 2)]
    assert capsys.readouterr().err.splitlines() == shown


def test_a_process_passes_on_the_lines_of_its_standard_error():
    told, stream = [], io.StringIO()
    heard = _StandardError(stream, lambda what, value: told.append((what, value)))
    for text in ("knittest: a ", "frame\n\nsecond\nthi", "rd"):
        print(text, end="", file=heard, flush=True)
    assert told == [("log", ("said", {"text": "knittest: a frame"})), ("log", ("said", {"text": "second"}))]
    assert stream.getvalue() == "knittest: a frame\n\nsecond\nthird"


def test_an_error_names_the_specimen_and_ends_the_others(asked, tmp_path, monkeypatch):
    asked["failing"] = 1
    with pytest.raises(NumericalError, match=r"^specimen 2 of 4 \(warp\): node 7 flew off$"):
        run_ahead(tmp_path, 2, monkeypatch)
    assert asked["closed"] == 1 and len(asked["specimens"]) == 2


@pytest.mark.parametrize(("specimens", "said"), [(3, "specimen 2 of 3 (warp): node 7"), (1, "node 7")])
def test_an_error_in_the_process_of_the_command_names_the_specimen_too(specimens, said):
    with pytest.raises(NumericalError) as raised, name_errors(resolve(specimens=specimens, **YARNS), 1):
        raise NumericalError("node 7")
    assert str(raised.value) == said


@pytest.mark.parametrize("case", [{"threads": 1}, {"scale": "macro"}, {"specimens": 1}, {"kept": (0, 1, 2)}])
def test_none_where_this_process_is_as_good(asked, tmp_path, monkeypatch, case):
    run_ahead(tmp_path, case.pop("threads", 8), monkeypatch, **case)
    assert asked["pools"] == []
