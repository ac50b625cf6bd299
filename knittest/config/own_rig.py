"""Conditions of a fabric's own tests as settings of their rigs, that a run starts from."""

from collections.abc import Collection
from functools import partial
from typing import get_args

from knittest.config.fabric import Direction
from knittest.config.layers import Layers
from knittest.config.yaml_loader import KeyPath


def lay_own_rig(layers: Layers, kind: str, direction: str, stated: Collection[str] = ()) -> None:
    """Lay what the fabric in ``layers`` says of the rig of a test of ``kind`` in ``direction`` over the rig.

    Sizes that the preset gave stay, and so do those ``stated`` elsewhere; a frame goes with its square.
    """
    at: KeyPath = ("fabric", "rigs", kind)
    own = layers.get(at)
    if not isinstance(own, dict):
        return
    kept = {*(layers.get(("rig",)) or {}), *stated}
    if "side" in kept:
        kept.add("frame_side")
    found = {key: (*at, key) for key in own if key not in get_args(Direction)}
    if isinstance(per := own.get(direction), dict):
        found |= {key: (*at, direction, key) for key in per}
    for key, path in found.items():
        if key not in kept:
            where = str(layers.where(path))
            layers.lay(layers.get(path), partial(_same, where), ("rig", key))


def _same(where: str, _: KeyPath) -> str:
    return where
