"""The periodic cell of the fabric: what determines it, its relaxed centre-lines, its file in the cache, and Munden's
constants to hold it against.
"""

import hashlib
import json
import math
from dataclasses import asdict, dataclass
from math import lcm
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from knittest.base.arrays import Array
from knittest.base.cache import Damaged, cache_folder, checksum, load_cached, save_cached
from knittest.base.history import RELAXED
from knittest.base.progress import tell
from knittest.config.fabric import Fabric
from knittest.config.structure import KNIT, Direction
from knittest.fabric.loop import polyline_length


@dataclass(frozen=True)
class LayerSpec:
    """One layer of inlays: ``width`` and ``height`` of its section [mm] (equal: a circle), crimp [-], EI [N mm^2].

    ``pattern`` tells which wales (warp) or courses (weft) have an inlay.
    """

    name: str
    direction: Direction
    width: float
    height: float
    crimp: float
    bending: float
    pattern: tuple[bool, ...] = (True,)

    @property
    def step(self) -> int:
        """Wales or courses from one inlay to the next; 1 where they are not equally spaced."""
        for step in range(1, len(self.pattern) + 1):
            repeated = self.pattern[:step] * (len(self.pattern) // step)
            if repeated == self.pattern and sum(self.pattern[:step]) == 1:
                return step
        return 1

    @property
    def half_axes(self) -> tuple[float, float]:
        """Half width and half height [mm]."""
        return 0.5 * self.width, 0.5 * self.height


@dataclass(frozen=True)
class CellSpec:
    """Inputs of the relaxation: spacings of wales and courses, lengths and diameters [mm], bending stiffness [N mm^2].

    ``layers`` are the inlays from back to face. ``stitches`` are the sides of the stitches by course and wale, 1 face
    (knit), -1 back (purl).
    """

    wale: float
    course: float
    loop_length: float
    knit_diameter: float
    bending_knit: float
    layers: tuple[LayerSpec, ...] = ()
    stitches: tuple[tuple[int, ...], ...] = ((1,),)

    @classmethod
    def of(cls, fabric: Fabric) -> "CellSpec":
        """The cell of a fabric."""
        knit = fabric.knitting
        return cls(
            wale=fabric.wale_spacing,
            course=fabric.course_spacing,
            loop_length=fabric.loop_length_mm,
            knit_diameter=knit.beam_diameter_mm,
            bending_knit=knit.bending_stiffness_n_mm2,
            layers=tuple(
                LayerSpec(i.name, i.direction, *i.section_mm, i.crimp, i.bending, i.pattern) for i in fabric.inlays
            ),
            stitches=fabric.grid,
        )

    @property
    def repeat(self) -> tuple[int, int]:
        """Wales and courses after which the structure repeats."""
        wales = lcm(len(self.stitches[0]), *(len(one.pattern) for one in self.layers if one.direction == "warp"))
        return wales, lcm(len(self.stitches), *(len(one.pattern) for one in self.layers if one.direction == "weft"))

    @property
    def size(self) -> Array:
        """Extent (2,) [mm] of the cell along x and y."""
        return np.array(self.repeat) * [self.wale, self.course]

    @property
    def systems(self) -> tuple[str, ...]:
        """Names of the yarn systems: the loops, and the layers from back to face."""
        return (KNIT, *(one.name for one in self.layers))

    @property
    def half_axes(self) -> dict[str, tuple[float, float]]:
        """Half width and half height [mm] of each yarn system, equal for circles."""
        knit = 0.5 * self.knit_diameter
        return {KNIT: (knit, knit)} | {one.name: one.half_axes for one in self.layers}

    @property
    def radius(self) -> dict[str, float]:
        """Radius [mm] of each yarn system, of ellipses that of the circle of their area."""
        return {s: a if a == b else math.sqrt(a * b) for s, (a, b) in self.half_axes.items()}

    @property
    def height(self) -> float:
        """Half the sum of the heights [mm] of all layers."""
        return sum(one.half_axes[1] for one in self.layers)

    @property
    def is_plain(self) -> bool:
        """Tell whether all stitches are knit."""
        return all(side > 0 for row in self.stitches for side in row)

    def side(self, wale: int, course: int) -> int:
        """Side of a stitch: 1 face, -1 back."""
        row = self.stitches[course % len(self.stitches)]
        return row[wale % len(row)]

    def axis(self, system: str) -> int:
        """Axis along which the yarns of ``system`` run: 0 (x) loops and weft, 1 (y) warp."""
        return int(any(one.name == system and one.direction == "warp" for one in self.layers))


@dataclass(frozen=True)
class Curve:
    """Centre-line of one yarn over its ``period`` (3,) [mm]: ``points`` (n, 3), the last one step before the end.

    ``index`` is the course of loops and weft and the wale of warp, counted from the corner of the cell.
    """

    system: str
    index: int
    points: Array
    period: Array

    @property
    def closed(self) -> Array:
        """Points [mm], (n + 1, 3), up to and including the end of the period."""
        return np.vstack([self.points, self.points[:1] + self.period])

    @property
    def length(self) -> float:
        """Arc length of one period [mm]."""
        return polyline_length(self.closed)


@dataclass(frozen=True)
class Cell:
    """Relaxed centre-lines of a repeat: the courses of loops, then the layers of inlays from back to face.

    Warp w lies at x = (w + 1/2) W on average, the needle arc of wale w at x = w W, weft c at y = c C and the middle of
    the thickness at z = 0. Penetrations are over the smaller radius [-]: ``deepest`` at rest and ``worst`` on the way;
    ``residual`` largest nodal force at rest [N]; ``iterations`` spent.
    """

    spec: CellSpec
    curves: tuple[Curve, ...]
    deepest: float
    worst: float
    residual: float
    iterations: int

    def of(self, system: str) -> list[Curve]:
        """Centre-lines of the yarns of ``system``."""
        return [one for one in self.curves if one.system == system]

    @property
    def faces(self) -> tuple[float, float]:
        """Lowest and highest yarn surface [mm]."""
        curves = [(one.points[:, 2], self.spec.half_axes[one.system][1]) for one in self.curves]
        return float(min(z.min() - r for z, r in curves)), float(max(z.max() + r for z, r in curves))

    def place_name(self, curve: Curve) -> str:
        """Name of the wale or course of ``curve``, counted from 1."""
        return f"{'wale' if self.spec.axis(curve.system) else 'course'} {curve.index + 1}"

    @property
    def thickness(self) -> float:
        """Distance of the outermost yarn surfaces [mm]."""
        return self.faces[1] - self.faces[0]

    @property
    def loop_length(self) -> float:
        """Mean length [mm] of a loop."""
        return self.length(KNIT) / math.prod(self.spec.repeat)

    @property
    def length_error(self) -> float:
        """Relative deviation [-] of the mean loop length of a course, the largest of all courses."""
        wanted = self.spec.repeat[0] * self.spec.loop_length
        return max((one.length / wanted - 1.0 for one in self.of(KNIT)), key=abs)

    def length(self, system: str) -> float:
        """Length [mm] of all yarns of ``system`` in the cell."""
        return sum(one.length for one in self.of(system))

    def crimp(self, system: str) -> float:
        """Extra length of relaxed inlays of ``system`` over their period [-]."""
        curves = self.of(system)
        return self.length(system) / sum(float(np.linalg.norm(one.period)) for one in curves) - 1.0


# Relaxed cells on disk, keyed by their inputs and by the sources that relaxed them, with a checksum inside.

#: sources that decide the shape of a cell besides its inputs
SOURCES = (
    "fabric/loop.py",
    "fabric/relaxation.py",
    "fabric/topology.py",
    "kernels/relaxation.py",
    "kernels/section.py",
)
NUMBERS = ("deepest", "worst", "residual", "iterations")
DIGITS = 24


def cell_path(spec: CellSpec) -> Path | None:
    """File of the cell of ``spec``; None where nothing is cached."""
    folder = cache_folder("cells")
    return None if folder is None else folder / f"{_key(spec)}.npz"


def load_cell(spec: CellSpec) -> Cell | None:
    """Cached cell; None if there is none, or with a line on stderr if it is damaged."""
    path = cell_path(spec)
    try:
        arrays = load_cached(path, _key(spec))
        return None if arrays is None else _cell(spec, arrays)
    except (Damaged, KeyError, TypeError, ValueError) as error:
        tell(f"{path}: {error}; the cached cell is relaxed again")
        return None


def save_cell(cell: Cell) -> None:
    """Write ``cell`` whole or not at all; if the disk refuses, the next run only relaxes again."""
    save_cached(cell_path(cell.spec), _key(cell.spec), _arrays(cell))


def cell_digest(cell: Cell) -> str:
    """Digest of the centre-lines of ``cell`` and of what it was relaxed from."""
    return checksum({"key": np.array(_key(cell.spec)), **_arrays(cell)})


def _cell(spec: CellSpec, arrays: dict[str, np.ndarray]) -> Cell:
    """Cell from its ``arrays``; raises :class:`Damaged` for invalid ones."""
    curves = []
    for system, index in curve_names(spec):
        points = np.asarray(arrays[f"{system}-{index}"], dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3 or len(points) < 4 or not np.isfinite(points).all():
            raise Damaged(f"no centre-line of {system} {index}")
        curves.append(Curve(system, index, points, period_of(spec, system)))
    deepest, worst, residual, iterations = (float(arrays[name]) for name in NUMBERS)
    return Cell(spec, tuple(curves), deepest, worst, residual, int(iterations))


def _arrays(cell: Cell) -> dict[str, Any]:
    curves = {f"{one.system}-{one.index}": one.points for one in cell.curves}
    return curves | {name: np.asarray(getattr(cell, name)) for name in NUMBERS}


def curve_names(spec: CellSpec) -> list[tuple[str, int]]:
    """System and index of the yarns of a cell, in the order of :attr:`Cell.curves`."""
    wales, courses = spec.repeat
    found = [(KNIT, course) for course in range(courses)]
    for one in spec.layers:
        count = wales if one.direction == "warp" else courses
        found += [(one.name, k) for k in range(count) if one.pattern[k % len(one.pattern)]]
    return found


def period_of(spec: CellSpec, system: str) -> Array:
    """Period vector (3,) [mm] of the yarns of ``system``."""
    axis, period = spec.axis(system), np.zeros(3)
    period[axis] = spec.size[axis]
    return period


def _key(spec: CellSpec) -> str:
    """Digest of the inputs of a cell and of the sources that relax it."""
    package = Path(__file__).parent.parent
    digest = hashlib.sha256(json.dumps(asdict(spec), sort_keys=True).encode())
    for name in SOURCES:
        digest.update((package / name).read_bytes())
    return digest.hexdigest()[:DIGITS]


# Constants of a plain knit by Munden (1959), J. Text. Inst. 50, T448: densities times the length of a loop.
#
# The knit relaxes towards values that hold for any yarn and length; with them it is seen whether that of a fabric
# with inlays is stretched.

#: stitches an area times the square of the loop length of a relaxed plain knit [-], 19 to 21.6
STITCHES = 20.0


class Munden(NamedTuple):
    """Courses and wales a length, and stitches an area, times the loop length or its square [-]."""

    courses: float
    wales: float
    stitches: float

    @classmethod
    def of(cls, spec: CellSpec, loop_shortening: float = 0.0) -> "Munden":
        """Constants of a cell whose loops are shorter by ``loop_shortening`` [-] than its loop length."""
        length = (1.0 - loop_shortening) * spec.loop_length
        courses, wales = length / spec.course, length / spec.wale
        return cls(courses, wales, courses * wales)

    def __str__(self) -> str:
        (low, high), (least, most) = RELAXED.values()
        return (
            f"{self.courses:.2f}, {self.stitches:.1f} (relaxed plain knits {low:g} to {high:g}, {least:g} to {most:g})"
        )
