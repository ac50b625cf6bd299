"""Files of picture frames as ``knittest data`` takes them: forces at angles, a shear law, and the rig of both."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment.lab_checks import common
from knittest.experiment.lab_conditions import FABRIC_SIDE, FRAME_SIDE, SAME
from knittest.experiment.lab_folder import SHEAR, Tests, counted
from knittest.experiment.lab_given import Given
from knittest.experiment.lab_recording import Recording, of, reader
from knittest.experiment.lab_results import Results
from knittest.experiment.lab_shear import END, Tested, reached, shear_curve, shear_curves, shear_forces
from knittest.experiment.lab_tests import LabTest, Rigs
from knittest.experiment.lab_units import plain
from knittest.experiment.statistics import Corridor
from knittest.laboratory.picture_frame.lab_cycles import UNITS, Frame, cycles_in, loop_lines, loops, turn_of
from knittest.materials.trellis import ANGLE, CONJUGATE, NORMALISED, crosshead_of_normalised, frame_angle, to_conjugate

Array = NDArray[np.float64]

NAME = "picture-frame"
#: width of the steps over which the law is averaged [deg]
STEP = 1.0
LAW = (
    "# conjugate to the shear angle, per reference area; mean of the specimens over 1 deg, from the origin, not falling"
)


def _frame(r: Recording, given: Given) -> Frame:
    """A shear angle counts before a displacement, which becomes one by the frame's side."""
    side, fabric = r.needed([FRAME_SIDE, FABRIC_SIDE], given)
    if fabric > side * (1.0 + SAME):
        raise InputError(f"{r.origin.path}: a fabric side of {fabric:g} mm in a frame of {side:g} mm: which is which?")
    tested = Tested(
        NAME, lambda travel: frame_angle(travel, side), (2.0 - 2.0**0.5) * side, f"a frame of {side:g} mm",
        "the frame square", FRAME_SIDE.option,
    )  # fmt: skip
    curve = shear_curve(r, tested, given)
    one = Frame(
        **of(r), angle=curve.angle, force=curve.force, frame_side=side, fabric_side=fabric, turned=curve.turned
    )  # fmt: skip
    if given.loading == "first" or (given.loading is None and not curve.turned):
        return one
    try:
        cycles = cycles_in(*curve.whole, side, r.where)
    except InputError as error:
        if given.loading is None:
            return replace(one, not_cycled=str(error))
        raise
    return replace(one, cycles=cycles, turn=turn_of(curve.whole[0]))


def _results(frames: Sequence[Frame]) -> Results:
    """Crosshead forces [N] at angles for the sides of the series, the same in N/mm for any, and rows of cycles.

    Curves are of the normalised shear force; ``shear.csv`` is a law for ``macro.shear``.
    """
    side = common(FRAME_SIDE, [s.frame_side for s in frames], frames)
    fabric = common(FABRIC_SIDE, [s.fabric_side for s in frames], frames)
    normalised, digests = shear_forces(frames)
    forces = {a: crosshead_of_normalised(v, np.deg2rad(a), fabric, side) for a, v in normalised.items()}
    rows, conditions = loops(frames, fabric)
    found = {f"{NORMALISED}_at_deg.{a:g}": values for a, values in normalised.items()}
    found |= {f"shear_force_n_at_deg.{a:g}": values for a, values in forces.items()}
    units = {name: "N/mm" if name.startswith(NORMALISED) else "N" for name in found} | UNITS | {END: "deg"}
    curves = shear_curves(frames, "shear angle")
    law: dict[str, Array] = dict(zip((ANGLE, CONJUGATE), shear_law(curves.band), strict=True))
    remark = "forces are taken as those of the fabric alone: that of the empty frame must have been subtracted before"
    return Results(
        found | rows | {END: np.array([s.angle[-1] for s in frames])}, units,
        [(FRAME_SIDE, side), (FABRIC_SIDE, fabric), *conditions],
        ("frame", f"of {side:g} mm, fabric of {fabric:g} mm"), digests,
        [(f"{a:g} deg [N]", ".4g", values) for a, values in forces.items()], [*loop_lines(frames, rows), remark],
        replace(curves, more={SHEAR: (law, [LAW])}),
    )  # fmt: skip


def shear_law(band: Corridor) -> tuple[Array, Array]:
    """Angles [deg] and conjugate force S [N/mm], (n,), of the mean: from (0, 0), not falling, to the common end.

    Means over whole steps of :data:`STEP`, and the end itself; the least change that lets none fall (isotonic
    regression). S dgamma is the work per reference area.
    """
    from scipy.optimize import isotonic_regression

    angle = band.strain
    conjugate = to_conjugate(band.mean, np.deg2rad(angle), "normalised")
    edges = np.arange(np.ceil(angle[0] / STEP), np.floor(angle[-1] / STEP)) * STEP
    samples = np.linspace(0.0, STEP, 21)
    means = [float(np.interp(edge + samples, angle, conjugate).mean()) for edge in edges]
    middle = np.append(edges + 0.5 * STEP, angle[-1])
    level = isotonic_regression(np.maximum(np.append(means, conjugate[-1]), 0.0)).x
    return np.append(0.0, middle), np.append(0.0, level)


def _fabric(tests: Tests, place: Path) -> dict[str, Any]:
    """Curve of the shear law."""
    if NAME not in tests:
        return {}
    test, curve = tests[NAME], (place / NAME / SHEAR).as_posix()
    side, fabric = (test["conditions"][what.key] for what in (FRAME_SIDE, FABRIC_SIDE))
    count = next(found["n"] for name, found in test.items() if name.startswith("shear_force_n_at_deg"))
    ref = f"{counted(count, 'picture frame')} of {side:g} mm, fabric of {fabric:g} mm"
    return {"macro": {"shear": {"kind": "table", "curve": curve, "source": "measured", "ref": ref}}}


def _rigs(tests: Tests) -> Rigs:
    """Both sides, and the angle that all specimens reach."""
    if NAME not in tests:
        return {}
    side, fabric = (tests[NAME]["conditions"][what.key] for what in (FRAME_SIDE, FABRIC_SIDE))
    found = {"side": fabric, "frame_side": max(side, fabric)}
    if END in tests[NAME]:
        found["max_angle"] = reached(tests[NAME])
    return {NAME: {name: plain(value) for name, value in found.items()}}


LAB = LabTest(
    NAME,
    reader(
        [("force",), ("angle", "travel", "extensometer")], "a force and a shear angle or a displacement", _frame,
        own=("cyclic",),
    ),
    _results, (FRAME_SIDE, FABRIC_SIDE), ("sign", "zero", "preload", "loading"), _rigs, _fabric,
)  # fmt: skip
