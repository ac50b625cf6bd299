"""Small trials, and ways to disturb the processes that run them."""

import json
import threading
import time
from pathlib import Path

from knittest.config.loading import resolve
from knittest.studies.trials.trial import Trial, trial_of

#: shells, a second or so; some ten of it at SLOW
QUICK, SLOW = 4.0, 0.1


def trial(width: float = 50.0, speed: float = QUICK, *sets: str) -> Trial:
    """A tensile trial of shells that a quality gate refuses at QUICK speed."""
    settings = [f"rig.width={width}", f"solver.speed={speed}", "output.checkpoint_interval=0.1", *sets]
    return trial_of(resolve(variant="1", scale="macro", preset="quick", direction="warp", sets=settings), f"{width} mm")


def process_in(folder: Path, checkpoint: bool = False) -> int:
    """Process id of the one that runs in ``folder``, once there is one that has written a ``checkpoint``.

    It compiles first where no kernels are kept, on a busy machine for minutes.
    """
    end = time.monotonic() + 240.0
    while time.monotonic() < end:
        time.sleep(0.01)
        if checkpoint and not list(folder.glob("checkpoint-[0-9]*.npz")):
            continue
        try:
            return int(json.loads((folder / "run.lock").read_text())["pid"])
        except (OSError, ValueError, KeyError):
            continue
    raise AssertionError(f"nobody runs in {folder}")


def meanwhile(act) -> threading.Thread:
    """Do ``act`` while a trial runs."""
    thread = threading.Thread(target=act, daemon=True)
    thread.start()
    return thread


def gone(pid: int, seconds: float = 20.0) -> bool:
    """Tell whether the process ends within ``seconds``."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        state = Path(f"/proc/{pid}/stat")
        if not state.exists() or state.read_text().rpartition(")")[2].split()[0] == "Z":
            return True
        time.sleep(0.05)
    return False
