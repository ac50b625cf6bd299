"""Origin of compared numbers: predicted, tuned, input or assumed, and the fabric of the measurement."""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, Literal, TypeVar

from pydantic import BaseModel

from knittest.base.errors import InputError
from knittest.base.files import data_dir, read_regular
from knittest.base.kinds import JoinedParts, Parts, check_method_names
from knittest.config.base import Quantity
from knittest.config.fabric import YARN_LEVEL, Fabric
from knittest.config.loading import other_direction_fields, rig_default_paths, rig_default_value
from knittest.config.quality_checks import (
    CELL,
    deciding_fields,
    field_value,
    is_in_macro_card,
    meso_run_behind_card,
    reproduces_input,
)
from knittest.config.run import Run, Scale
from knittest.config.yarn_card import SETTINGS, is_filled

MAX_BYTES = 10_000_000
#: line in the head of a curve
FABRIC = "fabric"
#: reference of a number that knittest new took over
_AS = re.compile(r"as (\S+?)(, scaled by the yarn diameters)?")


def borrowed_curves(fabric: Fabric) -> dict[str, str]:
    """Name of the other fabric by field, ``macro.tension.warp`` for example, for each curve that states one."""
    linear = fabric.macro.shear is not None and fabric.macro.shear.kind == "linear"
    curves = {name: text for name, text in fabric.macro.curve_files.items() if not (linear and name == "shear")}
    owners = {f"macro.{name}": _stated_fabric(data_dir() / text) for name, text in curves.items()}
    return {field: owner for field, owner in owners.items() if owner not in ("", fabric.name)}


def owner_of(fabric: Fabric, field: str) -> str:
    """Name of the other fabric that the number or curve ``field`` was taken from, empty where it is its own."""
    stated = field_value(fabric, field)
    if getattr(stated, "source", None) == "assumed" and (named := _AS.fullmatch(getattr(stated, "ref", ""))):
        return named[1]
    return borrowed_curves(fabric).get(field, "")


def _stated_fabric(path: Path) -> str:
    """Return the fabric in the ``# fabric:`` line of a curve; empty if there is none or it cannot be read."""
    try:
        lines = read_regular(path, MAX_BYTES, "a curve has fewer points").decode("utf-8-sig").splitlines()
    except (InputError, UnicodeDecodeError):
        return ""
    heads = (line[1:].partition(":") for line in lines if line.startswith("#"))
    return next((value.strip() for key, _, value in heads if key.strip() == FABRIC), "")


#: Coulomb coefficients of a rig
COEFFICIENTS = ("static_coefficient", "kinetic_coefficient")
#: experiment whose friction is the rigs' default
DEFAULT_FRICTION_OF = "pham2019"


def assumed_friction(run: Run) -> tuple[str, ...]:
    """Friction coefficients of ``run`` that are assumed: measured in the other direction only, or the defaults."""
    fabric, kind = run.fabric, run.rig.kind
    own = rig_default_paths(fabric.rigs.get(kind, {}), kind, run.direction)
    other = other_direction_fields(fabric, kind, run.direction)
    papers = (fabric.experiment or "").rpartition("/")[2] == DEFAULT_FRICTION_OF
    reasons: dict[str, list[str]] = {}
    for name in (name for name in COEFFICIENTS if name in type(run.rig).model_fields):
        value = getattr(run.rig, name)
        if name in other and value == rig_default_value(fabric, kind, own[name]):
            reasons.setdefault(f"as {other[name]}, the only direction tested", []).append(f"rig.{name}")
        elif value == type(run.rig).model_fields[name].default and name not in own and not papers:
            reasons.setdefault(f"default, measured on the fabrics of {DEFAULT_FRICTION_OF}", []).append(f"rig.{name}")
    return tuple(f"{' and '.join(fields)} ({reason})" for reason, fields in reasons.items())


RowKind = Literal["predicted", "tuned", "input", "assumed"]
RunT = TypeVar("RunT", bound=Run)
#: present name of each renamed method of an origin
OLD_METHODS = {"given": "given_results", "fed": "input_row_kind", "assumed": "assumed_inputs"}


class Origin(Generic[RunT]):
    """Origin of the rows of a test; by default only the numbers of the fabric are inputs."""

    def __init_subclass__(cls) -> None:
        check_method_names(cls, OLD_METHODS)

    def given_results(self, run: RunT) -> tuple[str, ...]:
        """Results of ``run`` that are inputs and not computed."""
        return ()

    def input_row_kind(self, run: RunT) -> RowKind:
        """Kind of the rows of a ``run`` that returns its input."""
        return "input"

    def assumed_inputs(self, run: RunT) -> tuple[str, ...]:
        """Fields that decide the rows of ``run`` and are assumed, or taken from another fabric, which is named."""
        return assumed_fields(run.fabric, deciding_fields(run))

    def given_curve_part(self, run: RunT, path: Path) -> str:
        """Part of the curve in ``path`` that is an input of ``run``, besides its macro curves; empty if none."""
        return ""


#: origin by test; each takes runs of its own kind
ORIGINS: Mapping[str, Origin[Any]] = Parts(lambda kind: kind.load("origin")() if kind.origin else Origin())


def assumed_fields(fabric: Fabric, fields: Sequence[str]) -> tuple[str, ...]:
    """Fields of ``fabric`` that are assumed, or taken from another fabric, which is named.

    For a number of a yarn card that was derived from an assumed one, such as the fracture strain from the efficiency,
    that one.
    """
    owners = borrowed_curves(fabric)
    found = []
    for field in fields:
        value = field_value(fabric, field)
        if field in owners:
            found.append(f"{field} (from {owners[field]})")
        elif getattr(value, "source", None) == "assumed":
            found.append(field)
        elif is_filled(value):
            card = next((one for one in fabric.yarn_cards if field.startswith(f"{one}.")), "")
            name = field.removeprefix(f"{card}.").partition(".")[0]
            settings = [f"{card}.{setting}" for setting, derived in SETTINGS.items() if derived == name]
            found += [one for one in settings if getattr(field_value(fabric, one), "source", None) == "assumed"]
    return tuple(dict.fromkeys(found))


#: names of rows as ``tuned_on`` and ``chosen_by`` write them, after variant and direction: "V1 warp max. tensile force"
ROW_NAMES: Mapping[str, str] = JoinedParts("row_names", {"thickness_mm": "thickness", "area_mass_g_m2": "area mass"})
#: the same row by another name
OTHER_NAMES: Mapping[str, str] = JoinedParts("other_names")


def row_kind(run: Run, quantity: str) -> RowKind:
    """Kind of ``quantity`` in the direction of ``run``.

    ``tuned``: a number of the fabric was fitted to the row or selected with it. ``input``: the row is an input that the
    model returns, such as macro curves and friction. ``assumed``: the input, or all numbers that decide the row, are
    assumed or taken from another fabric. Bending follows from the overhang by Eq. 2: an overhang that is found again is
    tuned, a given one is an input. Macro rows of a derived material card have the kind of their meso inputs.
    """
    origin, run = ORIGINS[run.rig.kind], meso_run_behind_card(run)
    if quantity in origin.given_results(run):
        return "input"
    if tuning_labels(run.fabric, run.model.scale, run.direction, quantity):
        return "tuned"
    unknown = origin.assumed_inputs(run)
    if reproduces_input(run):
        return "assumed" if unknown else origin.input_row_kind(run)
    return "assumed" if len(unknown) == len(deciding_fields(run)) else "predicted"


def given_results(run: Run) -> tuple[str, ...]:
    """Results of ``run`` that are inputs and not computed."""
    return ORIGINS[run.rig.kind].given_results(run)


def assumed_inputs(run: Run) -> tuple[str, ...]:
    """Fields that decide the compared rows of ``run`` and are assumed, or taken from another fabric, which is named."""
    found, yarns = ORIGINS[run.rig.kind].assumed_inputs(run), meso_run_behind_card(run)
    if yarns is run:
        return found
    return (*ORIGINS[run.rig.kind].assumed_inputs(yarns), *(name for name in found if not is_in_macro_card(name)))


def cell_row_kind(fabric: Fabric, quantity: str) -> RowKind:
    """Kind of ``thickness_mm`` or ``area_mass_g_m2`` of the relaxed cell, which has no inputs."""
    if tuning_labels(fabric, "meso", "", quantity):
        return "tuned"
    return "assumed" if len(cell_assumed_inputs(fabric, quantity)) == len(CELL[quantity]) else "predicted"


def cell_assumed_inputs(fabric: Fabric, quantity: str) -> tuple[str, ...]:
    """Fields that decide ``quantity`` of the relaxed cell and are assumed, or taken from another fabric."""
    return assumed_fields(fabric, CELL[quantity])


def quantities(model: BaseModel) -> Iterator[Quantity]:
    """All quantities below ``model``."""
    for name in type(model).model_fields:
        value = getattr(model, name)
        for one in value if isinstance(value, list) else (value,):
            if isinstance(one, Quantity):
                yield one
            elif isinstance(one, BaseModel):
                yield from quantities(one)


def tuning_labels(fabric: Fabric, scale: Scale, direction: str, quantity: str) -> list[str]:
    """Rows and curves with ``quantity`` that numbers read at ``scale`` were fitted to or selected with."""
    unread = YARN_LEVEL if scale == "macro" else ("macro",)
    read = fabric.model_copy(update=dict.fromkeys(unread))
    names = [quantity, ROW_NAMES.get(quantity, ""), OTHER_NAMES.get(quantity, "")]
    rows = [f"{direction} {name}".strip() for name in names if name]

    def is_row(label: str) -> bool:  # or a curve of the direction, which contains its peak
        own = label.removeprefix(f"V{fabric.experiment_variant} ")
        return own in rows or own.startswith(f"{rows[0]} = ") or is_curve(own, direction)

    labels = dict.fromkeys(label for q in quantities(read) for label in (*q.tuned_on, *q.chosen_by))
    return list(filter(is_row, labels))


def is_curve(label: str, direction: str) -> bool:
    """Return whether ``label`` of a row or curve names a curve of ``direction``."""
    return label.startswith(f"{direction} curve ".lstrip())
