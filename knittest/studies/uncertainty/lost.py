"""Runs that did not give every number: why, to which shorter end they count, and what that makes of the bands."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence

from knittest.studies.trials.record import Record
from knittest.studies.uncertainty.problem import Problem
from knittest.studies.uncertainty.runs import Attempt, Planned, missing
from knittest.studies.uncertainty.variables import Numbers
from knittest.studies.uncertainty.written import Lost, ShorterRow, Tried, VariableRow


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
