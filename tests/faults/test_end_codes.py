"""Leftovers of a run that ended, however it ended: the code of ``resume``, the folder, the lock, the processes."""

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from restart_cases import MACRO
from trial_cases import gone

from knittest.base.files import PACKAGE
from knittest.cli.main import run
from knittest.config.loading import resolve
from knittest.config.yaml_writer import dump
from knittest.export.folder import RunFolder
from knittest.export.lock import LOCK_NAME
from knittest.solve import compilation
from knittest.studies.trials.pool import LocalPool

QUICK = (*MACRO, "--quiet", "--threads", "1")
REFUSED = "not compared with the experiment: kinetic energy over work 7 % is above 5 %"


def ended_run(folder: Path, code: int = 0, message: str = "", direction: str = "warp") -> Path:
    """The folder of a run that completed with ``code``."""
    folder.mkdir(parents=True)
    (folder / "config.yaml").write_text(dump(resolve(variant="2", scale="macro", direction=direction)))
    manifest = {"status": "completed", "exit_code": code, "message": message, "ended": "2026-01-01T00:00:00+00:00"}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    (folder / "report.html").write_text("")
    return folder


def status(folder: Path) -> tuple[str, int | None]:
    manifest = json.loads((folder / "manifest.json").read_text())
    return manifest["status"], manifest["exit_code"]


def test_resume_of_a_refused_run_is_refused(tmp_path, capsys):
    folder = ended_run(tmp_path / "run", 3, REFUSED)
    assert run(["resume", str(folder)]) == 3
    assert REFUSED in capsys.readouterr().out
    assert run(["tensile", "--resume", str(folder)]) == 3
    capsys.readouterr()
    assert run(["resume", str(folder), "--json"]) == 3
    assert capsys.readouterr().out == ""  # where nothing but JSON goes


@pytest.mark.parametrize(("warp", "weft", "code"), [(0, 0, 0), (3, 0, 3), (0, 3, 3), (5, 0, 5)])
def test_the_worst_of_both_directions_counts(tmp_path, warp, weft, code):
    for direction, ended in (("warp", warp), ("weft", weft)):
        (tmp_path / f"config-{direction}.yaml").write_text("")
        ended_run(tmp_path / direction, ended, direction=direction)
    assert run(["resume", str(tmp_path)]) == code


def test_a_sibling_that_goes_on_does_not_hide_a_refusal(tmp_path, monkeypatch):
    for direction in ("warp", "weft"):
        text = dump(resolve(variant="2", scale="macro", direction=direction))
        (tmp_path / f"config-{direction}.yaml").write_text(text)
    ended_run(tmp_path / "warp", 3, REFUSED)
    monkeypatch.setattr("knittest.studies.command._run_jobs", lambda jobs, options, parent: 0)
    assert run(["resume", str(tmp_path)]) == 3


@pytest.mark.parametrize(("ended", "taken"), [(("failed", 2), True), (("failed", 3), False), (("completed", 0), False)])
def test_both_directions_corrected_take_the_folder_that_bad_input_ended(tmp_path, monkeypatch, capsys, ended, taken):
    seen = []
    monkeypatch.setattr("knittest.studies.command._run_jobs", lambda jobs, *_: seen.extend(jobs) or [])
    both = ["tensile", *(word for word in QUICK if word not in ("--direction", "warp")), "--out", str(tmp_path)]
    assert run(both) == 0 and len(seen) == 2
    assert run(both) == 2  # nothing has ended in it yet
    folder = ended_run(tmp_path / "warp")
    manifest = {"status": ended[0], "exit_code": ended[1]}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    assert run(both) == (0 if taken else 2) and len(seen) == (4 if taken else 2)
    assert ("holds a run; continue it with: knittest resume" in capsys.readouterr().err.splitlines()[-1]) or taken


def test_resume_writes_the_page_and_removes_the_leavings_of_a_kill(tmp_path, monkeypatch):
    folder = ended_run(tmp_path / "run")
    written = []
    monkeypatch.setattr("knittest.runs.opened_run.write_if_possible", lambda path, write: written.append(path))
    assert run(["resume", str(folder)]) == 0 and written == []
    (folder / LOCK_NAME).write_bytes(b"")
    for name in ("checkpoint-0000-0003.npz", ".checkpoint-0000-0004.7.tmp.npz"):
        (folder / name).write_bytes(b"")
    (folder / "report.html").unlink()
    assert run(["resume", str(folder)]) == 0
    assert written == [folder]
    assert sorted(p.name for p in folder.iterdir()) == ["config.yaml", "manifest.json"]


@pytest.mark.parametrize("content", [b"", b'{"pid": 1, "host": "here"}'])
def test_a_lock_left_in_a_finished_run_does_not_give_it_away(tmp_path, capsys, content):
    folder = ended_run(tmp_path / "run", 3)
    (folder / LOCK_NAME).write_bytes(content)
    before = (folder / "manifest.json").read_bytes()
    assert run(["tensile", *QUICK, "--out", str(folder)]) == 2
    assert "contains a completed run" in capsys.readouterr().err
    assert (folder / "manifest.json").read_bytes() == before and (folder / "config.yaml").is_file()


def test_a_signal_while_the_folder_is_opened(tmp_path, monkeypatch, capsys):
    create = RunFolder.create.__func__

    def stopped(cls, *arguments, **named):
        folder = create(cls, *arguments, **named)
        os.kill(os.getpid(), signal.SIGTERM)  # between the first manifest and whoever looks after it
        return folder

    monkeypatch.setattr(RunFolder, "create", classmethod(stopped))
    assert run(["tensile", *QUICK, "--out", str(tmp_path / "run")]) == 75
    assert status(tmp_path / "run") == ("interrupted", 75)
    assert not (tmp_path / "run" / LOCK_NAME).exists()
    assert f"stopped by SIGTERM; continue with: knittest resume {tmp_path / 'run'}" in capsys.readouterr().err


def test_a_signal_while_a_run_ends(tmp_path, monkeypatch):
    """It is complete, or it is not; it never stays running."""
    write = RunFolder._write_manifest

    def stopped(self):
        if self._manifest["status"] == "completed":
            os.kill(os.getpid(), signal.SIGTERM)
        write(self)

    monkeypatch.setattr(RunFolder, "_write_manifest", stopped)
    assert run(["tensile", *QUICK, "--out", str(tmp_path / "run")]) == 75
    assert status(tmp_path / "run") in (("completed", 0), ("completed", 3))
    assert not (tmp_path / "run" / LOCK_NAME).exists()
    assert not (tmp_path / "run" / "report.html").exists()
    assert run(["resume", str(tmp_path / "run")]) in (0, 3)
    assert (tmp_path / "run" / "report.html").is_file()


@pytest.mark.parametrize("direction", ["warp", "both"])
def test_a_curve_that_is_not_there_leaves_no_folder(tmp_path, direction):
    arguments = ["tensile", *QUICK, "--direction", direction, "--out", str(tmp_path / "run")]
    assert run([*arguments, "--against", str(tmp_path / "none.csv")]) == 2
    assert not (tmp_path / "run").exists()


def test_the_compiler_ends_with_its_parent(tmp_path):
    environment = os.environ | {"KNITTEST_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(PACKAGE.parent)}
    work = "from knittest.solve.compilation import compile_in_background\nwith compile_in_background('macro'): pass"
    parent = subprocess.Popen([sys.executable, "-c", work], env=environment)
    children = Path(f"/proc/{parent.pid}/task/{parent.pid}/children")
    while not (found := children.read_text().split()):
        assert parent.poll() is None
        time.sleep(0.05)
    compiled = tmp_path / "cache" / "numba"
    while not list(compiled.rglob("*.nbi")):  # it is at work
        time.sleep(0.05)
    parent.kill()
    parent.wait()
    assert gone(int(found[0]), 10.0)


def test_of_many_that_start_at_once_one_compiles(tmp_path, monkeypatch):
    """Four at a time, each as a process of its own would: the marker is there before the others have their turn."""
    compiled = []

    def compile_slowly(kernels):
        compiled.append(kernels)
        time.sleep(0.3)
        compilation._marker(kernels).touch()

    monkeypatch.setattr(compilation, "CODE_FOLDER", tmp_path)
    monkeypatch.setattr(compilation, "_compile_kernels", compile_slowly)
    with ThreadPoolExecutor(4) as threads:
        list(threads.map(compilation.fill_cache, ["macro"] * 4))
    assert compiled == ["macro"]
    (tmp_path / "meso.lock").mkdir()  # a folder that takes no lock: compiled all the same
    compilation.fill_cache("meso")
    assert compiled == ["macro", "meso"]


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_streams_closed_before_the_start(tmp_path, closed):
    command = f"cd {tmp_path}; {sys.executable} -m knittest.cli.main"
    environment = os.environ | {"PYTHONPATH": str(PACKAGE.parent)}
    for arguments, code in (("schema", 0), ("tensile --variant 7", 2)):
        text = f"({command} {arguments} {closed}); echo $?"
        done = subprocess.run(["bash", "-c", text], env=environment, capture_output=True, text=True)
        assert done.stdout.splitlines()[-1] == str(code), done
        assert "internal" not in done.stderr and "Traceback" not in done.stderr


def ended_by(tmp_path, work):
    return subprocess.run([sys.executable, "-c", work], capture_output=True, text=True, cwd=tmp_path)


def test_a_signal_at_the_very_end_does_not_change_the_code(tmp_path):
    """The interpreter puts the system's handlers back while it ends; a run that is done is no killed one."""
    ending = "import atexit, os, signal; atexit.register(lambda: [os.kill(os.getpid(), n) for n in (15, 2, 10)])"
    done = ended_by(
        tmp_path, f"import sys, knittest.cli.main as m\nsys.argv = ['knittest', '--version']\n{ending}\nm.main()"
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_a_signal_in_a_callback_shows_no_traceback(tmp_path):
    """Raised where nothing can be raised, as in a callback of a library: noted, and not shown as a traceback."""
    lose = "import os\nclass C:\n    def __del__(self): os.kill(os.getpid(), 15); [0 for _ in range(10)]\n"
    done = ended_by(
        tmp_path,
        f"import sys, knittest.cli.main as m\n{lose}\nclass D:\n    def __del__(self): raise ValueError('shown')\n"
        "m.cli.main = lambda **named: (C(), D(), print('on'))[2]\nm.main([])",
    )
    assert "Interrupted" not in done.stderr and "shown" in done.stderr, done


def test_a_pool_leaves_no_file_open():
    """Also of a process that nobody was waiting for: with warnings as errors, an open file is a traceback."""
    pool = LocalPool(2, 1)
    for child in pool.children:
        child.begin()
    errors = [child._errors for child in pool.children]
    pipes = [pipe for child in pool.children for pipe in (child._process.stdin, child._process.stdout)]
    pool.close()
    assert all(stream.closed for stream in (*errors, *pipes))
    assert [child._process for child in pool.children] == [None, None]
    pool.close()


@pytest.mark.parametrize(
    "error",
    [
        MemoryError("Unable to allocate 2.60 MiB"),
        OSError(12, "Cannot allocate memory"),
        ImportError("libXau.so: failed to map segment from shared object"),
        RuntimeError("can't start new thread"),
    ],
)
def test_short_memory_ends_a_run_with_4_and_its_manifest_says_so(tmp_path, monkeypatch, capsys, error):
    def fail(*_, **__):
        raise error

    folder = tmp_path / "run"
    monkeypatch.setattr("knittest.runs.execute.run_specimen", fail)
    assert run(["tensile", *QUICK, "--out", str(folder)]) == 4
    assert status(folder) == ("failed", 4)
    assert "out of memory: free memory" in capsys.readouterr().err
    monkeypatch.setattr("knittest.cli.system.schema.callback", fail)
    assert run(["schema"]) == 4


def test_a_memory_limit_below_the_need_of_the_libraries_is_refused_before_they_are_loaded(tmp_path):
    """They would abort (exit code 134), exit with 1, or wait for ever."""
    command = 'ulimit -v 600000; exec "$0" -m knittest.cli.main tensile --variant 1 --scale macro --out run'
    found = subprocess.run(
        ["bash", "-c", command, sys.executable], cwd=tmp_path, capture_output=True, text=True,
        env=os.environ | {"PYTHONPATH": str(PACKAGE.parent)},
    )  # fmt: skip
    assert found.returncode == 4 and "limited to 0.61 GB; numerical libraries need 1 GB" in found.stderr
    assert not (tmp_path / "run").exists()


def test_resume_leaves_out_what_the_run_left_out(tmp_path, monkeypatch):
    """Both directions, of which the second had not begun when the command was killed."""
    run_folder = tmp_path / "run"
    assert run(["tensile", *QUICK, "--no-pictures", "--no-frames", "--out", str(run_folder)]) in (0, 3)
    assert json.loads((run_folder / "manifest.json").read_text())["left_out"] == ["frames", "pictures"]
    seen, both = [], tmp_path / "both"
    for direction in ("warp", "weft"):
        folder = ended_run(both / direction, direction=direction)
        (both / f"config-{direction}.yaml").write_text((folder / "config.yaml").read_text())
    (both / "warp/manifest.json").write_text('{"status": "failed", "exit_code": 4, "left_out": ["pictures"]}')
    for file in (both / "weft").iterdir():
        file.unlink()
    monkeypatch.setattr("knittest.studies.command._run_jobs", lambda jobs, options, parent: seen.append(options) or [])
    assert run(["resume", str(both)]) == 0
    assert [(options.pictures, options.frames) for options in seen] == [(False, True)]
    assert not (both / "report.html").exists()


def test_both_directions_refuse_a_folder_that_holds_something_else(tmp_path, monkeypatch, capsys):
    """``--out configs`` would lay run folders beside the fabrics."""
    monkeypatch.setattr("knittest.studies.command._run_jobs", lambda jobs, *_: [])
    (tmp_path / "fabrics").mkdir()
    both = ["tensile", *(word for word in QUICK if word not in ("--direction", "warp")), "--out", str(tmp_path)]
    assert run(both) == 2 and [file.name for file in tmp_path.iterdir()] == ["fabrics"]
    assert "holds fabrics, which is no file of this run; choose a new folder" in capsys.readouterr().err
