"""Section of docs/validation.md on the order of both variants in shear: from docs/shear-order.json."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from docs.generate_config import table
from docs.validation_sections import sections_part
from knittest.studies.uncertainty.outcome import Uncertainty, VariableRow
from knittest.studies.uncertainty.page import index_text, points_text, ranked, share_text, short

FILE = Path(__file__).parent / "shear-order.json"
#: parameters named of a ratio
NAMED = 3
INTRO = """
### What the order hangs on

Nobody measured the stiffness in bending and torsion, set, tension and friction of these yarns, nor how far
crossings flatten. Each has a prior with its reason in `configs/uncertainty/shear-order.yaml`; both variants
take the same draw, so that they differ in loop length, densities and what follows from them alone. {runs}
cells of yarns at {points} points (`knittest uncertainty configs/uncertainty/shear-order.yaml`,
[uncertainty.md](uncertainty.md)), sections circles ([others](#with-sections-as-measured)). The rule is the same:
variant 2 below variant 1 at every angle. Median, in brackets 5 and 95 %, and points that ran{shorter}:
""".strip()
MEANING = """
So the order hangs on the tension of the loops, on how thick yarns are, at 30 deg on how loops resist torsion, and at
40 deg on friction. Nobody measured the first and the last two, and sections of yarns are not those of circles. A
draw-in multiplies the normal forces of variant 1, whose loops are near locking, and with them its friction; variant 2
has room, and hardly feels it. Over the prior variant 2 is mostly the softer one up to 30 deg, and the stiffer one at
40 deg, the more so the thicker its inlays are. Without a draw-in it is the stiffer one, and the paper's order fails.
No draw-in is shipped as calibrated on this order: until it is measured the order is open, and what the shipped
parameters give, above, stays contradicted. Cells that are lost are of soft loops under much draw-in ([one by
one](uncertainty.md#what-the-shipped-file-loses)).
""".strip()
#: of a study with shorter ends
SHORTER = ' ("shortened": of cells that were lost on their way and passed every gate to {ends} deg)'
LOST = """
Without a result to the full end (a cell may have several causes): {lost}. Bands and coefficients at an angle are of the
points that came so far, of ratios where both variants did; shares are of the points that came to all angles.
""".strip()
CELLS = """
Cells at the medians of all priors, without and with a draw-in of the loops; energy taken up from rest [mJ a cell] and
sum of the normal forces of all crossings:
""".strip()


def order_section() -> list[str]:
    """Blocks of the section."""
    stored = json.loads(FILE.read_text(encoding="utf-8"))
    found = Uncertainty.model_validate(stored)
    ratios = [one for one in found.variables if one.ratio]
    ends = ", ".join(f"{one.end:g}" for one in found.shorter)
    lost = "; ".join(lost_text(name, stored, found.points) for name in found.fabrics)
    return [
        INTRO.format(runs=found.runs, points=found.points, shorter=SHORTER.format(ends=ends) if ends else ""),
        table(*_bands(found.variables)),
        "![Shear stress of both variants, their ratio and thickness over the prior](shear-order.png)",
        "\n".join(f"- {one.text}: {share_text(one)}." for one in found.statements),
        LOST.format(lost=lost),
        "\n".join(_hangs_on(one) for one in ratios),
        CELLS,
        table(*_cells(stored["cells"])),
        MEANING,
        *sections_part(),
    ]


def lost_text(fabric: str, stored: dict[str, Any], points: int) -> str:
    """Lost runs of ``fabric`` by cause, and how many of them count to which shorter end."""
    causes = ", ".join(f"{count} {cause}" for cause, count in _sorted(stored["causes"][fabric]))
    ends = ", ".join(f"{count} to {end} deg" for end, count in stored["counts_to"][fabric].items())
    told = f"{fabric} {stored['lost_of'][fabric]} of {points} ({causes})"
    return f"{told}, of which {ends.replace(' to', ' count to', 1)}" if ends else told


def _sorted(causes: dict[str, int]) -> list[tuple[str, int]]:
    return sorted(causes.items(), key=lambda item: -item[1])


def _bands(variables: Sequence[VariableRow]) -> tuple[Sequence[str], list[list[str]]]:
    """Bands from 5 to 95 % at each angle, and the verdict on the ratio: its median, and whether its band holds 1."""
    at = list(dict.fromkeys(one.at for one in variables if one.at is not None))
    rows = []
    for angle in at:
        here = [one for one in variables if one.at == angle]
        ratio = next(one for one in here if one.ratio)
        rows.append([f"{angle:g}", *(_band(one) for one in here), verdict(ratio)])
    who = [f"{one.who}{f' [{one.unit}]' if one.unit not in ('', '1') else ''}" for one in variables if one.at == at[0]]
    return ("angle [deg]", *who, "verdict"), rows


def _band(one: VariableRow) -> str:
    """Median, 5 and 95 %, and the points that ran."""
    if not one.band:
        return f"-, {points_text(one)}"
    low, middle, high = (f"{end or 0.0:.3g}" for end in one.band)
    return f"{middle} ({low} to {high}), {points_text(one)}"


def verdict(ratio: VariableRow) -> str:
    """Verdict on the order: by the median, and open where the band reaches to the other side."""
    if not ratio.band or None in ratio.band:
        return "not known"
    low, middle, high = (float(end) for end in ratio.band if end is not None)
    judged = "passed" if middle < 1.0 else "**FAILED**"
    return judged + (", within the band open" if low < 1.0 < high else "")


def _hangs_on(one: VariableRow) -> str:
    if not one.indices or one.explained is None:
        return f"- {one.name} deg: no regression, {one.no_indices}"
    named = "; ".join(f"{short(i.parameter)} {index_text(i.first, i.first_interval)}" for i in ranked(one)[:NAMED])
    return f"- {one.name} deg, regression of ranks, R2 {one.explained:.2f}: {named}"


def _cells(cells: Sequence[dict[str, Any]]) -> tuple[Sequence[str], list[list[str]]]:
    names = ("bending", "torsion", "stretching", "contact", "friction", "spin")
    rows = [
        [
            cell["variant"],
            f"{cell['draw_in']:g}",
            f"{row['angle']:g}",
            *(f"{abs(row[n]) if abs(row[n]) < 5e-5 else row[n]:.4f}" for n in names),
            f"{row['normal_n']:.2f}",
        ]
        for cell in cells
        for row in cell["rows"]
    ]
    head = ("variant", "draw-in [%]", "angle [deg]", *names[:-1], "of it by spin", "normal forces [N]")
    return head, rows
