"""Throughput of a batch on two workers over that on one: quick tensile runs of the shells, one thread each.

    python benchmarks/batch.py --runs 20 --turns 3

One and two workers take turns. What others take of the machine meanwhile is measured (Linux): two workers cannot be
twice as fast where a core is taken, so a median is printed of the turns that had the machine to themselves, too.
"""

import argparse
import os
import statistics
import tempfile
import time
from pathlib import Path

from knittest.config.loading import resolve
from knittest.trials.pool import LocalPool
from knittest.trials.runner import TrialRunner
from knittest.trials.trial import Trial, trial_of

#: cores that others may take of a machine one has to oneself
ALONE = 0.1


def trials(count: int) -> list[Trial]:
    """Strips of slightly different widths: none is known, all cost the same."""
    settings = [f"rig.width={50.0 + 0.01 * k}" for k in range(count)]
    return [
        trial_of(resolve(variant="1", scale="macro", preset="quick", direction="warp", sets=[text]))
        for text in settings
    ]


def moments(workers: int, todo: list[Trial]) -> list[float]:
    """When each of ``todo`` was done [s]; processes start and load their kernels in this time."""
    began, ends = time.perf_counter(), []
    with (
        tempfile.TemporaryDirectory() as folder,
        TrialRunner(Path(folder), LocalPool(workers, threads=1), limit=600.0) as runner,
    ):
        for record in runner.run(todo):
            assert record.status == "completed", record.reason
            ends.append(time.perf_counter() - began)
    return ends


def taken() -> float:
    """Seconds of processor time that all processes of the machine have taken."""
    user, nice, system, _, _, irq, softirq, steal = map(int, Path("/proc/stat").read_text().split()[1:9])
    return (user + nice + system + irq + softirq + steal) / os.sysconf("SC_CLK_TCK")


def own() -> float:
    """Seconds of processor time that this process and those it ended have taken."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def main() -> None:
    """Print each turn and the medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--turns", type=int, default=3)
    asked = parser.parse_args()
    todo = trials(asked.runs)
    moments(1, todo[:1])  # compiles
    whole, steady, others = [], [], []
    for turn in range(1, asked.turns + 1):
        began, busy = time.perf_counter(), taken() - own()
        one, two = moments(1, todo), moments(2, todo)
        others.append((taken() - own() - busy) / (time.perf_counter() - began))
        rates = [(asked.runs - n) / (ends[-1] - ends[n - 1]) for n, ends in ((1, one), (2, two))]  # after the start
        whole.append(one[-1] / two[-1])
        steady.append(rates[1] / rates[0])
        print(
            f"turn {turn}: {asked.runs} runs in {one[-1]:.1f} s and {two[-1]:.1f} s, {whole[-1]:.2f} times as fast; "
            f"after the start {rates[0]:.2f} and {rates[1]:.2f} runs/s, {steady[-1]:.2f} times; "
            f"others took {others[-1]:.2f} cores",
            flush=True,
        )
    alone = [k for k, cores in enumerate(others) if cores < ALONE]
    for name, turns in (("all turns", range(asked.turns)), (f"the {len(alone)} turns alone", alone)):
        if turns:
            ratios = [statistics.median(values[k] for k in turns) for values in (whole, steady)]
            print(f"median of {name}: {ratios[0]:.2f} times, {ratios[1]:.2f} after the start")


if __name__ == "__main__":
    main()
