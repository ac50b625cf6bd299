"""Reconstructs the tensile curves of Pham et al. (2019), of which only the end points are published.

Shape: yarns with a harmonic wave, eps(T) = T/EA + c0 [1 - (1 + T/T*)^-2], T* = EI (2 pi / lambda)^2, with EA from
Table 1 and the fibre area, EI from Table 3's overhang and c0 such that the curve ends at Table 3's mean fracture
strain and force. A macro model that is fed such a curve repeats it; agreement of a shape with it proves nothing.

Run ``python -m knittest.experiment.reconstruction`` to write the files again.
"""

from pathlib import Path

import numpy as np

from knittest.base.files import data_dir
from knittest.experiment.tables import published_rows

AXIAL = 59.3e3 * 0.784  # EA of a yarn [N]
#: strip of DIN EN ISO 13934-1 [mm]
WIDTH, GAUGE = 50.0, 200.0
#: yarns in that width and straightening force T* of one [N], by variant and direction
CASES = {
    ("1", "warp"): (14.0, 56.0),
    ("1", "weft"): (14.0, 39.0),
    ("2", "warp"): (14.0, 196.0),
    ("2", "weft"): (20.5, 81.0),
}
POINTS = 61


def curve(variant: str, direction: str) -> tuple[np.ndarray, np.ndarray]:
    """Strain [%] and force [N] of a strip of :data:`WIDTH`, (POINTS,), from the origin to Table 3's mean end point."""
    peak, strain = (row.mean for row in published_rows(data_dir() / "pham2019", variant, direction))
    yarns, star = CASES[variant, direction]
    tension = np.linspace(0.0, 1.0, POINTS) ** 1.5 * peak / yarns
    straightened = 1.0 - (1.0 + tension / star) ** -2
    crimp = (0.01 * strain - tension[-1] / AXIAL) / straightened[-1]
    return 100.0 * (tension / AXIAL + crimp * straightened), yarns * tension


def text(variant: str, direction: str) -> str:
    """Content of the curve's CSV."""
    head = [
        "# kind: reconstructed",
        f"# fabric: pham2019-v{variant}",
        f"# source: Table 3 of Pham et al. 2019, variant {variant}, {direction}",
        "# method: wavy-yarn closed form through Table 3's mean end point (knittest/experiment/reconstruction.py)",
        "# note: only the end point is measured; a macro model fed with this repeats an input",
        "# test: tensile",
        f"# direction: {direction}",
        f"# strip_width_mm: {WIDTH:g}",
        f"# gauge_length_mm: {GAUGE:g}",
        "strain_pct,force_n_per_mm",
    ]
    # all digits, so that 0.001 N of the strip are kept for any width
    rows = [f"{e:.6f},{round(float(f), 3) / WIDTH!r}" for e, f in zip(*curve(variant, direction), strict=True)]
    return "\n".join([*head, *rows]) + "\n"


def write(folder: Path) -> None:
    """Write all four curves to ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    for variant, direction in CASES:
        (folder / f"tensile-v{variant}-{direction}.csv").write_text(text(variant, direction), encoding="utf-8")


if __name__ == "__main__":
    write(data_dir() / "pham2019" / "curves")
