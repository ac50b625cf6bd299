"""Says of a compared row what its simulated number is worth: predicted, tuned on it, its own input, or assumed."""

from collections.abc import Iterator, Mapping, Sequence

from pydantic import BaseModel

from knittest.base.kinds import Joined
from knittest.config.base import Quantity
from knittest.config.deciding import CELL, by_its_yarns, deciding, in_card, is_fed
from knittest.config.fabric import YARN_LEVEL, Fabric
from knittest.config.run import Run, Scale
from knittest.experiment.origin import ORIGINS, RowKind, guessed

#: names of rows as ``tuned_on`` and ``chosen_by`` write them, after variant and direction: "V1 warp max. tensile force"
ROW_NAMES: Mapping[str, str] = Joined("row_names", {"thickness_mm": "thickness", "area_mass_g_m2": "area mass"})
#: the same row by another name
OTHER_NAMES: Mapping[str, str] = Joined("other_names")


def row_kind(run: Run, quantity: str) -> RowKind:
    """Kind of ``quantity`` in the direction of ``run``.

    ``tuned``: a number of the fabric was fitted to the row, or chosen with it in view. ``input``: the model was given
    the row and returns it, as shells return their curves, and faces their friction. ``assumed``: what it was given, or
    every number that decides the row, is assumed or another fabric's. Bending follows from the overhang by Eq. 2: an
    overhang that is found again is tuned, one that is given an input, whatever else is assumed. Rows of shells whose
    card was derived from the yarns are worth what their yarns are.
    """
    origin, run = ORIGINS[run.rig.kind], by_its_yarns(run)
    if quantity in origin.given(run):
        return "input"
    if _names_row(run.fabric, run.model.scale, run.direction, quantity):
        return "tuned"
    unknown = origin.assumed(run)
    if is_fed(run):
        return "assumed" if unknown else origin.fed(run)
    return "assumed" if len(unknown) == len(deciding(run)) else "predicted"


def given_results(run: Run) -> tuple[str, ...]:
    """Results of ``run`` that were given to it as such: nothing computes them."""
    return ORIGINS[run.rig.kind].given(run)


def assumed_inputs(run: Run) -> tuple[str, ...]:
    """Fields that decide the compared rows of ``run`` and are assumed, or another fabric's, which is then named."""
    found, yarns = ORIGINS[run.rig.kind].assumed(run), by_its_yarns(run)
    if yarns is run:
        return found
    return (*ORIGINS[run.rig.kind].assumed(yarns), *(name for name in found if not in_card(name)))


def cell_row_kind(fabric: Fabric, quantity: str) -> RowKind:
    """Kind of ``thickness_mm`` or ``area_mass_g_m2`` of the relaxed cell, which nothing is given."""
    if _names_row(fabric, "meso", "", quantity):
        return "tuned"
    return "assumed" if len(cell_assumed_inputs(fabric, quantity)) == len(CELL[quantity]) else "predicted"


def cell_assumed_inputs(fabric: Fabric, quantity: str) -> tuple[str, ...]:
    """The same for ``quantity``, a row of the relaxed cell."""
    return guessed(fabric, CELL[quantity])


def quantities(model: BaseModel) -> Iterator[Quantity]:
    """All quantities below ``model``."""
    for name in type(model).model_fields:
        value = getattr(model, name)
        if isinstance(value, Quantity):
            yield value
        elif isinstance(value, BaseModel):
            yield from quantities(value)


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
