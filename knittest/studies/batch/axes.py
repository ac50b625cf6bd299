"""The axes of a sweep: what changes from run to run, each value with the line of the file it stands in."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knittest.base.errors import InputError
from knittest.config.settings import Setting
from knittest.config.sweep import Range, Sweep
from knittest.config.yaml_loader import Document, KeyPath, dotted
from knittest.studies.trials.draws import drawn

#: what of ``base`` and ``ensemble`` is a field of the run
FIELDS: dict[tuple[str, str], KeyPath] = {
    ("base", "scale"): ("model", "scale"),
    ("base", "preset"): ("model", "preset"),
    ("base", "parameters"): ("parameters",),
    ("ensemble", "specimens"): ("variability", "specimens"),
    ("ensemble", "seeds"): ("variability", "seed"),
}


@dataclass(frozen=True)
class Axis:
    """``count`` points that ``make`` gives, each a value for every field of ``paths``; ``where`` it stands.

    ``shown`` says whether the fields are columns of their own, ``chance`` whether the values are drawn.
    """

    paths: tuple[KeyPath, ...]
    count: int
    make: Callable[[], Sequence[tuple[Setting, ...]]]
    where: str
    shown: bool = True
    chance: bool = False


def axes_of(sweep: Sweep, document: Document) -> list[Axis]:
    """All axes but fabrics and directions; raises :class:`InputError` when two of them set the same field."""
    blocks = (_base_axes, _lists, _points, _sample)
    axes = [axis for block in blocks for axis in block(sweep, document)]
    said: dict[KeyPath, str] = {}
    for axis in axes:
        for path in axis.paths:
            for other, where in said.items():
                if path[: len(other)] == other[: len(path)]:  # the same, or one inside the other
                    raise InputError(f"{axis.where}: {dotted(path)}: given twice, first at {where}: give it once")
            said[path] = axis.where
    return axes


def field_path(name: str, where: str) -> KeyPath:
    """The key path of a dotted ``name``; raises :class:`InputError`."""
    path = tuple(name.split("."))
    if not all(path):
        raise InputError(f"{where}: {name!r}: expected the dotted path of a field, for example rig.width")
    return path


def spaced(values: Range) -> list[float | int]:
    """The values of a range; whole numbers where all of them are."""
    space = np.geomspace if values.spacing == "log" else np.linspace
    found = [float(f"{v:.12g}") for v in space(values.low, values.high, values.steps)]
    return [int(v) for v in found] if all(v.is_integer() for v in found) else found


def _base_axes(sweep: Sweep, document: Document) -> Iterator[Axis]:
    for at, path in FIELDS.items():
        given = getattr(getattr(sweep, at[0]), at[1])
        values = given if isinstance(given, list) else [given] if given is not None else []
        if values:
            yield _axis(path, values, document.where(at), shown=at[0] == "ensemble" and len(values) > 1)
    for name, value in sweep.base.set.items():
        where = document.where(("base", "set", name))
        yield _axis(field_path(name, where), [value], where, shown=False)


def _lists(sweep: Sweep, document: Document) -> Iterator[Axis]:
    for block, fields in (("grid", sweep.grid), ("range", sweep.range)):
        for name, values in fields.items():
            where = document.where((block, name))
            path = field_path(name, where)
            if isinstance(values, Range):
                yield _evenly(path, values, where)
            else:
                yield _axis(path, values, where)


def _points(sweep: Sweep, document: Document) -> Iterator[Axis]:
    if not sweep.points:
        return
    names = list(sweep.points[0])
    made = []
    for number, point in enumerate(sweep.points):
        where = document.where(("points", number))
        if set(point) != set(names):
            raise InputError(f"{where}: points[{number}]: expected the fields of the first point, {', '.join(names)}")
        made.append(tuple(_setting(n, point[n], document.where(("points", number, n))) for n in names))
    where = document.where(("points",))
    yield Axis(tuple(field_path(n, where) for n in names), len(made), lambda: made, where)


def _sample(sweep: Sweep, document: Document) -> Iterator[Axis]:
    sample = sweep.sample
    if sample is None:
        return
    places = {name: document.where(("sample", "fields", name)) for name in sample.fields}

    def make() -> list[tuple[Setting, ...]]:
        return [
            tuple(_setting(n, v, places[n]) for n, v in zip(sample.fields, point, strict=True))
            for point in drawn(sample)
        ]

    paths = tuple(field_path(name, where) for name, where in places.items())
    yield Axis(paths, sample.n, make, document.where(("sample",)), chance=True)


def _axis(path: KeyPath, values: Sequence[Any], where: str, shown: bool = True) -> Axis:
    return Axis((path,), len(values), lambda: [(Setting(path, v, where),) for v in values], where, shown)


def _evenly(path: KeyPath, values: Range, where: str) -> Axis:
    return Axis((path,), values.steps, lambda: [(Setting(path, v, where),) for v in spaced(values)], where)


def _setting(name: str, value: object, where: str) -> Setting:
    return Setting(field_path(name, where), value, where)
