"""Numerical error of results, from the same run at half its speed and on another mesh, and notes on it.

Grid convergence index of two solutions (Roache 1994, J. Fluids Eng. 116, 405): for element lengths, speeds or residuals
with the ratio r and an error of order p, the error of the finer solution is |change| / (r^p - 1), and r^p times as much
of the coarser one. Two solutions do not show their order, hence the safety factor of 3. Both errors are biases: they
are added, not squared.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any, Generic, NamedTuple, TypeVar, cast

from knittest.base.errors import InputError
from knittest.base.kinds import Parts, kinds
from knittest.base.summary import NumericalError, RepeatBlock, Summary
from knittest.config.base import field_meta
from knittest.config.run import MacroModel, MesoModel, Run
from knittest.laboratory.halved_setting import change, diagnostic_results

#: results, None where there is no number
Numbers = Mapping[str, float | None]
RunT = TypeVar("RunT", bound=Run)

#: factor for two solutions (Roache 1994); it covers orders down to 0.4 on halving and 0.9 to 1 of meshes
SAFETY = 3.0
#: order of inertia in the speed, and of shells and beams in their length
ORDER = 2.0
#: half the speed is the better solution, so the reported one is the coarser
HALF_FACTOR = SAFETY * 2.0**ORDER / (2.0**ORDER - 1.0)
#: why a result without a value has no error
NO_NUMBER = "the run has no number"


class Corrections(Generic[RunT]):
    """Known errors of the results of a test: none by default."""

    def exact(self, run: RunT, results: Numbers) -> Numbers:
        """Correct ``results`` for the tolerance of a search, so that two runs can be compared."""
        return results

    def correct_to_equilibrium(self, run: RunT, results: Numbers) -> Numbers:
        """Correct ``results`` for the criterion of equilibrium as well."""
        return self.exact(run, results)


#: by the name of the test
CORRECTIONS: Mapping[str, Corrections[Any]] = Parts(
    lambda kind: kind.load("corrections")() if kind.corrections else Corrections()
)


@dataclass(frozen=True)
class Repeat:
    """Results of a repeated run, or the ``reason`` why there are none."""

    results: Numbers
    reason: str = ""

    def of(self, quantity: str) -> float | None:
        """Return a finite result, or None."""
        return _finite(self.results.get(quantity))


def mesh_factor(ratio: float, finer: bool) -> float:
    """Error over change on a mesh with elements ``ratio`` times as long, or short; at least that of first order."""
    grown = ratio**ORDER
    if finer:
        return SAFETY * grown / (grown - 1.0)
    return max(SAFETY / (grown - 1.0), 1.0 / (ratio - 1.0))


def numerical_errors(
    results: Numbers, half: Repeat, mesh: Repeat, ratio: float, finer: bool
) -> dict[str, NumericalError]:
    """Block of summary.json: changes [%] and error, in its own unit, of results but diagnostics; None if unknown."""
    found, other_mesh = {}, "finer_mesh_pct" if finer else "coarser_mesh_pct"
    for quantity in (q for q in results if q not in diagnostic_results()):
        value, slow, other = _finite(results[quantity]), half.of(quantity), mesh.of(quantity)
        changes = {"half_speed_pct": _percent(value, slow), other_mesh: _percent(value, other), "error": None}
        row = cast(NumericalError, changes)
        if value is not None and slow is not None and other is not None:
            row["error"] = HALF_FACTOR * abs(slow - value) + mesh_factor(ratio, finer) * abs(other - value)
        elif value is None:
            row["reason"] = NO_NUMBER
        else:
            at, repeat = ("at half the speed", half) if slow is None else ("on the other mesh", mesh)
            row["reason"] = repeat.reason or f"no number {at}"
        found[quantity] = row
    return found


def _percent(value: float | None, other: float | None) -> float | None:
    return _finite(100.0 * change(value, other))


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


#: ratio of element lengths of two meshes: noise is small from 1.3 on (Celik et al. 2008, J. Fluids Eng. 130, 078001),
#: far above it the coarser mesh says little of the finer. Even counts of loops and waves leave no more
SHELLS, YARNS = (1.5, 2.5), (1.3, 2.0)
#: shells of a coarser mesh along and across a strip: with 5 along, the curvature of a bent root is not in its order
LEAST = (8, 2)
#: difference of the ratios along two sides, or of loops and waves, that does not matter, and largest one
EVEN, UNEVEN = 0.1, 0.3


@dataclass(frozen=True)
class OtherMesh:
    """``other`` is ``run`` with elements ``ratio`` times as long, or short if ``finer``, and the change as text."""

    run: Run
    other: Run
    setting: str
    value: str
    other_value: str
    ratio: float
    finer: bool


class _MeshChoice(NamedTuple):
    """New numbers of elements, both ratios of element lengths (at least 1), and whether the mesh is finer."""

    counts: tuple[int, int]
    ratios: tuple[float, float]
    finer: bool

    @property
    def mismatch(self) -> float:
        return max(self.ratios) / min(self.ratios) - 1.0


def remesh(run: Run, finer: bool = False) -> OtherMesh:
    """The next coarser mesh that fits the specimen, or a finer one; raises :class:`InputError` when none fits."""
    found = _shell_choices(run) if run.model.scale == "macro" else _beam_choices(run)
    choices = [c for c in found if c.mismatch <= UNEVEN and c.finer >= finer]
    if not choices:
        raise InputError("model: no other mesh fits the specimen; change the element size or the size of the specimen")
    best = min(choices, key=lambda c: (c.finer, max(c.mismatch - EVEN, 0.0), max(c.ratios), c.mismatch))
    return _apply_choice(run, best)


def sheet_sides(run: Run) -> tuple[float, float]:
    """Length and width [mm] of the sheet of shells; raises :class:`InputError` for a test that does not state them."""
    kind = kinds()[run.rig.kind]
    if not kind.sheet:
        raise InputError(f"model: the record of test {kind.name} has no sheet size, so no other mesh can be made")
    if isinstance(kind.sheet, tuple):
        return getattr(run.rig, kind.sheet[0]), getattr(run.rig, kind.sheet[1])
    length, width = kind.load("sheet")(run)
    return float(length), float(width)


def _shell_choices(run: Run) -> Iterator[_MeshChoice]:
    """Other numbers of shells along and across; the shells themselves stay about square."""
    (length, width), size = sheet_sides(run), run.model.macro.element_size
    along, across = max(round(length / size), 1), max(round(width / size), 1)
    low, high = field_meta(MacroModel, "element_size")["band"]
    for n in range(LEAST[1], int(SHELLS[1] * across) + 1):
        m = round(length * n / width)
        finer = n > across
        ratios = (m / along, n / across) if finer else (along / max(m, 1), across / n)
        if (finer or m >= LEAST[0]) and _are_within(ratios, SHELLS) and low <= width / n <= high:
            yield _MeshChoice((m, n), ratios, finer)


def _beam_choices(run: Run) -> Iterator[_MeshChoice]:
    """Other even numbers of beams in a loop and in a wave."""
    loop, wave = run.model.meso.elements_per_loop, run.model.meso.elements_per_wave
    counts = _counts("elements_per_loop", loop), _counts("elements_per_wave", wave)
    for finer in (False, True):
        for n, m in product(*counts):
            ratios = (n / loop, m / wave) if finer else (loop / n, wave / m)
            if _are_within(ratios, YARNS):
                yield _MeshChoice((n, m), ratios, finer)


def _counts(field: str, now: int) -> range:
    """Even numbers about ``now`` within the bounds of the field."""
    bounds = MesoModel.model_json_schema()["properties"][field]
    most = min(bounds["maximum"], int(YARNS[1] * now))
    return range(bounds["minimum"], most + 1, bounds["multipleOf"])


def _are_within(ratios: tuple[float, float], window: tuple[float, float]) -> bool:
    return all(window[0] - 1e-9 <= r <= window[1] + 1e-9 for r in ratios)


def _apply_choice(run: Run, choice: _MeshChoice) -> OtherMesh:
    if run.model.scale == "macro":
        size = sheet_sides(run)[1] / choice.counts[1]
        part, setting, changed = "macro", "model.macro.element_size", dict[str, float](element_size=size)
        before, after = (f"{length:.3g} mm" for length in (run.model.macro.element_size, size))
    else:
        part, names = "meso", ("elements_per_loop", "elements_per_wave")
        setting, changed = f"model.meso.{names[0]}, {names[1]}", dict(zip(names, choice.counts, strict=True))
        meso = run.model.meso
        before, after = (f"{n} and {m}" for n, m in ((meso.elements_per_loop, meso.elements_per_wave), choice.counts))
    new = getattr(run.model, part).model_copy(update=changed)
    other = run.model_copy(update={"model": run.model.model_copy(update={part: new})})
    ratio = (choice.ratios[0] * choice.ratios[1]) ** 0.5
    return OtherMesh(run, other, setting, before, after, ratio, choice.finer)


#: note of a run without repeats, and of one whose repeats did not finish
NOT_ESTIMATED = "numerical error: not estimated (--verify)"
UNFINISHED = "numerical error: the repeated runs are not finished; continue with knittest resume"


def error_notes(summary: Summary, *, asked: bool = False) -> list[str]:
    """Lines on the numerical errors of ``summary``, none of a rejected run. ``asked``: repeats were asked for."""
    if summary.get("refused"):
        return []
    block = summary.get("verification")
    if not block:
        return [UNFINISHED if asked else NOT_ESTIMATED]
    repeats = (("half", block.get("half_speed")), ("other mesh", block.get("mesh")))
    lines = [_repeat_line(what, repeat) for what, repeat in repeats if isinstance(repeat, Mapping)]
    if any(isinstance(value, Mapping) and "values" in value for value in summary["results"].values()):
        lines.append("numerical error: of the first specimen only")
    missing = {row.get("reason") for row in (summary.get("numerical_error") or {}).values() if row.get("error") is None}
    missing -= {NO_NUMBER}
    if missing:
        lines.append("numerical error: not available: " + "; ".join(sorted(str(reason) for reason in missing)))
    return lines


def _repeat_line(what: str, repeat: RepeatBlock) -> str:
    if not repeat.get("setting"):
        return f"numerical error, {what}: none: {repeat.get('reason')}"
    text = f"numerical error, {what}: {repeat['setting']} {repeat['value']} -> {repeat['other_value']}"
    wall, cpu = repeat.get("wall_s"), repeat.get("cpu_s")
    cost = f", {wall:.3g} s, {cpu:.3g} s CPU" if wall is not None and cpu is not None else ""
    instead = f", in place of {repeat['instead_of']}" if repeat.get("instead_of") else ""
    return f"{text}: {repeat.get('status')}{cost}{instead}"
