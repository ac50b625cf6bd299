"""Fields of the config models by key path: model, unit and description."""

import difflib
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel

from knittest.base.kinds import DEFAULT
from knittest.config.base import Quantity, field_meta
from knittest.config.run import RUNS
from knittest.config.yaml_loader import KeyPath


@dataclass(frozen=True)
class ConfigField:
    """Field of a config: its model, if it has one, its description, and ``meta``, as :func:`field_meta` has it.

    The model of a map is that of its entries; ``map_names`` are the names that the map allows (empty: any).
    """

    model: type[BaseModel] | None
    description: str
    meta: dict[str, Any] = field(default_factory=dict)
    map_names: tuple[str, ...] | None = None

    @property
    def unit(self) -> str:
        """Unit; ``""`` without one."""
        return str(self.meta.get("unit", ""))

    @property
    def is_quantity(self) -> bool:
        """Tell whether the field holds a number with its source."""
        return self.model is Quantity

    @property
    def names(self) -> list[str]:
        """Names of the fields inside."""
        return list(self.model.model_fields) if self.model else []


def field_at(path: KeyPath, kind: object = DEFAULT) -> ConfigField | None:
    """Field at ``path`` of a run of ``kind`` (or of the model ``kind``); ``None`` if there is none."""
    here = ConfigField(_root(kind), "the run")
    for part in path:
        if here.map_names is not None:
            if here.map_names and part not in here.map_names:
                return None
            here = replace(here, map_names=None)
            continue
        if str(part).isdigit() and here.model is not None:  # a model in a list
            continue
        if here.model is None or part not in here.model.model_fields:
            return None
        info = here.model.model_fields[str(part)]
        meta = field_meta(here.model, str(part))
        if here.unit and str(part) in ("warp", "weft", "value", "sd"):  # these carry unit and bounds of their holder
            meta = {"unit": here.unit} if part == "sd" else here.meta
        model = model_of(info.annotation, contained=True)
        names = _map_names(info.annotation) if model is not None else None
        here = ConfigField(model, info.description or here.description, meta, names)
    return here


def _map_names(annotation: object) -> tuple[str, ...] | None:
    """Names that a map allows, empty for any; None for what is no map."""
    for one in (annotation, *get_args(annotation)):
        if get_origin(one) is dict:
            key = get_args(one)[0]
            return get_args(key) if get_origin(key) is Literal else ()
    return None


def most_similar_name(name: str, names: list[str]) -> str | None:
    """Most similar of ``names``; ``None`` if none is similar."""
    lower = {n.lower(): n for n in reversed(names)}
    close = difflib.get_close_matches(name.lower(), list(lower), 1, 0.6)
    return lower[close[0]] if close else None


@cache
def all_paths(kind: object = DEFAULT) -> tuple[str, ...]:
    """Dotted paths, as for ``--set``, of all fields of a run of ``kind`` (or of the model ``kind``)."""
    return tuple(_paths_below(_root(kind), ""))


def _root(kind: object) -> type[BaseModel]:
    return kind if isinstance(kind, type) else RUNS[str(kind) if str(kind) in RUNS else DEFAULT]


def _paths_below(model: type[BaseModel], prefix: str) -> Iterator[str]:
    for name, info in model.model_fields.items():
        yield prefix + name
        inner = model_of(info.annotation)
        if inner is not None and inner is not Quantity:
            yield from _paths_below(inner, f"{prefix}{name}.")


def model_of(annotation: object, contained: bool = False) -> type[BaseModel] | None:
    """Model that a field holds, alone or optional; if ``contained``, also in a list or in the values of a map."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin in (list, dict, tuple):
        inner = inner[-1:] if contained and origin is not tuple else ()
    return next((model for one in inner if (model := model_of(one, contained)) is not None), None)
