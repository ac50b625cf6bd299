"""Marks a curve beside a run that the model was given, or tuned on: neither judges the run."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from knittest.base.resources import data_dir
from knittest.config.run import Run
from knittest.experiment.curves import ReferenceCurve
from knittest.experiment.forces import noted
from knittest.experiment.lab_results import folder_name
from knittest.experiment.row_kind import is_curve, tuning_labels
from knittest.laboratory.given_data import SPECIMENS, given_as, readable, same_data


def marked(run: Run, path: Path, curve: ReferenceCurve, quantities: Sequence[str]) -> ReferenceCurve:
    """``curve`` in ``path``, as it was read, as an input or as tuned on where ``run`` was; else as it is.

    ``quantities`` are the results of the test that are compared with its tables.
    """
    if given := given_as(run, path, curve):
        return noted(replace(curve, kind="input"), given)
    tuned = tuned_as(run, path, curve, quantities)
    return noted(replace(curve, kind="tuned"), tuned) if tuned else curve


def tuned_as(run: Run, path: Path, curve: ReferenceCurve, quantities: Sequence[str]) -> str:
    """Reason to call ``curve`` tuned: what numbers of ``run`` were tuned on, or chosen by; empty if nothing is known.

    Rows of tables are in the curves of the fabric's own experiment. A curve is recorded by the name of its file alone,
    so that each one of that direction may be it.
    """
    scale, fabric = run.model.scale, run.fabric
    labels = dict.fromkeys(
        label for quantity in quantities for label in tuning_labels(fabric, scale, run.direction, quantity)
    )
    of_curves = [label for label in labels if is_curve(label, run.direction)]
    found = of_curves or (list(labels) if labels and _is_own(run, path, curve) else [])
    return f"numbers of the model were tuned on, or chosen by, {', '.join(found)}" if found else ""


def _is_own(run: Run, path: Path, curve: ReferenceCurve) -> bool:
    """Tell whether ``curve`` is of the experiment of the run's fabric: a file of it, of its source, or of its data."""
    if run.fabric.experiment is None:
        return False
    folder = data_dir() / run.fabric.experiment
    if path.resolve().is_relative_to(folder.resolve()):
        return True
    return any(
        same_data(curve, one) or (curve.source != path.name and curve.source == one.source)
        for one in readable(_files(folder / folder_name(run.rig.kind, run.direction)))
    )


def _files(folder: Path) -> Iterator[Path]:
    yield folder / "corridor.csv"
    yield from sorted(folder.glob(SPECIMENS))
