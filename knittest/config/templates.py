"""Templates of config files: rigs, and fabrics from data sheets and imported tests."""

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
from knittest.config.sources import resolve_data_paths
from knittest.config.yaml_loader import Document, KeyPath, dotted_path, load_yaml, parse_value
from knittest.config.yarn import KnittingYarn, ReinforcingYarn

Model = TypeVar("Model", bound=BaseModel)

#: fields of the rig that are decided elsewhere unless the file has them, written as comments
DECIDED_ELSEWHERE = {
    "direction": "decided by --direction; both by default",
    "gauge_length": "decided by --preset at the meso scale",
    "speed": "2 at the meso scale, 0.5 at the macro scale",
}


def rig_template(use: str = "--variant 1 --config THIS_FILE") -> str:
    """Rig file of the default test with all defaults; ``use`` are the options of the command in its head."""
    head = [
        f"# {DEFAULT.capitalize()} test: rig and solver with their defaults. Use it with",
        f"#   knittest {DEFAULT} {use}",
        "# Values here override the preset; options and --set override values here.",
    ]
    sections = (("rig", rig_model(DEFAULT).model_validate({})), ("solver", Solver.model_validate({})))
    body = [line for name, section in sections for line in ("", f"{name}:", *_fields(section, 1, DECIDED_ELSEWHERE))]
    return "\n".join(head + body) + "\n"


def fabric_template(fabric: Fabric, like: str, own: Sequence[str] = ()) -> str:
    """Fabric file with the numbers of ``fabric``, taken from ``like`` except those that the lines ``own`` list."""
    name = fabric.name
    rest = "All numbers are those of" if not own else "All other numbers are those of"
    head = [
        *(f"# {line}" for line in own),
        f"# Fabric {name}. {rest} {like}, as measured: replace them by your own, with their source:",
        "#   measured, derived (ref: the formula), tuned (tuned_on: [results it was fitted to]) or assumed.",
        "# sd is the standard deviation, in the unit of the value. Use the file with",
        f"#   knittest {DEFAULT} --variant {name}",
        "# This file has no parameter sets: leave out --parameters. With sets, --parameters NAME overrides these "
        "numbers",
        "# by those of the set NAME; the default is calibrated:",
        "#   parameter_sets:",
        "#     as-measured: {}",
        "#     calibrated:",
        "#       reinforcing: {youngs_modulus: {value: 67.5, source: tuned, tuned_on: [warp max. tensile force]}}",
        "# The macro model (--scale macro) uses area_mass, thickness and the material card below macro:. Parts of the "
        "card",
        "# that are null are derived from the yarns when a run needs them, once, in up to three minutes.",
        f"# knittest check {DEFAULT} --variant {name} compares these numbers with each other and with your tests.",
        "# To compare with your own tests, see knittest data import --help and experiment: at the end.",
        "",
    ]
    return "\n".join(head + list(_fields(fabric, 0, {}))) + "\n"


def copy_as_assumed(fabric: Fabric, name: str) -> Fabric:
    """Fabric ``name`` with all numbers and laws of ``fabric``, marked as assumed."""
    assumed = _mark_assumed(fabric, f"as {fabric.name}")
    nothing: dict[str, Any] = {"title": "", "experiment": None, "experiment_variant": None, "rigs": {}}
    return assumed.model_copy(update={"name": name, **nothing})


def _mark_assumed(model: Model, ref: str) -> Model:
    """Copy of ``model`` in which every source is ``assumed`` with the reason ``ref``."""
    if isinstance(model, Quantity):
        return model.model_copy(update={"source": "assumed", "ref": ref, "tuned_on": [], "chosen_by": []})
    changed: dict[str, Any] = {
        name: _mark_assumed(value, ref)
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
            continue  # no choice
        if info.description:
            yield f"{indent}# {field_comment(type(model), name)}"
        if isinstance(value, BaseModel) and not isinstance(value, Quantity):
            yield f"{indent}{name}:"
            yield from _fields(value, level + 1, {})
        elif name in commented_out:
            yield f"{indent}# {name}: {_flow_text(value)}  ({commented_out[name]})"
        else:
            yield f"{indent}{name}: {_flow_text(value)}"


def field_comment(model: type[BaseModel], name: str) -> str:
    """Description of a field with its unit, bounds and choices."""
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


def _flow_text(value: object) -> str:
    if isinstance(value, Quantity):
        scatter = "" if value.sd is None else f", sd: {value.sd:g}"
        rows = "".join(f", {n}: {json.dumps(r)}" for n in ("tuned_on", "chosen_by") if (r := getattr(value, n)))
        shown = json.dumps(value.ref, ensure_ascii=False)
        return f"{{value: {json.dumps(value.value)}{scatter}, source: {value.source}{rows}, ref: {shown}}}"
    return json.dumps(value, ensure_ascii=False)  # JSON is YAML 1.2


YarnSystem = Literal["reinforcing", "knitting"]
#: file of an import with a part of a fabric file
FABRIC = "fabric.yaml"
#: fields of the macro material card that another field needs
TOGETHER = {"tension": ("fracture_strain",)}
#: fields of a shear law that exclude each other
LAWS = ("stiffness", "curve", "points", "source", "ref", "definition")


def new_fabric_text(
    name: str, like: Fabric, folder: Path | None = None, yarns: Mapping[YarnSystem, str] | None = None
) -> str:
    """Text of a fabric file ``name`` with the numbers of ``like``, assumed, and those of the ``folder`` of an import.

    ``yarns`` are texts such as "E-glass 600 tex", or yarn cards in YAML. Raises :class:`InputError` for a wrong yarn, a
    folder that is no import, a missing file, or numbers that contradict each other.
    """
    start = copy_as_assumed(like, name)
    own = []
    for system, text in (yarns or {}).items():
        start = start.model_copy(update={system: _make_yarn(system, text)})
        own.append(f"The numbers of {system}, area_mass and thickness are derived from {text}.")
    if yarns:
        start = scale_to_yarns(start, like)
        own.append(f"The densities and loop_length of {like.name} are scaled to the diameters of these yarns.")
        start = start.model_copy(
            update={name: Quantity.model_validate(made) for name, made in mass_and_thickness(start).items()}
        )
    assert like.contact is not None
    follows = "knitting" in (yarns or {}) or like.contact.normal_stiffness.source == "assumed"
    if start.knitting is not None and start.contact is not None and follows:
        made = contact_of(start.knitting, start.contact.model_dump())["normal_stiffness"]
        contact = start.contact.model_copy(update={"normal_stiffness": Quantity.model_validate(made)})
        start = start.model_copy(update={"contact": contact})
        own.append("contact.normal_stiffness is derived from the knitting yarn.")
    if folder is None:
        without = start.macro.model_copy(update=_empty_parts(CARD))
        return fabric_template(start.model_copy(update={"macro": without}), like.name, own)
    document = read_import(folder)
    fabric = _merge_import(start, document)
    own += [
        f"Numbers of the imported tests, from {folder / FABRIC}:",
        *(f"  {dotted_path(path)}" for path in _given_paths(document.data)),
    ]
    if fabric.reinforcing is None:
        own.append(f"The yarns of {like.name} do not fit this area mass and are left out: --scale meso needs your own.")
    return fabric_template(fabric, like.name, own)


#: fields that :func:`scale_to_yarns` scales
SCALED = ("warp_density", "weft_density", "loop_length")


def scale_to_yarns(fabric: Fabric, like: Fabric) -> Fabric:
    """Copy of ``fabric`` with spacings and loop length of ``like``, scaled by the room that the yarns take: the mean
    diameter of the inlays and a knitting yarn on both of its sides. Otherwise thin yarns form slack loops.
    """
    factor = _room(fabric) / _room(like)
    ref = f"as {like.name}, scaled by the yarn diameters"

    def scaled(name: str, by: float) -> Quantity:
        old: Quantity = getattr(like, name)
        sd = None if old.sd is None else float(f"{by * old.sd:.2g}")
        return Quantity(value=float(f"{by * old.value:.3g}"), sd=sd, source="assumed", ref=ref)

    powers = dict(zip(SCALED, (1.0 / factor, 1.0 / factor, factor), strict=True))
    return fabric.model_copy(update={name: scaled(name, by) for name, by in powers.items()})


def _room(fabric: Fabric) -> float:
    """Mean diameter of the inlays and two diameters of the knitting yarn [mm]."""
    inlays = [one.yarn.beam_diameter.value for one in fabric.inlays]
    return sum(inlays) / max(len(inlays), 1) + 2.0 * fabric.knitting.beam_diameter.value


def _make_yarn(system: YarnSystem, text: str) -> ReinforcingYarn | KnittingYarn:
    """Yarn of ``system`` from a text such as "E-glass 600 tex" or a yarn card."""
    return _checked_yarn(system, text)[1]


def read_yarn_card(system: YarnSystem, text: str) -> dict[str, Any]:
    """Fields of the card of a yarn of ``system`` from a text such as "E-glass 600 tex" or a yarn card.

    Raises :class:`InputError` for a wrong one.
    """
    return _checked_yarn(system, text)[0]


def _checked_yarn(system: YarnSystem, text: str) -> tuple[dict[str, Any], ReinforcingYarn | KnittingYarn]:
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
        return card, model.model_validate(card)
    except ValidationError as error:
        raise input_error(error, layers, model) from None


def _empty_parts(parts: Iterable[str]) -> dict[str, None]:
    """Empty fields of the macro material card for ``parts``, which are then derived from the yarns."""
    return dict.fromkeys(name for part in parts for name in (part, *TOGETHER.get(part, ())))


def read_import(folder: Path) -> Document:
    """Fabric part of the ``folder`` of an import; raises :class:`InputError` if there is none."""
    if not folder.is_dir():
        raise InputError(f"--from {folder}: expected the folder that knittest data import wrote (its --out)")
    if not (folder / FABRIC).is_file():
        raise InputError(f"--from {folder}: it has no {FABRIC}: write it by knittest data import FILES --out {folder}")
    return load_yaml(folder / FABRIC)


def _merge_import(start: Fabric, document: Document) -> Fabric:
    """Lay the numbers of ``document`` with their sources over ``start``.

    Yarns that do not fit its area mass are left out, else the parts of the macro material card that it does not give.
    """
    layers = Layers()
    layers.lay(start.model_dump(mode="json"), lambda path: f"{start.name}, as started", ("fabric",))
    law = Layers(document.data).get(("macro", "shear"))
    if isinstance(law, dict):  # its own law replaces the other as a whole
        layers.lay(
            {key: _empty_value(key) for key in LAWS if key not in law},
            lambda path: "defaults",
            ("fabric", "macro", "shear"),
        )
    stated = {key: value for key, value in document.data.items() if key != "name"}
    mass = Layers(stated).get(("area_mass", "value"))
    if isinstance(mass, int | float) and not makes_mass(start, mass):
        layers.lay(dict.fromkeys(YARN_LEVEL), lambda path: f"{start.name}, as started", ("fabric",))
    else:
        own = Layers(stated).get(("macro",)) or {}
        absent = _empty_parts(part for part in CARD if not {part, *TOGETHER.get(part, ())} & set(own))
        layers.lay(absent, lambda path: f"{start.name}, as started", ("fabric", "macro"))
    layers.lay(stated, lambda path: document.place_of(path[1:]), ("fabric",))
    return checked_fabric(layers)


def checked_fabric(layers: Layers) -> Fabric:
    """Fabric of ``layers``, for a file in ./configs; raises :class:`InputError` naming each wrong field."""
    try:
        run = RUNS[DEFAULT].model_validate({"fabric": layers.data["fabric"], "model": {"scale": "macro"}})
    except ValidationError as error:
        raise input_error(error, layers) from None
    resolve_data_paths(run, layers, [Path("configs")])
    return run.fabric


def _empty_value(key: str) -> Any:
    return {"points": [], "ref": "", "definition": "conjugate"}.get(key)


def _given_paths(data: dict[str, Any], at: KeyPath = ()) -> list[KeyPath]:
    """Paths of all that a part gives and does not assume; a quantity, a law or the rig of a test is one."""
    found: list[KeyPath] = []
    for key, value in data.items():
        if isinstance(value, dict) and value.get("source") == "assumed":
            continue
        nested = isinstance(value, dict) and not {"value", "kind"} & value.keys() and at != ("rigs",)
        found += _given_paths(value, (*at, key)) if nested else [(*at, key)]
    return found
