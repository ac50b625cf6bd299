"""Finds the fabric file of a run and applies one of its parameter sets."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from knittest.base.errors import InputError
from knittest.base.resources import configs_dir
from knittest.config.layers import Layers
from knittest.config.messages import unknown
from knittest.config.namesakes import namesake
from knittest.config.yaml_loader import Document, KeyPath, describe, load_yaml

#: the paper's two variants by number
NUMBERED = {"1": "pham2019-v1", "2": "pham2019-v2"}
DEFAULT_SET = "calibrated"
SETS = "parameter_sets"
#: what a run states of a fabric that has no sets
BASE = "base"
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,39}$")


def numbers_of(parameters: str) -> str:
    """Name of a parameter set for a reader; that of a fabric without any says so."""
    return "as in the fabric file" if parameters == BASE else parameters


@dataclass(frozen=True)
class FabricSource:
    """A mapping of fabric fields at ``root`` of ``document``; ``inline`` when a run config holds it."""

    document: Document
    root: KeyPath
    folder: Path
    inline: bool

    @property
    def fields(self) -> Any:
        """The fabric fields as written, parameter sets included."""
        return self.document.data["fabric"] if self.inline else self.document.data


def fabric_file(path: Path) -> FabricSource:
    """The fabric in a file of its own."""
    return FabricSource(load_yaml(path), (), path.resolve().parent, inline=False)


def variant_path(variant: str) -> Path:
    """File of a shipped fabric or of one in ``./configs`` or ``./configs/fabrics``; :class:`InputError` if none."""
    name = NUMBERED.get(variant, variant)
    if not NAME.match(name):
        raise InputError(
            f"--variant {variant!r}: expected 1, 2 or a name of letters, digits, '.', '_', '-'; "
            "give a path with --fabric"
        )
    folders = (configs_dir() / "fabrics", Path("configs"), Path("configs/fabrics"))
    for folder in folders:
        if (path := folder / f"{name}.yaml").is_file():
            _refuse_namesake(variant, path, [other / path.name for other in folders if other != folder])
            return path
    known = [*NUMBERED, *sorted({p.stem for folder in folders for p in folder.glob("*.yaml") if _is_fabric(p)})]
    raise InputError(f"--variant {variant}: {unknown(variant, known, 'fabric')}; give a path with --fabric")


def _refuse_namesake(variant: str, path: Path, others: list[Path]) -> None:
    """Raise :class:`InputError` where two fabrics have the name that was asked for; a number is one of the paper's."""
    if variant not in NUMBERED and (other := namesake(path, others)) is not None:
        raise InputError(
            f"--variant {variant}: {other} and {path} differ: expected one fabric of this name: give the path of the "
            "one that is meant with --fabric"
        )


def _is_fabric(path: Path) -> bool:
    """Tell whether a file holds a fabric, not a rig or a whole run; a broken one may."""
    try:
        return "name" in load_yaml(path).data
    except InputError:
        return True


def lay_fabric(layers: Layers, source: FabricSource, wanted: str | None) -> str:
    """Lay the fabric with its parameter set ``wanted`` (default ``calibrated``); return the name of the set.

    A fabric without sets is taken as it stands: the set is called ``base``, or as the resolved run around it says.
    """
    document, fields = source.document, source.fields
    if not isinstance(fields, dict):
        raise InputError(
            f"{document.where(source.root)}: fabric: expected a mapping of fields, found {describe(fields)}"
        )
    base = {key: value for key, value in fields.items() if key != SETS}
    layers.lay(base, lambda path: document.where(source.root + path[1:]), ("fabric",))
    if SETS not in fields:
        label_only = source.inline and wanted == document.data.get("parameters")
        if wanted is not None and not label_only:
            where = document.where(source.root)
            raise InputError(
                f"{where}: --parameters {wanted}: the fabric has no {SETS}, only one set of numbers: leave "
                f"--parameters away, or add {SETS}: {{{wanted}: {{...}}}} to the file"
            )
        return wanted or BASE
    at = (*source.root, SETS)
    name = _chosen_set(document, fields[SETS], at, wanted)
    at = (*at, name)
    overrides = fields[SETS][name]
    if not isinstance(overrides, dict | None):
        raise InputError(
            f"{document.where(at)}: {name}: expected a mapping of fabric fields, found {describe(overrides)}"
        )
    layers.lay(overrides or {}, lambda path: document.where(at + path[1:]), ("fabric",))
    return name


def _chosen_set(document: Document, sets: object, at: KeyPath, wanted: str | None) -> str:
    if not isinstance(sets, dict) or not sets:
        raise InputError(f"{document.where(at)}: {SETS}: expected a mapping of named sets, found {describe(sets)}")
    name = wanted or DEFAULT_SET
    if name not in sets:
        raise InputError(f"{document.where(at)}: parameters = {name}: {unknown(name, list(sets), 'parameter set')}")
    return name
