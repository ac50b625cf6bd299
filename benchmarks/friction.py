"""Runs the friction test on both scales, at half its speed, and with a larger static coefficient.

python benchmarks/friction.py FOLDER runs what is missing in FOLDER, writes docs/friction-curve.png,
docs/friction-pressure.png and the table in docs/friction.md between its marks. Some five minutes on two idle cores.
"""

import json
import shutil
import sys
from pathlib import Path

from knittest.cli.main import run

DOCS = Path(__file__).parents[1] / "docs"
BEGIN, END = "<!-- begin: benchmarks/friction.py -->", "<!-- end -->"
#: options of every run by the name of its folder
CASES = {
    "macro": ["--scale", "macro", "--preset", "paper"],
    "macro, half speed": ["--scale", "macro", "--preset", "paper", "--set", "solver.speed=0.5"],
    "macro, static 0.12": ["--scale", "macro", "--preset", "paper", "--set", "rig.static_coefficient=0.12"],
    "meso, 15 mm": ["--scale", "meso", "--preset", "quick"],
    "meso, 15 mm, half speed": ["--scale", "meso", "--preset", "quick", "--set", "solver.speed=2"],
    "meso, 50 mm": ["--scale", "meso", "--preset", "paper"],
}
COLUMNS = (
    ("pull_force_static_n", "largest [N]", "{:.1f}"),
    ("pull_force_kinetic_n", "kinetic [N]", "{:.1f}"),
    ("mu_paper", "F_R/F_N", "{:.4f}"),
    ("mu_per_face", "F_R/(2 F_N)", "{:.4f}"),
    ("normal_force_error_pct", "F_N error [%]", "{:.2f}"),
    ("compression_mm", "compression [mm]", "{:.3f}"),
    ("pressure_mean_mpa", "mean pressure [MPa]", "{:.2f}"),
    ("plate_penetration_um", "penetration [um]", "{:.2f}"),
    ("element_deformation_um", "deformation [um]", "{:.0f}"),
)


def summary(folder: Path, case: str) -> dict:
    """summary.json of a case, which is run if it is not there."""
    out = folder / case.replace(",", "").replace(" ", "-")
    if not (out / "summary.json").is_file():
        run(["friction", "--variant", "1", "--direction", "warp", *CASES[case], "--out", str(out)])
    return json.loads((out / "summary.json").read_text()) | {"folder": out}


def table(found: dict[str, dict]) -> list[str]:
    """One row a case."""
    head = ["| run | " + " | ".join(label for _, label, _ in COLUMNS) + " | elements | CPU [s] |"]
    rows = [*head, "|---" * (len(COLUMNS) + 3) + "|"]
    for case, s in found.items():
        cells = [form.format(s["results"][key]) for key, _, form in COLUMNS]
        refused = " (rejected)" if s["refused"] else ""
        cost = s["cost"]
        rows.append(f"| {case}{refused} | {' | '.join(cells)} | {cost['elements']} | {cost['cpu_s']:.0f} |")
    return rows


def main(folder: Path) -> None:
    """Run, then write table and pictures."""
    found = {case: summary(folder, case) for case in CASES}
    page = DOCS / "friction.md"
    before, rest = page.read_text().split(BEGIN)
    page.write_text("\n".join([before + BEGIN, *table(found), END]) + rest.split(END)[1])
    shutil.copy(found["macro, static 0.12"]["folder"] / "curve.png", DOCS / "friction-curve.png")
    shutil.copy(found["meso, 50 mm"]["folder"] / "pressure.png", DOCS / "friction-pressure.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
