"""Shears cells of both variants with inlays of the measured heights: docs/shear-sections.json, for docs/validation.md.

python benchmarks/shear_sections.py FOLDER     runs what is missing in FOLDER; then: python -m docs.generate
"""

import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml

sys.path.insert(0, str(Path(__file__).parents[1]))
from benchmarks.shear_order import energies
from docs import stored_runs
from docs.shear_cells import Case, cases
from docs.stored_runs import StoredRun, inputs_of
from docs.validation_sections import FILE
from knittest.base.result_rows import unfold_results
from knittest.cli.main import run
from knittest.config.loading import resolve


def ran(folder: Path, case: Case) -> Path:
    """Folder of the run of ``case``, which is made if it is missing."""
    out = folder / case.name
    if not (out / "manifest.json").exists():
        sets = [word for text in case.sets for word in ("--set", text)]
        options = ["--variant", case.variant, "--preset", "quick", *sets]
        run(["cell", *options, "--threads", "1", "--no-frames", "--no-pictures", "--quiet", "--out", str(out)])
    return out


def stored(folder: Path, case: Case) -> StoredRun:
    """The run of ``case`` in ``folder``; of one that came to no end the message, in place of what refused it."""
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    options = {
        "test": "cell", "variant": case.variant, "scale": "meso", "preset": "quick", "sets": list(case.sets),
    }  # fmt: skip
    asked = inputs_of(resolve(**options).model_dump(mode="json"))
    found = StoredRun(
        options, asked, {}, {}, {}, [], [], manifest["git_commit"], manifest["ended"], manifest["cpu"]
    )  # fmt: skip
    if not (folder / "summary.json").exists():
        return replace(found, refused=[manifest["message"]])
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    given = inputs_of(yaml.safe_load((folder / "config.yaml").read_text(encoding="utf-8")))
    if given != asked:
        raise ValueError(f"{folder}: given other numbers than its case has now")
    return replace(
        found, results=unfold_results(summary["results"]) | dict(_mechanisms(folder)), quality=summary["quality"],
        cost=summary["cost"], refused=summary["refused"], warnings=summary["warnings"],
    )  # fmt: skip


def _mechanisms(folder: Path) -> Iterator[tuple[str, Any]]:
    """Energies [mJ] by mechanism and angle, and the sum of the normal forces [N], flat."""
    for row in energies(folder)["rows"]:
        yield from ((f"{name}.{row['angle']:g}", value) for name, value in row.items() if name != "angle")


def main(folder: Path) -> None:
    """Run what is missing, and store all."""
    folders = [ran(folder, case) for case in cases()]
    stored_runs.save([stored(*one) for one in zip(folders, cases(), strict=True)], FILE)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
