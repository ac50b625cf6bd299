"""Small runs as processes, stopped in the middle."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import knittest

ROOT = Path(knittest.__file__).resolve().parents[1]
OFTEN = ("--set", "output.checkpoint_interval=0.02", "--set", "output.frames=3")
#: shells without contact whose yarns bend in the plane, some 0.3 s of simulation
MACRO = (
    "--variant", "2", "--scale", "macro", "--preset", "quick", "--direction", "warp", "--set", "solver.speed=0.3",
    "--set", "fabric.macro.in_plane_bending.warp=4", "--set", "fabric.macro.in_plane_bending.weft=4",
)  # fmt: skip
#: yarns with contact that break one after the other, some 0.5 s of simulation
MESO = (
    "--variant", "2", "--scale", "meso", "--preset", "quick", "--direction", "warp", "--set", "rig.width=10",
    "--set", "rig.gauge_length=10", "--set", "solver.ramp=0.1", "--set", "solver.speed=0.5",
)  # fmt: skip
CASES = {"macro": MACRO, "meso": MESO}


def start(*arguments, threads=1, cwd=None) -> subprocess.Popen:
    """A quiet ``knittest`` process without pictures."""
    options = ("--quiet", "--no-pictures", "--threads", str(threads))
    command = [sys.executable, "-m", "knittest.cli.main", *arguments, *options]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        command, cwd=cwd, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def finish(process: subprocess.Popen) -> tuple[int, str]:
    """Exit code and what it said on stderr."""
    _, error = process.communicate(timeout=120)
    return process.returncode, error


def run(*arguments, **options) -> tuple[int, str]:
    return finish(start(*arguments, **options))


def stop(process: subprocess.Popen, folder: Path, *signals: int, checkpoints: int = 2, delay: float = 0.0) -> tuple:
    """Send ``signals`` ``delay`` seconds after the process has written as many checkpoints; exit code and stderr."""
    last = max(numbers(folder), default=0) + checkpoints
    while process.poll() is None and max(numbers(folder), default=0) < last:
        time.sleep(0.002)
    time.sleep(delay)
    assert process.poll() is None, f"ended before it could be stopped: {process.communicate()}"
    for number in signals:
        process.send_signal(number)
    return finish(process)


def numbers(folder: Path) -> list[int]:
    """Numbers of the checkpoints of a run of one specimen in ``folder``."""
    return sorted(int(path.stem.split("-")[2]) for path in folder.glob("checkpoint-[0-9]*.npz"))


def checkpoint(folder: Path, number: int, specimen: int = 0) -> Path:
    """File of checkpoint ``number`` of ``specimen``."""
    return folder / f"checkpoint-{specimen:04d}-{number:04d}.npz"


def resumed_at(folder: Path) -> list[float]:
    """Simulated time [ms] from which the run in ``folder`` went on, each time that it did; 0 where it began anew."""
    log = [json.loads(line) for line in (folder / "log.jsonl").read_text().splitlines()]
    return [line["at_ms"] for line in log if line["event"] == "resumed"]


def results(folder: Path) -> dict[str, bytes]:
    """The files whose bits must not depend on how often a run was stopped, frames with their jaws among them."""
    frames = sorted((folder / "frames").glob("*.vtu"))
    assert {"fixed-jaw-0000.vtu", "moving-jaw-0000.vtu"} <= {path.name for path in frames}
    files = [folder / "curve.csv", folder / "energies.csv", folder / "frames.pvd", *frames]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}
