"""Centre-lines of the relaxed yarns as VTU for ParaView or as CSV."""

import csv
import io
from pathlib import Path
from typing import Any

import numpy as np

from knittest.base.atomic import replacing, write_atomic
from knittest.base.errors import InputError
from knittest.fabric.cell import SYSTEMS, Cell
from knittest.fabric.strip import YarnPath, centre_lines

FORMATS = (".vtu", ".csv")


def export_centre_lines(path: Path, cell: Cell, n_wales: int, n_courses: int) -> None:
    """Write the yarns of ``n_wales`` x ``n_courses`` cells in the format of the file's suffix.

    Raises :class:`InputError` for another suffix and :class:`ResourceError` if the file cannot be written.
    """
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: cannot tell the format from the suffix: expected {' or '.join(FORMATS)}")
    paths = centre_lines(cell, n_wales, n_courses)
    if path.suffix.lower() == ".csv":
        write_atomic(path, _csv(paths))
    else:
        _write_vtu(path, paths, cell.spec.radius)


def _csv(paths: list[YarnPath]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["system", "yarn", "point", "x_mm", "y_mm", "z_mm"])
    for path in paths:
        for number, point in enumerate(path.points, 1):
            writer.writerow([path.system, path.index + 1, number, *(f"{v:.6f}" for v in point)])
    return text.getvalue()


def _write_vtu(path: Path, paths: list[YarnPath], radius: dict[str, float]) -> None:
    """One line cell a segment; ``part`` indexes knit, warp, weft, ``yarn`` counts from 1, ``radius`` [mm] at points."""
    import meshio

    counts = np.array([len(p.points) for p in paths])
    starts = np.cumsum(counts) - counts
    first = np.delete(np.arange(counts.sum()), starts[1:] - 1)[:-1]  # every point but the last of each yarn
    fields: dict[str, Any] = {
        "part": [np.repeat([SYSTEMS.index(p.system) for p in paths], counts - 1)],
        "yarn": [np.repeat([p.index + 1 for p in paths], counts - 1)],
    }
    mesh = meshio.Mesh(
        np.vstack([p.points for p in paths]),
        [("line", np.column_stack([first, first + 1]))],
        point_data={"radius": np.repeat([radius[p.system] for p in paths], counts)},
        cell_data=fields,
    )
    with replacing(path) as temporary:
        meshio.write(temporary, mesh, file_format="vtu", compression="zlib")
