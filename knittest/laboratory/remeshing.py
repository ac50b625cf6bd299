"""A run and the same on another mesh: the next coarser one, or a finer one where it is as coarse as it may be."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

from knittest.base.errors import InputError
from knittest.base.kinds import kinds
from knittest.config.base import field_meta
from knittest.config.run import MacroModel, MesoModel, Run

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
