"""Runs knittest speed-study on variant 1, writes data/simulated/speed-study.csv and the table in docs/speed-study.md,
which has the results that change by 1 % or more and the largest change of all others.

python benchmarks/speed_study.py FOLDER runs what is missing in FOLDER. Some fifteen minutes on two idle cores.
"""

import shutil
import sys
from pathlib import Path

from knittest.cli.main import run
from knittest.experiment.tables import FOLDER, SPEED
from knittest.studies.speed_study import CSV, MARKDOWN

ROOT = Path(__file__).parents[1]
BEGIN, END = "<!-- begin: benchmarks/speed_study.py -->", "<!-- end -->"


def condensed(lines: list[str]) -> list[str]:
    """Rows of the table ``lines`` (header and rule first) of 1 % or more, and one row for the others of each test."""
    kept, rest = lines[:2], {}
    for line in lines[2:]:
        *which, _, _, _, change = (cell.strip() for cell in line.strip("|").split("|"))
        share = abs(float(change.strip("*%+ "))) if change != "-" else 0.0
        if share >= 1.0:
            kept.append(line)
        elif change != "-":
            rest.setdefault(tuple(which), []).append(share)
    others = []
    for which, shares in rest.items():
        count = f"{len(shares)} {'others' if _has(kept, which) else 'results'}"
        others.append(f"| {' | '.join(which)} | {count} | | | {max(shares):.2f} % at most |")
    return kept + others


def _has(lines: list[str], which: tuple[str, ...]) -> bool:
    """Tell whether a row of ``which`` test, scale and setting is among ``lines``."""
    return any(line.startswith(f"| {' | '.join(which)} |") for line in lines)


def main(folder: Path) -> None:
    """Run, copy the CSV, write the table between its marks."""
    if run(["speed-study", "--variant", "1", "--workers", "1", "--out", str(folder)]):
        raise SystemExit("the study failed")
    shutil.copy(folder / CSV, ROOT / "data" / FOLDER / SPEED)
    page = ROOT / "docs" / "speed-study.md"
    before, rest = page.read_text().split(BEGIN)
    page.write_text(
        "\n".join([before + BEGIN, *condensed((folder / MARKDOWN).read_text().rstrip().splitlines()), END])
        + rest.split(END)[1]
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
