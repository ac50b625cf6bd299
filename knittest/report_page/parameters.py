"""The parameters of a run by where they come from, and the settings of its test."""

from collections.abc import Iterator, Mapping
from pathlib import Path as FilePath
from typing import Any

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.base.layout import nearest
from knittest.config.fields import place
from knittest.config.sources import numbers_of
from knittest.experiment.curves import load_curve
from knittest.experiment.origin import borrowed
from knittest.report_page.blocks import Block, Cell, Section, Table, Text
from knittest.report_page.loading import LoadedRun

#: sources in the order of a page, and what a parameter of that source is worth
SOURCES = {
    "measured": "Measured: tests of yarn and fabric",
    "digitised": "Digitised: read off published pictures of curves",
    "reconstructed": "Reconstructed: from published numbers, in an assumed shape",
    "derived": "Derived: from measured numbers by a formula",
    "tuned": "Tuned: fitted to the rows named; these rows are no predictions",
    "predicted": "Predicted: by the model of the yarns, on numbers of which some are assumed",
    "assumed": "Assumed: nobody measured them for this fabric",
    "user": "Given by the user: source not stated",
}
Path = tuple[str, ...]


def parameters(run: LoadedRun) -> Section:
    """Quantities, one table a source, then the settings."""
    blocks: list[Block] = []
    if not run.config:
        blocks.append(Text("config.yaml could not be read, so the parameters are not known.", "warn"))
    found = list(sourced(run))
    known = [*SOURCES, *sorted({str(q["source"]) for _, q in found} - set(SOURCES))]
    for source in known:
        rows = [_row(run, path, q) for path, q in found if str(q["source"]) == source]
        if rows:
            caption = SOURCES.get(source, f"{source}: a source that this version does not know")
            blocks.append(Table(f"{caption} ({len(rows)})", ("parameter", "value", "where from"), rows, (1,)))
    for caption, paths in _settings(run):
        rows = [_setting(run, path, value) for path, value in paths]
        if rows:
            blocks.append(Table(caption, ("setting", "value", "meaning"), rows))
    return Section(f"run-{run.number}-parameters", "Specimen and parameters", blocks)


def sourced(run: LoadedRun) -> Iterator[tuple[Path, Mapping[str, Any]]]:
    """:func:`quantities` of the config, and curves that by their heads are another fabric's as assumed."""
    owners = borrowed(run.run.fabric) if run.run else {}
    for path, quantity in quantities(run.config):
        owner = owners.pop(".".join(path).removeprefix("fabric."), "")
        stated = f"; the fabric's file says {quantity['source']}"
        assumed = {"source": "assumed", "ref": f"of {owner}, by its head{stated}"}
        yield path, {**quantity, **assumed} if owner else quantity
    for field, owner in owners.items():
        path = ("fabric", *field.split("."))
        yield path, {"value": run.setting(*path), "source": "assumed", "ref": f"of {owner}, by its head"}
    tension = run.setting("fabric", "macro", "tension") or {}
    for direction, text in tension.items():
        if f"macro.tension.{direction}" not in owners and (head := _stated(str(text))):
            yield ("fabric", "macro", "tension", direction), {"value": text, **head}


def _stated(path: str) -> dict[str, str]:
    """Source that the head of the curve in ``path`` states; nothing where it cannot be read."""
    try:
        curve = load_curve(data_dir() / path)
    except InputError:
        return {}
    return {"source": "user", "ref": curve.doubt} if curve.doubt else {"source": curve.kind, "ref": curve.source}


def quantities(fields: object, at: Path = ()) -> Iterator[tuple[Path, Mapping[str, Any]]]:
    """Path and mapping of every number that states its source, below ``fields``."""
    if not isinstance(fields, Mapping):
        return
    if is_quantity(fields):
        yield at, fields
        return
    if fields.get("source"):  # of a table
        points = fields.get("points") or ()
        yield at, {**fields, "value": fields.get("curve") or f"{len(points)} points"}
    for key, value in fields.items():
        yield from quantities(value, (*at, str(key)))


def leaves(fields: object, at: Path = ()) -> Iterator[tuple[Path, Any]]:
    """Path and value of everything that is no quantity."""
    if not isinstance(fields, Mapping):
        yield at, fields
    elif not is_quantity(fields):
        for key, value in fields.items():
            yield from leaves(value, (*at, str(key)))


def is_quantity(value: object) -> bool:
    """Tell whether ``value`` is a number with its source."""
    return isinstance(value, Mapping) and "value" in value and "source" in value


def shown_quantity(quantity: Mapping[str, object]) -> str:
    """Value and standard deviation, as stated."""
    sd = quantity.get("sd")
    return shown(quantity["value"]) + (f" ± {shown(sd)}" if sd is not None else "")


def shown(value: object) -> str:
    """A number with six digits, anything else as text."""
    if isinstance(value, float):
        return f"{value:g}"
    if value == []:
        return "none"
    text = "none" if value is None else "yes" if value is True else "no" if value is False else str(value)
    return nearest(text) if FilePath(text).is_absolute() else text


def unit_of(path: Path, rig: str) -> str:
    """Unit of a field with a space in front; empty for a number without, and for a field of another schema."""
    field = place(path, rig)
    return f" {field.unit}" if field and field.unit and field.unit != "1" else ""


def _row(run: LoadedRun, path: Path, quantity: Mapping[str, object]) -> tuple[Cell, ...]:
    field = place(path, run.rig)
    value = quantity["value"]
    number = float(value) if isinstance(value, int | float) else None
    origin = str(quantity.get("ref") or "not stated")
    tuned = quantity.get("tuned_on")
    chosen = quantity.get("chosen_by")
    told = {"fitted to": tuned, "chosen by": chosen}
    fitted = "; ".join(
        f"{how}: {', '.join(map(str, rows))}" for how, rows in told.items() if isinstance(rows, list) and rows
    )
    return (
        Cell(".".join(path).removeprefix("fabric."), note=field.description if field else ""),
        Cell(shown_quantity(quantity) + unit_of(path, run.rig), number),
        Cell(origin, note=fitted),
    )


def _settings(run: LoadedRun) -> Iterator[tuple[str, list[tuple[Path, Any]]]]:
    """Settings that are no quantities, by caption; the discretisation of the other scale has no part in the run."""
    other = {"macro": "meso", "meso": "macro"}.get(str(run.setting("model", "scale")))
    told = {path for path, _ in sourced(run)}
    found = [(p, v) for p, v in leaves(run.config) if p and p[:2] != ("model", other) and p not in told]
    yield "Fabric: make, laws, files", [(p, v) for p, v in found if p[0] == "fabric"]
    yield "Settings of test, model and solver: chosen", [(p, v) for p, v in found if p[0] != "fabric"]


def _setting(run: LoadedRun, path: Path, value: object) -> tuple[Cell, ...]:
    field = place(path, run.rig)
    unit = unit_of(path, run.rig) if isinstance(value, int | float) else ""
    meaning = field.description if field and path[-1] != "kind" else ""
    text = numbers_of(str(value)) if path == ("parameters",) else shown(value)
    return Cell(".".join(path)), Cell(text + unit), Cell(meaning)
