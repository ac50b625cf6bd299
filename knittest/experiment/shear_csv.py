"""Reads a plain table of a picture frame: shear angle and force, their units in the names of the columns."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment.lab_rows import read_rows
from knittest.experiment.lab_units import decimal_mark, read_number
from knittest.materials.trellis import ANGLE, NORMALISED

Array = NDArray[np.float64]

#: angle [deg] below which a simulated frame's force is that of its start: at half its speed it halves there, the rest
#: stays
START = 5.0
#: names of the column of the force
FORCES = ("force_n", NORMALISED)


def read_shear(path: Path) -> tuple[Array, Array, str] | None:
    """Shear angle [deg], force and the force's name, None if no column is named ``shear_angle_deg``.

    Any delimiter and decimal mark. Raises :class:`InputError` with the row for text, gaps and angles that do not rise.
    """
    rows = read_rows(path)
    head = next((k for k, (_, cells) in enumerate(rows) if ANGLE in cells), None)
    if head is None:
        return None
    line, names = rows[head]
    force = next((name for name in FORCES if name in names), None)
    if force is None:
        raise InputError(f"{path}:{line}: beside {ANGLE}: expected one of the columns {', '.join(FORCES)}")
    body = rows[head + 1 :]
    mark = decimal_mark(path, [cell for _, cells in body for cell in cells])
    columns = names.index(ANGLE), names.index(force)
    values = np.array(
        [[read_number(path, n, cells[c] if c < len(cells) else "", mark) for c in columns] for n, cells in body]
    )
    if len(values) < 3:
        raise InputError(f"{path}: {len(values)} points; at least three are needed")
    falls = np.flatnonzero(np.diff(values[:, 0]) <= 0.0)
    if len(falls):
        raise InputError(
            f"{path}:{body[falls[0] + 1][0]}: {ANGLE} must rise from row to row: give the first loading alone"
        )
    return values[:, 0], values[:, 1], force
