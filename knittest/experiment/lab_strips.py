"""Strips pulled in a testing machine: force over the strain of the best column that there is, and of one series."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.config.fabric import MacroMaterial
from knittest.experiment import lab_names, lab_units
from knittest.experiment.lab_checks import common, digests, refuse_apart
from knittest.experiment.lab_conditions import (
    EXTENSOMETER,
    GAUGE,
    STANDARD,
    WIDTH,
    Condition,
    columns_of,
    in_column,
    known,
    said_by,
    same,
    stated,
    within,
)
from knittest.experiment.lab_given import JITTER, OTHER, Given, Sign, drawn, noise, pulled
from knittest.experiment.lab_recording import columns, specimens_in, told, unit_of
from knittest.experiment.lab_results import Curves
from knittest.experiment.lab_table import LabTable, read_tables
from knittest.experiment.statistics import Specimen, corridor, peaks

Array = NDArray[np.float64]

#: strain above which unit or gauge length must be wrong [%]
MAX_STRAIN = 100.0
#: strength of textiles per width [N/mm], and what a testing machine pulls a yarn or a strip with [N]
STRENGTH, FORCES = (0.5, 3000.0), (0.05, 500_000.0)
MOVES = ("extensometer", "travel")
#: share of its largest strain by which an extensometer may fall while the force rises, or turn negative
FALL, BELOW = 0.02, 0.05
#: it stays where it gains less than this share while the force gains that one of its maximum
STAYS, GAINS = 0.002, 0.08
#: difference of the shares of their ways that extensometer and clamp go from row to row beyond which one jumps
JUMP = 0.25
#: an extensometer slips where in one of so many parts of the clamp's way it moves at less than this share of its usual
#: pace, and the force gains that share of its maximum
PARTS, SLOW, GAINS_SLOW = 10, 0.25, 0.03
#: share of its way by which a clamp goes back before another loading
UNLOADED = 0.1
#: share of the largest travel below which an offset of the start is none
OFFSET = 0.002


@dataclass(frozen=True)
class _Measure:
    """A column that may give the strain: ``factor`` to %, ``rank`` of its kind (0 the best), ``gauge`` [mm] or none."""

    column: int
    rank: int
    unit: str
    gauge: float | None
    words: str

    @property
    def factor(self) -> float:
        if self.unit in lab_units.STRAIN:
            return lab_units.STRAIN[self.unit]
        return 100.0 * lab_units.LENGTH[self.unit] / (self.gauge or np.nan)

    @property
    def has_extensometer(self) -> bool:
        return self.rank < 2


def read_lab(
    path: Path, gauge_length: float | None = None, decimal: str | None = None, delimiter: str | None = None,
    width: float | None = None, sign: Sign = "positive",
) -> list[Specimen]:  # fmt: skip
    """:func:`read_strips` with sizes [mm] where they are given."""
    sizes = {what.key: v for what, v in ((GAUGE, gauge_length), (WIDTH, width)) if v is not None}
    return read_strips(path, Given(decimal, delimiter, sign, sizes))


def read_strips(path: Path, given: Given) -> list[Specimen]:
    """Specimens in one export.

    The strain is a measured one, else the travel of an extensometer over its gauge length, as long as it is valid, else
    the travel of the clamp over theirs. Raises :class:`InputError` with the row for what cannot be a pull.
    """
    return [strip for strip, _ in read_tabled(path, given)]


def read_tabled(path: Path, given: Given) -> list[tuple[Specimen, LabTable]]:
    """:func:`read_strips` with the table of each."""
    tables = read_tables(path, given, [("force",), MOVES], "a force and a displacement or strain column")
    found = []
    for name, table, group, number in specimens_in(tables, ("force",), MOVES):
        one, width = _specimen(table, name, group, given), known(WIDTH, table, given.sizes, number)
        found.append((replace(one, width=width, path=path, said=said_by(path, table.head)), table))
    return found


def _specimen(table: LabTable, name: str, group: Sequence[int], given: Given) -> Specimen:
    pull = next(k for k in group if table.roles[k] == "force")
    gauge = known(GAUGE, table, given.sizes)
    measures = _measures(table, group, gauge)
    clamp = next((m for m in measures if not m.has_extensometer and np.isfinite(m.factor)), None)
    unit, _ = unit_of(table, pull)
    why: dict[int, str] = {}
    for measure in measures:
        if not np.isfinite(measure.factor):
            row = "extensometer gauge length" if measure.has_extensometer else "gauge length"
            why[measure.column] = f"{measure.words}: no row '{row};...;mm' above the table states its gauge length"
            continue
        beside = clamp if measure.has_extensometer else None
        try:
            read = columns(table, [pull, measure.column, *([beside.column] if beside else [])], name)
        except InputError as error:
            if beside is None:
                raise
            why[measure.column] = f"{measure.words}: {error}"
            continue
        rows = _Rows(table, name, read, unit, measure, beside, given.sign)
        if measure.has_extensometer and (reason := rows.invalid()):
            why[measure.column] = f"{measure.words}: {reason}"
            continue
        strain, force = rows.curve()
        left = {m.column: f"{m.words}: {table.names[measure.column]!r} comes first" for m in measures}
        used = {pull: "force", measure.column: measure.words}
        notes = [*told(table, used, group, left | why), *rows.notes, *table.notes_of(name)]
        return Specimen(name, strain, force, None, gauge, unit=unit, notes=tuple(dict.fromkeys(notes)))
    if not any(m.has_extensometer for m in measures):
        raise InputError(
            f"{table.where}: travel in {measures[0].unit}, and the file states no gauge length: give --gauge-length "
            "[mm]"
        )
    reasons = "; ".join(f"{table.names[k]!r} ({reason})" for k, reason in why.items())
    raise InputError(
        f"{table.where}: specimen {name}: no valid strain: {reasons}: give --gauge-length [mm] for the travel of the "
        "clamp, or leave the specimen out"
    )


def _measures(table: LabTable, group: Sequence[int], gauge: float | None) -> list[_Measure]:
    """Columns that may give the strain, the best first; raises :class:`InputError` for a strain of an unknown unit."""
    own = stated(EXTENSOMETER, table)
    for k in columns_of(EXTENSOMETER, table):
        own = own or in_column(EXTENSOMETER, table, k)
    grips, marks = stated(GAUGE, table, (0,)), stated(GAUGE, table, (1,))
    if own is None and grips and marks and not same(grips[0], marks[0]):
        own = marks
    standard = stated(STANDARD, table)
    columns_ = [k for k in group if table.roles[k] in MOVES]
    found, failed = [], []
    for k in columns_:
        name, of_extensometer = table.names[k], table.roles[k] == "extensometer"
        derived = lab_names.is_kind("derived", name) and not lab_names.is_kind("sensor", name)
        try:
            unit, _ = unit_of(table, k)
        except InputError as error:
            if of_extensometer and not derived:
                raise
            failed.append(error)
            continue
        if unit in lab_units.STRAIN:
            rank = 0 if of_extensometer and not derived else 4
            words = "a measured strain" if rank == 0 else "a strain by the travel of the clamp"
            found.append(_Measure(k, rank, unit, None, words))
        elif of_extensometer:
            of_grips = grips and not marks and lab_names.is_kind("sensor", name)
            length = own[0] if own else gauge if len(columns_) == 1 and not of_grips else None
            words = "the travel of an extensometer" + (f" over {length:g} mm" if length else "")
            found.append(_Measure(k, 1, unit, length, words))
        else:
            is_standard = lab_names.is_kind("standard", name)
            length = standard[0] if is_standard and standard else gauge
            rank = (
                2
                if is_standard or lab_names.is_kind("corrected", name)
                else 5
                if lab_names.is_kind("machine", name)
                else 3
            )
            words = "a travel" + (f" over {length:g} mm between the clamps" if length else " of the clamp")
            found.append(_Measure(k, rank, unit, length, words))
    if not found:
        raise failed[0]
    return sorted(found, key=lambda m: m.rank)


class _Rows:
    """Rows of one specimen: strain [%] from its start, force [N] and, beside an extensometer, travel of the clamp."""

    def __init__(
        self, table: LabTable, name: str, read: tuple[list[int], Array], unit: str, measure: _Measure,
        beside: _Measure | None, sign: Sign,
    ) -> None:  # fmt: skip
        self.where, self.measure, self.notes = f"{table.place}:{{}}: specimen {name}", measure, []
        self.lines, self.values = read
        with np.errstate(over="ignore", invalid="ignore"):  # refused below
            force = self.values[:, 0] * lab_units.FORCE[unit]
            if not np.isfinite(force).all():
                row = int(np.argmin(np.isfinite(force)))
                raise InputError(f"{self.where.format(self.lines[row])}: no finite force")
            self.force = pulled(force, sign, f"{table.place}: specimen {name}")
            self.strain = drawn(self.values[:, 1] * measure.factor, sign)
            self.top = int(np.argmax(self.force)) if self.force.max() > 0.0 else len(self.force) - 1
            self.clamp = self.values[:, 2] * beside.factor if beside else None
            start = _start(self.strain, self.force, self.top)
            if self.strain[self.top] < start and sign == "positive" and not measure.has_extensometer:
                self.strain, start = -self.strain, -start
                self.notes.append("its travel falls under the pull: counted the other way")
            if start:
                raw = self.values[0, 1]
                self.notes.append(f"it begins at {raw:.4g} {measure.unit}: subtracted")
            self.strain = self.strain - start
            before = self.strain[: self.top + 1]
            self.jitter = max(JITTER * float(np.ptp(before)), 6.0 * noise(before))

    def invalid(self) -> str:
        """Reason why an extensometer does not hold up to the maximum force; empty if it does."""
        rows = slice(0, self.top + 1)
        e, force = _without_spikes(self.strain[rows]), np.maximum.accumulate(self.force[rows])
        most = np.maximum.accumulate(e)
        top, wide = float(np.abs(e).max()), 6.0 * noise(self.strain[rows])
        if self.top < 2:
            return ""
        if not top > 0.0:
            return "it shows nothing up to the maximum force"
        best = np.maximum.accumulate(np.where(e >= most, np.arange(len(e)), 0))
        falls = np.flatnonzero((most - e > max(FALL * top, wide)) & (self.force[rows] > force[best]))
        if len(falls):
            k = int(falls[0])
            return (
                f"it falls from {most[k]:.4g} to {e[falls].min():.4g} % while the force rises "
                f"(line {self.lines[k]}): taken off, or it slipped"
            )
        if e.min() < -max(BELOW * top, wide):
            return f"it turns negative under the pull, {e.min():.4g} % in line {self.lines[int(np.argmin(e))]}"
        changes = np.diff(np.flatnonzero(np.diff(self.strain[rows])))
        held = int(np.median(changes)) if len(changes) > 2 else 1  # rows between two values of a slower channel
        earlier = int(np.searchsorted(force, (1.0 - GAINS) * force[-1], side="right")) - 1
        earlier = max(min(earlier, self.top - 2 * held), 0)
        least = max(STAYS * top, 6.0 * noise(self.strain[earlier : self.top + 1]))
        if earlier and e[-1] - e[earlier] < least:
            k = int(np.argmax(e > e[-1] - least))
            return (
                f"it stays at {e[-1]:.4g} % while the force rises from {force[k]:.4g} to {force[-1]:.4g} N "
                f"(line {self.lines[k]})"
            )
        return self._apart(e)

    def _apart(self, e: Array) -> str:
        """Reason by the travel of the clamp beside it; raises :class:`InputError` where their units contradict."""
        if self.clamp is None:
            return ""
        x = _without_spikes(self.clamp[: self.top + 1] - self.clamp[0])
        if not abs(x[-1]) > 0.0:
            return ""
        steps = np.abs(np.diff(e / e.max())) - np.abs(np.diff(x / x[-1]))
        if len(steps) > 8 and steps.max() > JUMP:
            return f"it jumps in line {self.lines[int(np.argmax(steps)) + 1]}, the clamp does not"
        rows = np.searchsorted(np.maximum.accumulate(x / x[-1]), np.linspace(0.0, 1.0, PARTS + 1))
        pace, gain = np.diff(e[rows]), np.diff(np.maximum.accumulate(self.force)[rows]) / self.force[self.top]
        slow = np.flatnonzero((pace < SLOW * np.quantile(pace, 0.75)) & (gain > GAINS_SLOW))
        if len(np.unique(e)) > 4 * PARTS and (slow >= 2).any():
            return f"it hardly moves from line {self.lines[rows[slow[slow >= 2][0]]]} on, the clamp does: it slipped"
        ratio = e[-1] / abs(x[-1])
        if 0.005 < ratio < 0.02 or 50.0 < ratio < 200.0:
            raise InputError(
                f"{self.where.format(self.lines[self.top])}: a strain of {e[-1]:.4g} % at the maximum force, where the "
                f"clamp travels {abs(x[-1]):.4g} %: in % or a fraction? Check the unit of the strain"
            )
        return ""

    def curve(self) -> tuple[Array, Array]:
        """Strain [%], rising, and force [N]; raises :class:`InputError` for a travel that goes back before the peak."""
        strain, top = self.strain, self.top
        self._refuse_cycles()
        with np.errstate(over="ignore", invalid="ignore"):
            back = np.flatnonzero(np.maximum.accumulate(strain) - strain > self.jitter)
        before = back[back <= top]
        if len(before) and not self.measure.has_extensometer:
            k = int(before[0])
            raise InputError(
                f"{self.where.format(self.lines[k])}: the travel goes back before the maximum force "
                f"({self.values[k - 1, 1]:g} then {self.values[k, 1]:g}): a cyclic test? Keep the first loading alone"
            )
        end = int(back[back > top][0]) if (back > top).any() else len(strain)
        end = max(int(np.argmax(strain[:end])), top) + 1
        if self.measure.has_extensometer and self.clamp is not None and top > 1:  # taken off after the peak
            usual = 10.0 * float(np.abs(np.diff(strain[: top + 1])).max())
            jumps = np.flatnonzero(np.abs(np.diff(strain[top:end])) > usual)
            end = top + 1 + int(jumps[0]) if len(jumps) else end
        if len(strain) - end:
            self.notes.append(f"rows from line {self.lines[end]} on left out: the travel turns back")
        strain, force = _rising(strain[:end], self.force[:end], top)
        if not strain[-1] <= MAX_STRAIN:
            raise InputError(
                f"{self.where.format(self.lines[-1])}: a travel of {self.values[end - 1, 1]:g} would be a strain of "
                f"{strain[-1]:.4g} %: check the unit of the travel and the gauge length"
            )
        if len(strain) < 2:
            raise InputError(f"{self.where.format(self.lines[-1])}: the travel does not rise")
        return strain, force

    def _refuse_cycles(self) -> None:
        """Raise :class:`InputError` where the clamp goes back and the force rises again after it."""
        way = self.strain if self.clamp is None else np.abs(self.clamp - self.clamp[0])
        back = np.maximum.accumulate(way) - way > max(UNLOADED * float(np.ptp(way)), 6.0 * noise(way))
        later = self.force[int(np.argmax(back)) :] if back.any() else self.force[:0]
        if len(later) and (later - np.minimum.accumulate(later)).max() > OTHER * self.force[self.top]:
            raise InputError(
                f"{self.where.format(self.lines[int(np.argmax(back))])}: the travel goes back, and the force rises "
                "again after it: a cyclic test, or several specimens? Keep the first loading of one specimen alone"
            )


def _rising(strain: Array, force: Array, top: int) -> tuple[Array, Array]:
    """Rows that repeat a travel, or go back within its noise, as one each: their mean force, or the maximum."""
    x, row = np.unique(np.maximum.accumulate(strain), return_inverse=True)
    mean = np.bincount(row, force) / np.bincount(row)
    mean[row[top]] = force[top]
    return x, mean


def _start(strain: Array, force: Array, top: int) -> float:
    """Strain to subtract: that of the rows at rest before the pull, none where it is next to nothing.

    A first row that lies one step from the origin on the curve is none at rest: the row of zeros was left out.
    """
    way = float(np.abs(strain[top] - strain[0]))
    if not np.isfinite(way):
        return 0.0
    still = np.abs(strain - strain[0]) <= max(6.0 * noise(strain[: top + 1]), OFFSET * way)
    rows = int(np.argmin(still)) if not still.all() else 1
    zero = float(np.median(strain[: max(rows, 1)]))
    if abs(zero) <= OFFSET * max(way, abs(float(strain[top]) - zero)):
        return 0.0
    if rows <= 1 and len(strain) > 1 and zero > 0.0 and (step := float(strain[1] - strain[0])) > 0.0:
        slope = float(force[1] - force[0]) / step
        if zero <= 1.5 * step and force[0] > 0.0 and force[0] >= 0.25 * slope * zero:
            return 0.0
    return zero


def _without_spikes(values: Array) -> Array:
    """Running median of five rows, where there are many."""
    if len(values) < 25:
        return values
    padded = np.pad(values, 2, mode="edge")
    found: Array = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    return found


def plausible_strips(specimens: Sequence[Specimen]) -> None:
    """Raise :class:`InputError` for a force, a force per width or a strain at it that no strip or yarn has."""
    force, strain = peaks(specimens)
    for s, top, at in zip(specimens, force, strain, strict=True):
        band = FORCES if s.width is None else (STRENGTH[0] * s.width, STRENGTH[1] * s.width)
        if not band[0] <= top <= band[1]:
            per = "" if s.width is None else f", {top / s.width:.4g} N/mm of its {s.width:g} mm"
            raise InputError(
                f"{s.path}: specimen {s.name}: maximum force {top:.6g} N{per}: implausible, expected "
                f"{band[0]:g} to {band[1]:g} N{lab_units.likely_force(top, s.unit, band)}: check the unit of the force"
            )
        said = f"{s.path}: specimen {s.name}: strain at maximum force {at:.4g} %"
        check = ": check the unit of the travel and the gauge length"
        within(float(at), MacroMaterial, "fracture_strain", said, check)
    refuse_apart(specimens, force, "maximum force", "N")
    refuse_apart(specimens, strain, "strain at maximum force", "%")


def one_series(specimens: Sequence[Specimen]) -> tuple[list[Specimen], list[Specimen], dict[Condition, float]]:
    """Strips as if all were of their mean width, the same with forces in N/mm of it, and that width and gauge length.

    Forces are scaled by the width that each has. Raises :class:`InputError` for strips without a width, of different
    sizes, of the same numbers, or that no fabric has.
    """
    width = common(WIDTH, [s.width for s in specimens], specimens)
    found = {WIDTH: width}
    if any(s.gauge is not None for s in specimens):
        found[GAUGE] = common(GAUGE, [s.gauge for s in specimens], specimens)
    plausible_strips(specimens)
    digests(specimens, [(s.strain, s.force) for s in specimens])
    strips = [replace(s, force=s.force * (width / (s.width or width)), width=width) for s in specimens]
    return strips, [replace(s, force=s.force / width) for s in strips], found


def strip_curves(narrow: Sequence[Specimen]) -> Curves:
    """Curves of forces in N/mm of width."""
    names = ("strain_pct", "force_n_per_mm", "force_sd_n_per_mm")
    each = [(s.strain, s.force) for s in narrow]
    return Curves(each, corridor(narrow), names, ("strain [%]", "force per width [N/mm]"))
