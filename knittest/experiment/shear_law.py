"""Homogenises a picture frame of yarns: its force as a shear law of the shells."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.errors import InputError
from knittest.experiment.shear_csv import ANGLE
from knittest.export.atomic import replacing
from knittest.trellis import to_conjugate

Array = NDArray[np.float64]

#: width of the steps over which the frame's force is averaged [deg]
STEP = 2.5
#: angle [deg] below which a frame's force is that of its start: at half its speed the hump there halves, the rest stays
START = 5.0
FRAME_ANGLE, NORMALISED = "frame_shear_angle_deg", "normalised_shear_force_n_per_mm"


def homogenised_law(angle: Array, normalised: Array) -> tuple[Array, Array]:
    """Angles [deg] and conjugate force S [N/mm], (n,), from a frame's angle [deg] and normalised force [N/mm].

    Means over steps of :data:`STEP`, from :data:`START` on, below it a line from (0, 0); the least change that lets
    none fall (isotonic regression). Only the first loading counts. S dgamma is the work per reference area.
    """
    from scipy.optimize import isotonic_regression

    first = slice(0, int(np.argmax(angle)) + 1)
    angle, force = angle[first], to_conjugate(normalised[first], np.deg2rad(angle[first]), "normalised")
    number = np.floor(angle / STEP).astype(int)
    used = [k for k in np.unique(number) if k * STEP >= START and np.count_nonzero(number == k) > 1]
    middle = np.array([angle[number == k].mean() for k in used])
    mean = np.array([force[number == k].mean() for k in used])
    level = isotonic_regression(np.maximum(mean, 0.0)).x
    return np.concatenate([[0.0], middle]), np.concatenate([[0.0], level])


def write_law(run: Path, out: Path) -> tuple[Array, Array]:
    """Read curve.csv of the picture-frame ``run`` and write its law to ``out``; returns it.

    Raises :class:`InputError` when the folder holds no such run or the frame went less than two steps.
    """
    import pandas as pd

    path = run / "curve.csv"
    if not path.is_file():
        raise InputError(f"{run}: no curve.csv; expected the folder of a finished picture-frame run")
    curve = pd.read_csv(path, comment="#")
    missing = [c for c in (FRAME_ANGLE, NORMALISED) if c not in curve]
    if missing:
        raise InputError(f"{path}: no column {missing[0]}; expected the curve of a picture-frame run")
    angle, force = homogenised_law(curve[FRAME_ANGLE].to_numpy(float), curve[NORMALISED].to_numpy(float))
    if len(angle) < 3:
        least = START + 2 * STEP
        raise InputError(f"{path}: the frame went to {angle[-1]:g} deg only; expected at least {least:g} deg")
    rows = "".join(f"{a:.4f},{s:.6f}\n" for a, s in zip(angle, force, strict=True))
    head = f"# kind: simulated\n# source: picture frame of yarns, {run.name}\n{ANGLE},shear_force_n_per_mm\n"
    with replacing(out) as temporary:
        temporary.write_text(head + rows, encoding="utf-8")
    return angle, force
