"""Files of picture frames as ``knittest data`` takes them: forces at angles, a shear law, and the rig of both."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment.lab_checks import common, digests, refuse_apart, refuse_implausible
from knittest.experiment.lab_conditions import FABRIC_SIDE, FRAME_SIDE
from knittest.experiment.lab_folder import SHEAR, counted, folder_name
from knittest.experiment.lab_results import Curves, Results
from knittest.experiment.lab_tests import LabTest, Rigs
from knittest.experiment.lab_units import plain
from knittest.experiment.statistics import Corridor, band
from knittest.laboratory.picture_frame.lab_curves import Sheared, read_frames
from knittest.laboratory.picture_frame.lab_loops import UNITS, loop_lines, loops
from knittest.materials.trellis import ANGLE, CONJUGATE, NORMALISED, crosshead_of_normalised, to_conjugate

Array = NDArray[np.float64]

NAME = "picture-frame"
#: shear angles at which the force is a row [deg]: those of a run
ANGLES = (10.0, 20.0, 30.0, 40.0)
#: row of the largest angle of each frame
END = "end_of_first_loading_deg"
#: normalised shear force of textiles [N/mm]: from a loose knit at 3 deg to carbon fabrics beyond locking
FORCES = (5e-4, 20.0)
#: width of the steps over which the law is averaged [deg]
STEP = 1.0
NAMES = (ANGLE, NORMALISED, "normalised_shear_force_sd_n_per_mm")
LAW = (
    "# conjugate to the shear angle, per reference area; mean of the specimens over 1 deg, from the origin, not falling"
)


def frame_results(specimens: Sequence[Sheared], direction: str, files: Sequence[str]) -> Results:
    """Crosshead forces [N] at angles for the sides of the series, the same in N/mm for any, and rows of cycles.

    Raises :class:`InputError` for sides, copies and forces that are not of one series. Curves are of the normalised
    shear force; ``shear.csv`` is a law for ``macro.shear``.
    """
    paths, curves = [s.path for s in specimens], [(s.angle, s.normalised) for s in specimens]
    frame = common(FRAME_SIDE, [s.frame_side for s in specimens], paths)
    fabric = common(FABRIC_SIDE, [s.fabric_side for s in specimens], paths)
    end = min(float(s.angle[-1]) for s in specimens)
    for s in specimens:
        top, force = float(s.normalised.max()), float(s.force.max())
        refuse_implausible(s, top, FORCES, f"maximum force {force:.6g} N, normalised {top:.4g} N/mm", "N/mm", force)
    at_end = np.array([np.interp(end, *curve) for curve in curves])
    refuse_apart(specimens, at_end, f"normalised force at {end:.3g} deg", "N/mm")
    known = digests(specimens, [(s.angle, s.force) for s in specimens])
    free = {a: np.array([np.interp(a, *curve) for curve in curves]) for a in ANGLES if a <= end}
    if not free:
        raise InputError(f"{paths[0]}: all specimens together go to {end:.3g} deg: expected at least {ANGLES[0]:g} deg")
    forces = {a: crosshead_of_normalised(v, np.deg2rad(a), fabric, frame) for a, v in free.items()}
    cycles, corridor = loops(specimens, fabric), band(curves, end, "shear angles")
    found = {f"{NORMALISED}_at_deg.{a:g}": values for a, values in free.items()}
    found |= {f"shear_force_n_at_deg.{a:g}": values for a, values in forces.items()}
    units = {name: "N/mm" if name.startswith(NORMALISED) else "N" for name in found} | UNITS | {END: "deg"}
    found |= cycles.rows | {END: np.array([s.angle[-1] for s in specimens])}
    law: dict[str, Array] = dict(zip((ANGLE, CONJUGATE), shear_law(corridor), strict=True))
    remark = "forces are taken as those of the fabric alone: that of the empty frame must have been subtracted before"
    return Results(
        NAME, "", found, units, [(FRAME_SIDE, frame), (FABRIC_SIDE, fabric), *cycles.conditions],
        ("frame", f"of {frame:g} mm, fabric of {fabric:g} mm"), files, known, [s.name for s in specimens],
        [(f"{a:g} deg [N]", ".4g", values) for a, values in forces.items()], [*loop_lines(specimens, cycles), remark],
        Curves(
            curves, corridor, NAMES, ("shear angle [deg]", "normalised shear force [N/mm]"), {SHEAR: (law, [LAW])}
        ),
    )  # fmt: skip


def shear_law(band: Corridor) -> tuple[Array, Array]:
    """Angles [deg] and conjugate force S [N/mm], (n,), of the mean: from (0, 0), not falling, to the common end.

    Means over whole steps of :data:`STEP`, and the end itself; the least change that lets none fall (isotonic
    regression). S dgamma is the work per reference area.
    """
    from scipy.optimize import isotonic_regression

    angle, normalised = band.strain, band.mean
    conjugate = to_conjugate(normalised, np.deg2rad(angle), "normalised")
    edges = np.arange(np.ceil(angle[0] / STEP), np.floor(angle[-1] / STEP)) * STEP
    samples = np.linspace(0.0, STEP, 21)
    means = [float(np.interp(edge + samples, angle, conjugate).mean()) for edge in edges]
    middle = np.append(edges + 0.5 * STEP, angle[-1])
    level = isotonic_regression(np.maximum(np.append(means, conjugate[-1]), 0.0)).x
    return np.append(0.0, middle), np.append(0.0, level)


def _fabric(tests: Mapping[str, dict[str, Any]], place: Path) -> dict[str, Any]:
    """Curve of the shear law."""
    own = folder_name(NAME, "")
    return {"macro": {"shear": _shear(tests[own], (place / own / SHEAR).as_posix())}} if own in tests else {}


def _shear(test: dict[str, Any], curve: str) -> dict[str, Any]:
    frame, fabric = (test["conditions"][side.key] for side in (FRAME_SIDE, FABRIC_SIDE))
    count = next(value["n"] for name, value in test.items() if name.startswith("shear_force_n_at_deg"))
    ref = f"{counted(count, 'picture frame')} of {frame:g} mm, fabric of {fabric:g} mm"
    return {"kind": "table", "curve": curve, "source": "measured", "ref": ref}


def _rigs(tests: Mapping[str, dict[str, Any]]) -> Rigs:
    return {NAME: _frame(tests[NAME])} if NAME in tests else {}


def _frame(test: Mapping[str, Any]) -> dict[str, float]:
    """Both sides, and the angle that all specimens reach."""
    sides = test["conditions"]
    found = {"side": sides[FABRIC_SIDE.key], "frame_side": max(sides[FRAME_SIDE.key], sides[FABRIC_SIDE.key])}
    if END in test:
        found["max_angle"] = math.floor(10.0 * min(test[END]["values"])) / 10.0
    return {name: plain(value) for name, value in found.items()}


LAB = LabTest(
    read_frames, frame_results, (FRAME_SIDE, FABRIC_SIDE), ("sign", "zero", "preload", "loading"), rigs=_rigs,
    fabric=_fabric,
)  # fmt: skip
