"""Conditions of a fabric's own tests as settings of their rigs, that a run starts from."""

from collections.abc import Collection, Mapping
from functools import partial
from typing import get_args

from knittest.base.kinds import kinds
from knittest.config.fabric import Direction
from knittest.config.layers import Layers
from knittest.config.yaml_loader import KeyPath


def own_fields(own: Mapping[str, object], kind: str, direction: object) -> dict[str, KeyPath]:
    """Path below ``own``, what a fabric says of the rig of a test of ``kind``, of each field of a run in ``direction``.

    Those under warp or weft go over those of both; of a test without directions, warp and weft are fields like others.
    """
    per = [d for d in get_args(Direction) if kinds()[kind].directional and isinstance(own.get(d), Mapping)]
    found: dict[str, KeyPath] = {key: (key,) for key in own if key not in per}
    return found | {key: (d, key) for d in per if d == direction for key in own[d]}  # type: ignore[attr-defined]


def lay_own_rig(layers: Layers, kind: str, direction: object, stated: Collection[str] = ()) -> None:
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
    for key, path in own_fields(own, kind, direction).items():
        if key not in kept:
            where = str(layers.where((*at, *path)))
            layers.lay(layers.get((*at, *path)), partial(_same, where), ("rig", key))


def _same(where: str, _: KeyPath) -> str:
    return where
