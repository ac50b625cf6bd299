"""Colours of a field over all frames: what it is called, in which unit, and where its colours end."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.report_page.moving.recording import Array, Recording

#: label, unit and factor from the frame's unit to it
LABELS = {
    "axial_force": ("axial force", "N", 1.0),
    "axial_strain": ("axial strain", "%", 100.0),
    "shear_angle": ("shear angle", "°", float(np.degrees(1.0))),
    "height": ("height", "mm", 1.0),
    "force_warp": ("force along warp", "N/mm", 1.0),
    "force_weft": ("force along weft", "N/mm", 1.0),
    "strain_warp": ("strain along warp", "%", 100.0),
    "strain_weft": ("strain along weft", "%", 100.0),
}
#: fields that a reader looks for first, where they reach so far [unit of the label]
FIRST = {"axial_force": 0.0, "shear_angle": 0.1}
#: largest value of a field, by unit, that is no more than rounding
ROUNDING = {"N": 1e-6, "N/mm": 1e-6, "%": 1e-6, "°": 1e-4}
#: share of the values of elements that their colours tell apart: few recoiling ends would make all others alike
TOLD_APART = 99.8
#: negative values below this share of the largest are of no account, and the scale begins at 0
ONE_SIDED = 0.01
#: codes 1 to 255 are values, 0 is none
CODES = 254


@dataclass(frozen=True)
class Scale:
    """Colours of a field from ``low`` to ``high`` [``unit``], diverging about 0 if ``signed``; the frames hold values
    from ``least`` to ``largest``.
    """

    label: str
    unit: str
    factor: float
    low: float
    high: float
    signed: bool
    least: float
    largest: float

    def codes(self, values: Array) -> NDArray[np.int64]:
        """Whole numbers 1 to 255 for ``values`` in the frame's unit, 0 where there is no number."""
        share = np.clip((self.factor * values - self.low) / (self.high - self.low), 0.0, 1.0)
        known = np.isfinite(values)
        return np.where(known, 1 + np.round(CODES * np.where(known, share, 0.0)), 0).astype(np.int64)


def scales_of(recording: Recording) -> dict[str, Scale]:
    """Scales of the fields that are more than rounding, by name, those that a reader looks for first in front."""
    alive = recording.fields.get("alive")
    scaled = {name: scale_of(name, values, alive) for name, values in recording.fields.items() if name != "alive"}
    found = {name: scale for name, scale in scaled.items() if scale is not None}
    known = list(LABELS)

    def place(name: str) -> tuple[int, int]:
        rank = 1 if name not in FIRST else 0 if found[name].high >= FIRST[name] else 2
        return rank, known.index(name) if name in known else len(known)

    return {name: found[name] for name in sorted(found, key=place)}


def scale_of(name: str, values: Array, alive: Array | None = None) -> Scale | None:
    """Scale of the field ``name`` with ``values`` (k, m) in the frames, of elements that are ``alive``."""
    label, unit, factor = LABELS.get(name, (name.replace("_", " "), "", 1.0))
    known = factor * values[np.isfinite(values) if alive is None else np.isfinite(values) & (alive > 0.5)]
    limit = float(np.percentile(np.abs(known), TOLD_APART)) if known.size else 0.0
    limit = limit or float(np.abs(known).max(initial=0.0))
    if limit <= ROUNDING.get(unit, 0.0):
        return None
    least, largest = float(known.min()), float(known.max())
    signed = least < -ONE_SIDED * max(limit, largest)
    return Scale(label, unit, factor, -limit if signed else 0.0, limit, signed, least, largest)
