"""Throughput of a batch on two workers over that on one: quick tensile runs of the shells, one thread each.

    python benchmarks/batch.py --runs 20 --turns 3

One and two workers take turns. Where others use the machine, two workers cannot be twice as fast; so what the workers
waited for a core (the run delay of Linux' scheduler) is measured, too, and a ratio without it is printed.
"""

import argparse
import statistics
import tempfile
import time
from pathlib import Path

from knittest.config.loading import resolve
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.runner import TrialRunner
from knittest.studies.trials.trial import Trial, trial_of


def trials(count: int) -> list[Trial]:
    """Strips of slightly different widths: none is known, all cost the same."""
    settings = [f"rig.width={50.0 + 0.01 * k}" for k in range(count)]
    return [
        trial_of(resolve(variant="1", scale="macro", preset="quick", direction="warp", sets=[text]))
        for text in settings
    ]


def waited(pool: LocalPool) -> float:
    """Seconds that the processes of ``pool`` have waited for a core, mean of all."""
    pids = [child.pid for child in pool.children]
    return statistics.fmean(int(Path(f"/proc/{pid}/schedstat").read_text().split()[1]) for pid in pids) * 1e-9


def measured(workers: int, todo: list[Trial]) -> tuple[float, float, float]:
    """Wall time of all [s]; runs a second after each worker has started, as they were and without waits for a core."""
    began, ends, waits = time.perf_counter(), [], []
    pool = LocalPool(workers, threads=1)
    with tempfile.TemporaryDirectory() as folder, TrialRunner(Path(folder), pool, limit=600.0) as runner:
        for record in runner.run(todo):
            assert record.status == "completed", record.reason
            ends.append(time.perf_counter() - began)
            waits.append(waited(pool))
    spent, lost, runs = ends[-1] - ends[workers - 1], waits[-1] - waits[workers - 1], len(todo) - workers
    return ends[-1], runs / spent, runs / (spent - lost)


def main() -> None:
    """Print each turn and the medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--turns", type=int, default=3)
    asked = parser.parse_args()
    todo = trials(asked.runs)
    measured(1, todo[:2])  # compiles
    ratios = []
    for turn in range(1, asked.turns + 1):
        one, two = measured(1, todo), measured(2, todo)
        ratios.append((one[0] / two[0], two[1] / one[1], two[2] / one[2]))
        print(
            f"turn {turn}: {asked.runs} runs in {one[0]:.1f} and {two[0]:.1f} s, {ratios[-1][0]:.2f} times; after the "
            f"start {one[1]:.2f} and {two[1]:.2f} runs/s, {ratios[-1][1]:.2f} times; without waits for a core "
            f"{one[2]:.2f} and {two[2]:.2f} runs/s, {ratios[-1][2]:.2f} times",
            flush=True,
        )
    whole, steady, free = (statistics.median(values) for values in zip(*ratios, strict=True))
    print(f"median: {whole:.2f} times, {steady:.2f} after the start, {free:.2f} without waits for a core")


if __name__ == "__main__":
    main()
