"""A fabric to start from: a shipped one whose numbers are all assumed, with yarns of data sheets and imported tests."""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import ValidationError

from knittest.base.errors import InputError
from knittest.base.kinds import DEFAULT
from knittest.config.base import Quantity
from knittest.config.fabric import CARD, YARN_LEVEL, Fabric, contact_of, makes_mass, mass_and_thickness
from knittest.config.layers import Layers
from knittest.config.messages import input_error
from knittest.config.paths import settle_data_paths
from knittest.config.run import RUNS
from knittest.config.templates import fabric_template, taken_over
from knittest.config.yaml_loader import Document, KeyPath, describe, dotted, load_yaml, parse_value
from knittest.config.yarn import KnittingYarn, ReinforcingYarn

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
