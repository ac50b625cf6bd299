"""Fabric files that start from a shipped structure: its stitches and layers, with yarns by their data sheets."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from textwrap import wrap
from typing import Any

from pydantic import BaseModel

from knittest.base.errors import InputError
from knittest.base.files import structures
from knittest.base.kinds import DEFAULT
from knittest.config.base import Quantity
from knittest.config.fabric import Fabric
from knittest.config.fields import model_of
from knittest.config.settings import Layers
from knittest.config.templates import (
    SCALED,
    YarnSystem,
    checked_fabric,
    field_comment,
    read_import,
    read_yarn_card,
    scale_to_yarns,
)
from knittest.config.yaml_loader import Document, load_yaml
from knittest.config.yaml_writer import flow_text

#: characters of a line
WIDTH = 110
#: first fields of the file
FIRST = ("name", "title", "stitches", "layers", "warp_density", "weft_density", "loop_length")


def new_structure_text(
    name: str, structure: str, folder: Path | None = None, yarns: Mapping[YarnSystem, str] | None = None
) -> str:
    """Text of a fabric file ``name`` with the stitches and layers of a shipped ``structure``.

    ``yarns`` are texts such as "E-glass 600 tex", or yarn cards in YAML, and ``folder`` that of an import. Raises
    :class:`InputError` for an unknown structure, and as :func:`knittest.config.templates.new_fabric_text`.
    """
    shipped = structures()
    if structure not in shipped:
        raise InputError(f"--structure {structure}: no such structure; expected one of {', '.join(shipped)}")
    document = load_yaml(shipped[structure])
    data = _as_assumed(document.data, f"as {structure}") | {"name": name}
    data = {"stitches": ["k"], "layers": []} | data
    like, notes = _checked(data | {"name": structure}, document), []
    for system, text in (yarns or {}).items():
        if system == "reinforcing" and all(layer.yarn is not None for layer in like.layers or []):
            raise InputError(f"--reinforcing {text!r}: no layer of {structure} uses fabric.reinforcing; leave it out")
        data[system] = read_yarn_card(system, text)
    if yarns:
        scaled = scale_to_yarns(_checked(data, document), like)
        data |= {name: _entry(getattr(scaled, name)) for name in SCALED}
        notes.append(f"Densities and loop_length are those of {structure}, scaled to the diameters of the yarns.")
    if folder is not None:
        part = read_import(folder)
        layers = Layers()
        layers.lay({"fabric": data}, lambda path: f"{name}, as started")
        stated = {key: value for key, value in part.data.items() if key != "name"}
        layers.lay(stated, lambda path: part.place_of(path[1:]), ("fabric",))
        checked_fabric(layers)
        data = layers.data["fabric"]
        notes.append(f"Numbers of the imported tests are from {folder}.")
    return "\n".join([*_head(name, structure, shipped[structure], notes), "", *_body(data, Fabric)]) + "\n"


def _checked(data: dict[str, Any], document: Document) -> Fabric:
    layers = Layers()
    layers.lay({"fabric": data}, lambda path: document.place_of(path[1:]))
    return checked_fabric(layers)


def _as_assumed(value: Any, ref: str) -> Any:
    """Copy of ``value`` in which each quantity states ``ref`` as the reason of its assumption."""
    if isinstance(value, list):
        return [_as_assumed(one, ref) for one in value]
    if not isinstance(value, dict):
        return value
    if "value" in value:
        return value | {"source": "assumed", "ref": ref}
    return {key: _as_assumed(one, ref) for key, one in value.items()}


def _entry(quantity: Quantity) -> dict[str, Any]:
    return {"value": quantity.value, "source": quantity.source, "ref": quantity.ref}


def _head(name: str, structure: str, path: Path, notes: list[str]) -> Iterator[str]:
    yield f"# Fabric {name}, from the shipped structure {structure}:"
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        if not line.startswith("# A made-up fabric"):
            yield f"#   {line.removeprefix('# ')}"
    yield from (f"# {line}" for line in notes)
    yield "# Numbers without an own source are assumed: replace them by yours, with their source: measured, derived"
    yield "# (ref: the formula), tuned (tuned_on: [results it was fitted to]) or assumed; sd: standard deviation."
    yield "# Fields that this file leaves out are derived from the yarns: area_mass, thickness, contact, macro and the"
    yield "# other numbers of the yarns. knittest schema fabric lists all fields. Use the file with"
    yield f"#   knittest fabric relax --variant {name}"
    yield f"#   knittest {DEFAULT} --variant {name} --preset quick"
    yield "# Without inlays along the pull a strip of standard size takes up to an hour."


def _body(data: Mapping[str, Any], model: type[BaseModel], level: int = 0) -> Iterator[str]:
    """Lines of the fields of ``model`` in ``data``, each with its description as a comment."""
    indent = "  " * level
    names = [*(name for name in FIRST if not level), *(name for name in data if level or name not in FIRST)]
    for name in (name for name in names if name in data):
        info, value = model.model_fields.get(name), data[name]
        inner = None if info is None else model_of(info.annotation)
        if info is not None:
            yield from (f"{indent}# {line}" for line in wrap(field_comment(model, name), WIDTH))
        line = f"{indent}{name}: {flow_text(value)}"
        if isinstance(value, list) and value and isinstance(value[0], dict):
            yield f"{indent}{name}:"
            yield from (f"{indent}  - {flow_text(one)}" for one in value)
        elif isinstance(value, dict) and inner not in (None, Quantity) and len(line) > WIDTH:
            yield f"{indent}{name}:"
            yield from _body(value, inner, level + 1)
        else:
            yield line
