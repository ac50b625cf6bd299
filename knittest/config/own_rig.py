"""Conditions of a fabric's own tests as settings of their rigs, that a run starts from."""

from collections.abc import Collection, Mapping
from functools import partial
from typing import get_args

from knittest.base.errors import InputError
from knittest.base.kinds import kinds
from knittest.config.fabric import Direction, Fabric
from knittest.config.layers import Layers
from knittest.config.yaml_loader import KeyPath, dotted

DIRECTIONS: tuple[str, ...] = get_args(Direction)


def own_fields(own: Mapping[str, object], kind: str, direction: object) -> dict[str, KeyPath]:
    """Path below ``own``, what a fabric says of the rig of a test of ``kind``, of each field of a run in ``direction``.

    Those under its direction go over those of both. What is said of the other direction alone holds for it as well, as
    for a test without directions: :func:`taken_over` tells, since nobody measured it there.
    """
    per = [d for d in DIRECTIONS if isinstance(own.get(d), Mapping)]
    direction = direction if kinds()[kind].directional else ""
    others = [d for d in per if d != direction]
    found: dict[str, KeyPath] = {key: (d, key) for d in others if len(others) == 1 for key in own[d]}  # type: ignore[attr-defined]
    found |= {key: (key,) for key in own if key not in per}
    return found | {key: (d, key) for d in per if d == direction for key in own[d]}  # type: ignore[attr-defined]


def taken_over(fabric: Fabric, kind: str, direction: str) -> dict[str, str]:
    """Direction that each field of the rig of a test of ``kind`` in ``direction`` is taken over from, of those that the
    fabric states of the other one alone.
    """
    paths = own_fields(fabric.rigs.get(kind, {}), kind, direction)
    return {key: str(path[0]) for key, path in paths.items() if len(path) > 1 and path[0] != direction}


def own_value(fabric: Fabric, kind: str, path: KeyPath) -> float:
    """Number that the fabric states at ``path`` of :func:`own_fields`."""
    found = fabric.rigs[kind][str(path[0])]
    return float(found[str(path[1])] if isinstance(found, dict) else found)


def lay_own_rig(layers: Layers, kind: str, direction: object, stated: Collection[str] = ()) -> None:
    """Lay what the fabric in ``layers`` says of the rig of a test of ``kind`` in ``direction`` over the rig.

    Sizes that the preset gave stay, and so do those ``stated`` elsewhere, with the fields that are tied to them. Raises
    :class:`InputError` where a test without directions has numbers of both.
    """
    at: KeyPath = ("fabric", "rigs", kind)
    own = layers.get(at)
    if not isinstance(own, dict):
        return
    if not kinds()[kind].directional and all(isinstance(own.get(d), dict) for d in DIRECTIONS):
        raise InputError(
            f"{layers.where((*at, DIRECTIONS[0]))}: {dotted(at)}: numbers of warp and weft, but the test has no "
            "direction: expected one of each, such as their mean"
        )
    laid = layers.get(("rig",)) or {}
    kept = {*(name for name in kinds()[kind].sizes if name in laid), "kind", *stated}
    kept |= {field for field, other in kinds()[kind].tied.items() if other in kept}
    for key, path in own_fields(own, kind, direction).items():
        if key not in kept:
            where = str(layers.where((*at, *path)))
            layers.lay(layers.get((*at, *path)), partial(_same, where), ("rig", key))


def _same(where: str, _: KeyPath) -> str:
    return where
