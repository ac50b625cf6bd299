"""Plan of a sweep: its axes, each value with the line of the file that states it, and its runs."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from knittest.base.errors import InputError
from knittest.config.fields import field_at
from knittest.config.loading import resolve_directions
from knittest.config.messages import unknown_name_text
from knittest.config.run import RUNS
from knittest.config.settings import Setting
from knittest.config.studies import Range, Sweep, parse_sweep
from knittest.config.yaml_loader import Document, KeyPath, dotted_path, value_excerpt
from knittest.studies.homogenise.derived_card import complete_cards
from knittest.studies.trials.case import Case, claim_path, draw_points, field_path, shipped_fabric, sibling_file
from knittest.studies.trials.trial import Trial, trial_of

#: fields of ``base`` and ``ensemble`` that are fields of a run
FIELDS: dict[tuple[str, str], KeyPath] = {
    ("base", "scale"): ("model", "scale"),
    ("base", "preset"): ("model", "preset"),
    ("base", "parameters"): ("parameters",),
    ("ensemble", "specimens"): ("variability", "specimens"),
    ("ensemble", "seeds"): ("variability", "seed"),
}
DIRECTION: KeyPath = ("rig", "direction")


@dataclass(frozen=True)
class Axis:
    """Axis of ``count`` points from ``make``, stated at ``where``; ``shown`` as columns, by ``chance`` if drawn."""

    paths: tuple[KeyPath, ...]
    count: int
    make: Callable[[], Sequence[tuple[Setting, ...]]]
    where: str
    shown: bool = True
    is_random: bool = False


def axes_of(sweep: Sweep, document: Document) -> list[Axis]:
    """All axes but fabrics and directions; raises :class:`InputError` if two of them set the same field."""
    axes = list(_axes(sweep, document))
    claimed: dict[KeyPath, str] = {}
    for axis in axes:
        for path in axis.paths:
            claim_path(claimed, path, axis.where)
    return axes


def _axes(sweep: Sweep, document: Document) -> Iterator[Axis]:
    def listed(path: KeyPath, values: Sequence[Any], where: str, shown: bool = True) -> Axis:
        return Axis((path,), len(values), lambda: [(Setting(path, v, where),) for v in values], where, shown)

    def spread(path: KeyPath, values: Range, where: str) -> Axis:
        return Axis((path,), values.steps, lambda: [(Setting(path, v, where),) for v in range_values(values)], where)

    for at, path in FIELDS.items():
        given = getattr(getattr(sweep, at[0]), at[1])
        values = given if isinstance(given, list) else [given] if given is not None else []
        if values:
            yield listed(path, values, document.place_of(at), at[0] == "ensemble" and len(values) > 1)
    for name, value in sweep.base.set.items():
        where = document.place_of(("base", "set", name))
        yield listed(field_path(name, where), [value], where, False)
    for block, fields in (("grid", sweep.grid), ("range", sweep.range)):
        for name, one in fields.items():
            where = document.place_of((block, name))
            path = field_path(name, where)
            yield spread(path, one, where) if isinstance(one, Range) else listed(path, one, where)
    if sweep.points:
        names, where = list(sweep.points[0]), document.place_of(("points",))
        made = [_point_settings(point, names, number, document) for number, point in enumerate(sweep.points)]
        yield Axis(tuple(field_path(n, where) for n in names), len(made), lambda: made, where)
    if (sample := sweep.sample) is not None:
        places = {name: document.place_of(("sample", "fields", name)) for name in sample.fields}
        paths = {name: field_path(name, where) for name, where in places.items()}

        def draw() -> list[tuple[Setting, ...]]:
            pairs = (zip(paths, point, strict=True) for point in draw_points(sample))
            return [tuple(Setting(paths[name], value, places[name]) for name, value in point) for point in pairs]

        yield Axis(tuple(paths.values()), sample.n, draw, document.place_of(("sample",)), is_random=True)


def _point_settings(point: dict[str, Any], names: list[str], number: int, document: Document) -> tuple[Setting, ...]:
    where = document.place_of(("points", number))
    if set(point) != set(names):
        raise InputError(f"{where}: points[{number}]: expected the fields of the first point, {', '.join(names)}")
    places = {name: document.place_of(("points", number, name)) for name in names}
    return tuple(Setting(field_path(name, places[name]), point[name], places[name]) for name in names)


def range_values(values: Range) -> list[float | int]:
    """Values of a range; whole numbers where all of them are."""
    space = np.geomspace if values.spacing == "log" else np.linspace
    found = [float(f"{v:.12g}") for v in space(values.low, values.high, values.steps)]
    return [int(v) for v in found] if all(v.is_integer() for v in found) else found


@dataclass(frozen=True)
class SweptField:
    """Dotted field that changes from run to run: whether in even ratios, and whether its values are drawn."""

    name: str
    log: bool
    drawn: bool


@dataclass(frozen=True)
class Row:
    """One run of a plan: its swept ``values`` by dotted field, and its trial, or the ``problem`` with its input."""

    number: int
    values: dict[str, Any]
    case: Case
    trial: Trial | None
    problem: str = ""


@dataclass(frozen=True)
class Plan:
    """All runs of a sweep; ``count`` is known before they are made."""

    sweep: Sweep
    cases: list[Case]
    axes: list[Axis]

    @property
    def count(self) -> int:
        """Number of runs."""
        return len(self.cases) * math.prod(axis.count for axis in self.axes)

    @property
    def swept_fields(self) -> list[SweptField]:
        """Fields that change from run to run."""
        sample = self.sweep.sample
        log = {n for n, one in sample.fields.items() if one.kind == "log-uniform"} if sample else set()
        log |= {name for name, one in self.sweep.range.items() if one.spacing == "log"}
        shown = [(dotted_path(path), axis.is_random) for axis in self.axes if axis.shown for path in axis.paths]
        return [SweptField(name, name in log, drawn) for name, drawn in shown]

    def rows(self) -> list[Row]:
        """All runs; an invalid draw makes a row with a problem, an invalid listed value raises :class:`InputError`."""
        names = {field.name for field in self.swept_fields}
        draws = math.prod(
            axis.count for axis in self.axes if axis.is_random
        )  # the last axis: their rows are neighbours
        made = [axis.make() for axis in self.axes]  # once: every case has the same draws
        points = ((case, point) for case in self.cases for point in itertools.product(*made))
        rows: list[Row] = []
        for number, (case, point) in enumerate(points, 1):
            rows.append(_row(number, case, list(itertools.chain.from_iterable(point)), names))
            if number % draws == 0 and not any(row.trial for row in rows[-draws:]):
                raise InputError(rows[-draws].problem)
        return rows


def _row(number: int, case: Case, settings: list[Setting], names: set[str]) -> Row:
    values = {dotted_path(s.path): s.value for s in settings if dotted_path(s.path) in names}
    try:
        (run,) = complete_cards([case.run(settings)])
    except InputError as error:
        return Row(number, values, case, None, str(error))
    what = [run.rig.kind, run.fabric.name, run.direction, *(_short_label(*one) for one in values.items())]
    return Row(number, values, case, trial_of(run, " ".join(filter(None, what))))


def plan_of(document: Document, accept_limits: bool = False) -> Plan:
    """Read the plan of the sweep in ``document``; raises :class:`InputError` with file and line."""
    sweep = parse_sweep(document)
    base, where = sweep.base, {name: document.place_of(("base", name)) for name in type(sweep.base).model_fields}
    axes = axes_of(sweep, document)
    config = sibling_file(document, base.config, f"{where['config']}: base.config") if base.config is not None else None
    fabrics: list[Path | None] = [
        *(shipped_fabric(variant, where["variant"]) for variant in base.variant),
        *(sibling_file(document, name, f"{where['fabric']}: base.fabric") for name in base.fabric),
    ]
    if not fabrics and config is None:
        raise InputError(f"{document.place_of(('base',))}: base: no fabric is given: expected variant or fabric")
    for test in base.test:
        if test not in RUNS:
            raise InputError(
                f"{where['test']}: base.test = {value_excerpt(test)}: {unknown_name_text(test, list(RUNS), 'test')}"
            )
    cases = [
        Case("", test, fabric, config, settings, accept_limits)
        for test in base.test
        for fabric in fabrics or [None]
        for settings in _directions(sweep, where["direction"], test, config, axes)
    ]
    return Plan(sweep, cases, axes)


def _short_label(name: str, value: object) -> str:
    """``strain.warp=1.75``: enough to tell the runs of a sweep apart."""
    return (
        f"{'.'.join(name.split('.')[-2:])}={f'{value:.4g}' if isinstance(value, float) else value_excerpt(value, 20)}"
    )


def _directions(
    sweep: Sweep, where: str, test: str, config: Path | None, axes: list[Axis]
) -> list[tuple[Setting, ...]]:
    """Settings of each direction of ``test``: both, unless the sweep or its config states one."""
    swept = any(path == DIRECTION[: len(path)] for axis in axes for path in axis.paths)
    if swept and sweep.base.direction:
        raise InputError(f"{where}: base.direction: rig.direction is given as well: give one of them")
    if swept or field_at(DIRECTION, test) is None:
        return [()]
    for name in sweep.base.direction:
        if name not in ("warp", "weft", "both"):
            raise InputError(f"{where}: base.direction = {value_excerpt(name)}: expected warp, weft or both")
    asked: list[str | None] = [*sweep.base.direction] or [None]
    names = [found for name in asked for found in resolve_directions(name, config)]
    return [(Setting(DIRECTION, name, where),) for name in dict.fromkeys(names)]
