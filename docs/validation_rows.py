"""Rows of docs/validation.md: experiment, simulation with its numerical error, trivial predictor and verdict."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from docs.stored_runs import StoredRun
from knittest.base.files import data_dir
from knittest.base.result_rows import mean_factor, to_nominal_size
from knittest.experiment.origin import ROW_NAMES, RowKind, quantities, row_kind
from knittest.experiment.tables import PublishedValue, published_rows
from knittest.laboratory.report_base import REPORTS

#: deviation [sd of the experiment] that a predicted or tuned row may have, and share that an input may be off
LIMIT_SD, LIMIT_INPUT = 1.0, 0.01
#: rows of the paper's tables by test
QUANTITIES = {
    "tensile": ("peak_force_n", "fracture_strain_pct"),
    "cantilever": ("overhang_mm",),
    "friction": ("mu_paper",),
}
#: quantities that grow with the number of yarns
COUNTED = ("peak_force_n",)
#: row that the trivial predictor copies, variant and direction, and the one it takes for that row itself
COPIED, OWN = ("1", "warp"), ("1", "weft")


@dataclass(frozen=True)
class Copy:
    """The trivial predictor: ``value``, and ``of`` which row."""

    value: float
    of: str

    def deviation(self, measured: PublishedValue) -> float:
        """Share by which it is off."""
        return self.value / measured.mean - 1.0


@dataclass(frozen=True)
class Row:
    """A published number and what ``run`` makes of it, for the nominal size: ``value``, ``sd`` of an ensemble (else
    NaN), ``error`` the numerical one (NaN if it was not verified) and ``error_of`` the preset that it was found at.
    """

    run: StoredRun
    quantity: str
    measured: PublishedValue
    kind: RowKind
    value: float
    sd: float = math.nan
    error: float = math.nan
    error_of: str = ""
    copy: Copy | None = None

    @property
    def deviation(self) -> float:
        """Share by which the simulation is off."""
        return self.value / self.measured.mean - 1.0

    @property
    def deviation_sd(self) -> float:
        """The same in standard deviations of the experiment."""
        return (self.value - self.measured.mean) / self.measured.sd

    @property
    def verdict(self) -> str:
        """Say whether it keeps to the limit of its kind, and whether its numerical error leaves that open."""
        if self.run.refused:
            return "**rejected**"
        if self.kind == "assumed":
            return "not judged"
        if self.kind == "input":
            off, error, limit = abs(self.deviation), abs(self.error / self.measured.mean), LIMIT_INPUT
        else:
            off, error, limit = abs(self.deviation_sd), abs(self.error / self.measured.sd), LIMIT_SD
        passed = "passed" if off <= limit else "**FAILED**"
        return f"{passed}, within ± open" if abs(off - limit) < error else passed


def rows_of(runs: Sequence[StoredRun], test: str, scale: str) -> list[Row]:
    """Rows of all runs of ``test`` at ``scale``, by variant, direction and quantity."""
    chosen = [run for run in runs if (run.options["test"], run.options["scale"]) == (test, scale)]
    found = [row for run in chosen for row in _rows(run, runs)]
    names = QUANTITIES[test]
    return sorted(found, key=lambda r: (r.run.options["variant"], r.run.options["direction"], names.index(r.quantity)))


def _rows(run: StoredRun, runs: Sequence[StoredRun]) -> Iterator[Row]:
    now, options = run.run(), run.options
    for row in measured(options["variant"], options["direction"], QUANTITIES[options["test"]]):
        value = run.results.get(row.quantity)
        if value is None:
            continue
        scaled = REPORTS[now.rig.kind].scaled(now, [row])[0]
        value: Any = to_nominal_size(value, scaled.factors)
        ensemble = value if isinstance(value, dict) else {"mean": value, "sd": math.nan}
        error, preset = numerical_error(run, runs, row.quantity)
        yield Row(
            run, row.quantity, scaled,
            row_kind(now, row.quantity), ensemble["mean"], ensemble["sd"], mean_factor(scaled.factors) * error, preset,
            trivial(options["variant"], options["direction"], row.quantity),
        )  # fmt: skip


def measured(variant: str, direction: str, quantities: Sequence[str]) -> list[PublishedValue]:
    """Rows of the paper."""
    return published_rows(data_dir() / "pham2019", variant, direction, tuple(quantities))


def density(variant: str, direction: str) -> float:
    """Reinforcing yarns per 100 mm, Table 2."""
    (row,) = measured(variant, direction, ["yarn_density"])
    return row.mean


def trivial(variant: str, direction: str, quantity: str) -> Copy | None:
    """Value of another measured row of the same yarns as a copy, a force times the ratio of their densities; None for
    other tests than tension, whose rows are inputs.
    """
    if quantity not in QUANTITIES["tensile"]:
        return None
    source = OWN if (variant, direction) == COPIED else COPIED
    (row,) = measured(*source, [quantity])
    ratio = density(variant, direction) / density(*source) if quantity in COUNTED else 1.0
    return Copy(row.mean * ratio, f"V{source[0]} {source[1]}" + (f" x {ratio:.3g}" if ratio != 1.0 else ""))


def fitted(row: Row) -> bool:
    """Tell whether a number of the fabric was fitted to it, not only chosen with it in view."""
    o = row.run.options
    name = f"V{o['variant']} {o['direction']} {ROW_NAMES.get(row.quantity, row.quantity)}"
    return any(name in q.tuned_on for q in quantities(row.run.run().fabric))


def numerical_error(run: StoredRun, runs: Sequence[StoredRun], quantity: str) -> tuple[float, str]:
    """Error of ``quantity`` in its unit, and the preset it was found at: that of ``run`` itself, or the share that the
    same test has at another preset; NaN where none was verified.
    """
    same = [r for r in runs if _test(r) == _test(run) and r.numerical_error.get(quantity, {}).get("error") is not None]
    same.sort(key=lambda r: r != run)
    if not same:
        return math.nan, ""
    other = same[0]
    share = other.numerical_error[quantity]["error"] / abs(_mean(other.results[quantity]))
    return share * abs(_mean(run.results[quantity])), other.options["preset"]


def _test(run: StoredRun) -> tuple[Any, ...]:
    return tuple(run.options.get(name) for name in ("test", "scale", "variant", "direction", "parameters"))


def _mean(value: Any) -> float:
    return float(value["mean"] if isinstance(value, dict) else value)
