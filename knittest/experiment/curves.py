"""Reference curves: CSV files whose header says what kind of curve they hold."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from knittest.errors import InputError
from knittest.experiment.lab_csv import read_lab
from knittest.experiment.shear_csv import ANGLE, read_shear
from knittest.reading import read_regular
from knittest.resources import data_dir

Array = NDArray[np.float64]
Kind = Literal["measured", "digitised", "reconstructed", "simulated", "input"]
MAX_BYTES = 10_000_000


@dataclass(frozen=True)
class ReferenceCurve:
    """Curve ``mean`` over ``x``, (n,) each, with its scatter ``sd`` if known; names hold the units.

    ``stated_peak`` is the mean of the specimens' own peaks (x, y), where the mean curve ends before it; ``note`` says
    what was taken for granted.
    """

    kind: Kind
    x: Array
    mean: Array
    sd: Array | None
    x_name: str
    y_name: str
    source: str
    stated_peak: tuple[float, float] | None = None
    note: str = ""

    @property
    def peak(self) -> tuple[float, float]:
        """Peak (x, y) to judge by: the stated one, or that of the curve."""
        top = int(np.argmax(self.mean))
        return self.stated_peak or (float(self.x[top]), float(self.mean[top]))


def find_curve(path: Path) -> ReferenceCurve:
    """:func:`load_curve` of ``path``, or of that file in the shipped data."""
    return load_curve(located(path))


def located(path: Path) -> Path:
    """``path`` if it is a file, else the one of that name in the shipped data, if there is one."""
    shipped = data_dir() / path
    return shipped if not path.exists() and shipped.is_file() else path


def load_curve(path: Path) -> ReferenceCurve:
    """Read a curve CSV: ``# kind: ...`` comment lines, a header row, then x, y and optionally the sd of y.

    A file without ``# kind`` is read as a laboratory's, with either decimal mark, and taken as measured. Raises
    :class:`InputError` naming file and line for an unknown kind, text, NaN or an x that does not rise.
    """
    try:
        lines = read_regular(path, MAX_BYTES, "a curve has fewer points").decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return _plain(path)
    notes = {}
    for line in lines:
        if line.startswith("#"):
            key, _, value = line[1:].partition(":")
            notes[key.strip()] = value.strip()
    if "kind" not in notes:
        return _plain(path)
    kind = notes["kind"]
    if kind not in get_args(Kind):
        raise InputError(f"{path}:1: # kind: {kind}; expected one of {', '.join(get_args(Kind))}")
    body = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if len(body) < 3:
        raise InputError(f"{path}: a curve needs a header and at least two points")
    names = body[0][1].split(",")
    if len(names) < 2:
        raise InputError(f"{path}:{body[0][0]}: {names[0]!r}: expected the names of two columns, separated by a comma")
    rows = np.array([_row(path, n, line, len(names)) for n, line in body[1:]])
    falls = np.flatnonzero(np.diff(rows[:, 0]) <= 0.0)
    if len(falls):
        raise InputError(f"{path}:{body[falls[0] + 2][0]}: {names[0]} must rise from row to row")
    sd = rows[:, 2] if rows.shape[1] > 2 else None
    peak = _stated_peak(path, notes)
    return ReferenceCurve(
        kind, rows[:, 0], rows[:, 1], sd, names[0], names[1], notes.get("source", path.name), peak  # type: ignore[arg-type]
    )  # fmt: skip


def _plain(path: Path) -> ReferenceCurve:
    """A curve of a user's own: a column of strain or shear angle and one of force."""
    note = "the file has no '# kind:' line: taken as measured"
    sheared = read_shear(path)
    if sheared is not None:
        angle, force, name = sheared
        return ReferenceCurve("measured", angle, force, None, ANGLE, name, path.name, note=note)
    specimens = read_lab(path)
    if len(specimens) > 1:
        raise InputError(f"{path}: {len(specimens)} specimens; knittest data import makes one curve of them")
    (one,) = specimens
    return ReferenceCurve("measured", one.strain, one.force, None, "strain_pct", "force_n", path.name, note=note)


def _stated_peak(path: Path, notes: dict[str, str]) -> tuple[float, float] | None:
    texts = [notes.get(name) for name in ("fracture_strain_pct", "peak_force_n")]
    if None in texts:
        return None
    strain, force = (_row(path, 1, str(text), 1)[0] for text in texts)
    return strain, force


def _row(path: Path, number: int, line: str, columns: int) -> list[float]:
    cells = line.split(",")
    try:
        values = [float(cell) for cell in cells]
    except ValueError:
        values = []
    if len(cells) != columns or len(values) != columns or not np.isfinite(values).all():
        raise InputError(f"{path}:{number}: {line!r}: expected {columns} finite numbers")
    return values
