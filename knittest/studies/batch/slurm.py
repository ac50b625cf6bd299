"""Script of a job array of Slurm that runs a sweep in shares."""

import math
import shlex
import sys
from pathlib import Path

from knittest.base.atomic import write_atomic
from knittest.base.errors import InputError

SCRIPT = "batch.slurm"
#: seconds beside the runs of a share: start, kernels, table
UPKEEP = 300.0
#: seconds before the end of the time at which Slurm asks the runs to save themselves
WARNED = 120
TEMPLATE = """#!/bin/bash
#SBATCH --job-name={name}
#SBATCH --array=1-{shares}
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task={cores}
#SBATCH --time={time}
#SBATCH --signal=B:TERM@{warned}
#SBATCH --output={log}
# {runs} runs in {shares} shares, {limit:g} s a run at most. Submit it again to go on: finished runs are not repeated.
set -eu
cd {here}
exec {command} --shard "${{SLURM_ARRAY_TASK_ID}}/{shares}"
"""


def write_script(sweep: Path, folder: Path, shares: int, runs: int, limit: float, each: tuple[int, int]) -> Path:
    """Write the script for ``shares`` of ``runs`` of at most ``limit`` seconds into ``folder``; returns its path.

    ``each``: processes of a share, and threads of each of them. Raises :class:`InputError` for more shares than runs.
    """
    if shares > runs:
        raise InputError(f"--slurm {shares}: more shares than the {runs} runs of {sweep}; expected at most {runs}")
    workers, threads = each
    command = [
        str(Path(sys.executable).with_name("knittest")), "batch", str(sweep.resolve()), "--out", str(folder.resolve()),
        "--workers", str(workers), "--threads", str(threads), "--quiet", "--yes",
    ]  # fmt: skip
    text = TEMPLATE.format(
        name=folder.name, shares=shares, runs=runs, limit=limit, cores=workers * threads, warned=WARNED,
        time=_clock(math.ceil(math.ceil(runs / shares) / workers) * limit + UPKEEP),
        log=folder.resolve() / "slurm-%a.log", here=shlex.quote(str(Path.cwd())), command=shlex.join(command),
    )  # fmt: skip
    path = folder / SCRIPT
    write_atomic(path, text)
    return path


def _clock(seconds: float) -> str:
    """``seconds`` as hours:minutes:seconds."""
    whole = math.ceil(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"
