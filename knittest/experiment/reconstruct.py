"""Tensile curves from a published end point: the shape of a wavy yarn between the origin and the measured peak.

Run ``python -m knittest.experiment.reconstruct data/pham2019`` to write ``curves/tensile-v*-*.csv`` again.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.optimize import brentq

from knittest.errors import KnittestError
from knittest.experiment.tables import PublishedValue, one, published
from knittest.export.atomic import write_atomic
from knittest.history import Array

STRIP_WIDTH = 50.0  # mm
INTERVALS = 64  # 0.025 % of strain each at 1.6 %

# axial stiffness of a reinforcing yarn [N]: 59.3 GPa (Table 1) on the fibre area of 800 tex CF at 1.76 g/cm3 and
# 376 tex PA 6.6 at 1.14 g/cm3, 0.784 mm2
AXIAL_STIFFNESS = 46.5e3
MN_CM2 = 0.1  # N mm2


@dataclass(frozen=True)
class WavyYarn:
    """Axial stiffness EA [N], straightening force T* [N] and extra length c0 [-] of a harmonically wavy yarn."""

    axial_stiffness: float
    straightening_force: float
    crimp: float

    def strain(self, tension: float) -> float:
        """Strain [-] at ``tension`` [N]: eps = T/EA + c0 [1 - (1 + T/T*)^-2].

        Linear beam with the rest shape a cos(2 pi x/lambda) under tension: the amplitude falls as 1/(1 + T/T*), the
        extra length with its square.
        """
        straightened = 1.0 - (1.0 + tension / self.straightening_force) ** -2
        return tension / self.axial_stiffness + self.crimp * straightened

    def tension(self, strain: float, limit: float) -> float:
        """Tension [N] at ``strain`` [-] between 0 and ``limit`` [N]; raise ``ValueError`` when it lies outside."""
        return float(brentq(lambda tension: self.strain(tension) - strain, 0.0, limit, xtol=1e-10))


def through(axial_stiffness: float, straightening_force: float, strain: float, tension: float) -> WavyYarn:
    """The wavy yarn that has ``strain`` [-] at ``tension`` [N]; raise ``ValueError`` if a straight one is softer."""
    straightened = 1.0 - (1.0 + tension / straightening_force) ** -2
    crimp = (strain - tension / axial_stiffness) / straightened
    if crimp < 0:
        raise ValueError(f"a straight yarn stretches more than {strain:g} at {tension:g} N")
    return WavyYarn(axial_stiffness, straightening_force, crimp)


@dataclass(frozen=True)
class Reconstruction:
    """A reconstructed strip: its wavy yarn, yarns in the strip, published peak [N] and fracture strain [%]."""

    yarn: WavyYarn
    yarns: float
    peak: PublishedValue
    fracture: PublishedValue

    def curve(self) -> tuple[Array, Array]:
        """Strain [%] and force [N] of the strip, each (INTERVALS + 1,), from (0, 0) to the published end point."""
        limit = self.peak.mean / self.yarns
        strain = np.linspace(0.0, self.fracture.mean, INTERVALS + 1)
        inner = [self.yarns * self.yarn.tension(value / 100.0, limit) for value in strain[1:-1]]
        return strain, np.array([0.0, *inner, self.peak.mean])


def reconstruct(folder: Path, variant: str, direction: Literal["warp", "weft"]) -> Reconstruction:
    """Fit the wavy yarn to the end point in ``folder``'s tables; raise :class:`InputError` when a row is missing."""
    rows = published(folder, variant, direction)
    crossing = published(folder, variant, "weft" if direction == "warp" else "warp")
    peak, fracture = one(rows, "peak_force_n"), one(rows, "fracture_strain_pct")
    yarns = one(rows, "yarn_density").mean * STRIP_WIDTH / 100.0
    wave_length = 100.0 / one(crossing, "yarn_density").mean
    bending = one(rows, "bending_stiffness_mncm2").mean * MN_CM2 / yarns
    straightening = bending * (2.0 * np.pi / wave_length) ** 2
    yarn = through(AXIAL_STIFFNESS, straightening, fracture.mean / 100.0, peak.mean / yarns)
    return Reconstruction(yarn, yarns, peak, fracture)


def curve_text(folder: Path, variant: str, direction: Literal["warp", "weft"]) -> str:
    """The CSV of one reconstructed curve with the header that says what it is."""
    made = reconstruct(folder, variant, direction)
    lines = [
        "# kind: reconstructed",
        f"# source: Pham et al., Materials 2019, 12, 3693 (CC BY 4.0), {made.peak.table} end point, V{variant} {direction}",
        "# how: eps(T) = T/EA + c0 [1 - (1 + T/T*)^-2] for each yarn of the 50 mm strip; c0 set by the end point",
        f"# parameters: EA {made.yarn.axial_stiffness:.0f} N, T* {made.yarn.straightening_force:.1f} N, "
        f"c0 {100 * made.yarn.crimp:.3f} %, {made.yarns:g} yarns",
        "# use: a macro model fed with this curve must reproduce it (input)",
        "# limits: only the end point is published; agreement of a meso model's shape with this curve is not evidence",
        f"# end_x: {made.fracture.mean:g}",
        f"# end_x_sd: {made.fracture.sd:g}",
        f"# end_y: {made.peak.mean:g}",
        f"# end_y_sd: {made.peak.sd:g}",
        "strain_pct,force_n",
    ]
    strain, force = made.curve()
    lines += [f"{x:.3f},{y:.2f}" for x, y in zip(strain, force, strict=True)]
    return "\n".join(lines) + "\n"


def write_curves(folder: Path) -> list[Path]:
    """Write the four tensile curves of ``folder`` below ``curves/``; return their paths."""
    written = []
    (folder / "curves").mkdir(exist_ok=True)
    directions: tuple[Literal["warp", "weft"], ...] = ("warp", "weft")
    for variant in ("1", "2"):
        for direction in directions:
            path = folder / "curves" / f"tensile-v{variant}-{direction}.csv"
            write_atomic(path, curve_text(folder, variant, direction))
            written.append(path)
    return written


if __name__ == "__main__":
    try:
        for curve_path in write_curves(Path(sys.argv[1] if len(sys.argv) > 1 else "data/pham2019")):
            print(curve_path)
    except KnittestError as problem:
        sys.exit(str(problem))
