"""Bands of shear in the flange of formed shells, over their size: a table of docs/forming.md.

python benchmarks/forming_bands.py bands RUN [RUN ...]     runs of the whole blank, with and without
                                                           ``fabric.macro.in_plane_bending``
"""

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray
from scipy.signal import find_peaks

from benchmarks.forming import put, table
from knittest.base.result_rows import LABELS, unfold_results

Array = NDArray[np.float64]

#: depth of the rim that lies on the die all along the blank, over the side of the flat blank
RIM = 0.09
#: an extreme of the shear angle stands for a band where it stands out by this much [deg]
PROMINENCE = 5.0
#: parts of the stroke over which the stamp's force is averaged
PARTS = ((0.25, 0.5), (0.5, 0.75), (0.75, 1.0))
RESULTS = (
    "draw_in_max_mm", "draw_in_warp_mm", "draw_in_weft_mm", "shear_angle_p95_deg", "max_wrinkle_height_mm",
    "max_yarn_force_n",
)  # fmt: skip


def sides(angle: Array) -> list[Array]:
    """Shear angles (rows, n) of a square ``angle`` (n, n) along each side of the blank, within ``RIM`` of it."""
    rows = max(round(RIM * len(angle)), 1)
    return [angle[:rows], angle[-rows:], angle[:, :rows].T, angle[:, -rows:].T]


def band_width(rim: list[Array], size: float) -> float:
    """Mean width of a band [mm]: length of all rows over the number of extremes that stand out in them."""
    lines = [line for side in rim for line in side]
    found = [len(find_peaks(sign * line, prominence=PROMINENCE)[0]) for line in lines for sign in (1.0, -1.0)]
    return float(size * sum(len(line) for line in lines) / sum(found)) if sum(found) else np.inf


def difference(rim: list[Array]) -> float:
    """Mean difference of neighbours along the sides [deg]."""
    return float(np.mean([np.abs(np.diff(side, axis=1)).mean() for side in rim]))


def column(folder: Path) -> tuple[str, dict[str, str]]:
    """Heading and rows of a run."""
    summary = json.loads((folder / "summary.json").read_text())
    config = yaml.safe_load((folder / "config.yaml").read_text())
    size, given = float(config["model"]["macro"]["element_size"]), config["fabric"]["macro"]["in_plane_bending"]
    angle = pd.read_csv(folder / "shear-field.csv")["shear_angle_deg"].to_numpy()
    rim = sides(angle.reshape(2 * (round(len(angle) ** 0.5),)))
    curve = pd.read_csv(folder / "curve.csv")
    done, force = curve["stamp_travel_mm"] / float(config["rig"]["depth"]), curve["stamp_force_n"]
    quality, cost = summary["quality"], summary["cost"]
    results = unfold_results(summary["results"])
    rows = {
        "stamp force, largest [N]": f"{results['stamp_force_max_n']:.1f}",
        "same, mean of the second, third and last quarter of the stroke [N]": ", ".join(
            f"{force[(done > low) & (done <= high)].mean():.1f}" for low, high in PARTS
        ),
        "width of a shear band in the rim [mm]": f"{band_width(rim, size):.1f}",
        "shear difference of neighbouring elements there, mean [deg]": f"{difference(rim):.1f}",
    }
    rows |= {LABELS[k][0]: LABELS[k][1].format(results[k]) for k in RESULTS}
    rows |= {
        "hourglass over internal energy, largest [%]": f"{100.0 * quality['hourglass_over_internal_max']:.1f}",
        "kinetic energy over work [%]": f"{100.0 * quality['ke_over_ie_max']:.1f}",
        "energy error [%]": f"{100.0 * quality['energy_error_max']:.3f}",
        "quality checks": "rejected" if json.loads((folder / "comparison.json").read_text())["refused"] else "passed",
        "CPU time [s]": f"{cost['cpu_s']:.0f}",
    }
    return f"{size:g} mm, {'on' if given else 'off'}", rows


def main(mark: str, folders: list[Path]) -> None:
    """Write the table of ``mark``."""
    columns = [column(folder) for folder in folders]
    cells = [[row, *(rows[row] for _, rows in columns)] for row in columns[0][1]]
    put(mark, table(["", *(name for name, _ in columns)], cells))


if __name__ == "__main__":
    main(sys.argv[1], [Path(name) for name in sys.argv[2:]])
