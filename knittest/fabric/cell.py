"""The periodic cell of the fabric: what determines it, and its relaxed centre-lines."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.config.fabric import Fabric
from knittest.fabric.spline import polyline_length

Array = NDArray[np.float64]

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

    def closed(self, system: str) -> Array:
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
        return polyline_length(self.closed("knit")) / self.spec.loop_length - 1.0

    def crimp(self, system: str) -> float:
        """Extra length of a relaxed warp or weft over its period [-]."""
        return polyline_length(self.closed(system)) / float(np.linalg.norm(self.periods[system])) - 1.0
