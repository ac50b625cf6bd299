"""Markdown of every field of every test, of sweeps, calibrations and studies of uncertainty, from their models."""

from collections.abc import Iterator, Sequence
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from knittest.config import calibration, sweep, uncertainty
from knittest.config.base import PerDirection, Quantity, field_meta
from knittest.config.presets import PRESETS, default_scale, preset_settings
from knittest.config.run import RUNS, Run

WORDS = {float: "number", int: "whole number", bool: "yes or no", str: "text", Any: "anything", Quantity: "quantity"}
FIELD_HEADER = ("field", "type", "unit", "default", "bounds", "what")

CONFIG_INTRO = """
# Configuration

Every field of a run, as `--set FIELD=VALUE`, a YAML file of `--config` or `--fabric`, a [sweep](batch.md), a
[calibration](calibrate.md) or a [study of uncertainty](uncertainty.md) names it; `knittest schema` prints the same for
editors. A value outside its bounds is refused. So is one that is not plausible, which mostly is in another unit than
the one stated here. What is required in a group that may be left out is required where the group is given. `NAME`
stands for a name or field of your choice, `[]` for each entry of a list.
""".strip()
QUANTITIES = """
A **quantity** is a bare number, which then counts as given by the user, or a map of these fields; bounds hold for
its `value`:
""".strip()


def config_reference() -> str:
    """Markdown of every field of every test, of sweeps, calibrations and studies of uncertainty."""
    shared = [name for name in Run.model_fields if name not in ("rig", "fabric")]
    groups = [(f"`{name}`", [(name, Run)]) for name in shared if _model_of(Run.model_fields[name].annotation)]
    alone = [(name, Run) for name in shared if not _model_of(Run.model_fields[name].annotation)]
    parts = [CONFIG_INTRO, QUANTITIES, _fields(_rows(Quantity))]
    for kind, run in RUNS.items():
        parts += [f"## `rig` of {kind}", _summary(_rig(run)), _fields(_rows(_rig(run), "rig."))]
        parts += [_presets(kind)]
    parts += ["## `fabric`", _fields(_field(Run, "fabric"))]
    for title, names in [*groups, ("Parameter set", alone)]:
        parts += [f"## {title}", _fields(row for name, model in names for row in _field(model, name))]
    parts += ["## Sweep file", "Of `knittest batch`; see [batch.md](batch.md).", _fields(_rows(sweep.Sweep))]
    parts += ["## Calibration file", "Of `knittest calibrate`; see [calibrate.md](calibrate.md)."]
    parts += [_fields(_rows(calibration.Calibration))]
    parts += ["## File of uncertainty", "Of `knittest uncertainty`; see [uncertainty.md](uncertainty.md)."]
    parts += [_fields(_rows(uncertainty.Uncertainty))]
    return "\n\n".join(filter(None, parts)) + "\n"


def _rig(run: type[Run]) -> type[BaseModel]:
    model = _model_of(run.model_fields["rig"].annotation)
    if model is None:
        raise TypeError(f"{run.__name__}.rig holds no model")
    return model


def _rows(model: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, ...]]:
    """A row for every field below ``model``."""
    for name in model.model_fields:
        yield from _field(model, name, prefix)


def _field(model: type[BaseModel], name: str, prefix: str = "") -> Iterator[tuple[str, ...]]:
    info, meta, path = model.model_fields[name], field_meta(model, name), prefix + name
    inner = _model_of(info.annotation)
    if inner is PerDirection:
        for part in PerDirection.model_fields:
            yield _row(f"{path}.{part}", "quantity", info, meta)
    elif inner is None or inner is Quantity:
        yield _row(path, _type(info.annotation), info, meta)
    if inner not in (None, Quantity, PerDirection):
        yield from _rows(inner, f"{path}{_between(info.annotation)}.")


def _row(path: str, kind: str, info: FieldInfo, meta: dict[str, Any]) -> tuple[str, ...]:
    unit = meta.get("unit", "")
    what = plain(info.description or "")
    return (f"`{path}`", kind, "-" if unit == "1" else unit, _default(info), _bounds(info, meta), what)


def _model_of(annotation: Any) -> type[BaseModel] | None:
    """The model that a field holds, alone, optional, in a list or in a map."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    inner = get_args(annotation)[-1:] if get_origin(annotation) in (dict, list) else get_args(annotation)
    return next((model for model in map(_model_of, inner) if model is not None), None)


def _between(annotation: Any) -> str:
    origin = get_origin(annotation)
    return ".NAME" if origin is dict else "[]" if origin is list else ""


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
    return WORDS[annotation]


def _default(info: FieldInfo) -> str:
    if info.is_required():
        return "required"
    value = info.get_default(call_default_factory=True)
    if value is None or value in ("", [], {}):
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else _named(value)


def _named(value: Any) -> str:
    """A default that is no number: text, a list of it, or a quantity."""
    if isinstance(value, Quantity):
        return f"{value.value:g} ({value.source})"
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


def _summary(model: type[BaseModel]) -> str:
    return " ".join((model.__doc__ or "").split())


def _presets(kind: str) -> str:
    """Settings of a test that the presets make, by scale."""
    rows = []
    for scale in ("macro", "meso"):
        columns = [dict(_leaves(preset_settings(kind, preset, scale))) for preset in PRESETS]
        for path in columns[0]:
            if path in ("model.preset", "model.scale") or f"model.{'macro' if scale == 'meso' else 'meso'}." in path:
                continue
            rows.append((scale, f"`{path}`", *(f"{column[path]:g}" if path in column else "-" for column in columns)))
    told = "What a preset, or the test itself, sets instead of the defaults (-: not set)."
    told += f" Scale if none is asked for: {default_scale(kind)}."
    return f"{told}\n\n{table(('scale', 'field', *PRESETS), rows)}"


def _leaves(fields: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in fields.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def _fields(rows: Iterator[tuple[str, ...]]) -> str:
    return table(FIELD_HEADER, list(rows))


def plain(text: str) -> str:
    """``text`` in which nothing is a tag."""
    return text.replace("<", "&lt;")


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown; columns that say nothing are left out."""
    keep = [k for k in range(len(header)) if any(row[k] for row in rows)]
    lines = [
        [header[k] for k in keep],
        ["---"] * len(keep),
        *([row[k].replace("|", "\\|") for k in keep] for row in rows),
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
