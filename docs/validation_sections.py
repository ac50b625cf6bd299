"""Part of docs/validation.md on both variants in shear with inlays of the measured heights: from shear-sections.json."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi
from pathlib import Path

FILE = Path(__file__).parent / "shear-sections.json"
#: heights of the inlays that the measured thickness wants [mm], density of their fibres [g/cm3] and area [mm2]
HEIGHTS = {"1": 0.80, "2": 0.93}
DENSITY, FIBRES = 1.53, 1.2 / 1.53
PACKINGS = (0.9, 0.75, 0.6)
#: beams in a loop and in a wave
MESHES = ((30, 4), (48, 12), (64, 16))


@dataclass(frozen=True)
class Case:
    """Cell of ``variant`` with ellipses of ``packing`` [-] (None: circles) of a lateral ``modulus`` [MPa] (None:
    rigid), a ``draw_in`` [%] of its loops (None: free of force) and ``mesh`` beams in a loop and in a wave.
    """

    variant: str
    mesh: tuple[int, int]
    packing: float | None = None
    modulus: float | None = None
    draw_in: float | None = None

    @property
    def ratio(self) -> float:
        """Width over height of the ellipse of the measured height."""
        assert self.packing is not None
        return 4.0 * FIBRES / (pi * self.packing * HEIGHTS[self.variant] ** 2)

    @property
    def name(self) -> str:
        """Name of its folder."""
        return f"V{self.variant}-{self.packing}-{self.modulus}-{self.draw_in}-{self.mesh[0]}"

    @property
    def sets(self) -> tuple[str, ...]:
        """Settings by which it differs from the shipped cell."""
        loop, wave = self.mesh
        given = {
            "rig.max_angle": 41, "model.meso.elements_per_loop": loop, "model.meso.elements_per_wave": wave,
        }  # fmt: skip
        if self.draw_in is not None:
            given["fabric.knitting.draw_in"] = self.draw_in
        section = "fabric.reinforcing.section"
        if self.packing is not None:
            given |= {f"{section}.shape": "ellipse", f"{section}.fibre_density": DENSITY}
            for direction in ("warp", "weft"):
                given[f"{section}.packing.{direction}"] = self.packing
                given[f"{section}.width_to_height.{direction}"] = round(self.ratio, 3)
        if self.modulus is not None:
            given[f"{section}.flattening.modulus"] = self.modulus
        return tuple(f"{name}={value}" for name, value in given.items())


def cases() -> Iterator[Case]:
    """All cells that are stored, variant by variant."""
    for packing in (None, *PACKINGS):
        for mesh in MESHES:
            for draw_in in (None, 1.0):
                if draw_in is None or mesh != MESHES[0]:
                    yield from (Case(v, mesh, packing, draw_in=draw_in) for v in HEIGHTS)
    for modulus in (1.0, 0.3):
        for mesh in MESHES[:2]:
            yield from (Case(v, mesh, PACKINGS[0], modulus) for v in HEIGHTS)
