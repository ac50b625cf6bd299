"""Published results as tidy tables of means and standard deviations, and shipped studies of the model itself."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.files import data_dir, tidy_rows
from knittest.config.sources import NUMBERED
from knittest.experiment.conditions import EXACT, SIZES, UNKNOWN, Conditions, conditions_of

Array = NDArray[np.float64]
TENSILE = ("peak_force_n", "fracture_strain_pct")


@dataclass(frozen=True)
class PublishedValue:
    """One row: mean and standard deviation (NaN: not stated) of ``n`` specimens (0: not stated) in ``unit``.

    ``table`` is the citation that a reader is shown, ``file`` where the row stands, ``conditions`` are the sizes that
    rows of the same file state for its variant and direction, such as ``strip_width_mm``; ``scaled`` says for which
    other size it stands. Results of specimens that are modelled smaller or larger than that size are multiplied by
    ``factors``, one a specimen.
    """

    quantity: str
    mean: float
    sd: float
    n: int
    unit: str
    table: str
    conditions: Conditions = UNKNOWN
    file: str = ""
    scaled: str = ""
    factors: tuple[float, ...] = ()


def published(
    folder: Path, variant: str, direction: str, quantities: tuple[str, ...] = TENSILE
) -> list[PublishedValue]:
    """Rows of ``variant`` and ``direction``, or of no direction, in all tables of ``folder``, in the order of
    ``quantities``.

    Raises :class:`InputError` for a missing folder, a wrong header, a value that is no number and sizes that
    contradict each other.
    """
    found = {}
    for path, rows in groupby(tidy_rows(folder), key=lambda row: row[0]):
        own = [
            (line, row) for _, line, row in rows if row["variant"] == variant and row["direction"] in (direction, "")
        ]
        conditions = _conditions(path, own)
        for line, row in own:
            if row["quantity"] in quantities:
                found[row["quantity"]] = _value(path, line, row, conditions)
    return [found[q] for q in quantities if q in found]


def _conditions(path: Path, rows: Iterable[tuple[int, dict[str, str]]]) -> Conditions:
    """Sizes that ``rows`` of one table state."""
    texts: dict[str, tuple[str, str]] = {}
    for line, row in rows:
        name, where = row["quantity"], f"{path}:{line}"
        if name not in SIZES:
            continue
        if row["unit"] != SIZES[name].unit:
            raise InputError(f"{where}: {name}: unit = {row['unit']!r}; expected {SIZES[name].unit}")
        if name in texts and texts[name][0] != row["mean"]:
            raise InputError(f"{where}: {name}: {row['mean']}, but {texts[name][1]} states {texts[name][0]}")
        texts[name] = row["mean"], where
    return conditions_of(texts)


def for_width(row: PublishedValue, width: float) -> PublishedValue:
    """``row`` of a strip, whose mean grows with its width, for a strip of ``width`` [mm], and said so.

    Raises :class:`InputError` where the table states no width.
    """
    own = row.conditions.strip_width_mm
    if own is None:
        raise InputError(
            f"{row.file}: the strip width of {row.quantity} is unknown; add a row strip_width_mm [mm] for this variant "
            "and direction (knittest data import --width writes it)"
        )
    if math.isclose(own, width, rel_tol=EXACT):
        return row
    scaled = replace(row, mean=row.mean * width / own, sd=row.sd * width / own)
    return with_note(scaled, f"scaled from {own:g} to {width:g} mm")


def with_note(row: PublishedValue, note: str) -> PublishedValue:
    """``row`` with ``note`` on how it was scaled, which stands behind its citation as well."""
    if not note:
        return row
    return replace(row, table=f"{row.table}, {note}", scaled=", ".join(filter(None, (row.scaled, note))))


def with_factors(row: PublishedValue, factors: Sequence[float], what: str) -> PublishedValue:
    """``row`` beside results that are multiplied by ``factors``, one a specimen; ``what`` says why in words, and the
    row says it too. Without factors the row as it is.
    """
    if not factors:
        return row
    return with_note(replace(row, factors=tuple(factors)), factor_note(factors, what))


def factor_note(factors: Sequence[float], what: str) -> str:
    """Statement that simulated numbers are multiplied by ``factors``, and why.

    >>> factor_note([1.025], "20 yarns modelled, 20.5 in the real strip")
    'simulated x 1.025: 20 yarns modelled, 20.5 in the real strip'
    """
    different = sorted({f"{factor:.4g}" for factor in factors}, key=float, reverse=True)
    return f"simulated x {' or '.join(different)}: {what}"


def left_out(rows: Iterable[tuple[PublishedValue, str]]) -> list[str]:
    """One line for each reason why ``rows`` are not compared, with their names and file; a row without one is."""
    found: dict[str, list[PublishedValue]] = {}
    for row, reason in rows:
        if reason:
            found.setdefault(reason, []).append(row)
    return [
        f"not compared: {', '.join(one.quantity for one in same)} ({same[0].file.rpartition(':')[0]}): {reason}"
        for reason, same in found.items()
    ]


def _value(path: Path, line: int, row: dict[str, str], conditions: Conditions) -> PublishedValue:
    try:
        return PublishedValue(
            row["quantity"],
            float(row["mean"]),
            float(row["sd"] or "nan"),
            int(row["n"] or 0),
            row["unit"],
            row["table"],
            conditions,
            f"{path}:{line}",
        )
    except ValueError as error:
        raise InputError(f"{path}:{line}: {row['quantity']}: expected numbers for mean, sd and n ({error})") from None


# Studies of the model itself, shipped as tables: what its speed and an unpublished coefficient do to its results.
#
# They were simulated, with the fabrics and settings their heads name, and are shown beside a run; nothing is judged by
# them.

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
