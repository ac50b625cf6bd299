"""Paired throughput of two checkouts: the same runs from the command line, by turns, under the same load."""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError, NumericalError
from knittest.base.files import PACKAGE

#: the runs by name: both models, loops and inlays, bending shells
CASES = {
    "strip of yarns": "tensile --variant 2 --scale meso --direction warp --set rig.width=20 --set rig.gauge_length=40",
    "frame of yarns": "picture-frame --variant 2 --scale meso --set rig.max_angle=10",
    "strip of shells": "tensile --variant 1 --scale macro --direction warp",
    "frame of shells": "picture-frame --variant 1 --scale macro",
}
COMMON = ("--preset", "quick", "--threads", "1", "--quiet", "--no-frames", "--out")
START = "from knittest.cli.main import main; main()"
#: exit codes of runs that have run to their end: passed, comparison refused
ENDED = (0, NumericalError.exit_code)


@dataclass(frozen=True)
class Timed:
    """One run: element-steps a second of its steps, CPU time of the whole [s], its curve, (rows, columns)."""

    speed: float
    cpu: float
    curve: np.ndarray


def checkout(path: Path) -> Path:
    """Folder that holds the package ``knittest`` of another checkout; raises :class:`InputError`."""
    if not (path / "knittest" / "cli" / "main.py").is_file():
        raise InputError(f"--against {path}: expected a checkout of knittest, a folder that holds knittest/cli/main.py")
    return path.resolve()


def paired_lines(against: Path, pairs: int) -> Iterator[str]:
    """Speed of this checkout over that of the one in ``against``, a line for each case; one thread each.

    Every run happens once for its compilation and its cell, then ``pairs`` times by turns. Ratios are medians, with
    the least and the largest behind them. Raises :class:`InputError` for a run that does not reach its end.
    """
    here, there = PACKAGE.parent, checkout(against)
    yield f"this checkout over {against}, {pairs} pairs, one thread; above 1: this one is faster"
    yield f"{'run':<17}{'M steps/s':>10}  {'ratio of the steps':<23}{'of CPU time':<13}curve"
    for name, command in CASES.items():
        for place in (there, here):
            _timed(place, command)
        turns = [(_timed(there, command), _timed(here, command)) for _ in range(pairs)]
        faster = _spread([new.speed / old.speed for old, new in turns])
        speed = statistics.median(new.speed for _, new in turns)
        leaner = statistics.median(old.cpu / new.cpu for old, new in turns)
        yield f"{name:<17}{1e-6 * speed:>10.3g}  {faster:<23}{leaner:<13.2f}{difference(*(t.curve for t in turns[0]))}"


def _spread(ratios: Sequence[float]) -> str:
    return f"{statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"


def difference(old: np.ndarray, new: np.ndarray) -> str:
    """Largest difference of two curves in words, in percent of the largest value of its column.

    Curves that are not numbers in the same places differ by that.
    """
    if old.shape != new.shape:
        return f"{len(new)} rows for {len(old)}"
    if np.array_equal(old, new, equal_nan=True):
        return "the same"
    if not np.array_equal(np.isnan(old), np.isnan(new)):
        return "other gaps"
    largest = np.maximum(np.nanmax(np.abs(old), axis=0), np.finfo(float).tiny)
    return f"off by {100.0 * float(np.nanmax(np.abs(new - old) / largest)):.1g} %"


def _timed(place: Path, command: str) -> Timed:
    """Run ``command`` in a process of the checkout at ``place``; raises :class:`InputError` with what it said."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        done = subprocess.run(
            [sys.executable, "-c", START, *command.split(), *COMMON, str(out)],
            env=os.environ | {"PYTHONPATH": str(place)}, cwd=folder, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode not in ENDED:
            raise InputError(f"{place}: knittest {command}: exit code {done.returncode}: {done.stderr.strip()[-500:]}")
        cost = json.loads((out / "summary.json").read_text(encoding="utf-8"))["cost"]
        curve = np.genfromtxt(out / "curve.csv", delimiter=",", skip_header=1, ndmin=2)
    return Timed(cost["element_steps_per_s"], cost["cpu_s"], curve)
