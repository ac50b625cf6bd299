"""Yarns of a specimen: their over/under codes, which stitches and layers predict, and their scatter in strength, slack
and wave amplitude.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.arrays import Array
from knittest.base.errors import InputError, NumericalError
from knittest.config.fabric import Fabric
from knittest.config.run import Variability
from knittest.config.structure import KNIT
from knittest.config.yarn import Yarn

if TYPE_CHECKING:
    from knittest.fabric.cell import Cell, Curve


#: images of the cell that are searched in each direction, over those that the cell itself spans
IMAGES = 3


@dataclass(frozen=True)
class Crossing:
    """Two yarns cross in the projection: their numbers in the cell, place along each and image; the first lies over."""

    over: int
    under: int
    over_place: float
    under_place: float
    image: tuple[int, int]  # cell of the under strand, seen from the over strand


#: a strand that is met: number of its yarn in the cell, and image of the cell across it
Strand = tuple[int, int]


def crossings(cell: "Cell") -> list[Crossing]:
    """Crossings of different yarns in one period of the xy projection.

    A yarn's crossings with itself are left out: legs of neighbouring loops overlap in the projection of wide loops,
    exactly over the warp by symmetry, and say nothing of the interlacing.
    """
    curves = cell.curves
    starts = [one.points[:, :2] for one in curves]
    chords = [np.diff(one.closed, axis=0) for one in curves]
    found = []
    for a, b in np.ndindex(len(curves), len(curves)):
        if b < a or _are_parallel_inlays(curves[a], curves[b]):
            continue
        axis = cell.spec.axis(curves[a].system)
        for image in _images(cell):
            if a != b or image[1 - axis] > 0:
                shift = np.array(image) * cell.spec.size
                found += _pair_crossings(a, b, image, shift, starts, chords, [one.points for one in curves])
    return found


def _are_parallel_inlays(one: "Curve", other: "Curve") -> bool:
    return KNIT not in (one.system, other.system) and int(np.argmax(one.period)) == int(np.argmax(other.period))


def _images(cell: "Cell") -> list[tuple[int, int]]:
    """Images of the cell in which neighbours of a strand may lie."""
    x, y = (max(-(-IMAGES // pitches), 1) for pitches in cell.spec.repeat)
    return [(i, j) for i in range(-x, x + 1) for j in range(-y, y + 1)]


def _pair_crossings(
    a: int, b: int, image: tuple[int, int], shift: Array, starts: list[Array], chords: list[Array], curves: list[Array]
) -> list[Crossing]:
    """Crossings of yarn ``a`` with the image of yarn ``b``; solved for all segments at once."""
    p, r = starts[a][:, None], chords[a][:, None, :2]
    q, s = (starts[b] + shift)[None], chords[b][None, :, :2]
    cross = r[..., 0] * s[..., 1] - r[..., 1] * s[..., 0]
    safe = np.where(np.abs(cross) < 1e-14, np.nan, cross)
    t = ((q - p)[..., 0] * s[..., 1] - (q - p)[..., 1] * s[..., 0]) / safe
    u = ((q - p)[..., 0] * r[..., 1] - (q - p)[..., 1] * r[..., 0]) / safe
    out = []
    for i, j in np.argwhere((t >= 0) & (t < 1) & (u >= 0) & (u < 1)):
        first = curves[a][i, 2] + t[i, j] * chords[a][i, 2]
        second = curves[b][j, 2] + u[i, j] * chords[b][j, 2]
        here, there = float(i + t[i, j]), float(j + u[i, j])
        if first > second:
            out.append(Crossing(a, b, here, there, image))
        else:
            out.append(Crossing(b, a, there, here, (-image[0], -image[1])))
    return out


def strand_met(cell: "Cell", one: Crossing, over: bool) -> Strand:
    """Strand that is met at a crossing by the yarn that lies ``over`` there, or under."""
    other, image = (one.under, one.image) if over else (one.over, (-one.image[0], -one.image[1]))
    return other, image[1 - cell.spec.axis(cell.curves[other].system)]


def sequences(cell: "Cell", found: list[Crossing]) -> list[list[tuple[int, bool]]]:
    """Crossings (number, over) of each yarn with others, in order along it."""
    lines: list[list[tuple[float, int, bool]]] = [[] for _ in cell.curves]
    for k, one in enumerate(found):
        lines[one.over].append((one.over_place, k, True))
        lines[one.under].append((one.under_place, k, False))
    return [[(k, over) for _, k, over in sorted(line)] for line in lines]


def remove_slack_pairs(cell: "Cell", found: list[Crossing]) -> list[Crossing]:
    """Drop pairs of neighbouring crossings of the same two strands, one over the other in both (Reidemeister II)."""
    while (slack := _slack_pair(cell, found)) is not None:
        found = [c for k, c in enumerate(found) if k not in slack]
    return found


def _slack_pair(cell: "Cell", found: list[Crossing]) -> frozenset[int] | None:
    """Two crossings that follow each other along both of their strands, with the same one over."""
    neighbours: dict[frozenset[int], set[bool]] = {}
    for line in sequences(cell, found):
        for (k, over), (k2, over2) in pairwise([*line, *line[:1]]):
            if k == k2 or over != over2 or strand_met(cell, found[k], over) != strand_met(cell, found[k2], over):
                continue
            seen = neighbours.setdefault(frozenset((k, k2)), set())
            if seen and over not in seen:
                return frozenset((k, k2))
            seen.add(over)
    return None


@dataclass(frozen=True)
class LoopCrossing:
    """Crossing of two courses: course and wale of the lower loop, its place along both, and whether it lies over."""

    course: int
    wale: int
    lower_place: float
    upper_place: float
    lower_over: bool
    apart: int  # courses from the lower to the upper strand


def loop_crossings(cell: "Cell") -> list[LoopCrossing]:
    """Crossings of the courses of loops with each other, without pairs that are only slack.

    Places count loops. The wale is that of the lower strand, which is crossed near its needle arc: the sinker arc of
    the upper one may lie anywhere between two wales.
    """
    wales, courses = cell.spec.repeat
    loops = [one for one in crossings(cell) if cell.curves[one.over].system == cell.curves[one.under].system == KNIT]
    found = []
    for one in remove_slack_pairs(cell, loops):
        over, under = cell.curves[one.over], cell.curves[one.under]
        apart = under.index + courses * one.image[1] - over.index
        per_loop = len(over.points) / wales
        places = [one.over_place / per_loop, one.under_place / per_loop]
        if lower_over := apart > 0:
            lower, places[1] = over, places[1] + wales * one.image[0]
        else:
            lower, places = under, [places[1], places[0] - wales * one.image[0]]
        found.append(LoopCrossing(lower.index, int(places[0]), places[0], places[1], lower_over, abs(apart)))
    return found


def stitch_codes(cell: "Cell") -> dict[tuple[int, int], str]:
    """Code by course and wale of how the course above interlaces with a loop, such as ``OUUO``.

    It tells along the loop where it lies over (O) or under (U) the course above. ``?`` marks crossings whose order
    along the course above is another one, or with courses farther away. Legs of a narrow loop may cross each other: the
    two crossings with the needle arc then change their order (Reidemeister III).
    """
    wales, courses = cell.spec.repeat
    codes, found = {}, loop_crossings(cell)
    for place in np.ndindex(courses, wales):
        met = [one for one in found if (one.course, one.wale) == place]
        met.sort(key=lambda one: one.lower_place)
        code = "".join("O" if one.lower_over else "U" for one in met)
        above = sorted(met, key=lambda one: one.upper_place)
        crossed = [met[0], met[2], met[1], met[3]] if len(met) == 4 else met
        codes[place] = code + ("?" if above not in (met, crossed) or any(one.apart > 1 for one in met) else "")
    return codes


def predicted_code(side: int) -> str:
    """Code of a loop under a stitch of ``side`` (1 knit, -1 purl): its foot under the leg, its leg over the head."""
    return "OUUO" if side > 0 else "UOOU"


def check_topology(cell: "Cell", start: "Cell") -> None:
    """Raise :class:`NumericalError` naming the yarn whose interlacing is wrong, :class:`InputError` for a loose inlay.

    Loops interlace as their stitches predict. Layers of inlays lie in their order from back to face. Where a loop lies
    before or behind all layers in ``start``, it still does: legs of knit stitches before, their sinker arcs behind.
    Where a slack sinker arc dips behind the weft of the course below, the order of the layers holds.
    """
    for (course, wale), code in stitch_codes(cell).items():
        wanted = predicted_code(cell.spec.side(wale, course + 1))
        if code != wanted:
            raise NumericalError(
                f"the loop of course {course + 1}, wale {wale + 1} is not interlaced as its stitches: over (O) and "
                f"under (U) the course above as {code or 'no crossings'}, expected {wanted}"
            )
    order = {system: number for number, system in enumerate(cell.spec.systems)}
    for one in crossings(cell):
        over, under = cell.curves[one.over], cell.curves[one.under]
        if KNIT not in (over.system, under.system):
            if order[over.system] < order[under.system]:
                raise NumericalError(f"the {under.system} does not lie in front of the {over.system}")
        elif over.system != under.system:
            _check_side(cell, start, one)
    if loose := unheld_inlays(cell):
        raise InputError(loose)


def _check_side(cell: "Cell", start: "Cell", one: Crossing) -> None:
    """Check that a loop passes an inlay on the side of the layers on which it lies in ``start``.

    It lies there if it is beyond half the half height of the outermost inlays: start curves penetrate their surfaces.
    """
    is_loop_over = cell.curves[one.over].system == KNIT
    loop, place = (one.over, one.over_place) if is_loop_over else (one.under, one.under_place)
    inlay = cell.curves[one.under if is_loop_over else one.over]
    closed = start.curves[loop].closed[:, 2]
    height = float(np.interp(place, np.arange(len(closed)), closed))
    inlays = [
        (one.points[:, 2].mean(), start.spec.half_axes[one.system][1]) for one in start.curves if one.system != KNIT
    ]
    low, high = min(z - 0.5 * half for z, half in inlays), max(z + 0.5 * half for z, half in inlays)
    if (height > high and not is_loop_over) or (height < low and is_loop_over):
        side = "behind" if height > high else "in front of"
        part = "legs" if height > high else "sinker arcs"
        raise NumericalError(
            f"the {inlay.system} of {cell.place_name(inlay)} does not lie {side} the {part} of course "
            f"{cell.curves[loop].index + 1}"
        )


def unheld_inlays(cell: "Cell") -> str:
    """Reason why an inlay falls out of the fabric, and what would hold it; empty if all are held.

    A loop, or an inlay that is held on that side, must lie in front of each inlay and one behind it.
    """
    met, curves = crossings(cell), cell.curves
    for side in ("in front of", "behind"):
        pairs = {(one.under, one.over) if side == "in front of" else (one.over, one.under) for one in met}
        held = {k for k, one in enumerate(curves) if one.system == KNIT}
        while more := {inlay for inlay, holder in pairs if holder in held} - held:
            held |= more
        for k, one in enumerate(curves):
            if k not in held:
                other = "weft" if cell.spec.axis(one.system) else "warp"
                return (
                    f"fabric.layers: nothing lies {side} the {one.system} of {cell.place_name(one)}, so that it falls "
                    f"out of the fabric; expected a layer of {other} {side} it, or stitches that hold it on this side "
                    "(fabric.stitches = [kp], rib 1x1, holds wefts)"
                )
    return ""


#: a drawn fracture strain is not taken below this share of its mean: a yarn that weak would not survive knitting
WEAKEST = 0.2


@dataclass(frozen=True)
class YarnDraws:
    """Yarns of one system, each (n,): fracture strain [-], slack [-], relative wave amplitude [-], place of the
    weakest element along the yarn, from 0 to 1; length of the loops of each course over their mean [-], which other
    yarns have none of.
    """

    fracture_strain: Array
    slack: Array
    amplitude: Array
    weakest: Array
    loop: Array | None = None


def _uniforms(mode: str, n: int, rng: np.random.Generator) -> Array:
    """Probabilities in (0, 1): independent draws, or mid-point quantiles in random order."""
    if mode == "random":
        return np.clip(rng.random(n), 1e-12, 1.0 - 1e-12)
    return rng.permutation((np.arange(n) + 0.5) / n)


def draw(fabric: Fabric, variability: Variability, system: str, n: int, specimen: int) -> YarnDraws:
    """Draw the ``n`` yarns of ``system`` of one specimen.

    Fracture strain and amplitude are normal, slack is half-normal (the tautest yarn has none). ``uniform`` gives every
    yarn the mean fracture strain and the median slack. The same seed and specimen give the same bits.
    """
    from scipy.stats import halfnorm, norm

    inlays = None if system == KNIT else fabric.inlays_of_system(system)
    yarn: Yarn = fabric.knitting if inlays is None else inlays.yarn
    mean = yarn.fracture_strain_fraction
    relative = (yarn.fracture_strain.sd or 0.0) / yarn.fracture_strain.value
    slack = amplitude = 0.0
    if inlays is not None:
        slack = inlays.yarn.slack_fraction.of(inlays.direction)
        amplitude = inlays.yarn.crimp_scatter.of(inlays.direction).value
    rng = np.random.default_rng([variability.seed, specimen, _stream(fabric, system)])
    weakest = rng.random(n)
    if variability.mode == "uniform":
        return YarnDraws(np.full(n, mean), np.full(n, slack * float(halfnorm.ppf(0.5))), np.ones(n), weakest)
    strength, looseness, wave = (_uniforms(variability.mode, n, rng) for _ in range(3))
    scattered = system == KNIT and fabric.knitting.loop_scatter == "courses"
    loop = 1.0 + loop_scatter(fabric) * norm.ppf(_uniforms(variability.mode, n, rng)) if scattered else None
    return YarnDraws(
        mean * np.maximum(1.0 + relative * norm.ppf(strength), WEAKEST),
        slack * halfnorm.ppf(looseness),
        np.maximum(1.0 + amplitude * norm.ppf(wave), 0.0),
        weakest,
        loop,
    )


def _stream(fabric: Fabric, system: str) -> int:
    """Number of the random stream of ``system``."""
    single = ("warp", "weft", KNIT)
    return single.index(system) if system in single else 3 + [one.name for one in fabric.inlays].index(system)


def loop_scatter(fabric: Fabric) -> float:
    """Standard deviation of the loop length over its mean [-]; raises :class:`InputError` where none is stated."""
    length = fabric.loop_length
    if length.sd is None:
        raise InputError(
            "fabric.knitting.loop_scatter = courses: fabric.loop_length states no sd; expected the scatter of the "
            "measured lengths in fabric.loop_length.sd"
        )
    return length.sd / length.value


def bundle_peak(draws: YarnDraws, axial_stiffness: float) -> tuple[float, float]:
    """Peak force [N] and strain [-] of straight linear yarns between rigid clamps (Daniels, 1945).

    Without slack this is max_k EA e_(k) (n - k + 1) over the ordered fracture strains.
    """
    breaks = draws.fracture_strain + draws.slack
    forces = [
        axial_stiffness * np.maximum(strain - draws.slack, 0.0)[breaks >= strain].sum() for strain in np.sort(breaks)
    ]
    best = int(np.argmax(forces))
    return float(forces[best]), float(np.sort(breaks)[best])
