"""Tension, shear and bending as a finished test of yarns or shells, or a path of a cell, tells them."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knittest.base.errors import NumericalError
from knittest.config.run import Run
from knittest.experiment.shear_csv import START
from knittest.laboratory.cantilever.config import CantileverRun
from knittest.laboratory.cell.config import CellRun
from knittest.laboratory.picture_frame.shear_law import FRAME_ANGLE, NORMALISED, homogenised_law
from knittest.materials.heavy_elastica import stiffness_of
from knittest.studies.homogenise.curves import Array, read_columns, tension_curve, to_peak
from knittest.studies.homogenise.plan import overhang, width


@dataclass(frozen=True)
class Tested:
    """A finished test: its run, its folder, its results and its key."""

    run: Run
    folder: Path
    results: Mapping[str, float]
    key: str


class NotTornError(NumericalError):
    """A path ended before any yarn was torn."""


def pulled(test: Tested) -> tuple[Array, Array]:
    """Strain [%] and force per width [N/mm] up to the largest force, (n,)."""
    if isinstance(test.run, CellRun):
        return to_peak(*read_columns(test.folder, "strain_pct", f"{test.run.rig.path}_n_per_mm"))
    strain, force = to_peak(*read_columns(test.folder, "strain_pct", "force_n"))
    return strain, force / width(test.run)


def tension(test: Tested) -> tuple[Array, Array]:
    """The tension curve that shells take; raises :class:`NotTornError` where none of a cell's yarns was torn."""
    run = test.run
    if isinstance(run, CellRun) and "cell_fracture_strain_pct" not in test.results:
        raise NotTornError(
            f"path {run.rig.path}: no yarn was torn up to rig.max_strain = {run.rig.max_strain:g} %: the tension curve "
            "has no end"
        )
    return tension_curve(*pulled(test))


def normalised(test: Tested) -> tuple[Array, Array]:
    """Shear angle [deg] and normalised force [N/mm], (n,)."""
    if not isinstance(test.run, CellRun):
        return read_columns(test.folder, FRAME_ANGLE, NORMALISED)
    angle, force = read_columns(test.folder, "shear_angle_deg", "conjugate_force")
    return angle, force / np.cos(np.deg2rad(angle))


def shear_law(test: Tested) -> tuple[Array, Array]:
    """The shear law that shells take: of a frame beyond its start-up, of a cell, which has none, from 0 on."""
    return homogenised_law(*normalised(test), 0.0 if isinstance(test.run, CellRun) else START)


def bending_stiffness(test: Tested) -> float:
    """Bending stiffness per width [N mm]: of a strip that of the heavy elastica of the same chord angle."""
    run = test.run
    if isinstance(run, CellRun):
        return test.results["cell_bending_stiffness_n_mm"]
    assert isinstance(run, CantileverRun)
    weight = run.fabric.area_mass_g_per_mm2 * run.rig.gravity_mm_per_ms2
    return stiffness_of(test.results["chord_angle_deg"], overhang(run), weight)
