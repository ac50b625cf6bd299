"""Studies of uncertainty whose trials are formulas instead of simulations."""

import json
from pathlib import Path

import numpy as np
from calibration_cases import Pretending

from knittest.studies.uncertainty import command, indices
from knittest.studies.uncertainty.command import StudyOptions, run_uncertainty

#: two fabrics, a quantity at two places of an axis with its ratio, one number, and a statement
STUDY = """
base: {test: picture-frame, scale: meso, preset: quick, parameters: calibrated, set: {rig.max_angle: 45}}
fabrics:
  V1: {variant: 1}
  V2: {variant: 2}
differing_fields: [fabric.loop_length, fabric.weft_density, fabric.area_mass, fabric.thickness, fabric.reinforcing]
parameters:
  fabric.contact.friction_coefficient: {low: 0.1, high: 0.5, reason: glass on carbon as handbooks have it}
  fabric.knitting.degree_of_set: {low: 0.5, high: 1.0, reason: loops of a knit that was never heat-set}
quantities:
  force: {result: shear_force_n_at_deg, at: [10, 20], axis: "shear angle [deg]", unit: N, ratios: [[V2, V1]]}
  onset: {result: wrinkle_onset_deg, unit: deg}
statements:
  V2 below V1: {quantity: force, of: V2, below: V1}
samples: 16
"""


def values(trial) -> tuple[float, float]:
    """Friction and degree of set of a trial."""
    fabric = trial.run.fabric
    return fabric.contact.friction_coefficient.value, fabric.knitting.degree_of_set.value


def shearing(trial) -> dict[str, float]:
    """A frame that is linear in friction, and in V2 lower by what is not set."""
    friction, degree = values(trial)
    lower = 2.0 * (1.0 - degree) if trial.run.fabric.name == "pham2019-v2" else 0.3
    forces = {f"shear_force_n_at_deg.{a}": a / 10.0 * (1.0 + 10.0 * friction - lower) for a in (10, 20)}
    return {**forces, "wrinkle_onset_deg": 40.0}


def study(text: str, folder: Path, monkeypatch, pool=None, drawn=False) -> int:
    """Exit code of the study ``text`` in ``folder``; pictures and page only where they are to be ``drawn``."""
    if not drawn:
        monkeypatch.setattr(command, "draw_pictures", lambda found, folder: [])
        monkeypatch.setattr(command, "write_if_possible", lambda folder, write: None)
    monkeypatch.setattr(indices, "RESAMPLES", 99)
    (folder / "u.yaml").write_text(text)
    monkeypatch.chdir(folder)
    monkeypatch.setattr(command, "LocalPool", lambda workers, threads: pool or Pretending(shearing))
    return run_uncertainty(Path("u.yaml"), StudyOptions(quiet=True)).exit_code


def outcome(folder: Path) -> dict:
    """uncertainty.json of the study in ``folder``."""
    return json.loads((folder / "runs/uncertainty-u/uncertainty.json").read_text())


def ishigami(points: np.ndarray) -> np.ndarray:
    """Function of Ishigami and Homma (1990), a = 7, b = 0.1, at ``points`` (..., 3) of the unit cube."""
    x = np.pi * (2.0 * points - 1.0)
    return np.sin(x[..., 0]) + 7.0 * np.sin(x[..., 1]) ** 2 + 0.1 * x[..., 2] ** 4 * np.sin(x[..., 0])


def variable(folder: Path, name: str) -> dict:
    """The variable ``name`` of the study in ``folder``."""
    (found,) = [one for one in outcome(folder)["variables"] if one["name"] == name]
    return found
