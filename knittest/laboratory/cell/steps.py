"""Paths of the mean deformation from CSV files."""

import csv
from math import isfinite
from pathlib import Path

from knittest.base.errors import InputError

HEADER = ["fraction", "f_xx", "f_xy", "f_yx", "f_yy"]
Row = tuple[float, float, float, float, float]


def read_steps(name: str) -> list[Row]:
    """Rows of the share of the time and the components of the mean gradient in file ``name``.

    Raises :class:`InputError` naming the line of what is wrong.
    """
    try:
        lines = list(csv.reader(Path(name).read_text(encoding="utf-8").splitlines()))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"rig.path = {name}: cannot be read as text: {error}") from None
    numbered = [(k, [v.strip() for v in line]) for k, line in enumerate(lines, 1) if any(v.strip() for v in line)]
    if not numbered or numbered[0][1] != HEADER:
        raise InputError(f"{name}, line 1: expected the header {','.join(HEADER)}")
    rows: list[Row] = []
    for number, line in numbered[1:]:
        rows.append(_row(f"{name}, line {number}", line, rows))
    if len(rows) < 2 or rows[-1][0] != 1.0:
        raise InputError(f"{name}: {len(rows)} rows; expected the start and more, the last of fraction 1")
    return rows


def _row(where: str, line: list[str], before: list[Row]) -> Row:
    try:
        values = [float(v) for v in line]
    except ValueError:
        raise InputError(f"{where}: {','.join(line)}: expected numbers") from None
    if len(values) != len(HEADER) or not all(isfinite(v) for v in values):
        raise InputError(f"{where}: {','.join(line)}: expected {len(HEADER)} finite numbers, {','.join(HEADER)}")
    fraction, xx, xy, yx, yy = values
    if not before and (fraction, xx, xy, yx, yy) != (0.0, 1.0, 0.0, 0.0, 1.0):
        raise InputError(f"{where}: the path begins with the fabric as it is: expected 0,1,0,0,1")
    if before and not before[-1][0] < fraction <= 1.0:
        raise InputError(f"{where}: fraction = {fraction:g}: expected more than {before[-1][0]:g}, and at most 1")
    if not xx * yy - xy * yx > 0.0:
        raise InputError(f"{where}: the gradient has the determinant {xx * yy - xy * yx:g}: expected more than 0")
    return fraction, xx, xy, yx, yy
