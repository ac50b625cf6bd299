"""Published results as tidy tables of means and standard deviations, and shipped studies of the model."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.files import data_dir, read_tidy_rows
from knittest.config.sources import NUMBERED
from knittest.experiment.conditions import EXACT, SIZES, UNKNOWN, Conditions, conditions_of

Array = NDArray[np.float64]
TENSILE = ("peak_force_n", "fracture_strain_pct")


@dataclass(frozen=True)
class PublishedValue:
    """One row: mean and standard deviation (NaN: not stated) of ``n`` specimens (0: not stated) in ``unit``.

    ``table`` is the citation, ``file`` the place of the row, ``conditions`` are the sizes stated for its variant and
    direction, such as ``strip_width_mm``, and ``scaled`` is a note on scaling. Results of specimens of other size are
    multiplied by ``factors``, one for each specimen.
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


def published_rows(
    folder: Path, variant: str, direction: str, quantities: tuple[str, ...] = TENSILE
) -> list[PublishedValue]:
    """Rows of ``variant`` and ``direction``, or without direction, in ``folder``, in the order of ``quantities``.

    Raises :class:`InputError` for a missing folder, a wrong header, a value that is no number and contradicting sizes.
    """
    found = {}
    for path, rows in groupby(read_tidy_rows(folder), key=lambda row: row[0]):
        directions = (direction, "")
        own = [(n, row) for _, n, row in rows if row["variant"] == variant and row["direction"] in directions]
        conditions = _read_conditions(path, own)
        for line, row in own:
            if row["quantity"] in quantities:
                where = f"{path}:{line}"
                try:
                    mean, sd, n = float(row["mean"]), float(row["sd"] or "nan"), int(row["n"] or 0)
                except ValueError as error:
                    text = f"{where}: {row['quantity']}: expected numbers for mean, sd and n ({error})"
                    raise InputError(text) from None
                values = (row["quantity"], mean, sd, n, row["unit"], row["table"])
                found[row["quantity"]] = PublishedValue(*values, conditions, where)
    return [found[q] for q in quantities if q in found]


def _read_conditions(path: Path, rows: Iterable[tuple[int, dict[str, str]]]) -> Conditions:
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


def scale_to_width(row: PublishedValue, width: float) -> PublishedValue:
    """Scale ``row`` of a strip to a ``width`` [mm], with a note; raises :class:`InputError` without a width."""
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
    """Add ``note`` on how ``row`` was scaled, also to its citation."""
    if not note:
        return row
    return replace(row, table=f"{row.table}, {note}", scaled=", ".join(filter(None, (row.scaled, note))))


def with_factors(row: PublishedValue, factors: Sequence[float], what: str) -> PublishedValue:
    """Add ``factors`` of the results, one for each specimen, to ``row``, with a note that ``what`` is the reason."""
    return with_note(replace(row, factors=tuple(factors)), factor_note(factors, what)) if factors else row


def factor_note(factors: Sequence[float], what: str) -> str:
    """State that simulated numbers are multiplied by ``factors``, and why.

    >>> factor_note([1.025], "20 yarns modelled, 20.5 in the real strip")
    'simulated x 1.025: 20 yarns modelled, 20.5 in the real strip'
    """
    different = sorted({f"{factor:.4g}" for factor in factors}, key=float, reverse=True)
    return f"simulated x {' or '.join(different)}: {what}"


def rejected_row_lines(rows: Iterable[tuple[PublishedValue, str]]) -> list[str]:
    """Write a line for each reason why ``rows`` are not compared; a row without a reason is compared."""
    found: dict[str, list[PublishedValue]] = {}
    for row, reason in rows:
        if reason:
            found.setdefault(reason, []).append(row)
    return [
        f"not compared: {', '.join(one.quantity for one in same)} ({same[0].file.rpartition(':')[0]}): {reason}"
        for reason, same in found.items()
    ]


# Shipped studies of the model: effects of the speed and of an unpublished coefficient. They were simulated with the
# fabrics and settings in their heads. They are shown with a run and serve no comparison.

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
    """Shear stress [N/mm] of a meso cell at ``angle`` [deg] for priors of assumed parameters: 5, 50 and 95 % quantiles
    of ``count`` results of ``points`` runs.
    """

    angle: float
    low: float
    middle: float
    high: float
    count: int
    points: int


def shear_bands(fabric: str) -> list[ShearBand]:
    """Bands of ``fabric`` by rising angle; empty for one that was not studied."""
    rows = _read_study(SHEAR_BANDS, fabric).sort_values("shear_angle_deg")
    return [ShearBand(r.shear_angle_deg, r.p5, r.p50, r.p95, r.count, r.points) for r in rows.itertuples(index=False)]


def friction_curves(fabric: str) -> list[FrictionCurve]:
    """Picture frames of the yarns of ``fabric``, by rising coefficient; empty for one that was not swept."""
    groups = _read_study(YARN_FRICTION, fabric).groupby("friction_coefficient")
    return [FrictionCurve(float(mu), one[ANGLE].to_numpy(float), one[FORCE].to_numpy(float)) for mu, one in groups]


def speed_rows(test: str, scale: str, fabric: str) -> list[SpeedRow]:
    """Study of ``test`` at ``scale`` with ``fabric``; empty if there is none."""
    table = _read_study(SPEED, fabric)
    of = table[(table["test"] == test) & (table["scale"] == scale)]
    names = ["variant", "preset", "setting", "unit", "value", "quantity", "result", "result_half"]
    return [SpeedRow(*row) for row in of[names].itertuples(index=False)]


def _read_study(name: str, fabric: str) -> Any:
    """Return the rows of ``fabric``; those with a variant state it by its number."""
    import pandas as pd

    table = pd.read_csv(data_dir() / FOLDER / name, comment="#", dtype={"variant": str})
    return table[(table["variant"].replace(NUMBERED) if "variant" in table else table["fabric"]) == fabric]
