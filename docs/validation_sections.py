"""Part of docs/validation.md on both variants in shear with inlays of the measured heights: shear-sections.json."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from docs.generate_config import table
from docs.lost import cause
from docs.shear_cells import (
    CIRCLE,
    DENSITY,
    DRAW_INS,
    FINE,
    HEIGHTS,
    NARROW,
    PACKINGS,
    ROUND,
    SHORT,
    Case,
    equal,
    pairs,
)
from docs.stored_runs import StoredRun, load

FILE = Path(__file__).parent / "shear-sections.json"
ANGLES = ("10", "20", "30")
SHOWN = ("bending", "torsion", "stretching", "contact", "friction")
INTRO = """
### With sections as measured

The measured thicknesses (2.22 ± 0.08 and 2.63 ± 0.15 mm) require inlays {first:.2f} mm (variant 1) and {second:.2f} mm
(variant 2) high. Sections of these heights, 1200 tex, {density} g/cm³:

- Ellipses with all fibres. Their width follows from the packing, which was not measured.
- Circles, and ellipses {narrow} times as wide as high. Both hold fewer fibres than the yarns.

Cells of `quick`, parameters `calibrated`, checks from 12 % of the path. Loops carry no force unless a loop shortening
is stated. Cells with ellipses were also run to 21 deg only. *Elements* are those of a loop and of a crimp wave. The
table has V2/V1, and in brackets V2/V1 with the inlays of variant 1 in both, so that only loop length, densities and
sections differ. The rule is the same.
""".strip()
ENERGIES = """
Energy [mJ per cell] since the initial state, and sum of the normal forces of all crossings (V1; V2), on the finest
mesh on which both variants passed the checks:
""".strip()
MEANING = """
**Meaning.** While loops carry no force, sections of the measured heights do not bring variant 2 below variant 1.
Circles of these heights give both fabrics their measured thickness. With them V2/V1 changes from {circle10:.2f} to
{round10:.2f} at 10 deg and from {circle30:.2f} to {round30:.2f} at 30 deg, where the loops of variant 2 jam on its
higher inlays. Ellipses with all fibres (packing 0.9) also give the thickness. With them V2/V1 is {free10:.2f} at 10
and {free20:.2f} at 20 deg; a loop shortening of 0.5 % gives {half10:.2f} and {half20:.2f}, one of 1 % {one10:.2f} and
{one20:.2f}. So the order depends on loop tension here too, and 0.5 % is enough. Beyond 20 deg loops snap over the
ellipses; on the finer mesh these cells are rejected for overlap without force. Flatter sections (packing 0.75 and 0.6)
snap or jam earlier.
""".strip()
HEAD = ("sections, V1; V2 [mm]", "loop shortening [%]", "elements", "thickness, V1; V2 [mm]")
Found = Mapping[tuple[str, tuple[str, ...]], StoredRun]


def sections_part(runs: Sequence[StoredRun] | None = None) -> list[str]:
    """Blocks of the part."""
    found = {(run.options["variant"], tuple(run.options["sets"])): run for run in runs or load(FILE)}
    intro = INTRO.format(first=HEIGHTS["1"], second=HEIGHTS["2"], density=DENSITY, narrow=NARROW)
    head = (*HEAD, *(f"{angle} deg" for angle in ANGLES), "verdict")
    rows = [_row(first, second, found) for first, second in pairs()]
    return [intro, table(head, rows), ENERGIES, table(*_energies(found)), _meaning(found)]


def _meaning(found: Found) -> str:
    """Text on what the cells give, by numbers of the finest mesh."""
    numbers = {}
    for name, shape in (("circle", CIRCLE), ("round", ROUND)):
        one, two = (_of(found, Case(variant, FINE, shape)) for variant in HEIGHTS)
        numbers |= {f"{name}{angle}": _ratio(two, one, angle) for angle in ANGLES}
    for name, draw_in in (("free", None), ("half", DRAW_INS[0]), ("one", DRAW_INS[1])):
        cases = (Case(variant, FINE, PACKINGS[0], draw_in=draw_in, end=SHORT) for variant in HEIGHTS)
        one, two = (_of(found, case) for case in cases)
        numbers |= {f"{name}{angle}": _ratio(two, one, angle) for angle in ANGLES[:2]}
    return MEANING.format(**numbers)


def _of(found: Found, case: Case) -> StoredRun:
    return found[case.variant, case.sets]


def _row(first: Case, second: Case, found: Found) -> list[str]:
    runs = [_of(found, case) for case in (first, second)]
    named = [_sections(first, second), _drawn(first), _beams(first)]
    thick = "; ".join(f"{run.results['cell_thickness_at_rest_mm']:.2f}" if run.results else "-" for run in runs)
    lost = "; ".join(f"V{run.options['variant']}: {cause(run.refused[0])}" for run in runs if run.refused)
    if lost:
        return [*named, thick, *["-"] * len(ANGLES), f"rejected ({lost})"]
    reached = [angle for angle in ANGLES if first.end is None or float(angle) < first.end]
    ratios = [_ratio(runs[1], runs[0], angle) for angle in reached]
    alike = equal(second)
    other = None if alike is None else _of(found, alike)
    others = ["" if other is None or other.refused else f" ({_ratio(other, runs[0], angle):.2f})" for angle in reached]
    cells = [f"{ratio:.2f}{other}" for ratio, other in zip(ratios, others, strict=True)]
    return [*named, thick, *cells, *["-"] * (len(ANGLES) - len(cells)), verdict(ratios)]


def verdict(ratios: Sequence[float]) -> str:
    """Verdict on variant 2 below variant 1 at the :data:`ANGLES` that ``ratios`` reach, and where it is not."""
    above = [angle for angle, ratio in zip(ANGLES, ratios, strict=False) if not ratio < 1.0]
    return f"**FAILED** at {', '.join(above)} deg" if above else f"passed{_to(len(ratios))}"


def _to(reached: int) -> str:
    return "" if reached == len(ANGLES) else f" to {ANGLES[reached - 1]} deg"


def _ratio(over: StoredRun, under: StoredRun, angle: str) -> float:
    name = f"cell_shear_n_per_mm_at_deg.{angle}"
    return float(over.results[name]) / float(under.results[name])


def _energies(found: Found) -> tuple[Sequence[str], list[list[str]]]:
    """Header and lines of the energies by mechanism, of the finest mesh on which both variants count."""
    finest: dict[tuple[str | float, float | None, float | None], tuple[Case, Case]] = {}
    for pair in sorted(pairs(), key=lambda pair: (pair[0].end is None, pair[0].mesh)):
        if not any(_of(found, case).refused for case in pair):
            finest[pair[0].shape, pair[0].modulus, pair[0].draw_in] = pair
    lines = []
    for first, second in finest.values():
        runs = [_of(found, case).results for case in (first, second)]
        named = [_sections(first, second), _drawn(first), _beams(first)]
        for angle in ANGLES if first.end is None else ANGLES[:2]:
            parts = ("; ".join(_energy(r[f"{name}.{angle}"]) for r in runs) for name in SHOWN)
            normal = "; ".join(f"{r[f'normal_n.{angle}']:.2f}" for r in runs)
            lines.append([*named, angle, *parts, normal])
    return (*HEAD[:3], "angle [deg]", *SHOWN, "normal forces [N]"), lines


def _energy(value: float) -> str:
    return f"{abs(value) if abs(value) < 5e-5 else value:.4f}"


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
