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
#: width over height and area [mm2] of ellipses of fewer fibres, with a modulus [GPa] that keeps their EA
NARROW, NARROW_FIBRES, NARROW_MODULUS = 1.25, 0.56, 94.5
#: beams in a loop and in a wave
COARSE, USUAL, FINE = MESHES = ((30, 4), (48, 12), (60, 12))
#: meshes and moduli [MPa] of sections that flatten
SOFT = ((COARSE, 1.0), (USUAL, 1.0))
#: inlays of variant 1, given to both: then nothing differs but loop length, densities and sections
EQUAL = {"bending_stiffness.warp": 15.0, "bending_stiffness.weft": 12.4, "crimp.warp": 0.77, "crimp.weft": 0.77}
CIRCLE, ROUND, ELLIPSE = "circles of 0.75", "circles of the heights", "ellipses of fewer fibres"
ANGLES = ("10", "20", "30")
SHOWN = ("bending", "torsion", "stretching", "contact", "friction")


@dataclass(frozen=True)
class Case:
    """Cell of ``variant`` with inlays of a ``shape``, one of the above or the packing [-] of all fibres in an ellipse of
    the measured height, of a lateral ``modulus`` [MPa] (None: rigid), a ``draw_in`` [%] of its loops (None: free of
    force), ``mesh`` beams in a loop and in a wave, and inlays ``equal`` to those of variant 1 or its own.
    """

    variant: str
    mesh: tuple[int, int]
    shape: str | float = CIRCLE
    modulus: float | None = None
    draw_in: float | None = None
    equal: bool = False

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
        return f"V{self.variant}-{own}-{self.shape}-{self.modulus}-{self.draw_in}-{self.mesh[0]}".replace(" ", "-")

    @property
    def sets(self) -> tuple[str, ...]:
        """Settings by which it differs from the shipped cell."""
        loop, wave = self.mesh
        given: dict[str, float | str] = {
            "rig.max_angle": 31, "model.meso.elements_per_loop": loop, "model.meso.elements_per_wave": wave,
        }  # fmt: skip
        given |= {f"fabric.reinforcing.{field}": value for field, value in EQUAL.items() if self.equal}
        given |= {f"fabric.reinforcing.{field}": value for field, value in self._section()}
        if self.modulus is not None:
            given["fabric.reinforcing.section.flattening.modulus"] = self.modulus
        if self.draw_in is not None:
            given["fabric.knitting.draw_in"] = self.draw_in
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
    first += [Case("1", mesh, shape, modulus) for shape in (ELLIPSE, PACKINGS[0]) for mesh, modulus in SOFT]
    first += [Case("1", mesh, draw_in=1.0) for mesh in (USUAL, FINE)]
    first += [Case("1", USUAL, shape, draw_in=1.0) for shape in (ROUND, ELLIPSE, PACKINGS[0])]
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


INTRO = """
### With sections as measured

The measured thicknesses want inlays {first:.2f} mm (variant 1) and {second:.2f} mm high (2). All fibres of 1200 tex at
{density} g/cm³ then make ellipses whose width follows from their packing, which nobody measured. Cells as above, but with
the parameters `calibrated` and loops free of force unless a draw-in is stated; the same rule. "beams" are those of a
loop and of a wave. V2/V1, and in brackets with the inlays of variant 1 in both, so that loop length, densities and
sections alone differ:
""".strip()
ENERGIES = """
On the finest of these meshes, energy taken up from rest [mJ a cell] and sum of the normal forces of all
crossings, variant 1; 2:
""".strip()
HEAD = ("sections, V1; V2 [mm]", "draw-in [%]", "beams", "thickness, V1; V2 [mm]")


def sections_part(runs: Sequence[StoredRun] | None = None) -> list[str]:
    """Blocks of the part."""
    found = {(run.options["variant"], tuple(run.options["sets"])): run for run in runs or stored_runs.load(FILE)}
    intro = INTRO.format(first=HEIGHTS["1"], second=HEIGHTS["2"], density=DENSITY)
    head = (*HEAD, *(f"{angle} deg" for angle in ANGLES), "verdict")
    rows = [_row(first, second, found) for first, second in pairs()]
    return [intro, table(head, rows), ENERGIES, table(*_energies(found)), MEANING]


Found = Mapping[tuple[str, tuple[str, ...]], StoredRun]


def _of(found: Found, case: Case) -> StoredRun:
    return found[case.variant, case.sets]


def _row(first: Case, second: Case, found: Found) -> list[str]:
    runs = [_of(found, case) for case in (first, second)]
    named = [_sections(first, second), _drawn(first), _beams(first)]
    thick = "; ".join(f"{run.results['cell_thickness_at_rest_mm']:.2f}" if run.results else "-" for run in runs)
    lost = "; ".join(f"V{case.variant}: {cause(run.refused[0])}" for case, run in zip((first, second), runs) if run.refused)
    if lost:
        return [*named, thick, *["-"] * len(ANGLES), f"refused ({lost})"]
    ratios = [_ratio(runs[1], runs[0], angle) for angle in ANGLES]
    alike = equal(second)
    other = None if alike is None else _of(found, alike)
    others = ["" if other is None or other.refused else f" ({_ratio(other, runs[0], angle):.2f})" for angle in ANGLES]
    cells = [f"{ratio:.2f}{other}" for ratio, other in zip(ratios, others, strict=True)]
    return [*named, thick, *cells, verdict(ratios)]


def verdict(ratios: Sequence[float]) -> str:
    """Verdict on variant 2 below variant 1 at all of :data:`ANGLES`, with the angles at which it is not."""
    above = [angle for angle, ratio in zip(ANGLES, ratios, strict=True) if not ratio < 1.0]
    return f"**FAILED** at {', '.join(above)} deg" if above else "passed"


def _ratio(over: StoredRun, under: StoredRun, angle: str) -> float:
    name = f"cell_shear_n_per_mm_at_deg.{angle}"
    return float(over.results[name]) / float(under.results[name])


def _energies(found: Found) -> tuple[Sequence[str], list[list[str]]]:
    """Header and lines of the energies by mechanism, of the finest mesh on which both variants count."""
    finest: dict[tuple[str | float, float | None, float | None], tuple[Case, Case]] = {}
    for pair in pairs():
        if not any(_of(found, case).refused for case in pair):
            finest[pair[0].shape, pair[0].modulus, pair[0].draw_in] = pair
    lines = []
    for first, second in finest.values():
        runs = [_of(found, case).results for case in (first, second)]
        named = [_sections(first, second), _drawn(first), _beams(first)]
        for angle in ANGLES:
            parts = ("; ".join(f"{abs(r[f'{name}.{angle}']):.4f}" for r in runs) for name in SHOWN)
            normal = "; ".join(f"{r[f'normal_n.{angle}']:.2f}" for r in runs)
            lines.append([*named, angle, *parts, normal])
    return (*HEAD[:3], "angle [deg]", *SHOWN, "normal forces [N]"), lines


def _sections(first: Case, second: Case) -> str:
    """Sizes of the sections of both variants with what they are made of."""
    if first.shape == CIRCLE:
        return CIRCLE
    one = "; ".join(f"{c.ratio * c.height:.2f} x {c.height:.2f}" for c in (first, second))
    of = f"packing {first.shape:g}" if isinstance(first.shape, float) else first.shape
    soft = "" if first.modulus is None else f", flattening at {first.modulus:g} MPa"
    return f"{one} ({of}{soft})"


def _drawn(case: Case) -> str:
    return "-" if case.draw_in is None else f"{case.draw_in:g}"


def _beams(case: Case) -> str:
    return "{}, {}".format(*case.mesh)
