"""Section of a report on the parameters of a run by source, and on the settings of its test."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path as FilePath
from typing import Any

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.base.layout import shorten_path
from knittest.config.fields import field_at
from knittest.config.sources import parameter_set_text
from knittest.experiment.curves import load_curve
from knittest.experiment.origin import borrowed_curves
from knittest.report_page.blocks import Block, Cell, Section, Table, Text
from knittest.report_page.loaded_run import LoadedRun

#: captions of the sources of parameters, in the order of a page
SOURCES = {
    "measured": "Measured: tests of yarn and fabric",
    "digitised": "Digitised: read from published figures",
    "reconstructed": "Reconstructed: from published values, with an assumed shape of the curve",
    "derived": "Derived: computed from other values, which the source names",
    "tuned": "Tuned: fitted to the named results, which are therefore no predictions",
    "predicted": "Predicted: by the meso model, partly from assumed inputs",
    "assumed": "Assumed: not measured for this fabric",
    "user": "Given by the user: source not stated",
}
Path = tuple[str, ...]


def parameters(run: LoadedRun) -> Section:
    """Section with a table of quantities for each source, then the settings."""
    blocks: list[Block] = []
    if not run.config:
        blocks.append(Text("config.yaml could not be read, so the parameters are unknown.", "warn"))
    found = list(quantities_with_sources(run))
    known = [*SOURCES, *sorted({str(q["source"]) for _, q in found} - set(SOURCES))]
    for source in known:
        rows = [_row(run, path, q) for path, q in found if str(q["source"]) == source]
        if rows:
            caption = SOURCES.get(source, f"{source}: source unknown to this version")
            blocks.append(Table(f"{caption} ({len(rows)})", ("parameter", "value", "source"), rows, (1,)))
    for caption, paths in _settings(run):
        rows = [_setting(run, path, value) for path, value in paths]
        if rows:
            blocks.append(Table(caption, ("setting", "value", "meaning"), rows))
    return Section(f"run-{run.number}-parameters", "Specimen and parameters", blocks)


def quantities_with_sources(run: LoadedRun) -> Iterator[tuple[Path, Mapping[str, Any]]]:
    """Quantities of the config; a curve whose header names another fabric counts as assumed."""
    owners = borrowed_curves(run.run.fabric) if run.run else {}
    for path, quantity in quantities(run.config):
        if owner := owners.pop(".".join(path).removeprefix("fabric."), ""):
            origin = f"curve of {owner}, by its header; the fabric file states {quantity['source']}"
            quantity = {**quantity, "source": "assumed", "ref": origin}
        yield path, quantity
    for field, owner in owners.items():
        path = ("fabric", *field.split("."))
        yield path, {"value": run.setting(*path), "source": "assumed", "ref": f"curve of {owner}, by its header"}
    for direction, text in (run.setting("fabric", "macro", "tension") or {}).items():
        if f"macro.tension.{direction}" not in owners:
            with suppress(InputError):
                curve = load_curve(data_dir() / str(text))
                stated = {"source": "user", "ref": curve.doubt} if curve.doubt else None
                stated = stated or {"source": curve.kind, "ref": curve.source}
                yield ("fabric", "macro", "tension", direction), {"value": text, **stated}


def quantities(fields: object) -> Iterator[tuple[Path, Mapping[str, Any]]]:
    """Path and mapping of every number with a source below ``fields``, and of every table with one."""
    for path, value in _walk(fields):
        if is_quantity(value):
            yield path, value
        elif isinstance(value, Mapping) and value.get("source"):
            points = value.get("points") or ()
            yield path, {**value, "value": value.get("curve") or f"{len(points)} points"}


def plain_settings(fields: object) -> Iterator[tuple[Path, Any]]:
    """Path and value of every field that is no quantity."""
    return ((path, value) for path, value in _walk(fields) if not isinstance(value, Mapping))


def _walk(fields: object, at: Path = ()) -> Iterator[tuple[Path, Any]]:
    """Path and value of ``fields`` and everything below, except inside a quantity."""
    if isinstance(fields, list) and fields and isinstance(fields[0], Mapping):
        fields = dict(enumerate(fields))
    yield at, fields
    if isinstance(fields, Mapping) and not is_quantity(fields):
        for key, value in fields.items():
            yield from _walk(value, (*at, str(key)))


def is_quantity(value: object) -> bool:
    """Tell whether ``value`` is a number with its source."""
    return isinstance(value, Mapping) and "value" in value and "source" in value


def format_quantity(quantity: Mapping[str, object]) -> str:
    """Value and standard deviation of a quantity."""
    sd = quantity.get("sd")
    return format_value(quantity["value"]) + (f" ± {format_value(sd)}" if sd is not None else "")


def format_value(value: object) -> str:
    """A number with six digits, anything else as text."""
    if isinstance(value, float):
        return f"{value:g}"
    if value == []:
        return "none"
    text = "none" if value is None else "yes" if value is True else "no" if value is False else str(value)
    return shorten_path(text) if FilePath(text).is_absolute() else text


def unit_of(path: Path, rig: str) -> str:
    """Unit of a field after a space; empty without unit, and for an unknown field."""
    field = field_at(path, rig)
    return f" {field.unit}" if field and field.unit and field.unit != "1" else ""


def _row(run: LoadedRun, path: Path, quantity: Mapping[str, object]) -> tuple[Cell, ...]:
    field = field_at(path, run.rig)
    value = quantity["value"]
    number = float(value) if isinstance(value, int | float) else None
    origins = {"fitted to": quantity.get("tuned_on"), "chosen by": quantity.get("chosen_by")}
    fitted = "; ".join(
        f"{how}: {', '.join(map(str, rows))}" for how, rows in origins.items() if isinstance(rows, list) and rows
    )
    return (
        Cell(".".join(path).removeprefix("fabric."), note=field.description if field else ""),
        Cell(format_quantity(quantity) + unit_of(path, run.rig), number),
        Cell(str(quantity.get("ref") or "not stated"), note=fitted),
    )


def _settings(run: LoadedRun) -> Iterator[tuple[str, list[tuple[Path, Any]]]]:
    """Settings that are no quantities, by caption, without the discretisation of the other scale."""
    other = {"macro": "meso", "meso": "macro"}.get(str(run.setting("model", "scale")))
    listed = {path for path, _ in quantities_with_sources(run)}
    found = [(p, v) for p, v in plain_settings(run.config) if p and p[:2] != ("model", other) and p not in listed]
    yield "Fabric: description, laws, files", [(p, v) for p, v in found if p[0] == "fabric"]
    yield "Settings of test, model and solver", [(p, v) for p, v in found if p[0] != "fabric"]


def _setting(run: LoadedRun, path: Path, value: object) -> tuple[Cell, ...]:
    field = field_at(path, run.rig)
    unit = unit_of(path, run.rig) if isinstance(value, int | float) else ""
    meaning = field.description if field and path[-1] != "kind" else ""
    text = parameter_set_text(str(value)) if path == ("parameters",) else format_value(value)
    return Cell(".".join(path)), Cell(text + unit), Cell(meaning)
