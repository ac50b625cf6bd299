"""Runs knittest speed-study on variant 1, writes data/simulated/speed-study.csv and the table in docs/speed-study.md.

python benchmarks/speed_study.py FOLDER runs what is missing in FOLDER. Some fifteen minutes on two idle cores.
"""

import shutil
import sys
from pathlib import Path

from knittest.cli.main import run
from knittest.experiment.simulated_studies import FOLDER, SPEED
from knittest.studies.speed_study.command import CSV, MARKDOWN

ROOT = Path(__file__).parents[1]
BEGIN, END = "<!-- begin: benchmarks/speed_study.py -->", "<!-- end -->"


def main(folder: Path) -> None:
    """Run, copy the CSV, write the table between its marks."""
    if run(["speed-study", "--variant", "1", "--workers", "1", "--out", str(folder)]):
        raise SystemExit("the study failed")
    shutil.copy(folder / CSV, ROOT / "data" / FOLDER / SPEED)
    page = ROOT / "docs" / "speed-study.md"
    before, rest = page.read_text().split(BEGIN)
    page.write_text("\n".join([before + BEGIN, (folder / MARKDOWN).read_text().rstrip(), END]) + rest.split(END)[1])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
