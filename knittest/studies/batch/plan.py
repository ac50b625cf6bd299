"""Plan of a sweep: its runs."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from knittest.base.errors import InputError
from knittest.config.fields import place
from knittest.config.loading import planned_directions, resolve
from knittest.config.messages import unknown
from knittest.config.run import RUNS
from knittest.config.settings import Setting
from knittest.config.sources import variant_path
from knittest.config.sweep import Sweep, parse_sweep
from knittest.config.yaml_loader import Document, KeyPath, dotted, shown
from knittest.studies.batch.axes import Axis, axes_of
from knittest.studies.homogenise.yarn_card import with_cards
from knittest.studies.trials.trial import Trial, trial_of

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
