"""The periodic cell of the fabric: what determines it, its relaxed centre-lines, its file in the cache, and Munden's
constants to hold it against.
"""

import hashlib
import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from knittest.base.arrays import Array
from knittest.base.cache import Damaged, cache_folder, checksum, load_cached, save_cached
from knittest.base.history import RELAXED
from knittest.base.progress import tell
from knittest.config.fabric import Fabric
from knittest.fabric.loop import polyline_length

SYSTEMS = ("knit", "warp", "weft")


@dataclass(frozen=True)
class CellSpec:
    """Inputs of the relaxation: spacings, lengths and diameters [mm], crimps [-], bending stiffnesses [N mm^2].

    ``warp`` and ``weft`` are width and height [mm] of inlays whose section is an ellipse that lies flat, None where it
    is the circle of ``diameter``.
    """

    wale: float
    course: float
    loop_length: float
    diameter: float
    knit_diameter: float
    crimp_warp: float
    crimp_weft: float
    bending_warp: float
    bending_weft: float
    bending_knit: float
    warp: tuple[float, float] | None = None
    weft: tuple[float, float] | None = None

    @classmethod
    def of(cls, fabric: Fabric) -> "CellSpec":
        """The cell of a fabric."""
        yarn, knit = fabric.reinforcing, fabric.knitting
        return cls(
            wale=fabric.wale_spacing,
            course=fabric.course_spacing,
            loop_length=fabric.loop_length_mm,
            diameter=yarn.beam_diameter_mm,
            knit_diameter=knit.beam_diameter_mm,
            crimp_warp=yarn.crimp_fraction.warp,
            crimp_weft=yarn.crimp_fraction.weft,
            bending_warp=yarn.bending_stiffness_n_mm2.warp,
            bending_weft=yarn.bending_stiffness_n_mm2.weft,
            bending_knit=knit.bending_stiffness_n_mm2,
            warp=None if yarn.section is None else yarn.ellipse_mm(yarn.section, "warp"),
            weft=None if yarn.section is None else yarn.ellipse_mm(yarn.section, "weft"),
        )

    @property
    def half_axes(self) -> dict[str, tuple[float, float]]:
        """Half width and half height [mm] of each yarn system, equal for circles."""
        circle = (self.diameter, self.diameter)
        sizes = {"knit": (self.knit_diameter, self.knit_diameter), "warp": self.warp or circle}
        sizes["weft"] = self.weft or circle
        return {system: (0.5 * width, 0.5 * height) for system, (width, height) in sizes.items()}

    @property
    def radius(self) -> dict[str, float]:
        """Radius [mm] of each yarn system, of ellipses that of the circle of their area."""
        return {s: a if a == b else math.sqrt(a * b) for s, (a, b) in self.half_axes.items()}

    @property
    def height(self) -> float:
        """Mean height [mm] of the inlays."""
        return self.half_axes["warp"][1] + self.half_axes["weft"][1]

    @property
    def periods(self) -> dict[str, Array]:
        """Period vector [mm], (3,), of each yarn system: knit and weft run along x, warp along y."""
        along_x, along_y = np.array([self.wale, 0.0, 0.0]), np.array([0.0, self.course, 0.0])
        return {"knit": along_x, "warp": along_y, "weft": along_x}


@dataclass(frozen=True)
class Cell:
    """Relaxed centre-lines over one period [mm], (n, 3): knit from sinker arc to sinker arc, warp, weft.

    The last point of each is one step before the period ends. The warp lies at x = W/2 on average, the needle arc at
    x = 0, the weft at y = 0 and the middle of the thickness at z = 0. Penetrations are over the smaller radius [-]:
    ``deepest`` at rest and ``worst`` on the way; ``residual`` largest nodal force at rest [N]; ``iterations`` spent.
    """

    spec: CellSpec
    knit: Array
    warp: Array
    weft: Array
    deepest: float
    worst: float
    residual: float
    iterations: int

    @property
    def periods(self) -> dict[str, Array]:
        """Period vector [mm], (3,), of each yarn system."""
        return self.spec.periods

    def closed_curve(self, system: str) -> Array:
        """Centre-line [mm], (n + 1, 3), of ``system`` up to and including the end of its period."""
        curve: Array = getattr(self, system)
        return np.vstack([curve, curve[:1] + self.periods[system]])

    @property
    def faces(self) -> tuple[float, float]:
        """Lowest and highest yarn surface [mm]."""
        curves = [(getattr(self, s)[:, 2], self.spec.half_axes[s][1]) for s in SYSTEMS]
        return float(min(z.min() - r for z, r in curves)), float(max(z.max() + r for z, r in curves))

    @property
    def thickness(self) -> float:
        """Distance of the outermost yarn surfaces [mm]."""
        return self.faces[1] - self.faces[0]

    @property
    def length_error(self) -> float:
        """Relative deviation of the loop length [-]."""
        return polyline_length(self.closed_curve("knit")) / self.spec.loop_length - 1.0

    def crimp(self, system: str) -> float:
        """Extra length of a relaxed warp or weft over its period [-]."""
        return polyline_length(self.closed_curve(system)) / float(np.linalg.norm(self.periods[system])) - 1.0


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
    curves = [np.asarray(arrays[s], dtype=np.float64) for s in SYSTEMS]
    if any(c.ndim != 2 or c.shape[1] != 3 or len(c) < 4 or not np.isfinite(c).all() for c in curves):
        raise Damaged("no centre-lines of three yarn systems")
    knit, warp, weft = curves
    deepest, worst, residual, iterations = (float(arrays[name]) for name in NUMBERS)
    return Cell(spec, knit, warp, weft, deepest, worst, residual, int(iterations))


def _arrays(cell: Cell) -> dict[str, Any]:
    return {name: np.asarray(getattr(cell, name)) for name in (*SYSTEMS, *NUMBERS)}


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
    def of(cls, spec: CellSpec, draw_in: float = 0.0) -> "Munden":
        """Constants of a cell whose loops are shorter by ``draw_in`` [-] than its loop length."""
        length = (1.0 - draw_in) * spec.loop_length
        courses, wales = length / spec.course, length / spec.wale
        return cls(courses, wales, courses * wales)

    def __str__(self) -> str:
        (low, high), (least, most) = RELAXED.values()
        return (
            f"{self.courses:.2f}, {self.stitches:.1f} (relaxed plain knits {low:g} to {high:g}, {least:g} to {most:g})"
        )
