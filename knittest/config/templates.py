"""Commented config files to start from, written from the models: their fields, units, bounds and defaults."""

import json
from collections.abc import Iterator, Sequence
from typing import Any, TypeVar, get_args

from pydantic import BaseModel

from knittest.base.kinds import DEFAULT
from knittest.config.base import Quantity, field_meta
from knittest.config.fabric import Fabric
from knittest.config.run import Solver, rig_model

Model = TypeVar("Model", bound=BaseModel)

#: fields of the rig that something else decides unless the file does: written as comments
DECIDED_ELSEWHERE = {
    "direction": "--direction decides; both by default",
    "gauge_length": "--preset decides at the meso scale",
    "speed": "2 at the meso scale, 0.5 at the macro scale",
}


def rig_template(use: str = "--variant 1 --config THIS_FILE") -> str:
    """Rig file of the usual test with every default; ``use`` are the options of the command in its head."""
    head = [
        f"# {DEFAULT.capitalize()} test: rig and solver with their defaults. Use it with",
        f"#   knittest {DEFAULT} {use}",
        "# What stands here goes over the preset; options and --set go over what stands here.",
    ]
    sections = (("rig", rig_model(DEFAULT).model_validate({})), ("solver", Solver.model_validate({})))
    body = [line for name, section in sections for line in ("", f"{name}:", *_fields(section, 1, DECIDED_ELSEWHERE))]
    return "\n".join(head + body) + "\n"


def fabric_template(fabric: Fabric, like: str, own: Sequence[str] = ()) -> str:
    """Fabric file with the numbers of ``fabric``: those of the fabric ``like``, and its ``own``, described by lines."""
    name = fabric.name
    still = "Every number below is still that of" if not own else "What is not listed here is still that of"
    head = [
        *(f"# {line}" for line in own),
        f"# Fabric {name}. {still} {like}, as measured: put in your own, and state its source:",
        "#   measured, derived (ref: the formula), tuned (tuned_on: [rows it was fitted to]) or assumed.",
        "# sd is the standard deviation, in the unit of the value. Use it with",
        f"#   knittest {DEFAULT} --variant {name}",
        "# This file has no parameter sets: do not give --parameters. Sets may be added; --parameters NAME then lays",
        "# one over these numbers, calibrated unless another is named:",
        "#   parameter_sets:",
        "#     as-measured: {}",
        "#     calibrated:",
        "#       reinforcing: {youngs_modulus: {value: 67.5, source: tuned, tuned_on: [warp max. tensile force]}}",
        "# Shells (--scale macro) read area_mass, thickness and the material card below macro:. Parts of the card that",
        "# are null are derived from the yarns when a run needs them, which takes up to three minutes, once.",
        f"# knittest check {DEFAULT} --variant {name} compares these numbers with each other and with your tests.",
        "# To compare with tests of your own, see knittest data import --help and experiment: at the end.",
        "",
    ]
    return "\n".join(head + list(_fields(fabric, 0, {}))) + "\n"


def taken_over(fabric: Fabric, name: str) -> Fabric:
    """``fabric`` as the start of another one called ``name``: all that it says is assumed there, laws too."""
    assumed = _assumed(fabric, f"as {fabric.name}")
    nothing: dict[str, Any] = {"title": "", "experiment": None, "experiment_variant": None, "rigs": {}}
    return assumed.model_copy(update={"name": name, **nothing})


def _assumed(model: Model, ref: str) -> Model:
    """A copy of ``model`` in which every source is ``assumed`` with the reason ``ref``."""
    if isinstance(model, Quantity):
        return model.model_copy(update={"source": "assumed", "ref": ref, "tuned_on": [], "chosen_by": []})
    changed: dict[str, Any] = {
        name: _assumed(value, ref)
        for name in type(model).model_fields
        if isinstance(value := getattr(model, name), BaseModel)
    }
    if made := getattr(model, "description", ""):
        changed["description"] = f"{ref}: {made}"
    if getattr(model, "source", None) is not None:  # a law with a source of its own
        changed |= {"source": "assumed", "ref": ref}
    return model.model_copy(update=changed)


def _fields(model: BaseModel, level: int, commented_out: dict[str, str]) -> Iterator[str]:
    indent = "  " * level
    for name, info in type(model).model_fields.items():
        value = getattr(model, name)
        if name == "kind" and len(get_args(info.annotation)) == 1:
            continue  # no choice to make
        if info.description:
            yield f"{indent}# {_comment(type(model), name)}"
        if isinstance(value, BaseModel) and not isinstance(value, Quantity):
            yield f"{indent}{name}:"
            yield from _fields(value, level + 1, {})
        elif name in commented_out:
            yield f"{indent}# {name}: {_flow(value)}  ({commented_out[name]})"
        else:
            yield f"{indent}{name}: {_flow(value)}"


def _comment(model: type[BaseModel], name: str) -> str:
    info, meta = model.model_fields[name], field_meta(model, name)
    notes = [meta["unit"] if meta["unit"] != "1" else "dimensionless"] if "unit" in meta else []
    if "least" in meta:
        notes.append(f"0, or from {meta['least']:g} to {meta['le']:g}")
    if "band" in meta:
        notes.append(f"{meta['band'][0]:g} to {meta['band'][1]:g}")
    choices = [str(a) for a in get_args(info.annotation) if isinstance(a, str)]
    if choices:
        notes.append(" | ".join(choices))
    return str(info.description) + (f" [{', '.join(notes)}]" if notes else "")


def _flow(value: object) -> str:
    if isinstance(value, Quantity):
        scatter = "" if value.sd is None else f", sd: {value.sd:g}"
        rows = "".join(f", {n}: {json.dumps(r)}" for n in ("tuned_on", "chosen_by") if (r := getattr(value, n)))
        shown = json.dumps(value.ref, ensure_ascii=False)
        return f"{{value: {json.dumps(value.value)}{scatter}, source: {value.source}{rows}, ref: {shown}}}"
    return json.dumps(value, ensure_ascii=False)  # JSON is YAML 1.2
