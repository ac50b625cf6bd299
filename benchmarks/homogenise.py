"""Homogenises both shipped variants and writes the tables in docs/homogenise.md between its marks.

python benchmarks/homogenise.py FOLDER runs what is missing in FOLDER. Some eight minutes on two idle cores.
"""

import json
import shutil
import sys
from pathlib import Path

from knittest.cli.main import run

DOCS = Path(__file__).parents[1] / "docs"
BEGIN, END = "<!-- begin: benchmarks/homogenise.py -->", "<!-- end -->"
VARIANTS = ("1", "2")


def result(folder: Path, variant: str) -> dict:
    """homogenise.json of a variant; the command goes on where it was stopped."""
    out = folder / f"variant-{variant}"
    run(["homogenise", "--variant", variant, "--out", str(out), "--quiet"])
    return json.loads((out / "homogenise.json").read_text())


def cost(one: dict, scale: str) -> float:
    """CPU seconds of all tests of a scale."""
    return sum(run["cpu_s"] or 0.0 for run in one["runs"] if run["scale"] == scale)


def check(found: list[dict]) -> list[str]:
    """One row a number of both variants."""
    head = " | ".join(f"V{v} yarns | V{v} shells | off" for v in VARIANTS)
    lines = [f"| test | number | unit | {head} |", "|---" * (3 + 3 * len(VARIANTS)) + "|"]
    for rows in zip(*(one["check"] for one in found), strict=True):
        name = rows[0]["quantity"].split(", at ")
        where = " (at " + " / ".join(row["quantity"].split(", at ")[1].split(",")[0] for row in rows) + ")"
        label = f"{name[0]} over the peak{where}" if len(name) > 1 else name[0]
        cells = " | ".join(f"{r['yarns']:.4g} | {r['shells']:.4g} | {r['deviation']:+.2f} %" for r in rows)
        lines.append(f"| {rows[0]['test']} | {label} | {rows[0]['unit']} | {cells} |")
    return lines


def main(folder: Path) -> None:
    """Run, then write tables and picture."""
    found = [result(folder, variant) for variant in VARIANTS]
    lines = [f"Preset {found[0]['preset']}, parameters {found[0]['parameters']}, seed {found[0]['seed']}.", ""]
    lines += [*check(found), ""]
    for variant, one in zip(VARIANTS, found, strict=True):
        lines.append(
            f"Variant {variant}: {one['status']}, largest deviation {one['largest_deviation_pct']:.1f} %; CPU time "
            f"{cost(one, 'yarns'):.0f} s of yarns, {cost(one, 'shells'):.0f} s of shells."
        )
        lines.append("")
    page = DOCS / "homogenise.md"
    before, rest = page.read_text().split(BEGIN)
    page.write_text("\n".join([before + BEGIN, "", *lines, END]) + rest.split(END)[1])
    shutil.copy(folder / "variant-1" / "homogenise.png", DOCS / "homogenise.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
