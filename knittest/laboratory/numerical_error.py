"""The numerical error of results, from the same run at half its speed and on another mesh, and notes on it.

Roache's grid convergence index of two solutions (1994, J. Fluids Eng. 116, 405): with element lengths, speeds or
residuals that differ by the factor r and an error of order p, the finer solution is off by |change| / (r^p - 1) and the
coarser one by r^p times as much; two solutions do not show their order, so a safety factor of 3 goes on it. Both are
biases: they are added, not squared.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any, Generic, NamedTuple, TypeVar

from knittest.base.errors import InputError
from knittest.base.kinds import Parts, kinds
from knittest.base.summary import NumericalError, RepeatBlock, Summary
from knittest.config.base import field_meta
from knittest.config.run import MacroModel, MesoModel, Run
from knittest.laboratory.halving import change, diagnostic

#: results, None where there is no number
Numbers = Mapping[str, float | None]
RunT = TypeVar("RunT", bound=Run)

#: of two solutions (Roache 1994); with it the index covers orders down to 0.4 of halves and 0.9 to 1 of meshes
SAFETY = 3.0
#: order of inertia in the speed, and of shells and beams in their length
ORDER = 2.0
#: the half is the better one of the two, so the reported one is the coarser
HALF_FACTOR = SAFETY * 2.0**ORDER / (2.0**ORDER - 1.0)
#: why a result that the run does not have has no error
NO_NUMBER = "the run has no number"


class Corrections(Generic[RunT]):
    """Known errors of the results of a test: none, unless its folder says otherwise."""

    def exact(self, run: RunT, results: Numbers) -> Numbers:
        """Correct ``results`` for what a search within a tolerance left open, so that two runs can be compared."""
        return results

    def rested(self, run: RunT, results: Numbers) -> Numbers:
        """Correct them as well for what the criterion of rest left open."""
        return self.exact(run, results)


#: of every test; each takes runs of its own kind, which only their name tells
CORRECTIONS: Mapping[str, Corrections[Any]] = Parts(
    lambda kind: kind.load("corrections")() if kind.corrections else Corrections()
)


@dataclass(frozen=True)
class Repeat:
    """Results of a repeated run, empty where it has none: then ``reason`` says why."""

    results: Numbers
    reason: str = ""

    def of(self, quantity: str) -> float | None:
        """The result, None where there is no finite one."""
        return _finite(self.results.get(quantity))


def mesh_factor(ratio: float, finer: bool) -> float:
    """Error of the reported result over its change on a mesh with elements ``ratio`` times as long, or as short if
    ``finer``; never less than that of first order, which the index of a mesh more than twice as coarse is.
    """
    grown = ratio**ORDER
    if finer:
        return SAFETY * grown / (grown - 1.0)
    return max(SAFETY / (grown - 1.0), 1.0 / (ratio - 1.0))


def numerical_errors(
    results: Numbers, half: Repeat, mesh: Repeat, ratio: float, finer: bool
) -> dict[str, NumericalError]:
    """Changes [%] and error, in its own unit, of every result that is no diagnostic: summary.json's block.

    An error that cannot be told is None, with the reason; never 0.
    """
    found = {}
    for quantity in (q for q in results if q not in diagnostic()):
        value, slow, other = _finite(results[quantity]), half.of(quantity), mesh.of(quantity)
        speed, there = _percent(value, slow), _percent(value, other)
        row: NumericalError = {"half_speed_pct": speed, "coarser_mesh_pct": there, "error": None}
        if finer:
            row = {"half_speed_pct": speed, "finer_mesh_pct": there, "error": None}
        if value is None or slow is None or other is None:
            row["reason"] = _why(value, slow, half, mesh)
        else:
            row["error"] = HALF_FACTOR * abs(slow - value) + mesh_factor(ratio, finer) * abs(other - value)
        found[quantity] = row
    return found


def _why(value: float | None, slow: float | None, half: Repeat, mesh: Repeat) -> str:
    if value is None:
        return NO_NUMBER
    at, repeat = ("at half the speed", half) if slow is None else ("on the other mesh", mesh)
    return repeat.reason or f"no number {at}"


def _percent(value: float | None, other: float | None) -> float | None:
    return _finite(100.0 * change(value, other))


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


#: ratio of element lengths between two meshes. Below 1.3 noise is taken for error (Celik et al. 2008, J. Fluids Eng.
#: 130, 078001), far above it the coarser one says little of the finer; the even counts of loops and waves leave no more
SHELLS, YARNS = (1.5, 2.5), (1.3, 2.0)
#: shells that a coarser mesh keeps along and across a strip: with 5 along the curvature of a bent root is not yet in
#: its order
LEAST = (8, 2)
#: difference of the ratios along two sides, or of loops and waves, that does not matter, and that is too much
EVEN, UNEVEN = 0.1, 0.3


@dataclass(frozen=True)
class Remeshing:
    """``other`` is ``run`` with element lengths ``ratio`` times as long, or as short if ``finer``; as text what was
    changed, and from what to what.
    """

    run: Run
    other: Run
    setting: str
    value: str
    other_value: str
    ratio: float
    finer: bool


class _Choice(NamedTuple):
    """New numbers of elements, both ratios of element lengths, at least 1, and whether the mesh is finer."""

    counts: tuple[int, int]
    ratios: tuple[float, float]
    finer: bool

    @property
    def mismatch(self) -> float:
        return max(self.ratios) / min(self.ratios) - 1.0


def remeshing(run: Run, finer: bool = False) -> Remeshing:
    """The next coarser mesh of ``run`` that fits its specimen, a finer one if asked for; raises :class:`InputError`
    when none fits.

    Coarser before finer, even before uneven, near before far.
    """
    found = _shells(run) if run.model.scale == "macro" else _yarns(run)
    choices = [c for c in found if c.mismatch <= UNEVEN and c.finer >= finer]
    if not choices:
        raise InputError("model: no other mesh fits the specimen: fewer or more elements along all its sides")
    best = min(choices, key=lambda c: (c.finer, max(c.mismatch - EVEN, 0.0), max(c.ratios), c.mismatch))
    return _sized(run, best) if run.model.scale == "macro" else _counted(run, best)


def sides(run: Run) -> tuple[float, float]:
    """Length and width [mm] of the sheet of shells; raises :class:`InputError` for a test that does not state it."""
    kind = kinds()[run.rig.kind]
    if not kind.sheet:
        raise InputError(f"model: the test {kind.name} does not say how large its sheet is: no other mesh can be made")
    length, width = kind.load("sheet")(run)
    return float(length), float(width)


def _shells(run: Run) -> Iterator[_Choice]:
    """Other numbers of shells along and across; the shells themselves stay about square."""
    (length, width), size = sides(run), run.model.macro.element_size
    along, across = max(round(length / size), 1), max(round(width / size), 1)
    low, high = field_meta(MacroModel, "element_size")["band"]
    for n in range(LEAST[1], int(SHELLS[1] * across) + 1):
        m = round(length * n / width)
        finer = n > across
        ratios = (m / along, n / across) if finer else (along / max(m, 1), across / n)
        if (finer or m >= LEAST[0]) and _within(ratios, SHELLS) and low <= width / n <= high:
            yield _Choice((m, n), ratios, finer)


def _yarns(run: Run) -> Iterator[_Choice]:
    """Other even numbers of beams in a loop and in a wave."""
    loop, wave = run.model.meso.elements_per_loop, run.model.meso.elements_per_wave
    for finer in (False, True):
        for n, m in product(_counts("elements_per_loop", loop), _counts("elements_per_wave", wave)):
            ratios = (n / loop, m / wave) if finer else (loop / n, wave / m)
            if _within(ratios, YARNS):
                yield _Choice((n, m), ratios, finer)


def _counts(field: str, now: int) -> range:
    """Even numbers about ``now`` within the bounds of the field."""
    bounds = MesoModel.model_json_schema()["properties"][field]
    most = min(bounds["maximum"], int(YARNS[1] * now))
    return range(bounds["minimum"], most + 1, bounds["multipleOf"])


def _within(ratios: tuple[float, float], window: tuple[float, float]) -> bool:
    return all(window[0] - 1e-9 <= r <= window[1] + 1e-9 for r in ratios)


def _sized(run: Run, choice: _Choice) -> Remeshing:
    size = sides(run)[1] / choice.counts[1]
    macro = run.model.macro.model_copy(update={"element_size": size})
    other = run.model_copy(update={"model": run.model.model_copy(update={"macro": macro})})
    before = f"{run.model.macro.element_size:.3g} mm"
    ratio = (choice.ratios[0] * choice.ratios[1]) ** 0.5
    return Remeshing(run, other, "model.macro.element_size", before, f"{size:.3g} mm", ratio, choice.finer)


def _counted(run: Run, choice: _Choice) -> Remeshing:
    before, names = run.model.meso, ("elements_per_loop", "elements_per_wave")
    meso = before.model_copy(update=dict(zip(names, choice.counts, strict=True)))
    other = run.model_copy(update={"model": run.model.model_copy(update={"meso": meso})})
    value, other_value = (f"{m.elements_per_loop} and {m.elements_per_wave}" for m in (before, meso))
    ratio = (choice.ratios[0] * choice.ratios[1]) ** 0.5
    return Remeshing(run, other, f"model.meso.{names[0]}, {names[1]}", value, other_value, ratio, choice.finer)


#: what a run that was not repeated says
NOT_ESTIMATED = "numerical error: not estimated (--verify)"
#: what a run says whose repeats were asked for and did not end
UNFINISHED = "numerical error: its repeats are not finished; knittest resume goes on"


def error_notes(summary: Summary, *, asked: bool = False) -> list[str]:
    """Lines on the numerical errors of ``summary`` (summary.json): one a repeat, then what else to know.

    Of a refused run none. ``asked``: the run was to be repeated.
    """
    if summary.get("refused"):
        return []
    told = summary.get("verification")
    if not told:
        return [UNFINISHED if asked else NOT_ESTIMATED]
    repeats = (("half", told.get("half_speed")), ("other mesh", told.get("mesh")))
    lines = [_line(what, repeat) for what, repeat in repeats if isinstance(repeat, Mapping)]
    if any(isinstance(value, Mapping) and "values" in value for value in summary["results"].values()):
        lines.append("numerical error: that of the first specimen")
    missing = {row.get("reason") for row in (summary.get("numerical_error") or {}).values() if row.get("error") is None}
    missing -= {NO_NUMBER}
    if missing:
        lines.append("numerical error: not available: " + "; ".join(sorted(str(reason) for reason in missing)))
    return lines


def _line(what: str, repeat: RepeatBlock) -> str:
    """Line on what was changed, and what the repeat cost."""
    if not repeat.get("setting"):
        return f"numerical error, {what}: none: {repeat.get('reason')}"
    text = f"numerical error, {what}: {repeat['setting']} {repeat['value']} -> {repeat['other_value']}"
    wall, cpu = repeat.get("wall_s"), repeat.get("cpu_s")
    cost = f", {wall:.3g} s, {cpu:.3g} s of processor" if wall is not None and cpu is not None else ""
    instead = f", in place of {repeat['instead_of']}" if repeat.get("instead_of") else ""
    return f"{text}: {repeat.get('status')}{cost}{instead}"
