"""Outcome of a study, as in uncertainty.json: bands, indices, shares, and runs that lack a result."""

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

import knittest
from knittest.base.history import Array
from knittest.config.yaml_loader import dotted_path
from knittest.export.summary import timestamp
from knittest.report_page.files import Number
from knittest.studies.trials.trial import OPEN, Record, code_digest, relaxed_limits_note
from knittest.studies.uncertainty import indices as estimates
from knittest.studies.uncertainty.problem import Problem
from knittest.studies.uncertainty.runs import PlannedRun, values_of
from knittest.studies.uncertainty.variables import Numbers, Variable


class ParameterRow(BaseModel):
    """Parameter and its prior."""

    fields: list[str]
    unit: str = ""
    kind: str = ""
    low: Number = None
    high: Number = None
    mean: Number = None
    sd: Number = None
    reason: str = ""


class Index(BaseModel):
    """Indices of a variable for one parameter, with their 95 % intervals.

    A sample has no total index; its ``first`` is the coefficient of the rank regression, -1 to 1.
    """

    parameter: str
    first: Number = None
    first_interval: list[Number] = []
    total: Number = None
    total_interval: list[Number] = []


class VariableRow(BaseModel):
    """Quantity of a fabric, or a ratio, at one place: ``count`` of ``points`` of the prior have a number, ``shortened``
    of these from runs to a shorter end.

    ``band`` has the 5, 50 and 95 % points, ``band_low`` and ``band_high`` their intervals; empty if too few runs have a
    result. ``no_indices`` says why ``indices`` is empty. ``explained`` is the share of the variance that a rank
    regression explains.
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
    """Inequality and the share of the prior for which it holds, of the ``count`` points with all numbers.

    ``failing`` points lack a number and fail at another place. ``possible`` bounds the share for any missing numbers.
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


class ShorterRunRow(BaseModel):
    """Run to a shorter end."""

    end: float
    status: str
    reason: str = ""
    trial: str = ""


class LostRunRow(BaseModel):
    """Run that lacks a result, and its point of the prior.

    ``counts_to`` is the end of the run that counts in its place, the last one ``tried``; None without one.
    """

    point: int
    fabric: str
    status: str
    reason: str = ""
    values: dict[str, Number] = {}
    trial: str = ""
    counts_to: Number = None
    tried: list[ShorterRunRow] = []


class ShorterEndRow(BaseModel):
    """Runs to the shorter ``end``."""

    end: float
    runs_by_status: dict[str, int] = {}


class Uncertainty(BaseModel):
    """Contents of uncertainty.json; the priors of the parameters are independent of each other."""

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
    shorter: list[ShorterEndRow] = []
    warnings: list[str] = []
    parameters: list[ParameterRow] = []
    variables: list[VariableRow] = []
    statements: list[StatementRow] = []
    lost: list[LostRunRow] = []
    version: str = ""
    code: str = ""
    written: str = ""


def lost_run_row(
    one: PlannedRun, problem: Problem, records: Mapping[str, Record], numbers: Numbers
) -> LostRunRow | None:
    """Row of a run that lacks a result; None for any other."""
    status, reason = one.full.ended(records)
    gone = [name for name, found in numbers[one.fabric].items() if not np.isfinite(found[one.part, one.row])]
    if status == "completed" and not gone:
        return None
    values = {p.name: value for p, value in zip(problem.parameters, one.values, strict=True)}
    return LostRunRow(
        point=one.part * problem.study.samples + one.row + 1, fabric=one.fabric, status=status,
        reason=reason or f"no result {', '.join(gone)}", values=values, trial=one.full.key,
        counts_to=one.last.end if one.last.ended(records)[0] == "completed" else None,
        tried=[
            ShorterRunRow(end=again.end or 0.0, status=ended, reason=reason, trial=again.key)
            for again in one.attempts[1:]
            for ended, reason in [again.ended(records)]
        ],
    )  # fmt: skip


def lost_run_warnings(lost: Sequence[LostRunRow], runs: int, variables: Sequence[VariableRow], unit: str) -> list[str]:
    """Warnings on runs that are lost or end sooner, with ends in ``unit``, and on bands of unequal points."""

    def uneven(alike: str) -> list[str]:
        counts: dict[tuple[str, object], set[int]] = {}
        for one in variables:
            counts.setdefault((one.quantity, getattr(one, alike)), set()).add(one.count)
        return list(dict.fromkeys(name for (name, _), numbers in counts.items() if len(numbers) > 1))

    if not lost:
        return []
    share = f"{len(lost)} of {runs} runs ({100.0 * len(lost) / runs:.1f} %)"
    ends = Counter(one.counts_to for one in lost if one.counts_to is not None)
    if ends:
        counts = ", ".join(f"{ends[end]} to {end:g} {unit}".strip() for end in sorted(ends, reverse=True))
        share += f" did not reach their full end; {ends.total()} of these count to a shorter end ({counts}), the others"
    found = [f"{share} have no valid result: bands and shares cover only the part of the prior with results"]
    if names := uneven("at"):
        remedy = "compare fabrics by ratios and statements, which use the points of both"
        found.append(f"bands of {', '.join(names)} have different points for each fabric: {remedy}")
    if names := uneven("who"):
        few = "a band of few points covers only the part of the prior that reached its place"
        found.append(f"bands of {', '.join(names)} have different points at each place: {few}")
    return found


#: largest half width of the interval of an index without a warning
WIDE = 0.2


def outcome_of(
    problem: Problem, runs: Sequence[PlannedRun], records: Mapping[str, Record], numbers: Numbers
) -> Uncertainty:
    """Outcome of the runs that have ended; bands and shares are of the points of A and B with a number."""
    study = problem.study
    counts = Counter(one.full.ended(records)[0] for one in runs)
    lost = [row for one in runs if (row := lost_run_row(one, problem, records, numbers))]
    sooner = {fabric: np.zeros((problem.parts, study.samples), bool) for fabric in problem.cases}
    for one in runs:
        sooner[one.fabric][one.part, one.row] = one.last.end is not None
    shorter = {end: Counter[str]() for end in problem.shorter.values}
    for again in (again for one in runs for again in one.attempts[1:]):
        shorter[again.end or 0.0][again.ended(records)[0]] += 1
    shares = [estimates.share(s.holds(numbers)[:2], s.fails(numbers)[:2], study.seed) for s in problem.statements]
    variables = [_variable_row(one, problem, one.values(numbers), one.either_flag(sooner)) for one in problem.variables]
    setup = next(iter(problem.cases.values())).run()
    keys = [one.trial.key for run in runs for one in run.attempts if one.trial]
    looser = relaxed_limits_note(records[key] for key in keys if key in records)
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
        shorter=[ShorterEndRow(end=end, runs_by_status=dict(counts)) for end, counts in shorter.items()],
        warnings=[
            *looser, *lost_run_warnings(lost, len(runs), variables, problem.shorter.unit), *_warnings(variables),
            *idle_parameter_warnings(problem, numbers),
        ],
        parameters=[
            ParameterRow(
                fields=[dotted_path(path) for path in p.paths], unit=p.unit, kind=p.prior.kind, low=p.prior.low,
                high=p.prior.high, mean=p.prior.mean, sd=p.prior.sd, reason=" ".join(p.prior.reason.split()),
            )
            for p in problem.parameters
        ],
        variables=variables,
        statements=[
            StatementRow(
                name=one.name, text=one.text, holds=found.holds, count=found.count, points=found.total,
                failing=found.failing, share=found.value, interval=list(found.interval or ()),
                possible=list(found.possible),
            )
            for one, found in zip(problem.statements, shares, strict=True)
        ],
        lost=lost,
        version=knittest.__version__, code=code_digest(), written=timestamp(),
    )  # fmt: skip


def _variable_row(one: Variable, problem: Problem, values: Array, sooner: NDArray[np.bool_]) -> VariableRow:
    """Band and indices of ``values`` (parts, n), which are of runs to a shorter end where ``sooner``."""
    found = estimates.spread(values[:2], problem.study.seed)
    rows, explained, why = _index_rows(one, problem, values)
    band = {} if found is None else {"band": found.band, "band_low": found.interval[0], "band_high": found.interval[1]}
    return VariableRow(
        name=one.name, quantity=one.quantity, who=one.who, ratio=one.over is not None, at=one.at, axis=one.axis,
        unit=one.unit, log=one.log, count=int(np.isfinite(values[:2]).sum()), points=values[:2].size,
        shortened=int((np.isfinite(values) & sooner)[:2].sum()),
        indices=rows, explained=explained, no_indices=why,
        **{name: ends.tolist() for name, ends in band.items()},
    )  # fmt: skip


def _index_rows(one: Variable, problem: Problem, values: Array) -> tuple[list[Index], float | None, str]:
    """Indices of ``values`` (parts, n), the share that a regression explains, and the reason if there are none."""
    if problem.study.design == "sample":
        drawn = values_of(problem).reshape(-1, len(problem.parameters))
        if why := estimates.no_regression_reason(drawn, values.ravel()):
            return [], None, why
        found = estimates.rank_regression(drawn, values.ravel(), problem.study.seed)
        rows = zip(problem.parameters, found.coefficient.tolist(), found.interval.T.tolist(), strict=True)
        return [Index(parameter=p.name, first=c, first_interval=ends) for p, c, ends in rows], found.explained, ""
    if gone := int((~np.isfinite(values)).sum()):
        return [], None, f"{gone} of {values.size} points of the design have no result"
    if values.shape[1] < (least := estimates.LEAST_ROWS):
        return [], None, f"samples = {values.shape[1]}: indices need at least {least}"
    if one.log and values.min() <= 0.0:
        return [], None, "spacing: log, but some values are 0 or less"
    if not estimates.varies(values):
        return [], None, "the quantity does not change over the prior"
    sobol = estimates.indices(np.log(values) if one.log else values, problem.study.seed)
    return [
        Index(
            parameter=parameter.name, first=sobol.first[k], first_interval=sobol.first_interval[:, k].tolist(),
            total=sobol.total[k], total_interval=sobol.total_interval[:, k].tolist(),
        )
        for k, parameter in enumerate(problem.parameters)
    ], None, ""  # fmt: skip


def _warnings(variables: Sequence[VariableRow]) -> list[str]:
    def half_width(index: Index) -> float:
        sides = [[end for end in side if end is not None] for side in (index.first_interval, index.total_interval)]
        return max(0.5 * (max(side) - min(side)) for side in sides if side)

    found = []
    ranked = [one for one in variables if one.indices]
    wide = [one.name for one in ranked if any(half_width(index) > WIDE for index in one.indices)]
    if wide:
        whose = "all variables" if len(wide) == len(ranked) else "; ".join(wide)
        found.append(f"indices of {whose} have intervals of more than ± {WIDE:g}: use more samples to rank them")
    if few := [one.name for one in variables if not one.band]:
        found.append(f"too few points with a result for a band: {'; '.join(few)}")
    return found


def idle_parameter_warnings(problem: Problem, numbers: Numbers) -> list[str]:
    """Warning on parameters that change no result, such as fields that the test at this scale does not read.

    Only the design of Saltelli changes the parameters one by one.
    """
    if problem.study.design == "sample":
        return []
    results = np.array([found for by_name in numbers.values() for found in by_name.values()])  # (results, d + 2, n)
    changes = np.abs(results[:, 2:] - results[:, :1])  # NaN where either has no number
    known, moved = np.isfinite(changes).any(axis=(0, 2)), (changes > 0.0).any(axis=(0, 2))
    names = [problem.parameters[k].name for k in np.flatnonzero(known & ~moved)]
    return [f"no result changes with {', '.join(names)}: check that this test uses it"] if names else []
