"""Stores a finished study of the order of both variants in shear: docs/shear-order.json and .png for the validation,
data/simulated/shear-bands.csv for reports. Needs no simulation itself.

knittest uncertainty configs/uncertainty/shear-order.yaml --out STUDY
python benchmarks/shear_order.py STUDY CELL...    # cells of both variants at the medians, with and without draw-in
"""

import json
import shutil
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

sys.path.insert(0, str(Path(__file__).parents[1]))
from docs.lost import causes
from docs.validation_order import FILE
from knittest.base.files import data_dir
from knittest.experiment.tables import FOLDER, SHEAR_BANDS

#: shear angles [deg] at which the energies of the cells are read
ANGLES = (10.0, 20.0, 30.0)
MECHANISMS = {
    "bending": "bending_", "torsion": "torsion_", "stretching": "stretching_", "contact": "contact_mj",
    "friction": "friction_mj", "spin": "friction_spin_mj",
}  # fmt: skip


def energies(folder: Path) -> dict[str, Any]:
    """Energies [mJ] by mechanism that a cell has taken up to :data:`ANGLES`, and its normal forces there [N]."""
    config = yaml.safe_load((folder / "config.yaml").read_text(encoding="utf-8"))
    table, curve = pd.read_csv(folder / "energies.csv"), pd.read_csv(folder / "curve.csv")
    contacts = pd.read_csv(folder / "contacts.csv")
    angle = np.interp(table["time_ms"], curve["time_ms"], curve["shear_angle_deg"])
    rows = []
    for at in (a for a in ANGLES if a <= angle[-1]):
        k = int(np.argmin(np.abs(angle - at)))
        grown = table.iloc[k] - table.iloc[0]
        row = {
            name: float(grown[[c for c in table if c.startswith(start)]].sum()) for name, start in MECHANISMS.items()
        }
        pressed = [c for c in contacts if c.endswith("_normal_force_n")]
        numbers = [c.replace("_normal_force_n", "_contacts") for c in pressed]
        row["normal_n"] = float((contacts[pressed].iloc[k].to_numpy() * contacts[numbers].iloc[k].to_numpy()).sum())
        rows.append({"angle": at, **row})
    fabric = config["fabric"]
    draw_in = fabric["knitting"]["draw_in"]
    stated = 0.0 if draw_in is None else draw_in["value"]
    return {"variant": str(fabric["experiment_variant"]), "draw_in": stated, "rows": rows}


def _ends(lost: list[dict[str, Any]]) -> dict[str, int]:
    """Lost runs that count to a shorter end, by that end."""
    ends = Counter(one["counts_to"] for one in lost if one["counts_to"] is not None)
    return {f"{end:g}": ends[end] for end in sorted(ends, reverse=True)}


def main(study: Path, cells: list[Path]) -> None:
    """Write both files."""
    found = json.loads((study / "uncertainty.json").read_text(encoding="utf-8"))
    lost = found.pop("lost")
    by = {fabric: [one for one in lost if one["fabric"] == fabric] for fabric in found["fabrics"]}
    found["lost_of"] = {fabric: len(rows) for fabric, rows in by.items()}
    found["causes"] = {f: dict(Counter(c for one in rows for c in causes(one["reason"]))) for f, rows in by.items()}
    found["counts_to"] = {fabric: _ends(rows) for fabric, rows in by.items()}
    found["cells"] = [energies(folder) for folder in cells]
    FILE.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    shutil.copyfile(study / "bands.png", FILE.with_suffix(".png"))
    rows = [
        {
            "fabric": found["fabrics"].get(one["who"], one["who"]), "shear_angle_deg": one["at"], "unit": one["unit"],
            **dict(zip(("p5", "p50", "p95"), one["band"], strict=True)), "count": one["count"], "points": one["points"],
        }
        for one in found["variables"]
        if one["at"] is not None and one["band"]
    ]  # fmt: skip
    pd.DataFrame(rows).to_csv(data_dir() / FOLDER / SHEAR_BANDS, index=False, float_format="%.6g")


if __name__ == "__main__":
    main(Path(sys.argv[1]), [Path(name) for name in sys.argv[2:]])
