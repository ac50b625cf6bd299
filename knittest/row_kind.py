"""Says of a compared row whether the simulated number is a prediction, was tuned on it, or repeats its input."""

from collections.abc import Iterator
from typing import Literal

from pydantic import BaseModel

from knittest.config.base import Quantity
from knittest.config.rigs import CantileverRig
from knittest.config.run import Run

RowKind = Literal["predicted", "tuned", "input"]

#: names of Table 3's rows as ``tuned_on`` writes them, after variant and direction: "V1 warp max. tensile force"
ROW_NAMES = {"peak_force_n": "max. tensile force", "fracture_strain_pct": "fracture strain"}


def row_kind(run: Run, quantity: str) -> RowKind:
    """Kind of ``quantity`` in the direction of ``run``; the macro scale is fed the curve that ends in Table 3's row,
    and the coefficient of a face follows from that of two. Bending follows from the overhang by Eq. 2: an overhang that
    is found again is tuned, one that is given an input.
    """
    if isinstance(run.rig, CantileverRig) and run.rig.mode == "overhang":
        return "tuned"
    if run.model.scale == "macro" or run.rig.kind != "tensile":
        return "input"
    row = f"V{run.fabric.experiment_variant} {run.direction} {ROW_NAMES.get(quantity, quantity)}"
    tuned = {name for q in quantities(run.fabric) for name in q.tuned_on}
    return "tuned" if row in tuned else "predicted"


def quantities(model: BaseModel) -> Iterator[Quantity]:
    """All quantities below ``model``."""
    for name in type(model).model_fields:
        value = getattr(model, name)
        if isinstance(value, Quantity):
            yield value
        elif isinstance(value, BaseModel):
            yield from quantities(value)
