"""Relaxed cells on disk, keyed by their inputs and by the sources that relaxed them, with a checksum inside."""

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from knittest.base.cache import cache_folder
from knittest.base.kept import keep, kept
from knittest.base.notes import tell
from knittest.base.sealed import Damaged, checksum
from knittest.fabric.cell import SYSTEMS, Cell, CellSpec

#: what shapes a cell, beside its inputs
SOURCES = (
    "fabric/loop.py",
    "fabric/spline.py",
    "fabric/start.py",
    "fabric/relax.py",
    "fabric/topology.py",
    "kernels/relaxation.py",
    "kernels/section.py",
)
NUMBERS = ("deepest", "worst", "residual", "iterations")
DIGITS = 24


def cell_path(spec: CellSpec) -> Path | None:
    """File of the cell of ``spec``; None where nothing is cached."""
    folder = cache_folder("cells")
    return None if folder is None else folder / f"{_key(spec)}.npz"


def load_cell(spec: CellSpec) -> Cell | None:
    """The cached cell; None if there is none or it is not what was kept, which a line on stderr says."""
    path = cell_path(spec)
    try:
        arrays = kept(path, _key(spec))
        return None if arrays is None else _cell(spec, arrays)
    except (Damaged, KeyError, TypeError, ValueError) as error:
        tell(f"{path}: {error}: this cached cell is not used; it is relaxed anew")
        return None


def save_cell(cell: Cell) -> None:
    """Write ``cell`` whole or not at all; if the disk refuses, the next run only relaxes again."""
    keep(cell_path(cell.spec), _key(cell.spec), _arrays(cell))


def cell_digest(cell: Cell) -> str:
    """Digest of the centre-lines of ``cell`` and of what it was relaxed from."""
    return checksum({"key": np.array(_key(cell.spec)), **_arrays(cell)})


def _cell(spec: CellSpec, arrays: dict[str, np.ndarray]) -> Cell:
    """Raises :class:`Damaged` for arrays that no cell has."""
    curves = [np.asarray(arrays[s], dtype=np.float64) for s in SYSTEMS]
    if any(c.ndim != 2 or c.shape[1] != 3 or len(c) < 4 or not np.isfinite(c).all() for c in curves):
        raise Damaged("no centre-lines of three systems")
    knit, warp, weft = curves
    deepest, worst, residual, iterations = (float(arrays[name]) for name in NUMBERS)
    return Cell(spec, knit, warp, weft, deepest, worst, residual, int(iterations))


def _arrays(cell: Cell) -> dict[str, Any]:
    return {name: np.asarray(getattr(cell, name)) for name in (*SYSTEMS, *NUMBERS)}


def _key(spec: CellSpec) -> str:
    """Digest of the inputs of a cell and of the sources that relax it."""
    package = Path(__file__).parent.parent
    digest = hashlib.sha256(json.dumps(asdict(spec), sort_keys=True).encode())
    for name in SOURCES:
        digest.update((package / name).read_bytes())
    return digest.hexdigest()[:DIGITS]
