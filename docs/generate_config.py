"""Markdown of every field of every test, of sweeps, calibrations and studies of uncertainty, from their models."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from pydantic import BaseModel

from knittest.config import studies
from knittest.config.base import Quantity
from knittest.config.presets import PRESETS, default_scale, preset_settings
from knittest.config.run import RUNS, Run
from knittest.config.schema import FieldDescription, describe_fields, fields_below, model_of

FIELD_HEADER = ("field", "type", "unit", "default", "bounds", "what")

CONFIG_INTRO = """
# Configuration

This page lists all fields of a run. Use these names in `--set FIELD=VALUE`, in YAML files for `--config` and
`--fabric`, and in files of [sweeps](batch.md), [calibrations](calibrate.md) and [uncertainty studies](uncertainty.md).
`knittest schema` prints them for editors.

A value outside its bounds is an error. So is an implausible value, which mostly has a wrong unit. A required field of
an optional group is required only if the group is given. `NAME` stands for a name of your choice, `[]` for each entry
of a list.
""".strip()
QUANTITIES = """
A **quantity** is a number (its source is then `user`) or a map of these fields. Bounds apply to `value`.
""".strip()


def config_reference() -> str:
    """Markdown of every field of every test, of sweeps, calibrations and studies of uncertainty."""
    shared = [name for name in Run.model_fields if name not in ("rig", "fabric")]
    groups = [(f"`{name}`", [(name, Run)]) for name in shared if model_of(Run.model_fields[name].annotation)]
    alone = [(name, Run) for name in shared if not model_of(Run.model_fields[name].annotation)]
    parts = [CONFIG_INTRO, QUANTITIES, _fields(fields_below(Quantity))]
    for kind, run in RUNS.items():
        parts += [f"## `rig` of {kind}", _summary(_rig(run)), _fields(fields_below(_rig(run), "rig."))]
        parts += [_presets(kind)]
    parts += ["## `fabric`", _fields(describe_fields(Run, "fabric"))]
    for title, names in [*groups, ("Parameter set", alone)]:
        parts += [f"## {title}", _fields(row for name, model in names for row in describe_fields(model, name))]
    parts += ["## Sweep file", "Of `knittest batch`; see [batch.md](batch.md).", _fields(fields_below(studies.Sweep))]
    parts += ["## Calibration file", "Of `knittest calibrate`; see [calibrate.md](calibrate.md)."]
    parts += [_fields(fields_below(studies.Calibration))]
    parts += ["## File of uncertainty", "Of `knittest uncertainty`; see [uncertainty.md](uncertainty.md)."]
    parts += [_fields(fields_below(studies.Uncertainty))]
    return "\n\n".join(filter(None, parts)) + "\n"


def _rig(run: type[Run]) -> type[BaseModel]:
    model = model_of(run.model_fields["rig"].annotation)
    if model is None:
        raise TypeError(f"{run.__name__}.rig holds no model")
    return model


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


def _fields(fields: Iterable[FieldDescription]) -> str:
    rows = [
        (f"`{f.path}`", f.kind, "-" if f.unit == "1" else f.unit, f.default, f.bounds, plain(f.text)) for f in fields
    ]
    return table(FIELD_HEADER, rows)


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
