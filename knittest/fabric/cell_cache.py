"""Relaxed cells on disk, keyed by their inputs and by the sources that relaxed them."""

import hashlib
import json
import tempfile
import zipfile
import zlib
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from knittest.cache import cache_root
from knittest.fabric.cell import SYSTEMS, Cell, CellSpec

#: what shapes a cell, beside its inputs
SOURCES = (
    "fabric/loop.py",
    "fabric/spline.py",
    "fabric/start.py",
    "fabric/relax.py",
    "fabric/topology.py",
    "kernels/relaxation.py",
)
NUMBERS = ("deepest", "worst", "residual", "iterations")


def cell_path(spec: CellSpec) -> Path:
    """File of the cell of ``spec``."""
    package = Path(__file__).parent.parent
    digest = hashlib.sha256(json.dumps(asdict(spec), sort_keys=True).encode())
    for name in SOURCES:
        digest.update((package / name).read_bytes())
    return cache_root() / "cells" / f"{digest.hexdigest()[:24]}.npz"


def load_cell(spec: CellSpec) -> Cell | None:
    """The cached cell, or None if there is none or it cannot be trusted."""
    try:
        with np.load(cell_path(spec), allow_pickle=False) as data:
            curves = [np.asarray(data[s], dtype=np.float64) for s in SYSTEMS]
            numbers = [float(data[name]) for name in NUMBERS]
    except (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile, zlib.error):
        return None
    if any(c.ndim != 2 or c.shape[1] != 3 or len(c) < 4 or not np.isfinite(c).all() for c in curves):
        return None
    knit, warp, weft = curves
    return Cell(spec, knit, warp, weft, numbers[0], numbers[1], numbers[2], int(numbers[3]))


def save_cell(cell: Cell) -> None:
    """Write ``cell`` whole or not at all; if the disk refuses, the next run only relaxes again."""
    path = cell_path(cell.spec)
    arrays: dict[str, Any] = {name: np.asarray(getattr(cell, name)) for name in (*SYSTEMS, *NUMBERS)}
    temporary: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".tmp", delete=False) as stream:
            temporary = Path(stream.name)
            np.savez(stream, **arrays)
        temporary.replace(path)
    except OSError:
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink()
