"""Numbers and curves of a fabric that are another fabric's, by their reference or by the head of the curve."""

import re
from pathlib import Path

from knittest.base.errors import InputError
from knittest.base.reading import read_regular
from knittest.base.resources import data_dir
from knittest.config.deciding import entry
from knittest.config.fabric import Fabric

MAX_BYTES = 10_000_000
#: line in the head of a curve
FABRIC = "fabric"
#: reference of a number that knittest new took over
_AS = re.compile(r"as (\S+)")


def borrowed(fabric: Fabric) -> dict[str, str]:
    """Name of the other fabric by field, ``macro.tension.warp`` for example, for each curve that states one."""
    linear = fabric.macro.shear is not None and fabric.macro.shear.kind == "linear"
    curves = {name: text for name, text in fabric.macro.curve_files.items() if not (linear and name == "shear")}
    owners = {f"macro.{name}": stated_fabric(data_dir() / text) for name, text in curves.items()}
    return {field: owner for field, owner in owners.items() if owner not in ("", fabric.name)}


def owner_of(fabric: Fabric, field: str) -> str:
    """Name of the other fabric that the number or curve ``field`` was taken from, empty where it is its own."""
    stated = entry(fabric, field)
    if getattr(stated, "source", None) == "assumed" and (named := _AS.fullmatch(getattr(stated, "ref", ""))):
        return named[1]
    return borrowed(fabric).get(field, "")


def stated_fabric(path: Path) -> str:
    """Fabric that the ``# fabric:`` line in the head of a curve names; empty without one or where it cannot be read."""
    try:
        lines = read_regular(path, MAX_BYTES, "a curve has fewer points").decode("utf-8-sig").splitlines()
    except (InputError, UnicodeDecodeError):
        return ""
    heads = (line[1:].partition(":") for line in lines if line.startswith("#"))
    return next((value.strip() for key, _, value in heads if key.strip() == FABRIC), "")
