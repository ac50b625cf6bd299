"""CSV of the forces of both directions over both strains."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.files import read_regular
from knittest.base.units import to_kernel
from knittest.materials.biaxial_table import BiaxialTable

MAX_BYTES = 10_000_000
COLUMNS = ("strain_warp_pct", "strain_weft_pct", "force_warp_n_per_mm", "force_weft_n_per_mm")
#: largest strains [%] on either side
LOWEST, HIGHEST = -95.0, 500.0
#: fewest strains of a direction
FEWEST = 4


def read_biaxial(path: Path) -> BiaxialTable:
    """Read the table in ``path``; raises :class:`InputError` with line, column and value for what is no such table."""
    try:
        lines = read_regular(path, MAX_BYTES, "a table has fewer rows").decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise InputError(f"{path}: is no text; expected a CSV with the columns {', '.join(COLUMNS)}") from None
    body = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    names = [cell.strip() for cell in body[0][1].split(",")] if body else []
    if tuple(names) != COLUMNS:
        at = body[0][0] if body else 1
        raise InputError(f"{path}:{at}: {','.join(names) or 'no header'}; expected the header {','.join(COLUMNS)}")
    rows: dict[tuple[float, float], tuple[float, float]] = {}
    for line, text in body[1:]:
        warp, weft, *force = _read_row(path, line, text)
        if (warp, weft) in rows:
            raise InputError(f"{path}:{line}: a second row of {_pair(warp, weft)}; expected one")
        rows[warp, weft] = force[0], force[1]
    return table_of(str(path), rows)


def _read_row(path: Path, line: int, text: str) -> list[float]:
    cells = [cell.strip() for cell in text.split(",")]
    if len(cells) != len(COLUMNS):
        raise InputError(f"{path}:{line}: {len(cells)} cells; expected {len(COLUMNS)}: {','.join(COLUMNS)}")
    values = []
    for name, cell in zip(COLUMNS, cells, strict=True):
        try:
            value = float(cell)
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            raise InputError(f"{path}:{line}: {name} = {cell!r}; expected a finite number")
        if name.startswith("strain") and not LOWEST <= value <= HIGHEST:
            raise InputError(f"{path}:{line}: {name} = {value:g} %; expected {LOWEST:g} to {HIGHEST:g} %")
        values.append(value)
    return values


def _pair(warp: float, weft: float) -> str:
    return f"{COLUMNS[0]} = {warp:g}, {COLUMNS[1]} = {weft:g}"


def table_of(where: str, rows: Mapping[tuple[float, float], tuple[float, float]]) -> BiaxialTable:
    """Grid of ``rows``, strains of warp and weft [%] and their forces [N/mm].

    Raises :class:`InputError`, which begins with ``where``, for a pair of strains that is missing but at an end.
    """
    warp, weft = (sorted({pair[i] for pair in rows}) for i in range(2))
    for name, along in zip(COLUMNS, (warp, weft), strict=False):
        if len(along) < FEWEST or 0.0 not in along:
            raise InputError(f"{where}: {len(along)} different {name}; expected at least {FEWEST}, 0 among them")
    if (0.0, 0.0) not in rows:
        raise InputError(f"{where}: no row of {_pair(0.0, 0.0)}; expected it")
    force = np.array([[rows.get((a, b), (np.nan, np.nan)) for b in weft] for a in warp])
    known = np.isfinite(force[..., 0])
    for grid, along, pairs in (
        (known, warp, lambda i, j: (warp[i], weft[j])), (known.T, weft, lambda i, j: (warp[j], weft[i])),
    ):  # fmt: skip
        for i in range(len(along)):
            found = np.flatnonzero(grid[i])
            if (gaps := np.flatnonzero(np.diff(found) > 1)).size:
                raise InputError(
                    f"{where}: no row of {_pair(*pairs(i, int(found[gaps[0]]) + 1))}; expected a row for each pair of "
                    "strains. Only a corner that the fabric cannot reach may be missing"
                )
    return BiaxialTable(to_kernel(1.0, "%") * np.array(warp), to_kernel(1.0, "%") * np.array(weft), force)
