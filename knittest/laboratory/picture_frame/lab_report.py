"""Writes what an import of picture frames yields: forces at angles, corridor, and a shear law for the shells."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.atomic import write_atomic
from knittest.base.errors import InputError
from knittest.experiment.lab_checks import common, digest, refuse_apart, refuse_copies
from knittest.experiment.lab_conditions import FABRIC_SIDE, FRAME_SIDE
from knittest.experiment.lab_fabric import finish
from knittest.experiment.lab_folder import SHEAR, curve_text
from knittest.experiment.lab_lines import table_lines
from knittest.experiment.lab_picture import plot
from knittest.experiment.lab_series import Results, write_results
from knittest.experiment.lab_units import likely_force
from knittest.experiment.statistics import Corridor, band
from knittest.laboratory.picture_frame.lab_curves import Sheared
from knittest.laboratory.picture_frame.lab_loops import UNITS, Loops, loop_lines, loops
from knittest.materials.trellis import ANGLE, CONJUGATE, NORMALISED, crosshead_of_normalised, to_conjugate

Array = NDArray[np.float64]

#: shear angles at which the force is a row [deg]: those of a run
ANGLES = (10.0, 20.0, 30.0, 40.0)
#: row of the largest angle of each frame
END = "end_of_first_loading_deg"
#: normalised shear force of textiles [N/mm]: from a loose knit at 3 deg to carbon fabrics beyond locking
FORCES = (5e-4, 20.0)
#: width of the steps over which the law is averaged [deg]
STEP = 1.0
NORMALISED_SD = "normalised_shear_force_sd_n_per_mm"
LAW = (
    "# conjugate to the shear angle, per reference area; mean of the specimens over 1 deg, from the origin, not falling"
)


@dataclass(frozen=True)
class FrameSeries:
    """Specimens of one series, their sides [mm] and the corridor of the normalised force.

    ``rows`` are crosshead forces [N] at angles for these sides, ``normalised`` the same in N/mm for any; those of
    cycles are ``loops``.
    """

    specimens: Sequence[Sheared]
    frame: float
    fabric: float
    band: Corridor
    rows: dict[str, Array]
    normalised: dict[str, Array]
    loops: Loops


def frame_series(specimens: Sequence[Sheared]) -> FrameSeries:
    """``specimens`` as one series; raises :class:`InputError` for sides, copies and forces that are not of one."""
    paths = [s.path for s in specimens]
    frame = common(FRAME_SIDE, [s.frame_side for s in specimens], paths)
    fabric = common(FABRIC_SIDE, [s.fabric_side for s in specimens], paths)
    end = min(float(s.angle[-1]) for s in specimens)
    for s in specimens:
        top = float(s.normalised.max())
        if not FORCES[0] <= top <= FORCES[1]:
            force = float(s.force.max())
            limits = (FORCES[0] * force / top, FORCES[1] * force / top) if top else (FORCES[0], FORCES[1])
            raise InputError(
                f"{s.path}: specimen {s.name}: maximum force {force:.6g} N, normalised {top:.4g} N/mm: implausible, "
                f"expected {FORCES[0]:g} to {FORCES[1]:g} N/mm{likely_force(force, s.unit, limits)}: check the unit"
            )
    at_end = np.array([np.interp(end, s.angle, s.normalised) for s in specimens])
    refuse_apart([(s.name, s.path) for s in specimens], at_end, f"normalised force at {end:.3g} deg", "N/mm")
    refuse_copies([(s.name, digest(s.angle, s.force)) for s in specimens])
    rows, normalised = {}, {}
    for angle in (a for a in ANGLES if a <= end):
        values = np.array([np.interp(angle, s.angle, s.normalised) for s in specimens])
        normalised[f"{NORMALISED}_at_deg.{angle:g}"] = values
        rows[f"shear_force_n_at_deg.{angle:g}"] = crosshead_of_normalised(values, np.deg2rad(angle), fabric, frame)
    if not rows:
        raise InputError(f"{paths[0]}: all specimens together go to {end:.3g} deg: expected at least {ANGLES[0]:g} deg")
    corridor = band([(s.angle, s.normalised) for s in specimens], end, "shear angles")
    return FrameSeries(specimens, frame, fabric, corridor, rows, normalised, loops(specimens, fabric))


def shear_law(series: FrameSeries) -> tuple[Array, Array]:
    """Angles [deg] and conjugate force S [N/mm], (n,), of the mean: from (0, 0), not falling, to the common end.

    Means over whole steps of :data:`STEP`, and the end itself; the least change that lets none fall (isotonic
    regression). S dgamma is the work per reference area.
    """
    from scipy.optimize import isotonic_regression

    angle, normalised = series.band.strain, series.band.mean
    conjugate = to_conjugate(normalised, np.deg2rad(angle), "normalised")
    edges = np.arange(np.ceil(angle[0] / STEP), np.floor(angle[-1] / STEP)) * STEP
    samples = np.linspace(0.0, STEP, 21)
    means = [float(np.interp(edge + samples, angle, conjugate).mean()) for edge in edges]
    middle = np.append(edges + 0.5 * STEP, angle[-1])
    level = isotonic_regression(np.maximum(np.append(means, conjugate[-1]), 0.0)).x
    return np.append(0.0, middle), np.append(0.0, level)


def frame_lines(specimens: Sequence[Sheared]) -> list[str]:
    """Tables of the crosshead forces [N] at angles and of cycles, with mean and sd, and the sides."""
    series = frame_series(specimens)
    heads = [(f"{name.rpartition('.')[2]} deg [N]", ".4g") for name in series.rows]
    table = np.array(list(series.rows.values())).T
    lines = table_lines(heads, [(s.name, values) for s, values in zip(specimens, table, strict=True)])
    lines += loop_lines(specimens, series.loops)
    lines.append(
        "forces are taken as those of the fabric alone: that of the empty frame must have been subtracted before"
    )
    return [*lines, f"frame side: {series.frame:g} mm", f"fabric side: {series.fabric:g} mm"]


def write_frames(specimens: Sequence[Sheared], out: Path, files: Sequence[str]) -> str:
    """Write ``picture-frame.csv`` and ``picture-frame/`` into the experiment ``out``; returns its variant.

    Curves, corridor and their heads are of the normalised shear force; ``shear.csv`` is a law for ``macro.shear``.
    Raises as :func:`frame_series` does, and when ``out`` holds what no import wrote.
    """
    series = frame_series(specimens)
    results = Results(
        "picture-frame", "",
        series.normalised | series.rows | series.loops.rows | {END: np.array([s.angle[-1] for s in specimens])},
        dict.fromkeys(series.normalised, "N/mm") | dict.fromkeys(series.rows, "N") | UNITS | {END: "deg"},
        [(FRAME_SIDE, series.frame), (FABRIC_SIDE, series.fabric), *series.loops.conditions],
        ("frame", f"of {series.frame:g} mm, fabric of {series.fabric:g} mm"), files,
        [digest(s.angle, s.force) for s in specimens],
    )  # fmt: skip
    inner = write_results(out, results)
    notes = results.notes(out)
    for number, s in enumerate(specimens, 1):
        text = curve_text([f"# specimen: {s.name}", *notes[1:]], {ANGLE: s.angle, NORMALISED: s.normalised})
        write_atomic(inner / f"specimen-{number:02d}.csv", text)
    mean = {ANGLE: series.band.strain, NORMALISED: series.band.mean, NORMALISED_SD: series.band.sd}
    write_atomic(inner / "corridor.csv", curve_text(notes, mean))
    law = dict(zip((ANGLE, CONJUGATE), shear_law(series), strict=True))
    write_atomic(inner / SHEAR, curve_text([*notes, LAW], law))
    labels = ("shear angle [deg]", "normalised shear force [N/mm]")
    plot([(s.angle, s.normalised) for s in specimens], series.band, labels, inner / "curves.png")
    finish(out)
    return out.resolve().name
