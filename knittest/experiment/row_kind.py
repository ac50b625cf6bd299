"""Says of a compared row what its simulated number is worth: predicted, tuned on it, its own input, or assumed."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Literal

from pydantic import BaseModel

from knittest.base.kinds import Joined
from knittest.config.base import Quantity
from knittest.config.deciding import CELL, deciding, is_fed
from knittest.config.fabric import YARN_LEVEL, Fabric
from knittest.config.rigs import CantileverRig, FrictionRig
from knittest.config.run import Run, Scale
from knittest.experiment.borrowed import borrowed

RowKind = Literal["predicted", "tuned", "input", "assumed"]

#: names of rows as ``tuned_on`` and ``chosen_by`` write them, after variant and direction: "V1 warp max. tensile force"
ROW_NAMES: Mapping[str, str] = Joined("row_names", {"thickness_mm": "thickness", "area_mass_g_m2": "area mass"})
#: the same row by another name
OTHER_NAMES: Mapping[str, str] = Joined("other_names")
#: experiment whose friction is the rig's default
DEFAULT_FRICTION_OF = "pham2019"


def row_kind(run: Run, quantity: str) -> RowKind:
    """Kind of ``quantity`` in the direction of ``run``.

    ``tuned``: a number of the fabric was fitted to the row, or chosen with it in view. ``input``: the model was given
    the row and returns it, as shells return their curves, and faces their friction. ``assumed``: what it was given, or
    every number that decides the row, is assumed or another fabric's. Bending follows from the overhang by Eq. 2: an
    overhang that is found again is tuned, one that is given an input, whatever else is assumed.
    """
    if quantity in given_results(run):
        return "input"
    if _names_row(run.fabric, run.model.scale, run.direction, quantity):
        return "tuned"
    guessed = assumed_inputs(run)
    if is_fed(run):
        return "assumed" if guessed else _fed_kind(run)
    return "assumed" if len(guessed) == len(deciding(run)) else "predicted"


def given_results(run: Run) -> tuple[str, ...]:
    """Results of ``run`` that were given to it as such: nothing computes them."""
    given = isinstance(run.rig, CantileverRig) and run.rig.mode == "angle"
    return ("overhang_mm",) if given else ()


def cell_row_kind(fabric: Fabric, quantity: str) -> RowKind:
    """Kind of ``thickness_mm`` or ``area_mass_g_m2`` of the relaxed cell, which nothing is given."""
    if _names_row(fabric, "meso", "", quantity):
        return "tuned"
    return "assumed" if len(cell_assumed_inputs(fabric, quantity)) == len(CELL[quantity]) else "predicted"


def assumed_inputs(run: Run) -> tuple[str, ...]:
    """Fields that decide the compared rows of ``run`` and are assumed, or another fabric's, which is then named."""
    if isinstance(run.rig, FrictionRig):
        return _default_friction(run.fabric, run.rig)
    return _guessed(run.fabric, deciding(run))


def cell_assumed_inputs(fabric: Fabric, quantity: str) -> tuple[str, ...]:
    """The same for a row of the relaxed cell."""
    return _guessed(fabric, CELL[quantity])


def quantities(model: BaseModel) -> Iterator[Quantity]:
    """All quantities below ``model``."""
    for name in type(model).model_fields:
        value = getattr(model, name)
        if isinstance(value, Quantity):
            yield value
        elif isinstance(value, BaseModel):
            yield from quantities(value)


def _fed_kind(run: Run) -> RowKind:
    if isinstance(run.rig, CantileverRig):
        return "tuned" if run.rig.mode == "overhang" else "input"
    law = run.fabric.macro.shear
    if run.rig.kind == "picture-frame" and law.source in ("predicted", "tuned"):
        return "predicted" if law.source == "predicted" else "tuned"
    return "input"


def _default_friction(fabric: Fabric, rig: FrictionRig) -> tuple[str, ...]:
    """The rig's own coefficient is that of the paper's fabrics: assumed for all others."""
    same = rig.kinetic_coefficient == FrictionRig.model_fields["kinetic_coefficient"].default
    own = "friction" in fabric.rigs or (fabric.experiment or "").rpartition("/")[2] == DEFAULT_FRICTION_OF
    return (f"rig.kinetic_coefficient (the default, that of {DEFAULT_FRICTION_OF})",) if same and not own else ()


def _guessed(fabric: Fabric, fields: Sequence[str]) -> tuple[str, ...]:
    owners = borrowed(fabric)
    found = []
    for field in fields:
        if field in owners:
            found.append(f"{field} (from {owners[field]})")
        elif getattr(_at(fabric, field), "source", None) == "assumed":
            found.append(field)
    return tuple(found)


def _at(fabric: Fabric, field: str) -> object:
    """Entry of ``field``; a path of a curve has no source."""
    value: object = fabric
    for part in field.split("."):
        value = value.get(part) if isinstance(value, dict) else getattr(value, part, None)
    return value


def tuning_labels(fabric: Fabric, scale: Scale, direction: str, quantity: str) -> list[str]:
    """Rows and curves with ``quantity`` that numbers which ``scale`` reads were tuned on or chosen with in view."""
    unread = YARN_LEVEL if scale == "macro" else ("macro",)
    read = fabric.model_copy(update=dict.fromkeys(unread))
    labels = dict.fromkeys(label for q in quantities(read) for label in (*q.tuned_on, *q.chosen_by))
    return [label for label in labels if _is_row(label, fabric.experiment_variant, direction, quantity)]


def is_curve(label: str, direction: str) -> bool:
    """Tell whether ``label`` of a row or curve means a curve of ``direction``."""
    return label.startswith(f"{direction} curve ".lstrip())


def _names_row(fabric: Fabric, scale: Scale, direction: str, quantity: str) -> bool:
    return bool(tuning_labels(fabric, scale, direction, quantity))


def _is_row(label: str, variant: str | None, direction: str, quantity: str) -> bool:
    """Tell whether ``label`` means the row; one without a variant is of the fabric's own.

    A curve of the direction has its peak in it, and a value given to a calibration is that of its row.
    """
    own = label.removeprefix(f"V{variant} ") if variant else label
    names: Sequence[str] = [quantity, ROW_NAMES.get(quantity, ""), OTHER_NAMES.get(quantity, "")]
    rows = [f"{direction} {name}".strip() for name in names if name]
    return own in rows or own.startswith(f"{rows[0]} = ") or is_curve(own, direction)
