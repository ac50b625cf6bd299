"""Stops small runs of every test and a batch in every way, many times, and sees that nothing is lost or left behind.

    python benchmarks/soak.py > soak.md                    # 200 kills, 200 signals: an hour or so
    python benchmarks/soak.py --kills 14 --signals 0 --scenes head

Every run that was stopped goes on to its end and is compared bit by bit with one left alone. Exits with 1 when anything
was wrong, which stands below the table.
"""

import argparse
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from soak_scenes import SCENES
from soak_stops import Tally, soak_case
from soak_world import PROMPT, Case, World, cases


def main(arguments: list[str] | None = None) -> int:
    """Print the table and what was wrong."""
    asked = _options().parse_args(arguments)
    with tempfile.TemporaryDirectory(prefix="knittest-soak-", ignore_cleanup_errors=True) as name:
        world = World(Path(name))
        chosen = [case for case in cases(world.folder) if asked.only in case.name]
        for case in chosen:
            _note(f"{case.name}, left alone")
            world.leave_alone(case)
        rows, wrong = [], []
        for row, found in (*_stops(world, chosen, asked), *_scenes(world, chosen, asked)):
            _note(f"{row}: {found or 'right'}")
            rows.append(row)
            wrong += found
    print("| disturbed by | times | on | what came of it |\n|---|---|---|---|")
    print("\n".join(rows))
    print("\n".join(f"- {text}" for text in wrong), file=sys.stderr)
    return 1 if wrong else 0


def _options() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--signals", type=int, default=200)
    parser.add_argument("--scenes", default="", help="only scenes with this word in their name; none: no scene")
    parser.add_argument("--only", default="", help="only cases with this word in their name")
    parser.add_argument("--at-once", type=int, default=2, help="cases that are stopped side by side")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kept", action="store_true", help="stop nothing before it has something to go on from")
    return parser


def _stops(world: World, chosen: list[Case], asked: argparse.Namespace):
    """A row for the kills and one for the signals, shared out among the cases."""
    for kills, total in ((True, asked.kills), (False, asked.signals)):
        if not total:
            continue
        shares = [total // len(chosen) + (k < total % len(chosen)) for k in range(len(chosen))]
        with ThreadPoolExecutor(asked.at_once) as threads:
            work = partial(soak_case, world, seed=asked.seed, kills=kills, kept=asked.kept)
            tallies = list(threads.map(work, chosen, shares))
        yield _row(kills, tallies, len(chosen)), [text for tally in tallies for text in tally.wrong]


def _row(kills: bool, tallies: list[Tally], count: int) -> str:
    stopped, ended = sum(t.stopped for t in tallies), sum(t.ended for t in tallies)
    wrong, late = sum(len(t.wrong) for t in tallies), sum(t.late for t in tallies)
    prompt = f"; slowest answer {max(t.slowest for t in tallies):.1f} s, {late} over {PROMPT:g} s"
    what = "SIGKILL" if kills else "SIGTERM, SIGINT, SIGUSR1, a third twice"
    came = f"{ended} runs to their end, {wrong} wrong{'' if kills else prompt}"
    return f"| {what}, at a random moment | {stopped} | {count} cases | {came} |"


def _scenes(world: World, chosen: list[Case], asked: argparse.Namespace):
    for name, scene in SCENES.items():
        if asked.scenes == "none" or asked.scenes not in name:
            continue
        began = time.monotonic()
        count, wrong = scene(world, chosen)
        _note(f"{name}: {time.monotonic() - began:.0f} s")
        yield f"| {name} | {count} | | {count - len(wrong)} as left alone, {len(wrong)} wrong |", wrong


def _note(text: str) -> None:
    print(f"{time.strftime('%H:%M:%S')} {text}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
