"""Random kills and signals: a command is stopped and gone on with until it ends, to the bits of one left alone."""

import json
import random
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from soak_world import PROMPT, Case, World, catches, left_behind

#: waits for the moment of a stop, about so many seconds
Wait = Callable[[Any, float], None]
SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1)
INTERRUPTED = 75


@dataclass
class Tally:
    """Counts of stops and ends of a case, its slowest answer to a signal [s], how many were late, and what is wrong."""

    stopped: int = 0
    ended: int = 0
    slowest: float = 0.0
    late: int = 0
    wrong: list[str] = field(default_factory=list)
    #: how long the case takes [s], followed as the machine is busy or not
    seconds: float = 0.0


def soak_case(world: World, case: Case, stops: int, seed: int, kills: bool, kept: bool = False) -> Tally:
    """Stop ``case`` so often, in as many runs as that takes, each to its end; ``kept``: after a first checkpoint."""
    dice = random.Random(f"{case.name} {seed} {kills}")
    tally = Tally(seconds=world.whole[case.name].seconds)
    turn = 0
    while tally.stopped < stops:
        turn += 1
        out = world.folder / ("kills" if kills else "signals") / f"{case.name}-{seed}-{turn}"
        wait = partial(_wait_for_a_checkpoint, out) if kept else _wait
        _to_its_end(world, case, out, dice, stops, kills, tally, wait)
    return tally


def _to_its_end(
    world: World, case: Case, out: Path, dice: random.Random, stops: int, kills: bool, tally: Tally, wait: Wait
) -> None:
    whole, mark = world.whole[case.name], f"{out.parent.name}-{out.name}"
    while True:
        process = world.start(case.again(out), mark)
        if tally.stopped < stops:
            began = time.monotonic()
            _wait_until_it_listens(process)
            wait(process, dice.uniform(0.0, 1.2 * tally.seconds))
            tally.seconds *= 1.03
            if process.poll() is not None:
                tally.seconds = time.monotonic() - began
        if tally.stopped < stops and process.poll() is None:
            tally.stopped += 1
            ended = _kill(process) if kills else _signal(process, out, dice, tally, whole.code)
        else:
            _, error = process.communicate()
            ended = True
            if process.returncode != whole.code:
                tally.wrong.append(f"{out}: ended with {process.returncode}, not {whole.code}: {error.strip()[-300:]}")
        if behind := left_behind(mark):
            tally.wrong.append(f"{out}: {len(behind)} processes left behind")
        if ended:
            break
    tally.ended += 1
    if case.results(out) != whole.results:
        tally.wrong.append(f"{out}: other results than left alone")
    if not case.is_batch and _status(out) != "completed":
        tally.wrong.append(f"{out}: {_status(out)} at the end")


def _kill(process) -> bool:
    process.kill()
    process.communicate()
    return False


def _signal(process, out: Path, dice: random.Random, tally: Tally, code: int) -> bool:
    """Send one signal, or two; returns whether the command had come to its end all the same."""
    sent = dice.choices(SIGNALS, k=2 if dice.random() < 0.3 else 1)
    began = time.monotonic()
    process.send_signal(sent[0])
    if len(sent) > 1:
        _wait(process, 0.05)
        process.send_signal(sent[1])
    _, error = process.communicate()
    taken = time.monotonic() - began
    tally.slowest, tally.late = max(tally.slowest, taken), tally.late + (taken > PROMPT)
    if process.returncode == code:
        return True
    names = [signal.Signals(number).name for number in sent]
    said = any(f"stopped by {name}" in error for name in names) and "Traceback" not in error  # of two, either is first
    if process.returncode != INTERRUPTED or not said:
        tally.wrong.append(f"{out}: {', '.join(names)} ended it with {process.returncode}: {error.strip()[-300:]}")
    if _status(out) == "running":
        tally.wrong.append(f"{out}: running for ever")
    return False


def _wait_until_it_listens(process) -> None:
    """The interpreter itself has no handlers for the first tenth of a second."""
    while not catches(process.pid, signal.SIGTERM) and process.poll() is None:
        time.sleep(0.002)


def _wait(process, seconds: float) -> None:
    end = time.monotonic() + seconds
    while process.poll() is None and time.monotonic() < end:
        time.sleep(0.002)


def _wait_for_a_checkpoint(out: Path, process, seconds: float) -> None:
    """Wait for something to go on from that was not there before, however long that takes."""
    before = set(out.rglob("checkpoint-0*.npz"))
    while process.poll() is None and not set(out.rglob("checkpoint-0*.npz")) - before:
        time.sleep(0.002)


def _status(out: Path) -> str:
    try:
        return str(json.loads((out / "manifest.json").read_text())["status"])
    except FileNotFoundError:
        return "not there"
