"""Runs of the soak: small cases of every test and a batch as processes, what they leave, who is left behind."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MARK = "KNITTEST_SOAK"
OFTEN = ("--set", "output.checkpoint_interval=0.05", "--set", "output.frames=3")
SMALL = ("--preset", "quick", "--threads", "1", "--quiet", *OFTEN)
SHELLS, YARNS = ("--scale", "macro"), ("--scale", "meso")
WARP = ("--direction", "warp")
#: seconds after which a process that was left behind counts as such, and in which one must follow a signal
GONE, PROMPT = 20.0, 5.0

SWEEP = """
base: {test: tensile, variant: 1, scale: macro, preset: quick, direction: warp,
       set: {solver.speed: 1.0, output.checkpoint_interval: 0.05}}
grid: {rig.width: [20, 30, 40, 50]}
"""


@dataclass(frozen=True)
class Case:
    """A command that takes some seconds; ``files`` are those whose bits must not depend on how often it was stopped."""

    name: str
    arguments: tuple[str, ...]
    files: str = "curve.csv energies.csv"

    @property
    def is_batch(self) -> bool:
        return self.arguments[0] == "batch"

    def first(self, out: Path) -> list[str]:
        return [*self.arguments, "--out", str(out)]

    def again(self, out: Path) -> list[str]:
        """The command that goes on; the first one where there is nothing to go on with."""
        if self.is_batch or not (out / "config.yaml").is_file():
            return self.first(out)
        return ["resume", str(out), "--threads", "1", "--quiet"]

    def results(self, out: Path) -> dict[str, bytes]:
        found = (path for name in self.files.split() for path in out.rglob(name))
        return {str(path.relative_to(out)): path.read_bytes() for path in found}


def cases(folder: Path) -> list[Case]:
    sweep = folder / "sweep.yaml"
    sweep.write_text(SWEEP)
    strip = ("--set", "rig.width=10", "--set", "rig.gauge_length=10", "--set", "solver.ramp=0.1")
    blank = ("--set", "model.macro.element_size=20", "--set", "rig.depth=10")
    yarns = (*YARNS, *WARP, *SMALL, *strip, "--set", "solver.speed=0.5")
    return [
        Case("tensile of shells", ("tensile", "--variant", "2", *SHELLS, *WARP, *SMALL, "--set", "solver.speed=0.3")),
        Case("tensile of yarns", ("tensile", "--variant", "2", *yarns)),
        Case("picture frame", ("picture-frame", "--variant", "1", *SHELLS, *SMALL, "--set", "rig.side=50")),
        Case("cantilever", ("cantilever", "--variant", "1", *SHELLS, *WARP, *SMALL)),
        Case("friction", ("friction", "--variant", "1", *SHELLS, *WARP, *SMALL, "--set", "rig.travel=3")),
        Case("forming", ("forming", "--variant", "1", *SHELLS, *SMALL, *blank)),
        Case("batch", ("batch", str(sweep), "--workers", "2", "--threads", "1", "--quiet"), "curve.csv"),
    ]  # fmt: skip


@dataclass
class World:
    """A folder to soak in and the environment of its processes; ``whole`` is what each case comes to left alone."""

    folder: Path
    whole: dict[str, "Whole"] = field(default_factory=dict)

    def environment(self, mark: str, **more: str) -> dict[str, str]:
        return os.environ | {"PYTHONPATH": str(ROOT), MARK: mark} | more

    def start(self, arguments: list[str], mark: str, **more: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-m", "knittest.cli.main", *arguments], env=self.environment(mark, **more), text=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
        )  # fmt: skip

    def shell(self, text: str, mark: str, **more: str) -> subprocess.CompletedProcess[str]:
        """Run ``text`` in bash, in which ``$KNITTEST`` is the command."""
        command = f"{sys.executable} -m knittest.cli.main"
        return subprocess.run(
            ["bash", "-c", text], env=self.environment(mark, KNITTEST=command, **more), text=True, capture_output=True
        )

    def leave_alone(self, case: Case) -> None:
        """Run ``case`` twice in one go: the kernels are compiled by then, and the second tells how long it takes."""
        for turn in range(2):
            out = self.folder / "whole" / f"{case.name}-{turn}"
            began = time.monotonic()
            process = self.start(case.first(out), "whole")
            _, error = process.communicate()
            if process.returncode not in (0, 3):
                raise SystemExit(f"{case.name} left alone: {process.returncode}: {error}")
            self.whole[case.name] = Whole(process.returncode, time.monotonic() - began, case.results(out))


@dataclass(frozen=True)
class Whole:
    """Exit code, seconds and results of a case that nobody disturbed."""

    code: int
    seconds: float
    results: dict[str, bytes]


def left_behind(mark: str) -> list[int]:
    """Processes of ``mark`` that live on for longer than :data:`GONE` seconds; they are ended."""
    end = time.monotonic() + GONE
    while living := [pid for pid in _all() if _is_of(pid, mark)]:
        if time.monotonic() > end:
            for pid in living:
                os.kill(pid, signal.SIGKILL)
            return living
        time.sleep(0.1)
    return []


def catches(pid: int, number: int) -> bool:
    """Tell whether the process has a handler of its own for the signal."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return True  # it has ended
    caught = next((line for line in status.splitlines() if line.startswith("SigCgt")), "SigCgt: 0").split()[1]
    return bool(int(caught, 16) >> (number - 1) & 1)


def _all() -> list[int]:
    return [int(path.name) for path in Path("/proc").iterdir() if path.name.isdigit()]


def _is_of(pid: int, mark: str) -> bool:
    try:
        if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
            return False
        return f"{MARK}={mark}\0".encode() in Path(f"/proc/{pid}/environ").read_bytes() + b"\0"
    except OSError:
        return False
