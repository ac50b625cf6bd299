"""Checks that relaxed yarns are interlaced as a biaxial weft-knit: over/under codes of the periodic projection."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from knittest.errors import NumericalError

if TYPE_CHECKING:
    from knittest.fabric.relax import Cell

Array = NDArray[np.float64]

#: codes from the sinker arc on: over (O) or under (U) the warp, the weft, the course before (-) or after (+)
KNIT_CODE = "Uwarp U- O- Oweft O+ U+ U+ O+ Oweft O- U-".split()
#: what the inlays see, in any order
INLAY_CODES = {"warp": ["Oknit", "Uweft"], "weft": ["Owarp", "Uknit", "Uknit"]}
SYSTEMS = ("knit", "warp", "weft")


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

    A course's crossings with itself are left out: legs of neighbouring loops overlap in the projection of wide loops,
    exactly over the warp by symmetry, and say nothing of the interlacing.
    """
    curves = [getattr(cell, s) for s in SYSTEMS]
    starts = [c[:, :2] for c in curves]
    chords = [np.roll(c, -1, axis=0) - c for c in curves]
    for k, s in enumerate(SYSTEMS):
        chords[k][-1] += cell.periods[s]
    spacing = np.array([cell.spec.wale, cell.spec.course])
    found = []
    for a in range(3):
        for b in range(a, 3):
            for image in np.ndindex(7, 7):
                shift = np.array(image) - 3
                if a == b and shift[1] <= 0:
                    continue
                found += _pair(a, b, tuple(int(v) for v in shift), shift * spacing, starts, chords, curves)
    return found


def _pair(
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


def sequences(found: list[Crossing]) -> list[list[tuple[int, bool]]]:
    """For each yarn, its crossings (number, over) in order along it."""
    along: list[list[tuple[float, int, bool]]] = [[], [], []]
    for k, c in enumerate(found):
        along[c.over].append((c.over_place, k, True))
        along[c.under].append((c.under_place, k, False))
    return [[(k, over) for _, k, over in sorted(line)] for line in along]


def reduced(found: list[Crossing]) -> list[Crossing]:
    """Drop pairs of neighbouring crossings of the same two strands, one over the other in both (Reidemeister II)."""
    while True:
        lines = sequences(found)
        removable = _removable(found, lines)
        if removable is None:
            return found
        found = [c for k, c in enumerate(found) if k not in removable]


def _removable(found: list[Crossing], lines: list[list[tuple[int, bool]]]) -> set[int] | None:
    neighbours = set()
    for line in lines:
        n = len(line)
        for m in range(n if n > 2 else n - 1):
            (k, over), (k2, over2) = line[m], line[(m + 1) % n]
            if over == over2:
                pair = frozenset((k, k2))
                same_yarns = (found[k].over, found[k].under) == (found[k2].over, found[k2].under)
                if same_yarns and (pair, not over) in neighbours:
                    return set(pair)
                neighbours.add((pair, over))
    return None


def knit_code(found: list[Crossing], line: list[tuple[int, bool]]) -> list[str]:
    """Code of the loop along ``line``, in the notation of :data:`KNIT_CODE`."""
    code = []
    for k, over in line:
        crossing = found[k]
        other = crossing.under if over else crossing.over
        name = SYSTEMS[other]
        if other == 0:
            course = crossing.image[1] if over else -crossing.image[1]
            name = "+" if course == 1 else "-" if course == -1 else f"({course:+d})"
        code.append(("O" if over else "U") + name)
    return code


def check_topology(cell: "Cell") -> None:
    """Raise :class:`NumericalError` naming the yarn whose interlacing is wrong."""
    found = reduced(crossings(cell))
    lines = sequences(found)
    code = knit_code(found, lines[0])
    turns = [code[k:] + code[:k] for k in range(len(code))]
    if KNIT_CODE not in turns:
        raise NumericalError(f"the loop is not interlaced as plain knit: {' '.join(code)}, expected {' '.join(KNIT_CODE)}")
    for number, system in ((1, "warp"), (2, "weft")):
        seen = sorted(
            ("O" if over else "U") + SYSTEMS[found[k].under if over else found[k].over] for k, over in lines[number]
        )
        if seen != INLAY_CODES[system]:
            raise NumericalError(f"the {system} does not lie in its layer: {' '.join(seen)}")
