"""Every bound of every config field: what the models say, and values just inside and just outside."""

import importlib
import math
import pkgutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from knittest import config
from knittest.base.kinds import kinds
from knittest.config.base import PerDirection, Quantity, Strict, field_meta

LIMITS = ("gt", "ge", "lt", "le", "band", "least", "multiple_of", "min_length", "max_length", "pattern")


@dataclass(frozen=True)
class Bounded:
    """A field of ``model`` with its ``limits``; ``entry`` says that they are those of the entries of its list."""

    model: type[BaseModel]
    name: str
    limits: dict[str, Any] = field(default_factory=dict)
    kind: type = float
    entry: bool = False

    def __str__(self) -> str:
        return f"{self.model.__name__}.{self.name}" + "[]" * self.entry

    @property
    def stated(self) -> str:
        """The limits as text, for a table."""
        shown = {n: f"{v[0]:g}..{v[1]:g}" if n == "band" else f"{v:.12g}" if n != "pattern" else v
                 for n, v in self.limits.items()}  # fmt: skip
        return " ".join(f"{name}={shown[name]}" for name in LIMITS if name in shown)

    @property
    def two_sided(self) -> bool:
        """Tell whether a number can neither be too small nor too large."""
        low, high = {"gt", "ge"} & self.limits.keys(), {"lt", "le"} & self.limits.keys()
        return "band" in self.limits or bool(low and high)

    def outside(self) -> Iterator[Any]:
        """One value just beyond each limit."""
        step = self._next
        for name, limit in self.limits.items():
            if name in ("gt", "lt"):
                yield self.kind(limit)
            elif name == "ge":
                yield step(limit, -1)
            elif name == "le":
                yield step(limit, 1)
            elif name == "least":
                yield step(limit, -1)
            elif name == "band":
                yield step(limit[0], -1)
                yield step(limit[1], 1)

    def inside(self) -> list[Any]:
        """The smallest and the largest value that all limits allow, and the smallest but 0."""
        lows = [self._next(v, 1) if n == "gt" else v[0] if n == "band" else v
                for n, v in self.limits.items() if n in ("gt", "ge", "band")]  # fmt: skip
        highs = [v[1] if n == "band" else v for n, v in self.limits.items() if n in ("le", "band")]
        least = [self.limits["least"]] if "least" in self.limits else []
        return [self.kind(v) for v in (*([max(lows)] if lows else []), *([min(highs)] if highs else []), *least)]

    def _next(self, value: float, way: int) -> Any:
        if self.kind is int:
            return int(value) + way * self.limits.get("multiple_of", 1)
        return math.nextafter(float(value), way * math.inf)

    def placed(self, value: Any) -> Iterator[tuple[str, dict[str, Any]]]:
        """Path as a message names it and the data of the model, with ``value`` in the field."""
        annotation = self.model.model_fields[self.name].annotation
        if PerDirection in (annotation, *get_args(annotation)):
            middle = {"value": self.inside()[0], "source": "user"}
            for one, other in (("warp", "weft"), ("weft", "warp")):
                yield f"{self.name}.{one}", {self.name: {one: {"value": value, "source": "user"}, other: middle}}
        elif self.entry:
            yield f"{self.name}[0]", {self.name: [value]}
        else:
            yield self.name, {self.name: value}


def bounded_fields() -> list[Bounded]:
    """Numbers of all config models, and whatever else has a limit, in the class that declares it."""
    for module in pkgutil.iter_modules(config.__path__):
        importlib.import_module(f"{config.__name__}.{module.name}")
    of_tests = [kind.run.partition(":")[0] for kind in kinds().values() if kind.run.startswith("knittest.")]
    for name in of_tests:
        importlib.import_module(name)
    models = sorted({*_below(Strict), Quantity}, key=lambda m: (m.__module__, m.__name__))
    models = [m for m in models if m.__module__.startswith("knittest.config") or m.__module__ in of_tests]
    return [found for m in models for name in m.__annotations__ if name in m.model_fields for found in _of(m, name)]


def _below(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    for one in model.__subclasses__():
        yield one
        yield from _below(one)


def _of(model: type[BaseModel], name: str) -> Iterator[Bounded]:
    info = model.model_fields[name]
    limits = _limits(info.metadata) | {n: v for n, v in field_meta(model, name).items() if n in LIMITS}
    kinds = {Quantity: float, PerDirection: float, int: int, float: float}
    types = [info.annotation, *get_args(info.annotation)]
    kind = next((k for t in types for c, k in kinds.items() if t is c), None)
    if limits or (kind is not None and model is not PerDirection):
        yield Bounded(model, name, limits, kind or str)
    if get_origin(info.annotation) is list:
        (entry,) = get_args(info.annotation)
        inner = _limits(getattr(entry, "__metadata__", ()))
        if inner:
            yield Bounded(model, name, inner, int, entry=True)


def _limits(metadata: Any) -> dict[str, Any]:
    flat = [x for one in metadata for x in (one, *getattr(one, "metadata", ()))]
    return {n: v for one in flat for n in LIMITS if (v := getattr(one, n, None)) is not None}
