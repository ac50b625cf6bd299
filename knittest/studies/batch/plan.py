"""Plan of a sweep: its axes, each value with the line of the file it stands in, and its runs."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from knittest.base.errors import InputError
from knittest.config.fields import place
from knittest.config.loading import planned_directions, resolve
from knittest.config.messages import unknown
from knittest.config.run import RUNS
from knittest.config.settings import Setting
from knittest.config.sources import variant_path
from knittest.config.studies import Range, Sweep, parse_sweep
from knittest.config.yaml_loader import Document, KeyPath, dotted, shown
from knittest.studies.homogenise.yarn_card import with_cards
from knittest.studies.trials.case import drawn
from knittest.studies.trials.trial import Trial, trial_of

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


DIRECTION: KeyPath = ("rig", "direction")


@dataclass(frozen=True)
class Case:
    """A test of a fabric in one direction (none where the test has none)."""

    test: str
    fabric: Path | None
    config: Path | None
    settings: tuple[Setting, ...] = ()


@dataclass(frozen=True)
class Swept:
    """A dotted field that changes from run to run: whether in even ratios, and whether its values are drawn."""

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
    accept_limits: bool = False

    @property
    def count(self) -> int:
        """Number of runs."""
        return len(self.cases) * math.prod(axis.count for axis in self.axes)

    @property
    def swept(self) -> list[Swept]:
        """Fields that change from run to run."""
        sample = self.sweep.sample
        log = {n for n, one in sample.fields.items() if one.kind == "log-uniform"} if sample else set()
        log |= {name for name, one in self.sweep.range.items() if one.spacing == "log"}
        shown = [(dotted(path), axis.chance) for axis in self.axes if axis.shown for path in axis.paths]
        return [Swept(name, name in log, drawn) for name, drawn in shown]

    def rows(self) -> list[Row]:
        """All runs. A drawn value that the schema refuses makes a row with a problem.

        Raises :class:`InputError` for a listed value that is refused, whatever is drawn with it.
        """
        names = {field.name for field in self.swept}
        draws = math.prod(axis.count for axis in self.axes if axis.chance)  # the last axis: their rows are neighbours
        rows: list[Row] = []
        for number, (case, point) in enumerate(self._points(), 1):
            rows.append(self._row(number, case, list(itertools.chain.from_iterable(point)), names))
            if number % draws == 0 and not any(row.trial for row in rows[-draws:]):
                raise InputError(rows[-draws].problem)
        return rows

    def _points(self) -> Iterator[tuple[Case, tuple[tuple[Setting, ...], ...]]]:
        made = [axis.make() for axis in self.axes]  # once: draws must be those of every case
        for case in self.cases:
            for point in itertools.product(*made):
                yield case, point

    def _row(self, number: int, case: Case, settings: list[Setting], names: set[str]) -> Row:
        values = {dotted(s.path): s.value for s in settings if dotted(s.path) in names}
        try:
            run = resolve(
                test=case.test, fabric=case.fabric, config=case.config, sets=[*case.settings, *settings],
                accept_limits=self.accept_limits,
            )  # fmt: skip
            (run,) = with_cards([run])
        except InputError as error:
            return Row(number, values, case, None, str(error))
        what = [run.rig.kind, run.fabric.name, run.direction, *(_brief(*one) for one in values.items())]
        return Row(number, values, case, trial_of(run, " ".join(filter(None, what))))


def plan_of(document: Document, accept_limits: bool = False) -> Plan:
    """The plan of the sweep in ``document``, raises :class:`InputError` with file and line; limits looser than
    the preset's may be accepted.
    """
    sweep = parse_sweep(document)
    folder = Path(document.source).resolve().parent
    axes = axes_of(sweep, document)
    config = None if sweep.base.config is None else _file(folder / sweep.base.config, "config", document)
    fabrics = _fabrics(sweep, document, folder)
    if not fabrics and config is None:
        raise InputError(f"{document.where(('base',))}: base: no fabric is given: expected variant or fabric")
    cases = [
        Case(test, fabric, config, settings)
        for test in _tests(sweep, document)
        for fabric in fabrics or [None]
        for settings in _directions(sweep, document, test, config, axes)
    ]
    return Plan(sweep, cases, axes, accept_limits)


def _brief(name: str, value: object) -> str:
    """``strain.warp=1.75``: enough to tell the runs of a sweep apart."""
    return f"{'.'.join(name.split('.')[-2:])}={f'{value:.4g}' if isinstance(value, float) else shown(value, 20)}"


def _tests(sweep: Sweep, document: Document) -> list[str]:
    for test in sweep.base.test:
        if test not in RUNS:
            where = document.where(("base", "test"))
            raise InputError(f"{where}: base.test = {shown(test)}: {unknown(test, list(RUNS), 'test')}")
    return sweep.base.test


def _fabrics(sweep: Sweep, document: Document, folder: Path) -> list[Path | None]:
    found: list[Path | None] = []
    for variant in sweep.base.variant:
        try:
            found.append(variant_path(variant))
        except InputError as error:
            raise InputError(f"{document.where(('base', 'variant'))}: {error}") from None
    return [*found, *(_file(folder / name, "fabric", document) for name in sweep.base.fabric)]


def _file(path: Path, field: str, document: Document) -> Path:
    if not path.is_file():
        raise InputError(f"{document.where(('base', field))}: base.{field}: no such file: {path}")
    return path


def _directions(
    sweep: Sweep, document: Document, test: str, config: Path | None, axes: list[Axis]
) -> list[tuple[Setting, ...]]:
    """A setting for each direction of ``test``; both unless the sweep or its config says otherwise."""
    swept = any(path == DIRECTION[: len(path)] for axis in axes for path in axis.paths)
    where = document.where(("base", "direction"))
    if swept and sweep.base.direction:
        raise InputError(f"{where}: base.direction: rig.direction is given as well: give one of them")
    if swept or place(DIRECTION, test) is None:
        return [()]
    for name in sweep.base.direction:
        if name not in ("warp", "weft", "both"):
            raise InputError(f"{where}: base.direction = {shown(name)}: expected warp, weft or both")
    asked: list[str | None] = [*sweep.base.direction] or [None]
    names = [found for name in asked for found in planned_directions(name, config)]
    return [(Setting(DIRECTION, name, where),) for name in dict.fromkeys(names)]
