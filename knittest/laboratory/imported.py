"""The mean curve that an import of the fabric's own tests left, beside the curve of a run."""

from dataclasses import replace

from knittest.base.resources import data_dir
from knittest.config.run import Run
from knittest.experiment.curves import ReferenceCurve, load_curve
from knittest.experiment.forces import noted
from knittest.experiment.lab_folder import folder_name
from knittest.laboratory.given_data import given_as


def imported_corridor(run: Run) -> ReferenceCurve | None:
    """Corridor of the test and direction of ``run`` in the fabric's experiment; an input where the run was given it.

    ``None`` where nothing was imported.
    """
    if run.fabric.experiment is None:
        return None
    path = data_dir() / run.fabric.experiment / folder_name(run.rig.kind, run.direction) / "corridor.csv"
    if not path.is_file():
        return None
    curve = load_curve(path)
    known = given_as(run, path, curve)
    return noted(replace(curve, kind="input"), known) if known else curve
