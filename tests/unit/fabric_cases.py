"""Cells of the two studied variants, relaxed once for all tests, and of plain biaxial fabrics."""

from dataclasses import replace
from functools import cache

import numpy as np

from knittest.config.structure import Direction
from knittest.fabric.cell import Cell, CellSpec, LayerSpec
from knittest.fabric.relaxation import _Relaxation, relax_cell

WALE = 100 / 28
COURSE = {"V1": 100 / 28, "V2": 100 / 41}
LOOP_LENGTH = {"V1": 14.4, "V2": 13.4}
BENDING = {"V1": (18.1, 12.4), "V2": (29.6, 26.2)}


def layer(
    direction: Direction,
    crimp: float = 0.0,
    bending: float = 18.0,
    diameter: float = 0.75,
    pattern: str = "x",
    name: str = "",
) -> LayerSpec:
    """Layer of circular inlays, named by its direction if it is the only one."""
    inlays = tuple(letter == "x" for letter in pattern)
    return LayerSpec(name or direction, direction, diameter, diameter, crimp, bending, inlays)


def biaxial(
    wale: float,
    course: float,
    loop_length: float,
    *,
    crimp: float = 0.0,
    bending: tuple[float, float] = (18.1, 12.4),
    bending_knit: float = 0.05,
    diameter: float = 0.75,
    knit_diameter: float = 0.5,
) -> CellSpec:
    """Plain knit with a warp in every wale behind a weft in every course."""
    layers = (layer("warp", crimp, bending[0], diameter), layer("weft", crimp, bending[1], diameter))
    return CellSpec(wale, course, loop_length, knit_diameter, bending_knit, layers)


def crimped(spec: CellSpec, crimp: float = 0.006) -> CellSpec:
    return replace(spec, layers=tuple(replace(one, crimp=crimp) for one in spec.layers))


def points_of(cell: Cell, system: str, index: int = 0) -> np.ndarray:
    """Centre-line [mm] of yarn ``index`` of ``system``."""
    return cell.of(system)[index].points


def with_points(cell: Cell, system: str, points: np.ndarray, index: int = 0) -> Cell:
    """The cell with another centre-line of yarn ``index`` of ``system``."""
    old = cell.of(system)[index]
    return replace(cell, curves=tuple(replace(one, points=points) if one is old else one for one in cell.curves))


def start_cell(spec: CellSpec) -> Cell:
    """The start curves that a relaxation begins with."""
    return _Relaxation(spec, 1.0).cell()


def spec(variant: str, crimp: float = 0.006, loop_length: float | None = None) -> CellSpec:
    length = LOOP_LENGTH[variant] if loop_length is None else loop_length
    return biaxial(WALE, COURSE[variant], length, crimp=crimp, bending=BENDING[variant])


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


def structure(*layers: LayerSpec, loop_length: float = 14.4, stitches: str = "k") -> CellSpec:
    """Cell of ``layers`` from back to face and ``stitches`` such as kp/pk, first course first."""
    grid = tuple(tuple(1 if letter == "k" else -1 for letter in row) for row in stitches.split("/"))
    return CellSpec(WALE, WALE, loop_length, 0.5, 0.05, layers, grid)


THIN_WEFT = layer("weft", diameter=0.6)
FOUR_LAYERS = tuple(layer(way, name=f"{way}{k}") for k in (1, 2) for way in ("warp", "weft"))
WEFT_1, WEFT_2 = (layer("weft", crimp=0.003, name=f"weft{k}") for k in (1, 2))
STRUCTURES = {
    "biaxial": structure(layer("warp"), layer("weft")),
    "warp in every second wale": structure(layer("warp", 0.006, pattern="x."), layer("weft", 0.006)),
    "weft in every second course": structure(layer("warp", 0.006), layer("weft", 0.006, pattern="x.")),
    "two yarns, both in every second": structure(
        layer("warp", 0.006, pattern="x."), layer("weft", 0.006, diameter=0.6, pattern="x."), loop_length=14.0
    ),
    "90/0/90/0": structure(*FOUR_LAYERS, loop_length=18.0),
    "0/90/0 on rib": structure(WEFT_1, layer("warp", 0.003, diameter=0.6), WEFT_2, loop_length=15.0, stitches="kp"),
    "jersey": structure(),
    "rib": structure(stitches="kp"),
    "rib with weft": structure(THIN_WEFT, stitches="kp"),
    "rib with weft in every second course": structure(layer("weft", 0.003, pattern="x."), stitches="kp"),
    "rib 3x1 with weft": structure(layer("weft", 0.003), loop_length=13.8, stitches="kkkp"),
    "garter": structure(stitches="k/p"),
    "seed": structure(stitches="kp/pk"),
}  # fmt: skip


@cache
def relaxed_structure(name: str) -> Cell:
    return relax_cell(STRUCTURES[name])


def spline_points(control: np.ndarray, per_piece: int) -> np.ndarray:
    """Points [mm], ((n - 2) * per_piece, 3), on the B-spline of a chain of ``control`` points (n, 3)."""
    s = (np.arange(per_piece) / per_piece)[None, :, None]
    before, here, after = control[:-2, None], control[1:-1, None], control[2:, None]
    return (0.5 * (before + here) + s * (here - before) + 0.5 * s**2 * (before - 2.0 * here + after)).reshape(-1, 3)
