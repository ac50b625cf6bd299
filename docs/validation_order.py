"""Section of docs/validation.md on the order of both variants in shear: from docs/shear-order.json."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from docs.generate_config import table
from docs.validation_sections import sections_part
from knittest.studies.uncertainty.outcome import Uncertainty, VariableRow
from knittest.studies.uncertainty.page import index_text, points_text, ranked_indices, share_text, short_name

FILE = Path(__file__).parent / "shear-order.json"
#: parameters named of a ratio
NAMED = 3
INTRO = """
<a id="what-the-order-hangs-on"></a>

### What the order depends on

Bending and torsional stiffness, set, tension and friction of these yarns and the flattening of crossings were not
measured. `configs/uncertainty/shear-order.yaml` states a prior for each, with its reason. Both variants get the same
random values, so they differ only in loop length, densities and what follows from them. {runs} cells at {points}
points were run (`knittest uncertainty configs/uncertainty/shear-order.yaml`, [uncertainty.md](uncertainty.md)), with
circular sections ([others](#with-sections-as-measured)). The rule is the same: variant 2 below variant 1 at every
angle.

Median, 5 to 95 % in brackets, and number of points{shorter}. "Within the band open": the band reaches to both sides of
1.
""".strip()
MEANING = """
**Meaning.** The order depends on loop tension and on yarn thickness, at 30 deg also on the torsional stiffness of the
loops, at 40 deg on friction. Loop tension, torsion and friction were not measured, and real sections are no circles.
Loop shortening multiplies the normal forces of variant 1, whose loops are nearly locked, and with them its friction.
It hardly changes variant 2. Over the prior variant 2 is mostly softer up to 30 deg, but stiffer at 40 deg, above all
with thick inlays. Without loop shortening it is stiffer, against the paper. No shipped set has a loop shortening
calibrated on this order. Until it is measured the order is open, and the shipped parameters contradict the paper. The
rejected cells have soft loops and much loop shortening ([details](uncertainty.md#what-the-shipped-file-loses)).
""".strip()
#: of shares and coefficients
SHARES = "Share of the prior in which an order holds at all angles:"
RANKS = "Largest coefficients of a regression of ranks, with 95 % intervals:"
#: of a study with shorter ends
SHORTER = ' ("shortened": of cells that passed all checks to {ends} deg, but not to the end)'
LOST = """
Cells without a result at the last angle, by cause (a cell may have several): {lost}.

Bands and coefficients at an angle use the points that reached it, for ratios in both variants. Shares use the points
that reached all angles.
""".strip()
CELLS = """
Energy [mJ per cell] since the initial state, and sum of the normal forces of all crossings, at the medians of all
priors without and with loop shortening:
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
        SHARES,
        "\n".join(f"- {one.text}: {share_text(one)}." for one in found.statements),
        LOST.format(lost=lost),
        RANKS,
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
    named = "; ".join(
        f"{short_name(i.parameter)} {index_text(i.first, i.first_interval)}" for i in ranked_indices(one)[:NAMED]
    )
    return f"- {one.name} deg, R2 {one.explained:.2f}: {named}"


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
    head = ("variant", "loop shortening [%]", "angle [deg]", *names[:-1], "of it spin", "normal forces [N]")
    return head, rows
