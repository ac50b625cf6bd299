"""Drift of a curve: its ends, and the point that changed most."""

from pathlib import Path

import numpy as np

from knittest.base.history import Array
from knittest.config.run import Run
from knittest.laboratory.registry import REPORTS
from knittest.studies.regress.baseline import Curve
from knittest.studies.regress.change import Change
from knittest.studies.regress.recorded import has_curve, points
from knittest.studies.regress.rounding import TIMES


def curve_problem(run: Run, curve: Curve | None) -> str:
    """Reason why the curve of ``run`` cannot be held against the stored one, empty for none."""
    if curve is None:
        return "the baseline has no curve of this run" if has_curve(run) else ""
    if not has_curve(run):
        return "the baseline has a curve, the test has none"
    axes = REPORTS[run.rig.kind].axes
    if (axes.x, axes.y) != (curve.x_name, curve.y_name):
        return f"the baseline has a curve of {curve.y_name} over {curve.x_name}, the test of {axes.y} over {axes.x}"
    return ""


def curve_changes(run: Run, folder: Path, curve: Curve, limit: float) -> list[Change]:
    """Change of the end that moved more, over the length of the stored curve, and of the point that uses most of its
    limit, over its largest value: beyond an end a curve has no value that could be compared.
    """
    x, y = points(run, folder)
    return [_end_change(x, curve, limit), _worst_change(x, y, curve, limit)]


def limits_along(curve: Curve, limit: float) -> Array:
    """Change (n,) that each point may have over the largest value [-]."""
    scatter = np.array(curve.scatter) if curve.scatter else np.zeros(len(curve.y))
    return limit + TIMES * scatter / np.abs(curve.y).max()


def _end_change(x: Array, curve: Curve, limit: float) -> Change:
    ends = [(curve.x[0], float(x[0])), (curve.x[-1], float(x[-1]))]
    stored, now = max(ends, key=lambda end: abs(end[1] - end[0]))
    return Change(f"curve, end in {curve.x_name}", stored, now, (now - stored) / (curve.x[-1] - curve.x[0]), limit)


def _worst_change(x: Array, y: Array, curve: Curve, limit: float) -> Change:
    stored, now = np.array(curve.y), np.interp(curve.x, x, y)
    shares, limits = (now - stored) / np.abs(stored).max(), limits_along(curve, limit)
    worst = int(np.argmax(np.abs(shares) / limits))
    what = f"curve, {curve.y_name} at {curve.x_name} {curve.x[worst]:.4g}"
    return Change(what, float(stored[worst]), float(now[worst]), float(shares[worst]), float(limits[worst]))
