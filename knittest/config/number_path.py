"""Dotted names of numbers of the fabric or the rig, as studies of many runs vary them."""

from collections.abc import Sequence

from knittest.base.errors import InputError
from knittest.config.fields import all_paths, place
from knittest.config.messages import unknown
from knittest.config.yaml_loader import KeyPath


def number_path(name: str, where: str, kinds: Sequence[str]) -> KeyPath:
    """The key path of ``name``, a number of the fabric or the rig of one of ``kinds``; raises :class:`InputError`."""
    path: KeyPath = tuple(name.split("."))
    if path[0] not in ("fabric", "rig"):
        raise InputError(f"{where}: {name}: expected a field of the fabric or the rig, such as {_example(name, kinds)}")
    field = next((f for f in (place(path, kind) for kind in kinds) if f is not None), None)
    if field is None:
        known = sorted({p for kind in kinds for p in all_paths(kind) if p.split(".")[0] == path[0]})
        raise InputError(f"{where}: {name}: {unknown(name, known) if known else 'unknown field'}")
    if field.model is not None and not field.is_quantity:
        raise InputError(f"{where}: {name}: expected a number, this is a group of {', '.join(field.names)}")
    return path


def _example(name: str, kinds: Sequence[str]) -> str:
    last = name.split(".")[-1]
    known = (p for kind in kinds for p in all_paths(kind) if p.split(".")[0] in ("fabric", "rig"))
    return next((p for p in known if p.split(".")[-1] == last), "fabric.macro.bending_stiffness.warp")
