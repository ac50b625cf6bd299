"""Commented config files to start from, written from the models: their fields, units, bounds and defaults."""

import json
from collections.abc import Iterator
from typing import Any, get_args

from pydantic import BaseModel

from knittest.config.base import Quantity, field_meta
from knittest.config.fabric import Fabric
from knittest.config.rigs import TensileRig
from knittest.config.run import Solver

#: fields of the rig that something else decides unless the file does: written as comments
DECIDED_ELSEWHERE = {
    "direction": "--direction decides; both by default",
    "gauge_length": "--preset decides at the meso scale",
    "speed": "2 at the meso scale, 0.5 at the macro scale",
}


def rig_template(use: str = "--variant 1 --config THIS_FILE") -> str:
    """Rig file of the tensile test with every default; ``use`` are the options of the command in its head."""
    head = [
        "# Tensile test: rig and solver with their defaults. Use it with",
        f"#   knittest tensile {use}",
        "# What stands here goes over the preset; options and --set go over what stands here.",
    ]
    sections = (("rig", TensileRig.model_validate({})), ("solver", Solver.model_validate({})))
    body = [line for name, section in sections for line in ("", f"{name}:", *_fields(section, 1, DECIDED_ELSEWHERE))]
    return "\n".join(head + body) + "\n"


def fabric_template(name: str, like: Fabric) -> str:
    """Fabric file called ``name`` with the numbers of ``like``, each marked as assumed until the user states better."""
    head = [
        f"# Fabric {name}. Every number below is still that of {like.name}: put in your own, and state its source:",
        "#   measured, derived (ref: the formula), tuned (tuned_on: [rows it was fitted to]) or assumed.",
        "# sd is the standard deviation, in the unit of the value. Use it with",
        f"#   knittest tensile --variant {name}",
        f"# They are {like.name}'s as-measured numbers, without parameter sets: leave --parameters away.",
        "# Sets can be added; --parameters NAME lays one over these numbers, calibrated if it is not given:",
        "#   parameter_sets:",
        "#     as-measured: {}",
        "#     calibrated:",
        "#       reinforcing: {youngs_modulus: {value: 67.5, source: tuned, tuned_on: [warp max. tensile force]}}",
        "# To compare with tests of your own, see knittest data import --help and experiment: at the end.",
        "",
    ]
    own = like.model_copy(update={"name": name, "title": "", "experiment": None, "experiment_variant": None})
    return "\n".join(head + list(_fields(own, 0, {}, f"as {like.name}"))) + "\n"


def _fields(model: BaseModel, level: int, commented_out: dict[str, str], ref: str = "") -> Iterator[str]:
    indent = "  " * level
    for name, info in type(model).model_fields.items():
        value = getattr(model, name)
        if name == "kind" and len(get_args(info.annotation)) == 1:
            continue  # no choice to make
        if info.description:
            yield f"{indent}# {_comment(type(model), name)}"
        if isinstance(value, BaseModel) and not isinstance(value, Quantity):
            yield f"{indent}{name}:"
            yield from _fields(value, level + 1, {}, ref)
        elif name in commented_out:
            yield f"{indent}# {name}: {_flow(value, ref)}  ({commented_out[name]})"
        else:
            yield f"{indent}{name}: {_flow(value, ref)}"


def _comment(model: type[BaseModel], name: str) -> str:
    info, meta = model.model_fields[name], field_meta(model, name)
    notes = [meta["unit"] if meta["unit"] != "1" else "dimensionless"] if "unit" in meta else []
    if "band" in meta:
        notes.append(f"{meta['band'][0]:g} to {meta['band'][1]:g}")
    choices = [str(a) for a in get_args(info.annotation) if isinstance(a, str)]
    if choices:
        notes.append(" | ".join(choices))
    return str(info.description) + (f" [{', '.join(notes)}]" if notes else "")


def _flow(value: Any, ref: str) -> str:
    if isinstance(value, Quantity):
        scatter = "" if value.sd is None else f", sd: {value.sd:g}"
        return f"{{value: {json.dumps(value.value)}{scatter}, source: assumed, ref: {json.dumps(ref)}}}"
    return json.dumps(value, ensure_ascii=False)  # JSON is YAML 1.2
