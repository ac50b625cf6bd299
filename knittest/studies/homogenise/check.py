"""Comparison of macro simulations with the card and the meso simulations that it was made of."""

from dataclasses import dataclass

import numpy as np

from knittest.laboratory.cell.config import CellRun
from knittest.studies.homogenise.card import (
    Array,
    FinishedTest,
    bending_stiffness,
    biaxial_forces,
    normalised_shear_force,
    tension_to_peak,
)
from knittest.studies.homogenise.plan import PlannedTest, width

#: largest deviation [%] at which the macro model reproduces the meso model
TOLERANCE = 5.0
#: shares of the fracture strain and shear angles [deg] at which forces are compared
SHARES, ANGLES = (0.5, 0.75), (10.0, 20.0, 30.0, 40.0)
#: half the range over which a force is averaged, as a share of the fracture strain and in deg
NEAR_STRAIN, NEAR_ANGLE = 0.01, 0.5


@dataclass(frozen=True)
class ScaleRow:
    """One number of both scales; ``deviation`` [%] is that of the macro model."""

    test: str
    quantity: str
    unit: str
    yarns: float
    shells: float
    deviation: float

    @property
    def is_within_tolerance(self) -> bool:
        """Tell whether the deviation is within :data:`TOLERANCE`."""
        return abs(self.deviation) <= TOLERANCE


def compare_scales(piece: PlannedTest, yarns: FinishedTest, shells: FinishedTest) -> list[ScaleRow]:
    """Rows of a test that both scales have, of the same size."""
    if piece.angle is not None:
        return _biaxial_rows(piece, yarns, shells)
    if piece.kind == "tensile":
        return _tension_rows(piece, yarns, shells)
    if piece.kind == "picture-frame":
        own, other = normalised_shear_force(yarns), normalised_shear_force(shells)
        last = min(own[0][-1], other[0][-1])
        return [
            _row(
                piece, f"normalised force at {a:g} deg", "N/mm", *(_mean_near(*c, a, NEAR_ANGLE) for c in (own, other))
            )
            for a in ANGLES
            if a <= last
        ]
    stiffness = _row(piece, "bending stiffness", "N mm", *(bending_stiffness(t) for t in (yarns, shells)))
    if isinstance(yarns.run, CellRun):
        return [stiffness]
    return [_row(piece, "chord angle", "deg", *(t.results["chord_angle_deg"] for t in (yarns, shells))), stiffness]


def _tension_rows(piece: PlannedTest, yarns: FinishedTest, shells: FinishedTest) -> list[ScaleRow]:
    """Rows of a strip in N, of a cell in N/mm."""
    own, other = tension_to_peak(yarns), tension_to_peak(shells)
    unit = "N/mm" if isinstance(yarns.run, CellRun) else "N"
    if unit == "N":
        own, other = ((strain, force * width(t.run)) for (strain, force), t in ((own, yarns), (other, shells)))
    ends = [(c[1][-1], c[0][-1]) for c in (own, other)]
    if unit == "N":
        ends = [(t.results["peak_force_n"], t.results["fracture_strain_pct"]) for t in (yarns, shells)]
    peaks, strains = zip(*ends, strict=True)
    rows = [_row(piece, "largest force", unit, *peaks), _row(piece, "strain there", "%", *strains)]
    last = own[0][-1]
    for share in SHARES:
        forces = (_mean_near(*curve, share * last, NEAR_STRAIN * last) for curve in (own, other))
        rows.append(_row(piece, f"force at {100 * share:g} % of the strain", unit, *forces))
    shared = own[0] <= other[0][-1]
    off = np.interp(own[0][shared], *other) - own[1][shared]
    worst = int(np.argmax(np.abs(off)))
    force, share = float(own[1][worst]), float(100.0 * off[worst] / own[1][-1])
    name = f"largest difference, at {own[0][worst]:.2f} %, over the peak"
    return [*rows, ScaleRow(piece.name, name, unit, force, force + float(off[worst]), share)]


def _biaxial_rows(piece: PlannedTest, yarns: FinishedTest, shells: FinishedTest) -> list[ScaleRow]:
    """Forces of both directions over the strain of the stronger pull, with deviations over the larger force."""
    own, other = biaxial_forces(yarns), biaxial_forces(shells)
    last, rows = min(float(own[0][-1]), float(other[0][-1])), []
    for share in (*SHARES, 1.0 - NEAR_STRAIN):
        forces = [
            [_mean_near(strain, f, share * last, NEAR_STRAIN * last) for f in both] for strain, *both in (own, other)
        ]
        largest = max(map(abs, forces[0]))
        for name, yarn, shell in zip(("warp", "weft"), *forces, strict=True):
            text = f"{name} force at {share * last:.3g} %, deviation over the larger force"
            rows.append(ScaleRow(piece.name, text, "N/mm", yarn, shell, 100.0 * (shell - yarn) / largest))
    return rows


def _mean_near(x: Array, y: Array, at: float, half: float) -> float:
    """Mean of y within ``half`` of ``at``, on lines between the points."""
    return float(np.interp(np.linspace(at - half, at + half, 21), x, y).mean())


def _row(piece: PlannedTest, quantity: str, unit: str, yarns: float, shells: float) -> ScaleRow:
    return ScaleRow(piece.name, quantity, unit, yarns, shells, 100.0 * (shells / yarns - 1.0) if yarns else np.inf)
