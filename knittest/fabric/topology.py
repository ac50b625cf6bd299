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


def crossings(cell: "Cell") -> list[Crossing]:
    """Crossings of inlays with each other and with loops in one period of the xy projection."""
    curves = cell.curves
    chords = [np.diff(one.closed, axis=0) for one in curves]
    found = []
    for a, b in np.ndindex(len(curves), len(curves)):
        if b <= a or curves[a].system == curves[b].system == KNIT or _are_parallel_inlays(curves[a], curves[b]):
            continue
        for image in _images(cell):
            moved = curves[b].points + np.append(np.array(image) * cell.spec.size, 0.0)
            for here, there, over in line_crossings(curves[a].points, chords[a], moved, chords[b]):
                if over:
                    found.append(Crossing(a, b, here, there, image))
                else:
                    found.append(Crossing(b, a, there, here, (-image[0], -image[1])))
    return found


def _are_parallel_inlays(one: "Curve", other: "Curve") -> bool:
    return KNIT not in (one.system, other.system) and int(np.argmax(one.period)) == int(np.argmax(other.period))


def _images(cell: "Cell") -> list[tuple[int, int]]:
    """Images of the cell in which neighbours of a strand may lie."""
    x, y = (max(-(-IMAGES // pitches), 1) for pitches in cell.spec.repeat)
    return [(i, j) for i in range(-x, x + 1) for j in range(-y, y + 1)]


def line_crossings(start: Array, chord: Array, other: Array, other_chord: Array) -> list[tuple[float, float, bool]]:
    """Crossings of two polylines in the xy projection: place along both in segments, and whether the first lies over.

    ``start`` (n, 3) and ``chord`` (n, 3) [mm] are the segments of the first, the other two those of the second.
    """
    p, r = start[:, None, :2], chord[:, None, :2]
    q, s = other[None, :, :2], other_chord[None, :, :2]
    cross = r[..., 0] * s[..., 1] - r[..., 1] * s[..., 0]
    safe = np.where(np.abs(cross) < 1e-14, np.nan, cross)
    t = ((q - p)[..., 0] * s[..., 1] - (q - p)[..., 1] * s[..., 0]) / safe
    u = ((q - p)[..., 0] * r[..., 1] - (q - p)[..., 1] * r[..., 0]) / safe
    found = []
    for i, j in np.argwhere((t >= 0) & (t < 1) & (u >= 0) & (u < 1)):
        first = start[i, 2] + t[i, j] * chord[i, 2]
        second = other[j, 2] + u[i, j] * other_chord[j, 2]
        found.append((float(i + t[i, j]), float(j + u[i, j]), bool(first > second)))
    return found


#: part of a loop that the loop above passes, and parts of the loop above with its feet, from the sinker arc on [-]
HEAD, FEET = (0.2, 0.8), ((-0.15, 0.35), (0.65, 1.15))


def stitch_codes(cell: "Cell") -> dict[tuple[int, int], str]:
    """Code by course and wale of how the loop above interlaces with a loop, such as ``OUUO``.

    It tells along the loop where it lies over (O) or under (U) the loop above, without pairs that are only slack. Each
    loop is seen from its own face, because slack loops turn: across the line between its legs and the way from its
    feet to its head. ``?`` marks crossings whose order along the loop above is another one. Legs of a narrow loop may
    cross each other: the two crossings with the needle arc then change their order (Reidemeister III).
    """
    wales, courses = cell.spec.repeat
    codes = {}
    for course, wale in np.ndindex(courses, wales):
        loop = _part_of_course(cell, course, wale, *HEAD)
        feet = [_part_of_course(cell, course + 1, wale, *part) for part in FEET]
        face = _face_of_loop(cell, course, wale)
        found = []
        for number, foot in enumerate(feet):
            lines = [line @ face.T for line in (loop, foot)]
            met = line_crossings(lines[0][:-1], np.diff(lines[0], axis=0), lines[1][:-1], np.diff(lines[1], axis=0))
            found += [(here, number * len(foot) + there, over) for here, there, over in met]
        along = _without_slack_pairs(sorted(found))
        above = sorted(along, key=lambda one: one[1])
        crossed = [along[0], along[2], along[1], along[3]] if len(along) == 4 else along
        code = "".join("O" if over else "U" for *_, over in along)
        codes[course, wale] = code + ("" if above in (along, crossed) else "?")
    return codes


def _without_slack_pairs(found: list[tuple[float, float, bool]]) -> list[tuple[float, float, bool]]:
    """Drop pairs of crossings that follow each other along both lines with the same one over (Reidemeister II)."""
    above = sorted(found, key=lambda one: one[1])
    for one, other in pairwise(found):
        if len(found) > 4 and one[2] == other[2] and abs(above.index(one) - above.index(other)) == 1:
            return _without_slack_pairs([k for k in found if k not in (one, other)])
    return found


def _part_of_course(cell: "Cell", course: int, wale: int, start: float, end: float) -> Array:
    """Points (n, 3) [mm] of the loop of a stitch between two shares of it from its sinker arc on."""
    wales, courses = cell.spec.repeat
    curve = cell.of(KNIT)[course % courses]
    per_loop, count = len(curve.points) // wales, len(curve.points)
    number = np.arange(round((wale + start) * per_loop), round((wale + end) * per_loop) + 1)
    points = curve.points[number % count] + (number // count)[:, None] * curve.period
    return np.asarray(points + np.array([0.0, (course // courses) * cell.spec.size[1], 0.0]))


def _face_of_loop(cell: "Cell", course: int, wale: int) -> Array:
    """Axes (3, 3), rows, of a loop: from its left to its right leg, from its feet to its head, towards its face."""
    loop = _part_of_course(cell, course, wale, 0.0, 1.0)
    n = len(loop) - 1
    left, right = loop[n // 8 : 3 * n // 8].mean(axis=0), loop[5 * n // 8 : 7 * n // 8].mean(axis=0)
    up = loop[3 * n // 8 : 5 * n // 8].mean(axis=0) - 0.5 * (loop[0] + loop[-1])
    face = np.cross(right - left, up)
    face /= np.linalg.norm(face)
    up /= np.linalg.norm(up)
    return np.array([np.cross(up, face), up, face])


def predicted_code(side: int) -> str:
    """Code of a loop under a stitch of ``side`` (1 knit, -1 purl): its foot under the leg, its leg over the head."""
    return "OUUO" if side > 0 else "UOOU"


def check_topology(cell: "Cell", start: "Cell", continuous: bool = False) -> None:
    """Raise :class:`NumericalError` naming the yarn whose interlacing is wrong, :class:`InputError` for a loose inlay.

    Loops interlace as their stitches predict. Layers of inlays lie in their order from back to face. Where a loop lies
    before or behind all layers in ``start``, it still does: legs of knit stitches before, their sinker arcs behind.
    Where a slack sinker arc dips behind the weft of the course below, the order of the layers holds. Where ``cell``
    arose from ``start`` in a ``continuous`` motion, in which no yarn passed another, its loops interlace as those of
    the start: slack loops of rib turn until neither face shows how.
    """
    if continuous and (loose := unheld_inlays(cell)):
        raise InputError(loose)
    for (course, wale), code in stitch_codes(start if continuous else cell).items():
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
                other, stitches = (
                    ("weft", "[k, p], garter") if cell.spec.axis(one.system) else ("warp", "[kp], rib 1x1")
                )
                own = "warp" if other == "weft" else "weft"
                return (
                    f"fabric.layers: nothing lies {side} the {one.system} of {cell.place_name(one)}, so that it falls "
                    f"out of the fabric; expected a layer of {other} {side} it, or stitches that hold it on this side "
                    f"(fabric.stitches = {stitches}, holds a {own} on both sides)"
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
    from scipy.special import ndtri  # normal quantile; scipy.stats takes a second to load

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
        return YarnDraws(np.full(n, mean), np.full(n, slack * float(ndtri(0.75))), np.ones(n), weakest)
    strength, looseness, wave = (_uniforms(variability.mode, n, rng) for _ in range(3))
    scattered = system == KNIT and fabric.knitting.loop_scatter == "courses"
    loop = 1.0 + loop_scatter(fabric) * ndtri(_uniforms(variability.mode, n, rng)) if scattered else None
    return YarnDraws(
        mean * np.maximum(1.0 + relative * ndtri(strength), WEAKEST),
        slack * ndtri(0.5 * (1.0 + looseness)),
        np.maximum(1.0 + amplitude * ndtri(wave), 0.0),
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
