"""Homogenises shipped variants and writes the table in docs/homogenise.md between its marks.

python benchmarks/homogenise.py FOLDER VARIANT... runs what is missing in FOLDER. Some two CPU minutes a variant.
"""

import json
import shutil
import sys
from pathlib import Path

from knittest.cli.main import run

DOCS = Path(__file__).parents[1] / "docs"
BEGIN, END = "<!-- begin: benchmarks/homogenise.py -->", "<!-- end -->"


def result(folder: Path, variant: str) -> dict:
    """homogenise.json of a variant; the command goes on where it was stopped."""
    out = folder / f"variant-{variant}"
    run(["homogenise", "--variant", variant, "--out", str(out), "--quiet"])
    return json.loads((out / "homogenise.json").read_text())


def cost(one: dict, scale: str) -> float:
    """CPU seconds of all tests of a scale."""
    return sum(run["cpu_s"] or 0.0 for run in one["runs"] if run["scale"] == scale)


def check(variants: list[str], found: list[dict]) -> list[str]:
    """One row a number of all variants."""
    head = " | ".join(f"V{v} yarns | V{v} shells | off" for v in variants)
    lines = [f"| test | number | unit | {head} |", "|---" * (3 + 3 * len(variants)) + "|"]
    for rows in zip(*(one["check"] for one in found), strict=True):
        names = list(dict.fromkeys(row["quantity"] for row in rows))
        label = names[0] if len(names) == 1 else "; ".join(f"V{v}: {n}" for v, n in zip(variants, names, strict=True))
        cells = " | ".join(f"{r['yarns']:.4g} | {r['shells']:.4g} | {r['deviation']:+.2f} %" for r in rows)
        lines.append(f"| {rows[0]['test']} | {label} | {rows[0]['unit']} | {cells} |")
    return lines


def main(folder: Path, variants: list[str]) -> None:
    """Run, then write the table, and the picture of the first variant."""
    found = [result(folder, variant) for variant in variants]
    lines = [f"Preset {found[0]['preset']}, parameters {found[0]['parameters']}, seed {found[0]['seed']}.", ""]
    lines += [*check(variants, found), ""]
    for variant, one in zip(variants, found, strict=True):
        lines.append(
            f"Variant {variant}: {one['status']}, largest deviation {one['largest_deviation_pct']:.1f} %; CPU time "
            f"{cost(one, 'yarns'):.0f} s of yarns, {cost(one, 'shells'):.0f} s of shells."
        )
        lines.append("")
    page = DOCS / "homogenise.md"
    before, rest = page.read_text().split(BEGIN)
    page.write_text("\n".join([before + BEGIN, "", *lines, END]) + rest.split(END)[1])
    shutil.copy(folder / f"variant-{variants[0]}" / "homogenise.png", DOCS / "homogenise.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
