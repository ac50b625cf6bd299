"""Cells of the two studied variants, relaxed once for all tests."""

from functools import cache

import numpy as np

from knittest.fabric.cell import Cell, CellSpec
from knittest.fabric.relaxation import relax_cell

WALE = 100 / 28
COURSE = {"V1": 100 / 28, "V2": 100 / 41}
LOOP_LENGTH = {"V1": 14.4, "V2": 13.4}
BENDING = {"V1": (18.1, 12.4), "V2": (29.6, 26.2)}


def spec(variant: str, crimp: float = 0.006, loop_length: float | None = None) -> CellSpec:
    length = LOOP_LENGTH[variant] if loop_length is None else loop_length
    return CellSpec(WALE, COURSE[variant], length, 0.75, 0.5, crimp, crimp, *BENDING[variant], 0.05)


@cache
def relaxed(variant: str, crimp: float = 0.006, loop_length: float | None = None) -> Cell:
    return relax_cell(spec(variant, crimp, loop_length))


def ellipses(ratio: float = 1.3, packing: float = 0.9) -> dict[str, float | str]:
    """Settings of inlays whose sections have the area of the modelled circle, 0.442 mm2, and that carry what it does:
    those of all fibres lie along the loops of a strip.
    """
    section, reinforcing = "fabric.reinforcing.section.", "fabric.reinforcing."
    found: dict[str, float | str] = {
        f"{reinforcing}load_area": 0.392, f"{reinforcing}youngs_modulus": 135, f"{section}shape": "ellipse",
        f"{section}fibre_density": 1.2 / (0.442 * packing),
    }  # fmt: skip
    for direction in ("warp", "weft"):
        found |= {f"{section}packing.{direction}": packing, f"{section}width_to_height.{direction}": ratio}
    return found


def spline_points(control: np.ndarray, per_piece: int) -> np.ndarray:
    """Points [mm], ((n - 2) * per_piece, 3), on the B-spline of a chain of ``control`` points (n, 3)."""
    s = (np.arange(per_piece) / per_piece)[None, :, None]
    before, here, after = control[:-2, None], control[1:-1, None], control[2:, None]
    return (0.5 * (before + here) + s * (here - before) + 0.5 * s**2 * (before - 2.0 * here + after)).reshape(-1, 3)
