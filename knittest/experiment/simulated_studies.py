"""Studies of the model itself, shipped as tables: what its speed and an unpublished coefficient do to its results.

They were simulated, with the fabrics and settings their heads name, and are shown beside a run; nothing is judged by
them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.resources import data_dir
from knittest.config.sources import NUMBERED

Array = NDArray[np.float64]

FOLDER = "simulated"
SPEED, YARN_FRICTION, SHEAR_BANDS = "speed-study.csv", "yarn-friction.csv", "shear-bands.csv"
ANGLE, FORCE = "frame_shear_angle_deg", "normalised_shear_force_n_per_mm"


@dataclass(frozen=True)
class FrictionCurve:
    """Normalised shear force [N/mm] over the frame's angle [deg], (n,), at one yarn-yarn friction coefficient."""

    coefficient: float
    angle: Array
    force: Array


@dataclass(frozen=True)
class SpeedRow:
    """A result at a ``setting`` of ``value`` [``unit``], and at half of it; NaN where a run gave none."""

    variant: str
    preset: str
    setting: str
    unit: str
    value: float
    quantity: str
    result: float
    half: float


@dataclass(frozen=True)
class ShearBand:
    """Shear stress [N/mm] of a cell of yarns at ``angle`` [deg] over the prior of what nobody measured: 5, 50 and 95 %
    of the ``count`` of ``points`` that gave a number.
    """

    angle: float
    low: float
    middle: float
    high: float
    count: int
    points: int


def shear_bands(fabric: str) -> list[ShearBand]:
    """Bands of ``fabric`` by rising angle; empty for one that was not studied."""
    found = _table(SHEAR_BANDS)
    rows = found[found["fabric"] == fabric].sort_values("shear_angle_deg")
    return [ShearBand(r.shear_angle_deg, r.p5, r.p50, r.p95, r.count, r.points) for r in rows.itertuples(index=False)]


def friction_curves(fabric: str) -> list[FrictionCurve]:
    """Picture frames of the yarns of ``fabric``, by rising coefficient; empty for one that was not swept."""
    table = _table(YARN_FRICTION)
    of = table[_fabrics(table) == fabric]
    return [
        FrictionCurve(float(mu), one[ANGLE].to_numpy(float), one[FORCE].to_numpy(float))
        for mu, one in of.groupby("friction_coefficient")
    ]


def speed_rows(test: str, scale: str, fabric: str) -> list[SpeedRow]:
    """The study of ``test`` at ``scale`` with ``fabric``; empty where there is none."""
    table = _table(SPEED)
    of = table[(table["test"] == test) & (table["scale"] == scale) & (_fabrics(table) == fabric)]
    return [
        SpeedRow(r.variant, r.preset, r.setting, r.unit, r.value, r.quantity, r.result, r.result_half)
        for r in of.itertuples()
    ]


def _fabrics(table: Any) -> Any:
    """Names of the fabrics of the rows, which state them by their number."""
    return table["variant"].replace(NUMBERED)


def _table(name: str) -> Any:
    import pandas as pd

    return pd.read_csv(data_dir() / FOLDER / name, comment="#", dtype={"variant": str})
