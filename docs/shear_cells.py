"""Cells of both variants in shear whose inlays have the measured heights, as benchmarks/shear_sections.py runs them."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import pi

#: heights of the inlays that the measured thickness wants [mm], density of their fibres [g/cm3] and area [mm2]
HEIGHTS = {"1": 0.80, "2": 0.93}
DENSITY, FIBRES = 1.53, 1.2 / 1.53
PACKINGS = (0.9, 0.75, 0.6)
#: width over height and area [mm2] of ellipses of fewer fibres, with a modulus [GPa] that keeps their EA
NARROW, NARROW_FIBRES, NARROW_MODULUS = 1.25, 0.56, 94.5
#: beams in a loop and in a wave
USUAL, FINE = MESHES = ((48, 12), (64, 16))
#: modulus [MPa] of sections that flatten, draw-ins [%], and the share of the critical step of flatter sections, on
#: which more contacts press
SOFT, DRAW_INS, CAREFUL = 1.0, (0.5, 1.0), 0.6
#: share [%] of the path from which energies are judged: the first degree does no work on loops free of force; radii
#: that yarns may slide past each other
JUDGED_FROM, SLIDE = 12, 4
#: angle [deg] to which cells with ellipses run again
SHORT = 21
#: inlays of variant 1, given to both: then nothing differs but loop length, densities and sections
EQUAL = {"bending_stiffness.warp": 15.0, "bending_stiffness.weft": 12.4, "crimp.warp": 0.77, "crimp.weft": 0.77}
CIRCLE, ROUND, ELLIPSE = "circles of 0.75", "circles of the heights", "ellipses of fewer fibres"


@dataclass(frozen=True)
class Case:
    """Cell of ``variant`` with inlays of a ``shape``, one of the above or the packing [-] of all fibres in an ellipse
    of the measured height, of a lateral ``modulus`` [MPa] (None: rigid), a ``draw_in`` [%] of its loops (None: free of
    force), ``mesh`` beams in a loop and in a wave, inlays ``equal`` to those of variant 1 or its own, and the shear
    angle [deg] at which it is to ``end`` (None: 31).
    """

    variant: str
    mesh: tuple[int, int]
    shape: str | float = CIRCLE
    modulus: float | None = None
    draw_in: float | None = None
    equal: bool = False
    end: int | None = None

    @property
    def height(self) -> float:
        """Height of the section [mm]."""
        return 0.75 if self.shape == CIRCLE else HEIGHTS[self.variant]

    @property
    def ratio(self) -> float:
        """Width over height of the section [-]."""
        if isinstance(self.shape, float):
            return 4.0 * FIBRES / (pi * self.shape * self.height**2)
        return NARROW if self.shape == ELLIPSE else 1.0

    @property
    def name(self) -> str:
        """Name of its folder."""
        own = "equal" if self.equal else "own"
        short = "" if self.end is None else f"-{self.end}"
        name = f"V{self.variant}-{own}-{self.shape}-{self.modulus}-{self.draw_in}-{self.mesh[0]}{short}"
        return name.replace(" ", "-")

    @property
    def sets(self) -> tuple[str, ...]:
        """Settings by which it differs from the shipped cell."""
        loop, wave = self.mesh
        given: dict[str, float | str] = {
            "rig.max_angle": 31, "rig.evaluated_from": JUDGED_FROM, "rig.max_slip": SLIDE,
            "model.meso.elements_per_loop": loop, "model.meso.elements_per_wave": wave,
        }  # fmt: skip
        given |= {f"fabric.reinforcing.{field}": value for field, value in EQUAL.items() if self.equal}
        given |= {f"fabric.reinforcing.{field}": value for field, value in self._section()}
        if self.end is not None:
            given["rig.end_angle"] = self.end
        if self.shape in PACKINGS[1:]:
            given["solver.safety"] = CAREFUL
        if self.modulus is not None:
            given["fabric.reinforcing.section.flattening.modulus"] = self.modulus
        if self.draw_in is not None:
            given["fabric.knitting.loop_shortening"] = self.draw_in
        return tuple(f"{name}={value}" for name, value in given.items())

    def _section(self) -> Iterator[tuple[str, float | str]]:
        """Fields of the inlays by which their section is told."""
        if isinstance(self.shape, str) and self.shape != ELLIPSE:
            yield from [("beam_diameter", self.height)] if self.shape == ROUND else []
            return
        packing, density = (0.9, self._density) if self.shape == ELLIPSE else (self.shape, DENSITY)
        if self.shape == ELLIPSE:
            yield from (("load_area", NARROW_FIBRES), ("youngs_modulus", NARROW_MODULUS))
        yield from (("section.shape", "ellipse"), ("section.fibre_density", density))
        for direction in ("warp", "weft"):
            yield f"section.packing.{direction}", packing
            yield f"section.width_to_height.{direction}", round(self.ratio, 3)

    @property
    def _density(self) -> float:
        """Density [g/cm3] of fibres that fill the narrow ellipse to 0.9."""
        return round(1.2 / (0.9 * 0.25 * pi * self.ratio * self.height**2), 4)


def pairs() -> Iterator[tuple[Case, Case]]:
    """Both variants alike."""
    first = [Case("1", mesh, shape) for shape in (CIRCLE, ROUND, ELLIPSE, PACKINGS[0]) for mesh in MESHES]
    first += [Case("1", USUAL, packing) for packing in PACKINGS[1:]]
    first += [Case("1", USUAL, shape, SOFT) for shape in (ELLIPSE, PACKINGS[0])]
    drawn = [(shape, draw_in) for shape in (CIRCLE, ROUND, PACKINGS[0]) for draw_in in DRAW_INS]
    first += [Case("1", mesh, shape, draw_in=draw_in) for shape, draw_in in drawn for mesh in MESHES]
    # ellipses snap from 20 deg on: what they give before
    first += [replace(case, end=SHORT) for case in first if case.shape in (ELLIPSE, *PACKINGS) and not case.modulus]
    yield from map(_pair, first)


def _pair(first: Case) -> tuple[Case, Case]:
    return first, replace(first, variant="2")


def equal(case: Case) -> Case | None:
    """The same cell with the inlays of variant 1, where it is stored."""
    return replace(case, equal=True) if case.mesh == USUAL and case.modulus is None else None


def cases() -> Iterator[Case]:
    """All cells that are stored."""
    for pair in pairs():
        yield from pair
        if alike := equal(pair[1]):
            yield alike
