"""Outcome of a study, as uncertainty.json holds it: bands, indices, shares, and runs that did not give every number."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

import knittest
from knittest.base.history import Array
from knittest.export.summary import now
from knittest.report_page.files import Number
from knittest.studies.trials.trial import OPEN, Record, code_digest, looser_note
from knittest.studies.uncertainty.indices import (
    LEAST_ROWS,
    indices,
    no_regression,
    rank_regression,
    share,
    spread,
    varies,
)
from knittest.studies.uncertainty.problem import Parameter, Problem
from knittest.studies.uncertainty.runs import Attempt, Planned, ended_sooner, missing, values_of
from knittest.studies.uncertainty.variables import Numbers, Stated, Variable


class ParameterRow(BaseModel):
    """A parameter and its prior."""

    fields: list[str]
    unit: str = ""
    kind: str = ""
    low: Number = None
    high: Number = None
    mean: Number = None
    sd: Number = None
    reason: str = ""


class Index(BaseModel):
    """Indices of a variable to one parameter, with their 95 % intervals.

    Of a sample there is no total, and ``first`` is the coefficient of the regression of ranks, -1 to 1.
    """

    parameter: str
    first: Number = None
    first_interval: list[Number] = []
    total: Number = None
    total_interval: list[Number] = []


class VariableRow(BaseModel):
    """A quantity of a fabric or a ratio at one place: ``count`` of ``points`` of the prior gave a number, ``shortened``
    of these by runs to a shorter end.

    ``band`` is its 5, 50 and 95 % points, each with its interval in ``band_low`` and ``band_high``; empty where too
    few ran. ``indices`` is empty where ``no_indices`` says why; ``explained`` is what share of the variance of the
    ranks their regression explains, where it is one.
    """

    name: str
    quantity: str = ""
    who: str = ""
    ratio: bool = False
    at: Number = None
    axis: str = ""
    unit: str = ""
    log: bool = False
    count: int = 0
    points: int = 0
    shortened: int = 0
    band: list[Number] = []
    band_low: list[Number] = []
    band_high: list[Number] = []
    indices: list[Index] = []
    explained: Number = None
    no_indices: str = ""


class StatementRow(BaseModel):
    """An inequality and the share of the prior that it holds for, of the ``count`` points with all numbers.

    ``failing`` points lack a number and fail at a place that they have. ``possible`` is between which shares it lies,
    whatever the numbers that are missing would have been.
    """

    name: str
    text: str = ""
    holds: int = 0
    count: int = 0
    points: int = 0
    failing: int = 0
    share: Number = None
    interval: list[Number] = []
    possible: list[Number] = []


class Tried(BaseModel):
    """A run to a shorter end."""

    end: float
    status: str
    reason: str = ""
    trial: str = ""


class Lost(BaseModel):
    """A run that did not give every number, and where in the prior it was.

    ``counts_to`` is where the run ends that counts in its place, the last one ``tried``; None where none does.
    """

    point: int
    fabric: str
    status: str
    reason: str = ""
    values: dict[str, Number] = {}
    trial: str = ""
    counts_to: Number = None
    tried: list[Tried] = []


class ShorterRow(BaseModel):
    """Runs to the shorter ``end``."""

    end: float
    runs_by_status: dict[str, int] = {}


class Uncertainty(BaseModel):
    """uncertainty.json; the priors of the parameters are independent of each other."""

    uncertainty: str = ""
    status: str = ""
    test: str = ""
    setup: list[str] = []
    fabrics: dict[str, str] = {}
    differences: dict[str, list[object]] = {}
    design: str = "saltelli"
    samples: int = 0
    seed: int = 0
    points: int = 0
    runs: int = 0
    runs_by_status: dict[str, int] = {}
    lost_share: Number = None
    shorter_field: str = ""
    shorter_unit: str = ""
    shorter: list[ShorterRow] = []
    warnings: list[str] = []
    parameters: list[ParameterRow] = []
    variables: list[VariableRow] = []
    statements: list[StatementRow] = []
    lost: list[Lost] = []
    version: str = ""
    code: str = ""
    written: str = ""


def lost_row(one: Planned, problem: Problem, records: Mapping[str, Record], numbers: Numbers) -> Lost | None:
    """The run as one that did not give every number; None for one that did."""
    (status, reason), gone = one.full.ended(records), missing(one, numbers)
    if status == "completed" and not gone:
        return None
    values = {p.name: value for p, value in zip(problem.parameters, one.values, strict=True)}
    return Lost(
        point=one.part * problem.study.samples + one.row + 1, fabric=one.fabric, status=status,
        reason=reason or f"no number of {', '.join(gone)}", values=values, trial=_key(one.full),
        counts_to=one.last.end if one.last.ended(records)[0] == "completed" else None,
        tried=[_tried(again, end, records) for again, end in _again(one, problem)],
    )  # fmt: skip


def _again(one: Planned, problem: Problem) -> Iterator[tuple[Attempt, float]]:
    """Attempts to shorter ends, with the ends."""
    return zip(one.attempts[1:], problem.shorter.values, strict=False)


def _tried(one: Attempt, end: float, records: Mapping[str, Record]) -> Tried:
    status, reason = one.ended(records)
    return Tried(end=end, status=status, reason=reason, trial=_key(one))


def _key(one: Attempt) -> str:
    return one.trial.key if one.trial else ""


def shorter_rows(problem: Problem, runs: Sequence[Planned], records: Mapping[str, Record]) -> list[ShorterRow]:
    """Runs to each shorter end by status; the ones completed are those that count."""
    found = {end: Counter[str]() for end in problem.shorter.values}
    for one in runs:
        for again, end in _again(one, problem):
            found[end][again.ended(records)[0]] += 1
    return [ShorterRow(end=end, runs_by_status=dict(counts)) for end, counts in found.items()]


def lost_warnings(lost: Sequence[Lost], runs: int, variables: Sequence[VariableRow], unit: str) -> list[str]:
    """Lines on how many runs are lost or end sooner, at ends in ``unit``, and on bands that are not of the same points;
    none where nothing is lost.
    """
    if not lost:
        return []
    share = f"{len(lost)} of {runs} runs ({100.0 * len(lost) / runs:.1f} %)"
    ends = Counter(one.counts_to for one in lost if one.counts_to is not None)
    if ends:
        told = ", ".join(f"{ends[end]} to {end:g} {unit}".strip() for end in sorted(ends, reverse=True))
        share += f" did not pass to their full end; {ends.total()} of these count to a shorter one ({told}), the others"
    found = [f"{share} have no result that counts: bands and shares are of the part of the prior that ran"]
    if uneven := _uneven(variables, lambda one: one.at):
        found.append(
            f"bands of {', '.join(uneven)} are not of the same points for all fabrics: compare by ratios and "
            "statements, which are of points that both have"
        )
    if uneven := _uneven(variables, lambda one: one.who):
        found.append(
            f"bands of {', '.join(uneven)} are not of the same points at all places: those of few points are of the "
            "part of the prior that came so far"
        )
    return found


def _uneven(variables: Sequence[VariableRow], alike: Callable[[VariableRow], object]) -> list[str]:
    """Quantities whose variables that are ``alike`` are of different numbers of points."""
    counts: dict[tuple[str, object], set[int]] = {}
    for one in variables:
        counts.setdefault((one.quantity, alike(one)), set()).add(one.count)
    return list(dict.fromkeys(name for (name, _), numbers in counts.items() if len(numbers) > 1))


#: half the width of the interval of an index from which it is called uncertain
WIDE = 0.2


def outcome_of(
    problem: Problem, runs: Sequence[Planned], records: Mapping[str, Record], numbers: Numbers
) -> Uncertainty:
    """Outcome as far as runs have ended; bands and shares are of the points of A and B that gave a number."""
    study = problem.study
    counts = Counter(one.full.ended(records)[0] for one in runs)
    lost = [row for one in runs if (row := lost_row(one, problem, records, numbers))]
    sooner = ended_sooner(problem, runs)
    variables = [_variable_row(one, problem, one.values(numbers), one.either(sooner)) for one in problem.variables]
    setup = next(iter(problem.cases.values())).run()
    keys = [one.trial.key for run in runs for one in run.attempts if one.trial]
    looser = looser_note(records[key] for key in keys if key in records)
    left = any(one.last.ended(records)[0] == OPEN for one in runs)
    return Uncertainty(
        uncertainty=problem.name, status="not finished" if left else "finished",
        test=" ".join(filter(None, (setup.rig.kind, setup.direction))),
        setup=[setup.model.scale, f"preset {setup.model.preset}", f"parameters {setup.parameters}"],
        fabrics={name: case.run().fabric.name for name, case in problem.cases.items()},
        differences={name: list(values) for name, values in problem.differences.items()},
        design=study.design, samples=study.samples, seed=study.seed, points=problem.parts * study.samples,
        runs=len(runs), runs_by_status=dict(counts), lost_share=len(lost) / len(runs),
        shorter_field=problem.shorter.field, shorter_unit=problem.shorter.unit,
        shorter=shorter_rows(problem, runs, records),
        warnings=[
            *looser, *lost_warnings(lost, len(runs), variables, problem.shorter.unit), *_warnings(variables),
            *idle(problem, numbers),
        ],
        parameters=[_parameter_row(one) for one in problem.parameters], variables=variables,
        statements=[_statement_row(one, study.seed, numbers) for one in problem.statements], lost=lost,
        version=knittest.__version__, code=code_digest(), written=now(),
    )  # fmt: skip


def _parameter_row(one: Parameter) -> ParameterRow:
    prior = one.prior
    fields = [".".join(map(str, path)) for path in one.paths]
    return ParameterRow(
        fields=fields, unit=one.unit, kind=prior.kind, low=prior.low, high=prior.high, mean=prior.mean, sd=prior.sd,
        reason=" ".join(prior.reason.split()),
    )  # fmt: skip


def _variable_row(one: Variable, problem: Problem, values: Array, sooner: NDArray[np.bool_]) -> VariableRow:
    """Band and indices of ``values`` (parts, n), which are of runs to a shorter end where ``sooner``."""
    found = spread(values[:2], problem.study.seed)
    hang, explained, why = _hanging(one, problem, values)
    band = {} if found is None else {"band": found.band, "band_low": found.interval[0], "band_high": found.interval[1]}
    return VariableRow(
        name=one.name, quantity=one.quantity, who=one.who, ratio=one.over is not None, at=one.at, axis=one.axis,
        unit=one.unit, log=one.log, count=int(np.isfinite(values[:2]).sum()), points=values[:2].size,
        shortened=int((np.isfinite(values) & sooner)[:2].sum()),
        indices=hang, explained=explained, no_indices=why,
        **{name: ends.tolist() for name, ends in band.items()},
    )  # fmt: skip


def _hanging(one: Variable, problem: Problem, values: Array) -> tuple[list[Index], float | None, str]:
    """Indices of ``values`` (parts, n), the share that a regression explains, and why there are none."""
    if problem.study.design == "sample":
        drawn = values_of(problem).reshape(-1, len(problem.parameters))
        if why := no_regression(drawn, values.ravel()):
            return [], None, why
        found = rank_regression(drawn, values.ravel(), problem.study.seed)
        rows = zip(problem.parameters, found.coefficient.tolist(), found.interval.T.tolist(), strict=True)
        return [Index(parameter=p.name, first=c, first_interval=ends) for p, c, ends in rows], found.explained, ""
    why = hindrance(values, one.log)
    return [] if why else _index_rows(problem, np.log(values) if one.log else values), None, why


def hindrance(values: Array, log: bool) -> str:
    """Reason why ``values`` (d + 2, n) have no indices; empty where they have."""
    rows, gone = values.size, int((~np.isfinite(values)).sum())
    if gone:
        return f"{gone} of {rows} points of the design have no number, and what they would give is not made up"
    if values.shape[1] < LEAST_ROWS:
        return f"samples = {values.shape[1]}: indices take {LEAST_ROWS} at least"
    if log and values.min() <= 0.0:
        return "spacing: log, and some values are 0 or less"
    return "" if varies(values) else "it does not change over the prior"


def _index_rows(problem: Problem, values: Array) -> list[Index]:
    found = indices(values, problem.study.seed)
    return [
        Index(
            parameter=one.name, first=found.first[k], first_interval=found.first_interval[:, k].tolist(),
            total=found.total[k], total_interval=found.total_interval[:, k].tolist(),
        )
        for k, one in enumerate(problem.parameters)
    ]  # fmt: skip


def _statement_row(one: Stated, seed: int, numbers: Numbers) -> StatementRow:
    found = share(one.holds(numbers)[:2], one.fails(numbers)[:2], seed)
    return StatementRow(
        name=one.name, text=one.text, holds=found.holds, count=found.count, points=found.total, failing=found.failing,
        share=found.value, interval=list(found.interval or ()), possible=list(found.possible),
    )  # fmt: skip


def _warnings(variables: Sequence[VariableRow]) -> list[str]:
    found = []
    ranked = [one for one in variables if one.indices]
    wide = [one.name for one in ranked if any(_half_width(index) > WIDE for index in one.indices)]
    if wide:
        whose = "all variables" if len(wide) == len(ranked) else "; ".join(wide)
        found.append(f"indices of {whose}: intervals of more than ± {WIDE:g}: more samples rank them more surely")
    if few := [one.name for one in variables if not one.band]:
        found.append(f"no band, for too few points ran: {'; '.join(few)}")
    return found


def idle(problem: Problem, numbers: Numbers) -> list[str]:
    """A line for parameters that change no result at all, as fields do that the test at this scale does not read.

    Only the design of Saltelli changes them one by one.
    """
    if problem.study.design == "sample":
        return []
    results = np.array([found for by_name in numbers.values() for found in by_name.values()])  # (results, d + 2, n)
    changes = np.abs(results[:, 2:] - results[:, :1])  # NaN where either has no number
    known, moved = np.isfinite(changes).any(axis=(0, 2)), (changes > 0.0).any(axis=(0, 2))
    names = [problem.parameters[k].name for k in np.flatnonzero(known & ~moved)]
    return [f"no result changes at all with {', '.join(names)}: does this test read it?"] if names else []


def _half_width(index: Index) -> float:
    sides = [[end for end in side if end is not None] for side in (index.first_interval, index.total_interval)]
    return max(0.5 * (max(side) - min(side)) for side in sides if side)
