"""Rows of the result table: labels, digits, deviation from the experiment, kind, verdict; error of the mean."""

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import cast

from knittest.base.kinds import JoinedParts
from knittest.base.summary import ComparisonRow, Spread, Summary, Value

#: confidence level of the interval of a mean
CONFIDENCE = 0.95


def mean_error(value: Value) -> float:
    """Half width of the confidence interval (Student's t) of the mean of ``value``; 0 for a single number, else nan if
    it is unknown.

    >>> round(mean_error({"mean": 3.0, "sd": 2.0**0.5, "values": [2.0, 4.0]}), 2)
    12.71
    """
    if not isinstance(value, Mapping):
        return 0.0
    from scipy.special import stdtrit  # heavy

    count, sd = len(value["values"]), value["sd"]
    if sd is None or count < 2:
        return math.nan
    return float(stdtrit(count - 1, 0.5 * (1.0 + CONFIDENCE))) * sd / math.sqrt(count)


#: label and format of a result
LABELS: Mapping[str, tuple[str, str]] = JoinedParts("labels")
#: results that grow with the specimen, and the same per size
SIZED: Mapping[str, str] = JoinedParts("sized")
#: meaning of the kinds of rows
KINDS = {
    "tuned": "tuned: a model parameter was fitted to or chosen by this value, so the agreement validates nothing",
    "input": "input: the model was given this value, or the data from which it follows",
    "assumed": "assumed: the value depends on assumptions or on data of another fabric, so it validates nothing",
}
#: note on assumed inputs of a row
ON_ASSUMED = "on {} assumed input{}"
#: verdict on a result whose numerical error crosses the limit
UNRESOLVED = "unresolved: the numerical error crosses 1 sd"
#: verdict on the mean of specimens whose confidence interval crosses the limit
FEW = "unresolved: too few specimens"
#: meaning of the error of a deviation
OF_MEANS = "± of a deviation: 95 % interval of the mean of the specimens (Student's t), and numerical error if known"
#: verdict if the experiment has no sd, as of one specimen
UNSCATTERED = "sd not stated"
#: verdict on a result without measurement
NO_REFERENCE = "no reference"
#: note instead of empty columns if no result is compared
NOTHING = "no reference: there is no measurement for these results"
#: verdict on a number that is a setting of the run
GIVEN = "given"
#: largest number of specimens that are listed instead of their sd
SIDE_BY_SIDE = 2


def fold_results(results: Mapping[str, object]) -> dict[str, object]:
    """Results as in summary.json: ``name.key`` becomes the map ``name`` with ``key``."""
    whole, maps = dict[str, object](), dict[str, dict[str, object]]()
    for quantity, value in results.items():
        name, dot, key = quantity.partition(".")
        if dot:
            whole[name] = maps.setdefault(name, {})
            maps[name][key] = value
        else:
            whole[name] = value
    return whole


def unfold_results(results: Mapping[str, object]) -> dict[str, Value]:
    """Inverse of :func:`fold_results`: a number, or mean, sd and values of an ensemble, for each ``name.key``."""
    flat = dict[str, object]()
    for name, value in results.items():
        if isinstance(value, Mapping) and "values" not in value:
            flat |= {f"{name}.{key}": inner for key, inner in value.items()}
        else:
            flat[name] = value
    return cast("dict[str, Value]", flat)


def number_of(value: Value) -> float | None:
    """Number of a result; mean of an ensemble."""
    return value["mean"] if isinstance(value, Mapping) else value


def spread_of(values: Sequence[float]) -> Spread:
    """Mean, sd (0 for one) and ``values``; mean and sd are nan if a value is."""
    known = all(math.isfinite(value) for value in values)
    sd = (statistics.stdev(values) if known else math.nan) if len(values) > 1 else 0.0
    return Spread(mean=statistics.fmean(values), sd=sd, values=list(values))


def to_nominal_size(value: Value, factors: Sequence[float]) -> Value:
    """Convert the result ``value`` to the nominal size, each specimen by its own of ``factors``."""
    if not factors or value is None:
        return value
    if not isinstance(value, Mapping):
        return mean_factor(factors) * value
    values = value["values"]
    each = factors if len(factors) == len(values) else [mean_factor(factors)] * len(values)
    return spread_of([math.nan if v is None else f * v for f, v in zip(each, values, strict=True)])


def mean_factor(factors: Sequence[float]) -> float:
    """Factor of a mean over specimens: harmonic mean, because sizes add up; 1 without ``factors``.

    >>> round(mean_factor([20.5 / 20, 20.5 / 21]), 12)
    1.0
    """
    return statistics.harmonic_mean(factors) if factors else 1.0


@dataclass(frozen=True)
class ResultRow:
    """Result as text, "-" if there is none; ``value`` is the number, or mean of an ensemble, for the nominal size.

    ``assumed`` are the assumed fields that decide a compared row; ``error`` is the numerical error, if known.
    """

    quantity: str
    label: str
    value: float | None
    simulated: str
    experiment: str
    deviation: str
    kind: str
    verdict: str
    assumed: tuple[str, ...] = ()
    error: float | None = None

    @property
    def assumed_note(self) -> str:
        """Note such as ``on 2 assumed inputs`` on a prediction that depends on some, else empty."""
        count = len(self.assumed)
        return ON_ASSUMED.format(count, "s" * (count > 1)) if self.kind == "predicted" and count else ""

    @property
    def kind_text(self) -> str:
        """Kind, with the number of assumed inputs of a prediction."""
        return f"{self.kind}, {self.assumed_note}" if self.assumed_note else self.kind


def result_rows(summary: Summary, plus_minus: str = "±", *, refused: bool) -> list[ResultRow]:
    """One row per result of ``summary`` (summary.json); results of a ``refused`` run are not compared."""
    compared = {row["quantity"]: row for row in summary["comparison"]}
    alone, errors = summary.get("kinds") or {}, summary.get("numerical_error") or {}
    rows = []
    for quantity, value in unfold_results(summary["results"]).items():
        label, form = LABELS.get(quantity, (quantity.replace("_", " "), "{:.4g}"))
        factors = (compared[quantity].get("factors") or ()) if quantity in compared and not refused else ()
        value, error = to_nominal_size(value, factors), errors[quantity].get("error") if quantity in errors else None
        error = None if error is None else mean_factor(factors) * error
        tail = _evaluate_row(compared.get(quantity), form, plus_minus, error, mean_error(value), refused=refused)
        if quantity in alone and not refused:
            tail = ("-", "-", alone[quantity], NO_REFERENCE)
        if errors and error is None and tail[-1].endswith("1 sd"):
            tail = (*tail[:-1], f"{tail[-1]}, numerical error unknown")
        own = compared.get(quantity) or (summary if quantity in alone else None)
        guessed = tuple(own.get("assumed") or ()) if own else ()
        simulated = _simulated_text(value, form, plus_minus, error)
        rows.append(ResultRow(quantity, label, number_of(value), simulated, *tail, guessed, error))
    return rows


def assumed_inputs(summary: Summary, rows: Sequence[ResultRow]) -> list[str]:
    """Assumed inputs that decide predicted or assumed ``rows``, or all results if none is compared; each once."""
    found = dict.fromkeys(field for row in rows if row.kind in ("predicted", "assumed") for field in row.assumed)
    return list(found or (summary.get("assumed") or () if all(row.kind == "-" for row in rows) else ()))


def error_text(error: float, form: str) -> str:
    """Error in the format of its result, or with two digits if that would show 0."""
    text = form.format(error)
    return f"{error:.2g}" if error > 0.0 and float(text) == 0.0 else text


def _simulated_text(value: Value, form: str, plus_minus: str, error: float | None = None) -> str:
    """Text of a number with its numerical ``error``; of an ensemble mean, count and sd, or the values of a few."""
    if not isinstance(value, Mapping):
        return _number_text(value, form) + ("" if error is None else f" {plus_minus} {error_text(error, form)}")
    mean, sd, count = _number_text(value["mean"], form), _number_text(value["sd"], form), len(value["values"])
    tail = "" if error is None else f", numerical {plus_minus} {error_text(error, form)}"
    if count <= SIDE_BY_SIDE:
        return f"{mean} (n {count}: {', '.join(_number_text(v, form) for v in value['values'])}){tail}"
    return f"{mean} {plus_minus} {sd} (n {count}){tail}"


def _evaluate_row(
    row: ComparisonRow | None, form: str, plus_minus: str, numerical: float | None, sampling: float, *, refused: bool
) -> tuple[str, str, str, str]:
    """Experiment, deviation, kind and verdict of a row, with its ``numerical`` and ``sampling`` error in its unit."""
    if refused:
        return "-", "-", "-", "refused"
    if row is None:
        return "-", "-", "-", NO_REFERENCE
    error = None if numerical is None and sampling == 0.0 else (numerical or 0.0) + sampling
    mean, deviation = _number_text(row["experiment_mean"], form), row["deviation_sd"]
    scaled = f" ({row['scaled']})" if row.get("scaled") else ""
    if row.get("given"):
        return _experiment_text(row, form, plus_minus) + scaled, "-", row["kind"], GIVEN
    if deviation is None or not math.isfinite(deviation):
        percent = _percent_text(row.get("simulated"), row["experiment_mean"], error, plus_minus)
        return mean + scaled, percent or "-", row["kind"], UNSCATTERED if percent else "not comparable"
    share = 0.0 if error is None else error / row["experiment_sd"]
    tail = "" if error is None else f" {plus_minus} {error_text(share, '{:.2f}')}"
    # the error of an input does not matter
    verdict = verdict_of(deviation, 0.0 if row["kind"] == "input" else share)
    if verdict == UNRESOLVED and verdict_of(deviation, (numerical or 0.0) / row["experiment_sd"]) != UNRESOLVED:
        verdict = FEW
    return _experiment_text(row, form, plus_minus) + scaled, f"{deviation:+.2f}{tail} sd", row["kind"], verdict


def _experiment_text(row: ComparisonRow, form: str, plus_minus: str) -> str:
    """Mean of the experiment, with sd if it has one."""
    sd = row.get("experiment_sd")
    scatter = f" {plus_minus} {_number_text(sd, form)}" if sd and math.isfinite(sd) else ""
    return _number_text(row["experiment_mean"], form) + scatter


#: largest number that is rounding
ROUNDING = 1e-6


def verdict_of(deviation: float, error: float = 0.0) -> str:
    """Verdict on a ``deviation`` with its ``error`` [sd]: within or outside one sd of the experiment, or unresolved."""
    if abs(deviation) + error <= 1.0:
        return "within 1 sd"
    return "outside 1 sd" if abs(deviation) - error > 1.0 else UNRESOLVED


def _percent_text(simulated: float | None, mean: float | None, error: float | None, plus_minus: str) -> str:
    """Deviation with its ``error`` in percent of the mean; empty if it is no number."""
    if simulated is None or not mean or not math.isfinite(simulated / mean):
        return ""
    tail = "" if error is None else f" {plus_minus} {error_text(abs(100.0 * error / mean), '{:.1f}')}"
    return f"{100.0 * (simulated / mean - 1.0):+.1f}{tail} %"


def _number_text(value: float | None, form: str) -> str:
    """Text of ``value`` by the format of its quantity, or with two digits if that shows fewer of a small number."""
    if value is None or not math.isfinite(value):
        return "-"
    text = form.format(value)
    few = len(text.replace(".", "").lstrip("+-0")) < 2
    return f"{value:{'+' if '+' in form else ''}.2g}" if few and ROUNDING < abs(value) < 1.0 else text
