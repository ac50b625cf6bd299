"""Tells whether the shells of a run were given the data of a curve that is to be compared with them."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.resources import data_dir
from knittest.config.run import Run
from knittest.experiment.compare import LEFT_OUT, STRAIN
from knittest.experiment.curves import ReferenceCurve, load_curve
from knittest.experiment.forces import normalised, per_width
from knittest.experiment.lab_results import SHEAR, TENSION
from knittest.experiment.origin import ORIGINS
from knittest.materials.trellis import CONJUGATE, NORMALISED, to_conjugate

#: rms difference of two curves, over the largest force, below which they are the same data: that of rounding and of
#: points placed otherwise; strips of one fabric scatter ten times as much
ROUNDING = 0.005
SPECIMENS = "specimen-*.csv"


def given_as(run: Run, path: Path, curve: ReferenceCurve) -> str:
    """Part of ``curve`` in ``path``, as it was read, that the shells of ``run`` were given; empty if none is known.

    The same file, one of the same source, the same data, or a specimen of the import that a given file was made of.
    """
    if told := ORIGINS[run.rig.kind].gave(run, path):
        return told
    if run.model.scale != "macro":
        return ""
    files = [data_dir() / name for name in run.fabric.macro.curve_files.values()]
    files = [file for file in files if file.is_file()]
    if path.resolve() in [file.resolve() for file in files]:
        return "the shells were given this file"
    given = [load_curve(file) for file in files]
    if curve.source != path.name and curve.source in [one.source for one in given]:
        return "the shells were given a curve of the same source"
    if any(same_data(curve, one) for one in given):
        return "the shells were given the same data"
    if any(same_data(curve, one) for file in files for one in readable(sorted(file.parent.glob(SPECIMENS)))):
        return "it is a specimen of the import that the shells were given"
    beside = readable([path.parent / name for name in (TENSION, SHEAR)] if path.match(SPECIMENS) else [])
    if any(same_data(made, one) for made in beside for one in given):
        return "it is a specimen of the import that the shells were given"
    return ""


def readable(paths: Iterable[Path]) -> Iterator[ReferenceCurve]:
    """The curves among ``paths``."""
    for path in paths:
        try:
            yield load_curve(path)
        except InputError:  # nothing that could be the same
            continue


def same_data(one: ReferenceCurve, other: ReferenceCurve) -> bool:
    """Tell whether two curves differ by rounding only, over the range that counts of both."""
    try:
        one, other = _size_free(one), _size_free(other)
    except InputError:  # of unknown size: not comparable
        return False
    if (one.x_name, one.y_name) != (other.x_name, other.y_name):
        return False
    low, high = max(one.x[0], other.x[0]), min(_end(one), _end(other))
    if high - low < (1.0 - LEFT_OUT) * max(_end(one) - one.x[0], _end(other) - other.x[0]):
        return False
    grid = np.linspace(low, high, 201)
    first, second = np.interp(grid, one.x, one.mean), np.interp(grid, other.x, other.mean)
    return bool(np.sqrt(np.mean((first - second) ** 2)) <= ROUNDING * np.abs(second).max())


def _size_free(curve: ReferenceCurve) -> ReferenceCurve:
    """Force per width of a strip, normalised shear force of a frame or of a law."""
    if curve.x_name == STRAIN:
        return per_width(curve)
    if curve.y_name == CONJUGATE:
        share = to_conjugate(1.0, np.deg2rad(curve.x), "normalised")
        return replace(curve, mean=curve.mean / share, y_name=NORMALISED)
    return normalised(curve)


def _end(curve: ReferenceCurve) -> float:
    """Strain [%] at the largest force of a strip, last angle [deg] of a frame."""
    return float(curve.x[int(np.argmax(curve.mean))] if curve.x_name == STRAIN else curve.x[-1])
