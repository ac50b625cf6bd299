"""Writes the table of docs/forming.md from run folders: python benchmarks/forming.py RUN [RUN ...]."""

import json
import sys
from pathlib import Path

import yaml

from knittest.result_rows import LABELS, unfolded

PAGE = Path(__file__).parent.parent / "docs" / "forming.md"
BEGIN, END = "<!-- begin: benchmarks/forming.py -->", "<!-- end -->"


def column(folder: Path) -> tuple[str, dict[str, str]]:
    """Heading and rows of a run."""
    summary = json.loads((folder / "summary.json").read_text())
    config = yaml.safe_load((folder / "config.yaml").read_text())
    force = config["rig"]["blank_holder_force"]
    name = f"{config['model']['scale']}, {config['model']['preset']}, {force:g} N"
    quality, cost = summary["quality"], summary["cost"]
    rows = {LABELS[k][0]: LABELS[k][1].format(v) for k, v in unfolded(summary["results"]).items() if k in LABELS}
    rows |= {
        "kinetic energy over work [%]": f"{100.0 * quality['ke_over_ie_max']:.1f}",
        "energy error [%]": f"{100.0 * quality['energy_error_max']:.3f}",
        "comparison": "refused" if quality["failures"] else "passed",
        "elements": f"{cost['elements']}",
        "time of the run [s]": f"{cost['wall_s']:.0f} (processor {cost['cpu_s']:.0f})",
    }
    return name, rows


def main(folders: list[Path]) -> None:
    """Replace what stands between the marks."""
    columns = [column(folder) for folder in folders]
    names = list(dict.fromkeys(row for _, rows in columns for row in rows))
    lines = ["| | " + " | ".join(name for name, _ in columns) + " |", "|---" * (len(columns) + 1) + "|"]
    lines += [f"| {row} | " + " | ".join(rows.get(row, "-") for _, rows in columns) + " |" for row in names]
    text = PAGE.read_text()
    start, end = text.index(BEGIN) + len(BEGIN), text.index(END)
    PAGE.write_text(text[:start] + "\n\n" + "\n".join(lines) + "\n\n" + text[end:])


if __name__ == "__main__":
    main([Path(name) for name in sys.argv[1:]])
