"""Outcome of a study: bands, indices and shares from the numbers that its runs gave, and what they did not give."""

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

import knittest
from knittest.base.history import Array
from knittest.export.manifest import now
from knittest.studies.trials.record import OPEN, Record, looser_note
from knittest.studies.trials.trial import code_digest
from knittest.studies.uncertainty.indices import LEAST_ROWS, indices, share, spread, varies
from knittest.studies.uncertainty.lost import lost_row, lost_warnings, shorter_rows
from knittest.studies.uncertainty.problem import Parameter, Problem
from knittest.studies.uncertainty.ranks import no_regression, rank_regression
from knittest.studies.uncertainty.runs import Planned, ended_sooner, values_of
from knittest.studies.uncertainty.variables import Numbers, Stated, Variable
from knittest.studies.uncertainty.written import Index, ParameterRow, StatementRow, Uncertainty, VariableRow

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
