"""Forces of strips and frames of any size as what does not depend on the size, and for the size of a run.

A strip carries its force over its width: F / b [N/mm]. A frame is judged by the normalised shear force
F_s L_frame / L_fabric^2 [N/mm] of :mod:`knittest.materials.trellis`.
"""

import math
from dataclasses import replace

import numpy as np

from knittest.base.errors import InputError
from knittest.experiment.conditions import EXACT
from knittest.experiment.curves import FORCE, FORCE_PER_WIDTH, ReferenceCurve
from knittest.materials.trellis import NORMALISED, normalised_force


def per_width(curve: ReferenceCurve) -> ReferenceCurve:
    """A tensile ``curve`` as force per width [N/mm]; raises :class:`InputError` where its strip has no width."""
    if curve.y_name == FORCE_PER_WIDTH:
        return curve
    if curve.y_name != FORCE:
        raise InputError(f"{curve.file}: {curve.y_name}; expected {FORCE_PER_WIDTH}, or {FORCE} of a strip")
    width = curve.conditions.strip_width_mm
    if width is None:
        raise InputError(
            f"{curve.file}: {FORCE} of a strip of unknown width: expected a line '# strip_width_mm: ...' in its header "
            f"(knittest data import --width writes it; knittest compare has --width), or a column {FORCE_PER_WIDTH}"
        )
    return _divided(curve, width, FORCE_PER_WIDTH)


def for_width(curve: ReferenceCurve, width: float) -> ReferenceCurve:
    """A tensile ``curve`` as force [N] of a strip of ``width`` [mm], and in its note of which width it was.

    Raises as :func:`per_width` does.
    """
    own = curve.conditions.strip_width_mm
    scaled = _divided(per_width(curve), 1.0 / width, FORCE)
    if own is None:
        return noted(scaled, f"given per width, for {width:g} mm")
    return scaled if math.isclose(own, width, rel_tol=EXACT) else noted(scaled, f"for {width:g} instead of {own:g} mm")


def normalised(curve: ReferenceCurve) -> ReferenceCurve:
    """A frame's ``curve`` as normalised shear force [N/mm]; raises :class:`InputError` for a force [N] of a frame or
    fabric of unknown side.
    """
    if curve.y_name == NORMALISED:
        return curve
    fabric, frame = curve.conditions.fabric_side_mm, curve.conditions.frame_side_mm
    if curve.y_name != FORCE or fabric is None or frame is None:
        sides = {"fabric_side_mm": fabric, "frame_side_mm": frame}
        missing = " and ".join(f"'# {name}: ...'" for name, side in sides.items() if side is None)
        raise InputError(
            f"{curve.file or curve.source}: {curve.y_name} of a frame: expected a column {NORMALISED}, or {FORCE} of "
            f"the crosshead and in the header {missing or 'both sides'} (options --fabric-side, --frame-side)"
        )
    angle = np.deg2rad(curve.x)
    force = normalised_force(curve.mean, angle, fabric, frame)
    sd = None if curve.sd is None else normalised_force(curve.sd, angle, fabric, frame)
    note = f"normalised by its own sides, fabric {fabric:g} mm in a frame of {frame:g} mm"
    return noted(replace(curve, mean=force, sd=sd, y_name=NORMALISED), note)


def noted(curve: ReferenceCurve, note: str) -> ReferenceCurve:
    """``curve`` with ``note`` added to its own."""
    return replace(curve, note="; ".join(filter(None, (curve.note, note))))


def _divided(curve: ReferenceCurve, size: float, name: str) -> ReferenceCurve:
    peak = curve.stated_peak
    return replace(
        curve, mean=curve.mean / size, sd=None if curve.sd is None else curve.sd / size, y_name=name,
        stated_peak=None if peak is None else (peak[0], peak[1] / size),
    )  # fmt: skip
