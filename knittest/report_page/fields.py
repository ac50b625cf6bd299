"""Fields of several runs on one colour scale, and by how much each differs from the first."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.errors import InputError
from knittest.base.figure import png
from knittest.base.reading import read_regular
from knittest.export.fields_picture import PlanField, fields_figure
from knittest.report_page.blocks import Block, Picture, Text
from knittest.report_page.loading import LoadedRun
from knittest.report_page.pictures import light

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: table of a run, and what it has at each place
FILE, COLUMNS = "shear-field.csv", ("x_mm", "y_mm", "shear_angle_deg")
LABEL, TITLE = "shear angle [deg]", "Shear angle of the material at the end, in plan"
#: runs in a row, and bytes of a table that is read
MOST, MAX_BYTES = 4, 30_000_000


def fields(runs: Sequence[LoadedRun]) -> list[Block]:
    """The shear angles of ``runs`` of one test in plan, on one scale, where two or more left them."""
    found, problems = _read(runs)
    blocks: list[Block] = [Text(problem, "warn") for problem in problems]
    figure = _figure(found)
    if figure is None:
        return blocks
    caption = f"{TITLE}: one colour scale; below, each less the first"
    try:
        uri = light(png(figure))
    except Exception as error:  # whatever the encoder meets
        return [Text(f"{caption}: cannot be drawn ({error})", "warn"), *blocks]
    return [Picture(uri, caption, caption, wide=True), *blocks]


def fields_of(runs: Sequence[LoadedRun]) -> "Figure | None":
    """The picture of :func:`fields`, ``None`` where fewer than two runs left their field."""
    return _figure(_read(runs)[0])


def _figure(found: Sequence[PlanField]) -> "Figure | None":
    return fields_figure(found, title=TITLE, label=LABEL) if len(found) > 1 else None


def _read(runs: Sequence[LoadedRun]) -> tuple[list[PlanField], list[str]]:
    """Fields of the first runs that left them, and what is wrong with others."""
    found: list[PlanField] = []
    problems = []
    for run in runs:
        path = run.path / FILE
        if not path.is_file() or len(found) == MOST:
            continue
        try:
            lines = read_regular(path, MAX_BYTES, "too large for a page").decode("utf-8").splitlines()
            table = np.array([[float(v) for v in line.split(",")] for line in lines[1:]])
            if tuple(lines[0].split(",")) != COLUMNS or table.shape[1:] != (3,) or not np.isfinite(table[:, :2]).all():
                raise ValueError(f"expected the columns {', '.join(COLUMNS)}")
        except (InputError, ValueError, IndexError) as error:
            problems.append(f"{path}: {error}")
            continue
        scale = run.summary.scale or str(run.setting("model", "scale") or "")
        found.append(
            PlanField(f"run {run.number}, {'yarns' if scale == 'meso' else 'shells'}", table[:, :2], table[:, 2])
        )
    return found, problems
