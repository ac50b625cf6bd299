"""Config files to start from: commented templates of all fields, and fabrics from data sheets and imported tests."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from knittest.base.errors import InputError
from knittest.base.kinds import DEFAULT
from knittest.config.base import Quantity, field_meta
from knittest.config.fabric import CARD, YARN_LEVEL, Fabric, contact_of, makes_mass, mass_and_thickness
from knittest.config.messages import input_error
from knittest.config.run import RUNS, Solver, rig_model
from knittest.config.settings import Layers
from knittest.config.sources import settle_data_paths
from knittest.config.yaml_loader import Document, KeyPath, describe, dotted, load_yaml, parse_value
from knittest.config.yarn import KnittingYarn, ReinforcingYarn

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


YarnSystem = Literal["reinforcing", "knitting"]
#: part of a fabric file that an import writes
FABRIC = "fabric.yaml"
#: fields of the card of the shells that go with another one
TOGETHER = {"tension": ("fracture_strain",)}
#: fields of a shear law of which one excludes the others
LAWS = ("stiffness", "curve", "points", "source", "ref", "definition")


def starting_text(
    name: str, like: Fabric, folder: Path | None = None, yarns: Mapping[YarnSystem, str] | None = None
) -> str:
    """Text of a fabric file ``name`` with the numbers of ``like``, assumed, and those of an import's ``folder``.

    ``yarns`` are texts as "E-glass 600 tex", or cards in YAML, from which the yarns of a system are derived. Raises
    :class:`InputError` when one of them is none, the folder is no import, its file is no part of a fabric, what it
    names cannot be found from here, or its numbers and the assumed ones exclude each other.
    """
    start = taken_over(like, name)
    own = []
    for system, text in (yarns or {}).items():
        start = start.model_copy(update={system: _yarn(system, text)})
        own.append(f"The numbers of {system} are derived from {text}, and so are area_mass and thickness.")
    if yarns:
        start = start.model_copy(
            update={name: Quantity.model_validate(made) for name, made in mass_and_thickness(start).items()}
        )
    if start.knitting is not None and start.contact is not None and _follows(like, yarns):
        made = contact_of(start.knitting, start.contact.model_dump())["normal_stiffness"]
        contact = start.contact.model_copy(update={"normal_stiffness": Quantity.model_validate(made)})
        start = start.model_copy(update={"contact": contact})
        own.append("contact.normal_stiffness is derived from the yarn of the loops.")
    if folder is None:
        without = start.macro.model_copy(update=_absent(CARD))
        return fabric_template(start.model_copy(update={"macro": without}), like.name, own)
    document = _part(folder)
    fabric = _laid_over(start, document)
    own += [
        f"Started from {folder / FABRIC}: of the imported tests are",
        *(f"  {dotted(path)}" for path in _stated(document.data)),
    ]
    if fabric.reinforcing is None:
        own.append(f"Yarns of {like.name} cannot make this area mass and are left out: --scale meso needs others.")
    return fabric_template(fabric, like.name, own)


def _follows(like: Fabric, yarns: Mapping[YarnSystem, str] | None) -> bool:
    """Tell whether the contact stiffness follows the loop yarn: that of ``like`` is a guess or another yarn's."""
    assert like.contact is not None
    return "knitting" in (yarns or {}) or like.contact.normal_stiffness.source == "assumed"


def _yarn(system: YarnSystem, text: str) -> ReinforcingYarn | KnittingYarn:
    """Yarn of ``system`` from the text of its data sheet."""
    said = f"--{system} {text!r}"
    if text.lstrip().startswith("{"):
        card = parse_value(text, said)
    elif found := re.fullmatch(r"\s*(\D*[^\d\s,])[\s,]+(\d.*)", text):
        card = dict(zip(("fibre", "linear_density"), found.groups(), strict=True))
    else:
        raise InputError(f'{said}: expected a fibre and its linear density, such as "E-glass 600 tex"')
    layers, model = Layers(), ReinforcingYarn if system == "reinforcing" else KnittingYarn
    layers.lay(card, lambda path: said)
    try:
        return model.model_validate(card)
    except ValidationError as error:
        raise input_error(error, layers, model) from None


def _absent(parts: Iterable[str]) -> dict[str, None]:
    """Fields of a card without ``parts``, which are then derived from yarns."""
    return dict.fromkeys(name for part in parts for name in (part, *TOGETHER.get(part, ())))


def _part(folder: Path) -> Document:
    if folder.is_dir() and not (folder / FABRIC).is_file():
        raise InputError(
            f"--from {folder}: no {FABRIC} in it; knittest data import FILES --out {folder} writes one with the tests"
        )
    if not folder.is_dir():
        raise InputError(f"--from {folder}: expected the folder that knittest data import wrote (its --out)")
    document = load_yaml(folder / FABRIC)
    if not isinstance(document.data, dict):
        raise InputError(f"{document.where(())}: expected a part of a fabric file, found {describe(document.data)}")
    return document


def _laid_over(start: Fabric, document: Document) -> Fabric:
    """``start`` with what ``document`` states, each number with its own source; without yarns that cannot make the area
    mass it states, else without the parts of the card of the shells that it does not state.
    """
    layers = Layers()
    layers.lay(start.model_dump(mode="json"), lambda path: f"{start.name}, as started", ("fabric",))
    law = Layers(document.data).get(("macro", "shear"))
    if isinstance(law, dict):  # its own law stands alone
        layers.lay(
            {key: _empty(key) for key in LAWS if key not in law}, lambda path: "defaults", ("fabric", "macro", "shear")
        )
    stated = {key: value for key, value in document.data.items() if key != "name"}
    mass = Layers(stated).get(("area_mass", "value"))
    if isinstance(mass, int | float) and not makes_mass(start, mass):
        layers.lay(dict.fromkeys(YARN_LEVEL), lambda path: f"{start.name}, as started", ("fabric",))
    else:
        own = Layers(stated).get(("macro",)) or {}
        absent = _absent(part for part in CARD if not {part, *TOGETHER.get(part, ())} & set(own))
        layers.lay(absent, lambda path: f"{start.name}, as started", ("fabric", "macro"))
    layers.lay(stated, lambda path: document.where(path[1:]), ("fabric",))
    try:
        run = RUNS[DEFAULT].model_validate({"fabric": layers.data["fabric"], "model": {"scale": "macro"}})
    except ValidationError as error:
        raise input_error(error, layers) from None
    settle_data_paths(run, layers, [Path("configs")])
    return run.fabric


def _empty(key: str) -> Any:
    return {"points": [], "ref": "", "definition": "conjugate"}.get(key)


def _stated(data: dict[str, Any], at: KeyPath = ()) -> list[KeyPath]:
    """Paths of all that a part states and does not assume: a quantity, a law or the rig of a test as one."""
    found: list[KeyPath] = []
    for key, value in data.items():
        if isinstance(value, dict) and value.get("source") == "assumed":
            continue
        nested = isinstance(value, dict) and not {"value", "kind"} & value.keys() and at != ("rigs",)
        found += _stated(value, (*at, key)) if nested else [(*at, key)]
    return found
