"""JSON schema of a run: fields with unit, bounds, plausibility band, default and description."""

import difflib
import re
from collections.abc import Iterator
from types import UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from knittest.base.errors import InputError
from knittest.base.kinds import DEFAULT, kinds
from knittest.config.aliases import present_fields
from knittest.config.base import PerDirection, Quantity, field_meta
from knittest.config.fields import model_of
from knittest.config.presets import PRESETS, preset_settings
from knittest.config.run import RUNS
from knittest.config.settings import leaf_values

#: bounds of the models -> keywords of JSON schema (draft 2020-12); of a quantity they bind the bare number
KEYWORDS = {"gt": "exclusiveMinimum", "ge": "minimum", "le": "maximum"}
WORDS = {float: "number", int: "whole number", bool: "yes or no", str: "text", Any: "anything", Quantity: "quantity"}
#: parts of a config that only one scale uses
OF_SCALE = {
    "macro": ("fabric.macro", "model.macro"),
    "meso": ("fabric.loop_length", "fabric.reinforcing", "fabric.knitting", "fabric.contact", "model.meso"),
}


class FieldDescription(NamedTuple):
    """Field in words; the unit ``1`` is that of a bare number."""

    path: str
    kind: str
    unit: str
    default: str
    bounds: str
    text: str


def run_schema(kind: str = DEFAULT) -> dict[str, Any]:
    """JSON schema of a run of ``kind``, with which editors complete and check YAML."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **_rename_bounds(RUNS[kind].model_json_schema())}


def _rename_bounds(node: object, names: bool = False) -> Any:
    """Rename the bounds; if ``names``, the keys of ``node`` are field names, not keywords."""
    if isinstance(node, list):
        return [_rename_bounds(item) for item in node]
    if not isinstance(node, dict):
        return node
    return {
        key if names else KEYWORDS.get(key, key): _rename_bounds(
            item, names=not names and key in ("properties", "$defs")
        )
        for key, item in node.items()
    }


def field_lines(name: str) -> list[str]:
    """Explain the field ``name`` of a run, by its present or old name, or list the fields below it.

    Raises :class:`InputError` with the nearest names for an unknown one.
    """
    found: dict[FieldDescription, list[str]] = {}
    for kind, run in RUNS.items():
        for field in fields_below(run):
            found.setdefault(field, []).append(kind)
    patterns = {  # NAME and [] stand for any name and index; a part of a quantity is explained by the quantity
        field: re.escape(field.path).replace("NAME", r"[^.]+").replace(r"\[\]", r"(\[\d*\])?") for field in found
    }
    part = r"(\.(value|sd|source|ref))?"
    named = {field: tests for field, tests in found.items() if re.fullmatch(patterns[field] + part, name)}
    fields = {field.path: field for field in found if _is_below(field.path, name)}
    below = [f"{path}{_unit(field)}: {field.text}" for path, field in fields.items()]
    if named:
        lines = [line for field, tests in named.items() for line in [*_explain(field, tests), ""]]
        return [*lines, *below] if below else lines[:-1]
    if below:
        return below
    paths = list(dict.fromkeys(field.path for field in found))
    ends = [path for path in paths if path.endswith(f".{name}")]
    if not ends and (present := present_fields(name)):
        known = [one for one in present if one in paths]
        if not known:
            raise InputError(f"{name}: is now called {present[0]}, a field of the file of a study and not of a run")
        return [line for one in known for line in (f"{name} is now called {one}", *field_lines(one))]
    close = ends or difflib.get_close_matches(name, paths, 5, 0.5)
    hint = f"did you mean {' or '.join(close[:5])}?" if close else "see docs/reference-config.md"
    raise InputError(f"{name}: a run has no such field; {hint}")


def _is_below(path: str, name: str) -> bool:
    """Tell whether the field at ``path`` lies below ``name``; NAME stands for any name."""
    parts, above = path.split("."), name.split(".")
    return len(parts) > len(above) and all(part in ("NAME", one) for part, one in zip(parts, above, strict=False))


def _explain(field: FieldDescription, tests: list[str]) -> list[str]:
    facts = {
        "type": field.kind.replace("`", ""),
        "default": field.default,
        "bounds": field.bounds,
        "tests": "all" if len(tests) == len(RUNS) else ", ".join(tests),
        "scale": next((s for s, parts in OF_SCALE.items() if any(_is_in(field.path, p) for p in parts)), "both"),
        "decides": "; ".join(_decided_results(field.path)),
    } | {f"preset, {tested}": values for tested, values in _preset_values(field.path, tests)}
    return [f"{field.path}{_unit(field)}", f"  {field.text}", *(f"  {n}: {v}" for n, v in facts.items() if v)]


def _unit(field: FieldDescription) -> str:
    return f" [{field.unit}]" if field.unit not in ("", "1") else ""


def _is_in(path: str, part: str) -> bool:
    return path == part or path.startswith(f"{part}.")


def _decided_results(path: str) -> Iterator[str]:
    """Tests, with their scale, whose results the field decides."""
    for name, kind in kinds().items():
        for scale, parts in kind.deciding.items():
            named = [part.format(d=d) for part in parts for d in ("warp", "weft")]
            known = [part if part.startswith("rig.") else f"fabric.{part}" for part in named]
            if any(_is_in(whole, path) or _is_in(path, whole) for whole in known):
                yield f"results of {name}, {scale}"


def _preset_values(path: str, tests: list[str]) -> Iterator[tuple[str, str]]:
    """Tests for which presets set the field, and the values."""
    found: dict[str, list[str]] = {}
    for test in tests:
        for scale in kinds()[test].scales:
            values = {p: dict(leaf_values(preset_settings(test, p, scale))).get(path) for p in PRESETS}  # type: ignore[arg-type]
            if any(value is not None for value in values.values()) and path not in ("model.preset", "model.scale"):
                text = ", ".join(f"{preset} {value:g}" for preset, value in values.items() if value is not None)
                found.setdefault(text, []).append(f"{test} {scale}")
    everywhere = len(found) == 1 and len(tests) == len(RUNS)
    return (("all tests" if everywhere else ", ".join(names), text) for text, names in found.items())


def fields_below(model: type[BaseModel], prefix: str = "") -> Iterator[FieldDescription]:
    """Fields below ``model``, with paths that begin with ``prefix``."""
    for name in model.model_fields:
        yield from describe_fields(model, name, prefix)


def describe_fields(model: type[BaseModel], name: str, prefix: str = "") -> Iterator[FieldDescription]:
    """Field ``name`` of ``model``, or the fields below it."""
    info, meta, path = model.model_fields[name], field_meta(model, name), prefix + name
    inner = model_of(info.annotation, contained=True)
    if inner is PerDirection:
        for part in PerDirection.model_fields:
            yield _row(f"{path}.{part}", "quantity", info, meta)
    elif inner is None or inner is Quantity or _is_text_or_model(info.annotation):
        yield _row(path, _type(info.annotation), info, meta)
    if inner not in (None, Quantity, PerDirection):
        between = {dict: ".NAME", list: "[]"}.get(get_origin(info.annotation), "")  # type: ignore[arg-type]
        yield from fields_below(inner, f"{path}{between}.")


def _row(path: str, kind: str, info: FieldInfo, meta: dict[str, Any]) -> FieldDescription:
    return FieldDescription(
        path, kind, meta.get("unit", ""), _default(info), _bounds(info, meta), info.description or ""
    )


def _is_text_or_model(annotation: Any) -> bool:
    """Tell whether each entry of a map is a text or a model."""
    inner = get_args(annotation)
    if get_origin(annotation) is dict:
        return WORDS[str] in _type(inner[1]).split()
    return get_origin(annotation) is Annotated and _is_text_or_model(inner[0])


def _type(annotation: Any) -> str:
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _type(inner[0])
    if origin is Literal:
        return ", ".join(f"`{choice}`" for choice in inner)
    if origin in (Union, UnionType):
        return " or ".join(_type(one) for one in inner if one is not type(None))
    if origin is list:
        return f"list: {_type(inner[0])}"
    if origin is dict:
        return f"map: {_type(inner[1])}"
    if origin is tuple:
        return f"[{', '.join(map(_type, inner))}]"
    return "fields below" if issubclass(annotation, BaseModel) and annotation not in WORDS else WORDS[annotation]


def _default(info: FieldInfo) -> str:
    if info.is_required():
        return "required"
    value = info.get_default(call_default_factory=True)
    if value is None or value in ("", [], {}):
        return "none"
    if isinstance(value, Quantity):
        return f"{value.value:g} ({value.source})"
    if isinstance(value, bool | float):
        return ("yes" if value else "no") if isinstance(value, bool) else f"{value:g}"
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _bounds(info: FieldInfo, meta: dict[str, Any]) -> str:
    signs = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
    limits = {name: meta[name] for name in signs if name in meta}
    words = []
    for one in info.metadata:
        limits |= {name: getattr(one, name) for name in signs if getattr(one, name, None) is not None}
        if getattr(one, "multiple_of", None):
            words.append(f"multiple of {one.multiple_of}")
        if getattr(one, "pattern", None):
            words.append(f"matches `{one.pattern}`")
    found = [f"{sign} {limits[name]:.10g}" for name, sign in signs.items() if name in limits] + words
    if "least" in meta:
        found.append(f"plausible 0, or from {meta['least']:g}")
    if "band" in meta:
        found.append("plausible {:g} to {:g}".format(*meta["band"]))
    return ", ".join(found)
