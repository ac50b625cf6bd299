"""Part of docs/validation.md on both variants in shear with inlays of the measured heights: shear-sections.json."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path

from docs import stored_runs
from docs.generate_config import table
from docs.lost import cause
from docs.stored_runs import StoredRun

FILE = Path(__file__).parent / "shear-sections.json"
#: heights of the inlays that the measured thickness wants [mm], density of their fibres [g/cm3] and area [mm2]
HEIGHTS = {"1": 0.80, "2": 0.93}
DENSITY, FIBRES = 1.53, 1.2 / 1.53
PACKINGS = (0.9, 0.75, 0.6)
#: beams in a loop and in a wave
MESHES = ((30, 4), (48, 12), (64, 16))
#: inlays of variant 1, given to both: then nothing differs but loop length, densities and sections
EQUAL = {"bending_stiffness.warp": 15.0, "bending_stiffness.weft": 12.4, "crimp.warp": 0.77, "crimp.weft": 0.77}
ANGLES = ("10", "20", "30", "40")
SHOWN = ("bending", "torsion", "stretching", "contact", "friction")


@dataclass(frozen=True)
class Case:
    """Cell of ``variant`` with ellipses of ``packing`` [-] (None: circles) of a lateral ``modulus`` [MPa] (None:
    rigid), a ``draw_in`` [%] of its loops (None: free of force), ``mesh`` beams in a loop and in a wave, and inlays
    ``equal`` to those of variant 1 or its own.
    """

    variant: str
    mesh: tuple[int, int]
    packing: float | None = None
    modulus: float | None = None
    draw_in: float | None = None
    equal: bool = False

    @property
    def ratio(self) -> float:
        """Width over height of the ellipse of the measured height."""
        assert self.packing is not None
        return 4.0 * FIBRES / (pi * self.packing * HEIGHTS[self.variant] ** 2)

    @property
    def name(self) -> str:
        """Name of its folder."""
        own = "equal" if self.equal else "own"
        return f"V{self.variant}-{own}-{self.packing}-{self.modulus}-{self.draw_in}-{self.mesh[0]}"

    @property
    def sets(self) -> tuple[str, ...]:
        """Settings by which it differs from the shipped cell."""
        loop, wave = self.mesh
        given: dict[str, float | str] = {
            "rig.max_angle": 41, "model.meso.elements_per_loop": loop, "model.meso.elements_per_wave": wave,
        }  # fmt: skip
        if self.equal:
            given |= {f"fabric.reinforcing.{field}": value for field, value in EQUAL.items()}
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


def pairs() -> Iterator[tuple[Case, Case]]:
    """Both variants alike."""
    for packing in (None, *PACKINGS):
        for mesh in MESHES:
            for draw_in in (None, 1.0):
                if draw_in is None or mesh != MESHES[0]:
                    yield _pair(Case("1", mesh, packing, draw_in=draw_in))
    for modulus in (1.0, 0.3):
        yield from (_pair(Case("1", mesh, PACKINGS[0], modulus)) for mesh in MESHES[:2])


def _pair(first: Case) -> tuple[Case, Case]:
    return first, replace(first, variant="2")


def cases() -> Iterator[Case]:
    """All cells that are stored."""
    for pair in pairs():
        yield from pair
        yield replace(pair[1], equal=True)
