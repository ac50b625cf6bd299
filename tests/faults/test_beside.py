"""Both directions of a test of yarns, side by side."""

import json
import shutil
import signal

import pytest
from restart_cases import MESO, OFTEN, finish, numbers, results, resumed_at, run, start, stop

from knittest.base.errors import OUT_OF_MEMORY, InputError, KnittestError, NumericalError, ResourceError
from knittest.studies.trials.parallel import raise_run_error
from knittest.studies.trials.trial import Record

BOTH = [word for word in MESO if word not in ("--direction", "warp")]


def test_directions_run_at_the_same_time_and_to_the_same_bits(tmp_path):
    slow = ("--set", "solver.speed=0.2")  # the warp still runs when the process of the weft has started
    code, said = finish(start("tensile", *BOTH, *slow, "--out", str(tmp_path / "both"), threads=2))
    assert code in (0, 3), said
    begun, ended = tmp_path / "both/weft/config.yaml", tmp_path / "both/warp/summary.json"
    assert begun.stat().st_mtime < ended.stat().st_mtime
    assert run("tensile", *MESO, *slow, "--out", str(tmp_path / "one"))[0] in (0, 3)
    assert results(tmp_path / "both" / "warp") == results(tmp_path / "one")


def test_stopped_directions_go_on_at_the_same_time_and_are_refused_as_one_is(tmp_path):
    both, slow = tmp_path / "both", (*BOTH, *OFTEN, "--set", "solver.speed=0.2")
    process = start("tensile", *slow, "--out", str(both), threads=2)
    # the weft has a process to itself: on a busy machine the warp, which is run anew below, may have ended before
    code, said = stop(process, both / "weft", signal.SIGINT, checkpoints=1)
    assert code == 75 and f"knittest resume {both}" in said
    config = both / "weft/config.yaml"
    text = config.read_text()
    config.write_text(text.replace("damping: 0.5 ", "damping: 0.6 "))
    kept = numbers(both / "weft")
    code, said = run("resume", str(both), threads=2)
    assert code == 2 and "weft: " in said and "solver.damping was 0.5, is 0.6" in said
    assert numbers(both / "weft") == kept
    config.write_text(text)
    shutil.rmtree(both / "warp")  # begins anew, while the weft goes on
    code, said = run("resume", str(both), threads=2)
    assert code in (0, 3), said
    assert [at > 0.0 for at in resumed_at(both / "weft")] == [True]
    ended = json.loads((both / "warp/manifest.json").read_text())["ended"]
    again = json.loads((both / "weft/manifest.json").read_text())["resumed"][0]["time"]
    assert again < ended
    assert run("tensile", *slow, "--direction", "weft", "--out", str(tmp_path / "one"))[0] in (0, 3)
    assert results(both / "weft") == results(tmp_path / "one")


ERRORS = {"failed": NumericalError, "invalid": InputError, "blocked": ResourceError, "crashed": ResourceError}


@pytest.mark.parametrize(("status", "error"), [*ERRORS.items(), ("error", KnittestError)])
def test_the_error_of_a_parallel_run_ends_the_command_as_if_it_had_run_here(status, error):
    raise_run_error(Record("weft", "refused", "it has a result"), "weft")
    with pytest.raises(error, match="weft: node 7") as raised:
        raise_run_error(Record("k", status, "node 7"), "weft")
    assert type(raised.value) is error


@pytest.mark.parametrize(
    "record",
    [
        Record("k", "crashed", "its process was killed by SIGKILL", earlier=("crashed: ", "crashed: ")),
        Record("k", "blocked", OUT_OF_MEMORY),
    ],
)
def test_where_memory_may_have_been_short_it_says_what_takes_less(record):
    with pytest.raises(ResourceError, match="fewer --threads run fewer at a time") as raised:
        raise_run_error(record, "weft")
    assert (", 3 times;" in str(raised.value)) == (record.status == "crashed")
