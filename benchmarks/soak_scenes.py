"""One-off disturbances: cold starts at once, closed streams and pipes, warnings as errors, lost workers, clocks."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from soak_world import Case, World, left_behind

#: what is wrong, one text each; empty when all is right
Wrong = list[str]

CALIBRATION = """
base: {variant: 1, scale: macro, preset: quick}
parameters:
  fabric.macro.bending_stiffness.warp: {low: 2, high: 12, spacing: log}
tests:
  bend: {test: cantilever, direction: warp, set: {rig.mode: overhang}}
targets:
  - {test: bend, quantity: overhang_mm, value: 171, sd: 51}
method: optuna
tolerance: 0.5
max_runs: 30
"""

#: the real-time clock, an hour back from the third second of a process on; what a step of ntpd or an admin does
CLOCK = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <sys/time.h>
#include <time.h>
static int (*real)(clockid_t, struct timespec *);
static time_t begin;
int clock_gettime(clockid_t id, struct timespec *at) {
    if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
    int code = real(id, at);
    if (id == CLOCK_REALTIME || id == CLOCK_REALTIME_COARSE) {
        if (!begin) begin = at->tv_sec;
        if (at->tv_sec > begin + 2) at->tv_sec -= 3600;
    }
    return code;
}
time_t time(time_t *out) {
    struct timespec at;
    clock_gettime(CLOCK_REALTIME, &at);
    if (out) *out = at.tv_sec;
    return at.tv_sec;
}
int gettimeofday(struct timeval *out, void *zone) {
    struct timespec at;
    clock_gettime(CLOCK_REALTIME, &at);
    out->tv_sec = at.tv_sec;
    out->tv_usec = at.tv_nsec / 1000;
    return 0;
}
"""


def judged(world: World, case: Case, out: Path, code: int, error: str, mark: str) -> Wrong:
    """Differences from the case left alone."""
    whole, wrong = world.whole[case.name], []
    if code != whole.code or "Traceback" in error or "internal error" in error:
        wrong.append(f"{out.name}: {case.name}: {code}, not {whole.code}: {error.strip()[-300:]}")
    if case.results(out) != whole.results:
        wrong.append(f"{out.name}: {case.name}: other results than left alone")
    if left_behind(mark):
        wrong.append(f"{out.name}: {case.name}: processes left behind")
    return wrong


def cold_starts(world: World, cases: list[Case], count: int = 8) -> tuple[int, Wrong]:
    """So many processes at once on an empty cache, which none of them has compiled."""
    cache = world.folder / "cold"
    started = []
    for k in range(count):
        out = world.folder / f"cold-{k}"
        started.append((out, world.start(cases[0].first(out), f"cold-{k}", KNITTEST_CACHE_DIR=str(cache))))
    wrong = []
    for out, process in started:
        _, error = process.communicate()
        wrong += judged(world, cases[0], out, process.returncode, error, out.name)
    shutil.rmtree(cache)
    return count, wrong


def in_shell(name: str, text: str, **more: str) -> Callable[[World, list[Case]], tuple[int, Wrong]]:
    """A scene of every case: ``text`` for bash, in which ``RUN`` is its command; the last line is the code."""

    def scene(world: World, cases: list[Case]) -> tuple[int, Wrong]:
        wrong: Wrong = []
        for number, case in enumerate(cases):
            out = world.folder / f"{name}-{number}"
            line = " ".join(f"'{argument}'" for argument in case.first(out) if argument != "--quiet")
            done = world.shell(f"RUN() {{ $KNITTEST {line}; }}\n{text}", out.name, **more)
            code = int(done.stdout.strip().splitlines()[-1])
            wrong += judged(world, case, out, code, done.stderr, out.name)
        return len(cases), wrong

    return scene


def closed_streams(world: World, cases: list[Case]) -> tuple[int, Wrong]:
    """stdin, stdout, stderr and all three closed before the start."""
    total, wrong = 0, []
    for name, closing in (("in", "<&-"), ("out", ">&-"), ("err", "2>&-"), ("all", "<&- >&- 2>&-")):
        count, found = in_shell(f"closed-{name}", f"(RUN {closing}); echo $?")(world, cases)
        total, wrong = total + count, wrong + found
    return total, wrong


def clock_back(world: World, cases: list[Case]) -> tuple[int, Wrong]:
    """The clock jumps back by an hour while every case runs."""
    library = world.folder / "clock.so"
    (world.folder / "clock.c").write_text(CLOCK)
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, world.folder / "clock.c", "-ldl"], check=True)
    work = "import time; a = time.time(); time.sleep(3.2); print(int(a - time.time()))"
    done = subprocess.run([sys.executable, "-c", work], env=os.environ | {"LD_PRELOAD": str(library)}, text=True,
                          capture_output=True, check=True)  # fmt: skip
    assert 3590 < int(done.stdout) < 3600, "the clock does not jump"
    return in_shell("clock", "RUN; echo $?", LD_PRELOAD=str(library))(world, cases)


def lost_worker(world: World, cases: list[Case]) -> tuple[int, Wrong]:
    """One of two Dask workers is killed while a batch runs on them."""
    (case,) = (c for c in cases if c.is_batch)
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{one.getsockname()[1]}"
    options = ("--nworkers", "1", "--nthreads", "1", "--host", "127.0.0.1", "--no-dashboard", "--no-nanny")

    def dask(*arguments: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-m", "dask", *arguments], env=world.environment("dask"), start_new_session=True,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    place = ("--local-directory", str(world.folder / "dask"))
    cluster = [dask("scheduler", "--host", "127.0.0.1", "--port", address.rpartition(":")[2], "--no-dashboard")]
    time.sleep(5.0)
    cluster += [dask("worker", address, *options, *place) for _ in range(2)]
    out = world.folder / "on-dask"
    keep = [a for a in case.first(out) if a not in ("--workers", "2")]
    process = world.start([*keep, "--dask", address], "on-dask")
    while process.poll() is None and not list(out.glob("trials/*/checkpoint-0*.npz")):
        time.sleep(0.01)
    lost = process.poll() is None
    cluster[1].kill()
    _, error = process.communicate()
    for one_of_them in cluster:
        if one_of_them.poll() is None:
            os.killpg(one_of_them.pid, signal.SIGKILL)
        one_of_them.wait()
    wrong = [] if lost else ["the batch had ended before a worker was lost"]
    return 1, wrong + judged(world, case, out, process.returncode, error, "on-dask")


def two_on_one_study(world: World, cases: list[Case]) -> tuple[int, Wrong]:
    """Two processes on one Optuna study, and two studies in one database."""
    file = world.folder / "bend.yaml"
    file.write_text(CALIBRATION)
    command = ["calibrate", str(file), "--workers", "1", "--threads", "1", "--quiet"]
    wrong: Wrong = []
    shared = f"sqlite:///{world.folder / 'shared.db'}"
    same, own = world.folder / "one-study", [world.folder / f"study-{k}" for k in range(2)]
    for name, outs, more, codes in (
        ("one study", [same, same], [], [0, 4]), ("one database", own, ["--storage", shared], [0, 0]),
    ):  # fmt: skip
        both = [world.start([*command, "--out", str(out), *more], name) for out in outs]
        said = [process.communicate()[1] for process in both]
        found = sorted(process.returncode for process in both)
        if found != codes or any("internal" in text or "Traceback" in text for text in said):
            wrong.append(f"{name}: {found}, expected {codes}: {' | '.join(text.strip()[-200:] for text in said)}")
        if left_behind(name):
            wrong.append(f"{name}: processes left behind")
    found_values = [json.loads((out / "calibration.json").read_text())["parameters"] for out in (same, *own)]
    if any(values != found_values[0] for values in found_values):
        wrong.append("the same search came to other parameters")
    return 4, wrong


SCENES = {
    "cold starts at once on an empty cache": cold_starts,
    "closed stdin, stdout, stderr, all three": closed_streams,
    "`| head -1`": in_shell("head", "RUN | head -1 > /dev/null; echo ${PIPESTATUS[0]}"),
    "`PYTHONWARNINGS=error`": in_shell("warnings", "RUN; echo $?", PYTHONWARNINGS="error"),
    "a Dask worker killed": lost_worker,
    "two processes on one Optuna study, and on one database": two_on_one_study,
    "a clock that jumps back by an hour": clock_back,
}
