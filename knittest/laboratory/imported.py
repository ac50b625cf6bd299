"""The mean curve that an import of the fabric's own tests left, beside the curve of a run."""

from collections.abc import Sequence

from knittest.base.resources import data_dir
from knittest.config.run import Run
from knittest.experiment.curves import ReferenceCurve, load_curve
from knittest.experiment.lab_results import folder_name
from knittest.laboratory.tuned_data import marked


def imported_corridor(run: Run, quantities: Sequence[str]) -> ReferenceCurve | None:
    """Corridor of the test and direction of ``run`` in the fabric's experiment; an input where the run
    was given it, tuned where it was tuned on it.

    ``None`` where nothing was imported. ``quantities`` as :func:`~knittest.laboratory.tuned_data.marked` has them.
    """
    if run.fabric.experiment is None:
        return None
    path = data_dir() / run.fabric.experiment / folder_name(run.rig.kind, run.direction) / "corridor.csv"
    if not path.is_file():
        return None
    return marked(run, path, load_curve(path), quantities)
