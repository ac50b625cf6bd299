"""Curves of a user's own beside the curve of a run: for its size, said what they are, and drawn."""

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from knittest.base.kinds import kinds
from knittest.base.stamp import stamped
from knittest.config.run import Run
from knittest.experiment.compare import column_of, columns_of
from knittest.experiment.conditions import UNKNOWN, Conditions
from knittest.experiment.curves import ReferenceCurve, load_curve, located
from knittest.export.line_picture import Band, Line, line_picture
from knittest.laboratory.registry import REPORTS
from knittest.laboratory.report_base import title_of
from knittest.laboratory.run_stamp import run_stamp
from knittest.laboratory.tuned_data import marked

#: characters of a line in the legend
LEGEND = 105


def own_curves(run: Run, paths: Sequence[Path], given: Conditions = UNKNOWN) -> list[ReferenceCurve]:
    """Curves in ``paths`` for the size of ``run``; data that its shells were given are an input.

    ``given`` are conditions that the files may leave open. Raises :class:`InputError` for a curve of another test,
    direction or quantity, or of a specimen whose size is not known.
    """
    return [_own_curve(run, located(path), given) for path in paths]


def _own_curve(run: Run, path: Path, given: Conditions) -> ReferenceCurve:
    report = REPORTS[run.rig.kind]
    names = (report.axes.x, report.axes.y, *report.axes.others)
    curve = load_curve(path, given)
    column_of(names, curve.x_name, curve)
    curve = report.matched(run, marked(run, path, curve, kinds()[run.rig.kind].published))
    columns_of(names, curve)
    return curve


def draw_against(run: Run, columns: Mapping[str, np.ndarray], curve: ReferenceCurve, path: Path, identity: str) -> None:
    """Draw the curve of ``run`` in ``columns`` and the reference to ``path`` (PNG), ``identity`` below the title."""
    x, y = columns_of(columns, curve)
    axes = REPORTS[run.rig.kind].axes
    labels = [f"simulated, {identity}", f"{curve.source} ({curve.kind})"]
    labels[1] += f": {curve.note}" if curve.note else ""
    simulated, reference = (textwrap.fill(label, LEGEND) for label in labels)
    lines = [Line(columns[x], columns[y], simulated), Line(curve.x, curve.mean, reference, "--")]
    bands = []
    if curve.sd is not None:
        bands.append(Band(curve.x, curve.mean - curve.sd, curve.mean + curve.sd, f"{curve.kind}, ± sd"))
    if y == axes.mean and axes.sd in columns:
        spread = columns[axes.sd]
        bands.append(Band(columns[x], columns[y] - spread, columns[y] + spread, "simulated, ± sd"))
    with stamped(run_stamp(run, ())):  # a run that was refused is compared with nothing
        line_picture(
            path, lines, title=title_of(run), xlabel=axes.xlabel, ylabel=axes.labels.get(y, axes.ylabel), bands=bands,
        )  # fmt: skip


def identity_of(run: Run, folder: Path, manifest: Mapping[str, object]) -> str:
    """Preset, size, folder and date of a run, as a picture states them."""
    _, size = REPORTS[run.rig.kind].size(run)
    started = str(manifest.get("started") or "")[:10]
    return ", ".join(filter(None, (f"preset {run.model.preset}", size, folder.resolve().name, started)))
