"""Paired throughput of two checkouts: the same command-line runs in turns, under the same load."""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError, NumericalError
from knittest.base.files import PACKAGE

#: the runs by name: both models, loops and inlays, bending shells
CASES = {
    "tensile, meso": "tensile --variant 2 --scale meso --direction warp --set rig.width=20 --set rig.gauge_length=40",
    "frame, meso": "picture-frame --variant 2 --scale meso --set rig.max_angle=10",
    "tensile, macro": "tensile --variant 1 --scale macro --direction warp",
    "frame, macro": "picture-frame --variant 1 --scale macro",
}
COMMON = ("--preset", "quick", "--threads", "1", "--quiet", "--no-frames", "--out")
START = "from knittest.cli.main import main; main()"
#: exit codes of completed runs: quality checks passed or failed
VALID_EXIT_CODES = (0, NumericalError.exit_code)


@dataclass(frozen=True)
class TimedRun:
    """One run: element-steps per second, CPU time [s], and curve (rows, columns)."""

    speed: float
    cpu: float
    curve: np.ndarray


def check_checkout(path: Path) -> Path:
    """Folder of another checkout, with the package ``knittest`` in it; raises :class:`InputError`."""
    if not (path / "knittest" / "cli" / "main.py").is_file():
        raise InputError(f"--against {path}: expected a checkout of knittest, with knittest/cli/main.py")
    return path.resolve()


def paired_lines(against: Path, pairs: int) -> Iterator[str]:
    """Speed of this checkout over the speed of ``against``, a line for each case, on one thread.

    Each case runs once to fill the caches, then ``pairs`` times in turns. Ratios are medians with their range. Raises
    :class:`InputError` for a run that does not complete.
    """
    here, there = PACKAGE.parent, check_checkout(against)
    yield f"speed of this checkout over {against}: {pairs} pairs, one thread; above 1: this checkout is faster"
    yield f"{'run':<17}{'M steps/s':>10}  {'ratio of the steps':<23}{'of CPU time':<13}curve"
    for name, command in CASES.items():
        for place in (there, here):
            _time_run(place, command)
        turns = [(_time_run(there, command), _time_run(here, command)) for _ in range(pairs)]
        ratios = [new.speed / old.speed for old, new in turns]
        faster = f"{statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"
        speed = statistics.median(new.speed for _, new in turns)
        leaner = statistics.median(old.cpu / new.cpu for old, new in turns)
        differing = difference_text(*(t.curve for t in turns[0]))
        yield f"{name:<17}{1e-6 * speed:>10.3g}  {faster:<23}{leaner:<13.2f}{differing}"


def difference_text(old: np.ndarray, new: np.ndarray) -> str:
    """Largest difference of two curves as text, in percent of the largest value of its column."""
    if old.shape != new.shape:
        return f"{len(new)} rows, not {len(old)}"
    if np.array_equal(old, new, equal_nan=True):
        return "identical"
    if not np.array_equal(np.isnan(old), np.isnan(new)):
        return "gaps differ"
    largest = np.maximum(np.nanmax(np.abs(old), axis=0), np.finfo(float).tiny)
    return f"off by {100.0 * float(np.nanmax(np.abs(new - old) / largest)):.1g} %"


def _time_run(place: Path, command: str) -> TimedRun:
    """Run ``command`` in a process of the checkout at ``place``; raises :class:`InputError` with its last output."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        done = subprocess.run(
            [sys.executable, "-c", START, *command.split(), *COMMON, str(out)],
            env=os.environ | {"PYTHONPATH": str(place)}, cwd=folder, capture_output=True, encoding="utf-8", check=False,
        )  # fmt: skip
        if done.returncode not in VALID_EXIT_CODES:
            raise InputError(f"{place}: knittest {command}: exit code {done.returncode}: {done.stderr.strip()[-500:]}")
        cost = json.loads((out / "summary.json").read_text(encoding="utf-8"))["cost"]
        curve = np.genfromtxt(out / "curve.csv", delimiter=",", skip_header=1, ndmin=2)
    return TimedRun(cost["element_steps_per_s"], cost["cpu_s"], curve)
