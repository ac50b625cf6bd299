"""Yarns of a specimen: their over/under codes as a biaxial weft-knit has them, and their scatter in strength, slack and
wave amplitude.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.arrays import Array
from knittest.base.errors import InputError, NumericalError
from knittest.config.fabric import Fabric
from knittest.config.run import Variability
from knittest.fabric.cell import SYSTEMS

if TYPE_CHECKING:
    from knittest.fabric.cell import Cell


#: plain knit, from the sinker arc on: over (O) or under (U) the course before (-) or after (+)
KNIT_CODE = ["U-", "O-", "O+", "U+", "U+", "O+", "O-", "U-"]
#: images of the cell that are searched in each direction
IMAGES = 3


@dataclass(frozen=True)
class Crossing:
    """Two yarns cross in the projection: system, place along it and image of each strand; the first lies over."""

    over: int
    under: int
    over_place: float
    under_place: float
    image: tuple[int, int]  # cell of the under strand, seen from the over strand


def crossings(cell: "Cell") -> list[Crossing]:
    """Crossings of different yarns in one period of the xy projection.

    A yarn's crossings with itself are left out: legs of neighbouring loops overlap in the projection of wide loops,
    exactly over the warp by symmetry, and say nothing of the interlacing.
    """
    curves = [getattr(cell, s) for s in SYSTEMS]
    starts = [c[:, :2] for c in curves]
    chords = [np.diff(cell.closed_curve(s), axis=0) for s in SYSTEMS]
    spacing = np.array([cell.spec.wale, cell.spec.course])
    found = []
    for a, b in ((0, 0), (0, 1), (0, 2), (1, 2)):
        for across, along in np.ndindex(2 * IMAGES + 1, 2 * IMAGES + 1):
            image = (across - IMAGES, along - IMAGES)
            if a != b or image[1] > 0:
                found += _pair_crossings(a, b, image, np.array(image) * spacing, starts, chords, curves)
    return found


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


def sequence(found: list[Crossing]) -> list[tuple[int, bool]]:
    """Crossings (number, over) of a course with its neighbours, in order along the yarn."""
    along = [(c.over_place, k, True) for k, c in enumerate(found)]
    along += [(c.under_place, k, False) for k, c in enumerate(found)]
    return [(k, over) for _, k, over in sorted(along)]


def remove_slack_pairs(found: list[Crossing]) -> list[Crossing]:
    """Drop pairs of neighbouring crossings of the same two strands, one over the other in both (Reidemeister II)."""
    while (slack := _slack_pair(found)) is not None:
        found = [c for k, c in enumerate(found) if k not in slack]
    return found


def _slack_pair(found: list[Crossing]) -> frozenset[int] | None:
    """Two crossings that follow each other along both of their strands, with the same one over."""
    line = sequence(found)
    neighbours = set()
    for (k, over), (k2, over2) in pairwise([*line, *line[:1]]):
        pair = frozenset((k, k2))
        if over == over2 and found[k].image[1] == found[k2].image[1]:
            if (pair, not over) in neighbours:
                return pair
            neighbours.add((pair, over))
    return None


def knit_code(cell: "Cell") -> list[str]:
    """Code of a course along its yarn, in the notation of :data:`KNIT_CODE`, without pairs that are only slack."""
    found = remove_slack_pairs([c for c in crossings(cell) if c.over == c.under == 0])
    code = []
    for k, over in sequence(found):
        course = found[k].image[1] if over else -found[k].image[1]
        sign = {1: "+", -1: "-"}.get(course, f"({course:+d})")
        code.append(("O" if over else "U") + sign)
    return code


def check_topology(cell: "Cell") -> None:
    """Raise :class:`NumericalError` naming the yarn whose interlacing is wrong.

    From back to face: sinker arcs, warp, weft, loop legs; the loops interlace as plain knit. Where a slack sinker arc
    dips behind the weft of the course below, the weft lies in front of it, and the order of the layers holds.
    """
    code = knit_code(cell)
    found = " ".join(code) or "no crossings"
    if KNIT_CODE not in [code[k:] + code[:k] for k in range(len(code))]:
        raise NumericalError(
            f"the knitting yarn is not interlaced as plain knit: {found}, expected {' '.join(KNIT_CODE)}"
        )
    pairs = [(SYSTEMS[c.over], SYSTEMS[c.under], c.image[1]) for c in crossings(cell)]
    if [p[:2] for p in pairs if set(p[:2]) == {"warp", "weft"}] != [("weft", "warp")]:
        raise NumericalError("the weft does not lie in front of the warp")
    if {p[:2] for p in pairs if set(p[:2]) == {"warp", "knit"}} != {("warp", "knit")}:
        raise NumericalError("the warp does not lie in front of the sinker arcs")
    own = [over for over, under, course in pairs if {over, under} == {"weft", "knit"} and course == 0]
    if set(own) != {"knit"} or len(own) < 2:
        raise NumericalError("the weft does not lie behind the legs of its loops")
    if any(over == "knit" and under == "weft" and course != 0 for over, under, course in pairs):
        raise NumericalError("the weft lies behind loops of another course")


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
    """Draw the yarns of ``system`` (warp, weft, knit) of one specimen.

    Fracture strain and amplitude are normal, slack is half-normal (the tautest yarn has none). ``uniform`` gives every
    yarn the mean fracture strain and the median slack. The same seed and specimen give the same bits.
    """
    from scipy.stats import halfnorm, norm

    yarn = fabric.knitting if system == "knit" else fabric.reinforcing
    mean = yarn.fracture_strain_fraction
    relative = (yarn.fracture_strain.sd or 0.0) / yarn.fracture_strain.value
    slack = amplitude = 0.0
    if system != "knit":
        slack = fabric.reinforcing.slack_fraction.of(system)
        amplitude = fabric.reinforcing.crimp_scatter.of(system).value
    rng = np.random.default_rng([variability.seed, specimen, ("warp", "weft", "knit").index(system)])
    weakest = rng.random(n)
    if variability.mode == "uniform":
        return YarnDraws(np.full(n, mean), np.full(n, slack * float(halfnorm.ppf(0.5))), np.ones(n), weakest)
    strength, looseness, wave = (_uniforms(variability.mode, n, rng) for _ in range(3))
    scattered = system == "knit" and fabric.knitting.loop_scatter == "courses"
    loop = 1.0 + loop_scatter(fabric) * norm.ppf(_uniforms(variability.mode, n, rng)) if scattered else None
    return YarnDraws(
        mean * np.maximum(1.0 + relative * norm.ppf(strength), WEAKEST),
        slack * halfnorm.ppf(looseness),
        np.maximum(1.0 + amplitude * norm.ppf(wave), 0.0),
        weakest,
        loop,
    )


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
