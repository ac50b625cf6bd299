"""Strips from a testing machine: force over the strain of the best column, and series of strips."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from knittest.base.errors import InputError
from knittest.config.fabric import MacroMaterial
from knittest.experiment import lab_shear as checks
from knittest.experiment.lab_conditions import (
    EXTENSOMETER,
    GAUGE,
    STANDARD,
    WIDTH,
    Condition,
    check_within_bounds,
    common_value,
    sizes_agree,
)
from knittest.experiment.lab_recording import Recording, make_reader
from knittest.experiment.lab_results import Curves
from knittest.experiment.lab_table import ReadOptions, noise
from knittest.experiment.lab_units import QUANTITIES
from knittest.experiment.statistics import Array, Specimen, corridor, peaks

StripT = TypeVar("StripT")

#: strain above which unit or gauge length are wrong [%]
MAX_STRAIN = 100.0
#: strength of textiles per width [N/mm], and maximum force of a yarn or a strip [N]
STRENGTH, FORCES = (0.5, 3000.0), (0.05, 500_000.0)
MOVES = ("extensometer", "travel")
#: shares of its largest strain by which an extensometer may fall while the force rises, and turn negative
FALL, BELOW = 0.02, 0.05
#: an extensometer stays if it gains less than this share while the force gains that share of its maximum
STAYS, GAINS = 0.002, 0.08
#: an extensometer jumps if its step and that of the clamp, as shares of their travels, differ by more
JUMP = 0.25
#: an extensometer slips if, in one of this number of parts of the clamp travel, its pace is below this share of its
#: usual one and the force gains that share of its maximum
PARTS, SLOW, GAINS_SLOW = 10, 0.25, 0.03
#: share of its travel by which a clamp returns before another loading
UNLOADED = 0.1
#: share of the largest travel below which an offset at the start is ignored
OFFSET = 0.002


@dataclass(frozen=True)
class _Measure:
    """A column for the strain: ``factor`` to %, nan without a gauge length, and ``rank`` of its kind (0 best)."""

    column: int
    rank: int
    unit: str
    factor: float
    words: str

    @property
    def has_extensometer(self) -> bool:
        return self.rank < 2


def strip_reader(one: Callable[[Recording], StripT]) -> Callable[[Path, ReadOptions], list[StripT]]:
    """Return a function that reads a file of strips and calls ``one`` for each recording."""
    return make_reader([("force",), MOVES], "a force and a displacement or strain column", one)


def read_strip(r: Recording) -> Specimen:
    """Read a specimen. Its strain is the measured one, else the valid extensometer travel over its gauge length, else
    the clamp travel over the gauge length of the clamps.
    """
    names, why = r.table.names, {}
    pull, gauge = next(k for k in r.group if r.table.roles[k] == "force"), r.find(GAUGE)
    measures = _find_measures(r, gauge)
    clamp = next((m for m in measures if not m.has_extensometer and np.isfinite(m.factor)), None)
    r.unit, _ = r.unit_of(pull)
    for measure in measures:
        beside = clamp if measure.has_extensometer else None
        if not np.isfinite(measure.factor):
            row = "extensometer gauge length" if measure.has_extensometer else "gauge length"
            why[measure.column] = f"{measure.words}: no gauge length; add a row '{row};...;mm' above the table"
            continue
        try:
            read = r.fetch([pull, measure.column, *([beside.column] if beside else [])])
        except InputError as error:
            if beside is None:
                raise
            why[measure.column] = f"{measure.words}: {error}"
            continue
        rows = _Rows(r, *read, measure, beside)
        if measure.has_extensometer and (reason := rows.invalid()):
            why[measure.column] = f"{measure.words}: {reason}"
            continue
        strain, force = rows.curve()
        left = {m.column: f"{m.words}: {names[measure.column]!r} is used instead" for m in measures}
        origin = r.origin({pull: "force", measure.column: measure.words}, left | why, rows.notes)
        return Specimen(**origin, strain=strain, force=force, width=r.find(WIDTH), gauge=gauge)
    where = r.table.header_place
    if not any(m.has_extensometer for m in measures):
        raise InputError(f"{where}: the file states no gauge length for the travel; give --gauge-length [mm]")
    reasons = "; ".join(f"{names[k]!r} ({reason})" for k, reason in why.items())
    raise InputError(
        f"{where}: specimen {r.name}: no valid strain: {reasons}. Give --gauge-length [mm] to use the clamp travel, "
        "or remove the specimen"
    )


def _find_measures(r: Recording, gauge: float | None) -> list[_Measure]:
    """Find the columns for the strain, the best first; raises :class:`InputError` for an unknown unit."""
    own, standard, grips, marks = r.find(EXTENSOMETER), r.find(STANDARD), r.find(GAUGE, [0]), r.find(GAUGE, [1])
    if own is None and grips and marks and not sizes_agree(grips, marks):
        own = marks
    found, failed, moves = [], [], [k for k in r.group if r.table.roles[k] in MOVES]
    for k in moves:
        kinds = {kind for kind in ("derived", "sensor", "standard", "corrected", "machine") if r.is_kind(k, kind)}
        is_extensometer, length = r.table.roles[k] == "extensometer", gauge
        is_sensor = is_extensometer and not ("derived" in kinds and "sensor" not in kinds)
        try:
            unit, _ = r.unit_of(k)
        except InputError as error:
            if is_sensor:
                raise
            failed.append(error)
            continue
        if unit in QUANTITIES["strain"]:
            rank, words = (0, "measured strain") if is_sensor else (4, "strain from the clamp travel")
        elif is_extensometer:
            of_grips = len(moves) > 1 or (grips and not marks and "sensor" in kinds)
            length = own or (None if of_grips else gauge)
            rank, words = 1, "extensometer travel" + (f", gauge length {length:g} mm" if length else "")
        else:
            length = standard if "standard" in kinds and standard else gauge
            rank = 2 if {"standard", "corrected"} & kinds else 5 if "machine" in kinds else 3
            words = "clamp travel" + (f", gauge length {length:g} mm" if length else "")
        factor = QUANTITIES["strain"].get(unit) or 100.0 * QUANTITIES["length"][unit] / (length or np.nan)
        found.append(_Measure(k, rank, unit, factor, words))
    if not found:
        raise failed[0]
    return sorted(found, key=lambda m: m.rank)


class _Rows:
    """Rows of one specimen: strain [%] from its start, force [N] and, with an extensometer, the clamp travel."""

    def __init__(
        self, r: Recording, lines: list[int], values: Array, measure: _Measure, beside: _Measure | None
    ) -> None:
        self.lines, self.values, self.measure, sign = lines, values, measure, r.given.sign
        self.where = f"{r.table.place}:{{}}: specimen {r.name}"
        self.notes: list[str] = []
        with np.errstate(over="ignore", invalid="ignore"):  # refused below
            force = values[:, 0] * QUANTITIES["force"][r.unit]
            if not np.isfinite(force).all():
                raise InputError(f"{self.where.format(lines[int(np.argmin(np.isfinite(force)))])}: no finite force")
            self.force = checks.to_tension_force(force, sign, r.place)
            self.top = int(np.argmax(self.force)) if self.force.max() > 0.0 else len(self.force) - 1
            self.clamp = values[:, 2] * beside.factor if beside else None
            strain = checks.to_rising_travel(values[:, 1] * measure.factor, sign)
            start = _strain_at_start(strain, self.force, self.top)
            if strain[self.top] < start and sign == "positive" and not measure.has_extensometer:
                strain, start = -strain, -start
                self.notes.append("the travel is negative in tension: its sign was reversed")
            if start:
                self.notes.append(f"the travel starts at {values[0, 1]:.4g} {measure.unit}: this offset was subtracted")
            self.strain = strain - start
            before = self.strain[: self.top + 1]
            self.noise = 6.0 * noise(before)
            self.jitter = max(checks.JITTER * float(np.ptp(before)), self.noise)

    def invalid(self) -> str:
        """Return why an extensometer is not valid up to the maximum force; empty if it is.

        Raises :class:`InputError` if its unit contradicts the clamp travel.
        """
        rows, lines = slice(0, self.top + 1), self.lines
        e, force = _remove_spikes(self.strain[rows]), np.maximum.accumulate(self.force[rows])
        most, top = np.maximum.accumulate(e), float(np.abs(e).max())
        if self.top < 2:
            return ""
        if not top > 0.0:
            return "it reads zero up to the maximum force"
        best = np.maximum.accumulate(np.where(e >= most, np.arange(len(e)), 0))
        falls = np.flatnonzero((most - e > max(FALL * top, self.noise)) & (self.force[rows] > force[best]))
        if len(falls):
            k, fall = int(falls[0]), f"from {most[falls[0]]:.4g} to {e[falls].min():.4g} %"
            return f"its strain falls {fall} while the force rises (line {lines[k]}): removed or slipped"
        if e.min() < -max(BELOW * top, self.noise):
            return f"its strain turns negative in tension, {e.min():.4g} % in line {lines[int(np.argmin(e))]}"
        changes = np.diff(np.flatnonzero(np.diff(self.strain[rows])))
        held = int(np.median(changes)) if len(changes) > 2 else 1  # rows between two values of a slower channel
        earlier = int(np.searchsorted(force, (1.0 - GAINS) * force[-1], side="right")) - 1
        earlier = max(min(earlier, self.top - 2 * held), 0)
        least = max(STAYS * top, 6.0 * noise(self.strain[earlier : self.top + 1]))
        if earlier and e[-1] - e[earlier] < least:
            k = int(np.argmax(e > e[-1] - least))
            rise = f"from {force[k]:.4g} to {force[-1]:.4g} N (line {lines[k]})"
            return f"its strain stays at {e[-1]:.4g} % while the force rises {rise}"
        x = np.zeros(1) if self.clamp is None else _remove_spikes(self.clamp[rows] - self.clamp[0])
        if not abs(x[-1]) > 0.0:
            return ""
        steps = np.abs(np.diff(e / e.max())) - np.abs(np.diff(x / x[-1]))
        if len(steps) > 8 and steps.max() > JUMP:
            return f"its strain jumps in line {lines[int(np.argmax(steps)) + 1]}, the clamp travel does not"
        parts = np.searchsorted(np.maximum.accumulate(x / x[-1]), np.linspace(0.0, 1.0, PARTS + 1))
        pace, gain = np.diff(e[parts]), np.diff(force[parts]) / force[-1]
        slow = np.flatnonzero((pace < SLOW * np.quantile(pace, 0.75)) & (gain > GAINS_SLOW))
        if len(np.unique(e)) > 4 * PARTS and (slow >= 2).any():
            return f"it hardly moves from line {lines[parts[slow[slow >= 2][0]]]} on while the clamp moves: slipped"
        ratio = e[-1] / abs(x[-1])
        if 0.005 < ratio < 0.02 or 50.0 < ratio < 200.0:
            raise InputError(
                f"{self.where.format(lines[self.top])}: the strain at maximum force is {e[-1]:.4g} %, the clamp travel "
                f"gives {abs(x[-1]):.4g} %; check whether the strain is in % or a fraction"
            )
        return ""

    def curve(self) -> tuple[Array, Array]:
        """Return strain [%], rising, and force [N]; raises InputError for a travel that falls before the peak."""
        strain, top, values = self.strain, self.top, self.values
        self._refuse_cycles()
        with np.errstate(over="ignore", invalid="ignore"):
            back = np.flatnonzero(np.maximum.accumulate(strain) - strain > self.jitter)
        before, after = back[back <= top], back[back > top]
        if len(before) and not self.measure.has_extensometer:
            k = int(before[0])
            raise InputError(
                f"{self.where.format(self.lines[k])}: the travel falls from {values[k - 1, 1]:g} to {values[k, 1]:g} "
                "before the maximum force; for a cyclic test, keep only the first loading"
            )
        end = int(after[0]) if len(after) else len(strain)
        end = max(int(np.argmax(strain[:end])), top) + 1
        if self.measure.has_extensometer and self.clamp is not None and top > 1:  # taken off after the peak
            usual = 10.0 * float(np.abs(np.diff(strain[: top + 1])).max())
            jumps = np.flatnonzero(np.abs(np.diff(strain[top:end])) > usual)
            end = top + 1 + int(jumps[0]) if len(jumps) else end
        if len(strain) - end:
            self.notes.append(f"rows from line {self.lines[end]} on skipped: the travel falls")
        # rows that repeat a travel, or go back within its noise, are one: their mean force, or the maximum
        rising, row = np.unique(np.maximum.accumulate(strain[:end]), return_inverse=True)
        force = np.bincount(row, self.force[:end]) / np.bincount(row)
        force[row[top]] = self.force[top]
        where = self.where.format(self.lines[-1])
        if not rising[-1] <= MAX_STRAIN:
            raise InputError(
                f"{where}: travel {values[end - 1, 1]:g} gives a strain of {rising[-1]:.4g} %, above the limit of "
                f"{MAX_STRAIN:g} %; check the unit of the travel and the gauge length"
            )
        if len(rising) < 2:
            raise InputError(f"{where}: the travel does not rise; check its column")
        return rising, force

    def _refuse_cycles(self) -> None:
        """Raise :class:`InputError` if the clamp travel falls and the force rises again after it."""
        way = self.strain if self.clamp is None else np.abs(self.clamp - self.clamp[0])
        back = np.maximum.accumulate(way) - way > max(UNLOADED * float(np.ptp(way)), 6.0 * noise(way))
        later = self.force[int(np.argmax(back)) :] if back.any() else self.force[:0]
        if len(later) and (later - np.minimum.accumulate(later)).max() > checks.OTHER * self.force[self.top]:
            raise InputError(
                f"{self.where.format(self.lines[int(np.argmax(back))])}: the travel falls, then the force rises again, "
                "as in cycles or with several specimens; keep only the first loading of one specimen"
            )


def _strain_at_start(strain: Array, force: Array, top: int) -> float:
    """Return the strain of the rows before loading, to be subtracted.

    It is 0 if negligible, or if the first row is one step from the origin on the curve (a missing row of zeros).
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


def _remove_spikes(values: Array) -> Array:
    """Running median of five rows, for at least 25 rows."""
    from scipy.ndimage import median_filter

    return values if len(values) < 25 else np.asarray(median_filter(values, 5, mode="nearest")) + 0.0


read_strips = strip_reader(read_strip)


def check_strips(specimens: Sequence[Specimen]) -> None:
    """Raise :class:`InputError` for an implausible maximum force, force per width or strain at maximum force."""
    force, strain = peaks(specimens)
    for s, top, at in zip(specimens, force, strain, strict=True):
        band = FORCES if s.width is None else (STRENGTH[0] * s.width, STRENGTH[1] * s.width)
        per = "" if s.width is None else f", {top / s.width:.4g} N/mm at {s.width:g} mm width"
        checks.refuse_implausible(s, top, band, f"maximum force {top:.6g} N{per}", "N", top)
        check = ": check the unit of the travel and the gauge length"
        check_within_bounds(
            at, MacroMaterial, "fracture_strain", f"{s.place}: strain at maximum force {at:.4g} %", check
        )
    checks.refuse_outliers(specimens, force, "maximum force", "N")
    checks.refuse_outliers(specimens, strain, "strain at maximum force", "%")


def make_series(specimens: Sequence[Specimen]) -> tuple[list[Specimen], list[Specimen], dict[Condition, float]]:
    """Scale strips to their mean width; returns them with forces in N and in N/mm, and width and gauge length."""
    width = common_value(WIDTH, [s.width for s in specimens], specimens)
    found = {WIDTH: width}
    if any(s.gauge is not None for s in specimens):
        found[GAUGE] = common_value(GAUGE, [s.gauge for s in specimens], specimens)
    check_strips(specimens)
    strips = [replace(s, force=s.force * (width / (s.width or width)), width=width) for s in specimens]
    return strips, [replace(s, force=s.force / width) for s in strips], found


def strip_curves(narrow: Sequence[Specimen]) -> Curves:
    """Curves of the force per width [N/mm]."""
    names = ("strain_pct", "force_n_per_mm", "force_sd_n_per_mm")
    each = [(s.strain, s.force) for s in narrow]
    return Curves(each, corridor(narrow), names, ("strain [%]", "force per width [N/mm]"))
