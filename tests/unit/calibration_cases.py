"""Calibrations whose trials are formulas instead of simulations."""

import json
import signal
from pathlib import Path

import numpy as np

from knittest.studies.calibrate import command
from knittest.studies.calibrate.command import CalibrateOptions, run_calibration
from knittest.studies.trials.trial import Record

BEND = """
base: {variant: 1, scale: macro, preset: quick}
parameters:
  fabric.macro.bending_stiffness.warp: {low: 2, high: 12, spacing: log}
tests:
  bend: {test: cantilever, direction: warp, set: {rig.mode: overhang}}
targets:
  - {test: bend, quantity: overhang_mm}
tolerance: 0.01
"""
#: stiffness [N mm] per overhang^3 of variant 1 by Eq. 2, B = w (L / 2)^3 with w = 824.2 g/m2 x 9.81 m/s2
EQ_2 = 824.2e-6 * 9.81e-3 / 8.0
#: stiffnesses at the overhangs of the two tests below
WARP, WEFT = EQ_2 * 171.0**3, EQ_2 * 151.0**3
#: two parameters of two tests
TWO = """
base: {variant: 1, scale: macro, preset: quick}
parameters:
  fabric.macro.bending_stiffness.warp: {low: 1, high: 20, spacing: log, start: 2}
  fabric.macro.bending_stiffness.weft: {low: 1, high: 20}
tests:
  one: {test: cantilever, direction: warp, set: {rig.mode: overhang}}
  other: {test: cantilever, direction: weft, set: {rig.mode: overhang}}
targets:
  - {test: one, quantity: overhang_mm}
  - {test: other, quantity: overhang_mm, value: 151, sd: 15}
"""


def overhang(stiffness: float) -> float:
    """Overhang [mm] of a strip of ``stiffness`` [N mm] by Eq. 2."""
    return (stiffness / EQ_2) ** (1.0 / 3.0)


def stiffness(trial) -> float:
    """Bending stiffness of a trial along the warp [N mm]."""
    return trial.run.fabric.macro.bending_stiffness.warp.value


def bending(trial) -> dict[str, float]:
    """Results of a cantilever."""
    quantity = getattr(trial.run.fabric.macro.bending_stiffness, trial.run.direction)
    return {"overhang_mm": overhang(quantity.value), "chord_angle_deg": 41.5}


class Pretending:
    """A pool whose trials give ``results``, end as ``ends`` says, and leave the ``curve`` (x, y), if any."""

    def __init__(self, results=bending, ends=lambda trial: "completed", curve=None):
        self.asked: list[str] = []
        self._results, self._ends, self._curve = results, ends, curve

    def run(self, trials, place, limit, options, watch):
        for trial in trials:
            watch(trial, 0.0)
            self.asked.append(trial.key)
            status = self._ends(trial)
            if status != "completed":
                yield Record(trial.key, status, f"{status} on purpose", limit=limit)
                continue
            if self._curve is not None:
                place(trial).mkdir()
                rows = "\n".join(f"{x},{y}" for x, y in zip(*self._curve(trial), strict=True))
                (place(trial) / "curve.csv").write_text(f"strain_pct,force_n\n{rows}\n")
            summary = {"results": self._results(trial), "comparison": [], "refused": [], "quality": {}, "cost": {}}
            yield Record(trial.key, "completed", summary=summary)

    def close(self):
        pass


class Stopping(Pretending):
    """A pool that is interrupted by a signal when ``at`` trials were asked for."""

    def __init__(self, at: int, results=bending):
        super().__init__(results)
        self._at = at

    def run(self, *arguments):
        for record in super().run(*arguments):
            if len(self.asked) == self._at:
                signal.raise_signal(signal.SIGINT)
            yield record


def calibrate(text: str, folder: Path, monkeypatch, pool) -> int:
    """Exit code of the calibration ``text`` in ``folder``."""
    (folder / "c.yaml").write_text(text)
    monkeypatch.chdir(folder)
    monkeypatch.setattr(command, "LocalPool", lambda workers, threads: pool)
    return run_calibration(Path("c.yaml"), CalibrateOptions(quiet=True)).exit_code


def outcome(folder: Path) -> dict:
    """calibration.json of the calibration in ``folder``."""
    return json.loads((folder / "runs/calibrate-c/calibration.json").read_text())


def values(folder: Path) -> np.ndarray:
    """Values that were found (n,)."""
    return np.array([row["value"] for row in outcome(folder)["parameters"]])
