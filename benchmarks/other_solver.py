"""Runs the same tests in knittest and in OpenRadioss, and prints the ratio of their forces.

OPENRADIOSS_PATH=/opt/OpenRadioss python benchmarks/other_solver.py FOLDER [CASE ...] exports the decks, runs the
starter and the engine of OpenRadioss (double precision) in FOLDER, and reads their time histories. The variable names
the folder with exec/ and hm_cfg_files/. Without it the script runs knittest, writes the decks and says so. Cases:
:data:`CASES`.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from knittest.cli.main import run
from knittest.config.loading import resolve
from knittest.laboratory.reference_curves import own_curves
from knittest.laboratory.report_base import REPORTS

VARIABLE = "OPENRADIOSS_PATH"
#: test and options, and the places at which forces are compared: strain [%] of a strip, shear angle [deg] of a frame
CASES = {
    "shells": (("tensile", "--variant", "1", "--scale", "macro", "--direction", "warp"), (0.1, 0.4, 0.8, 1.2, 1.6)),
    "yarns": (
        ("tensile", "--variant", "2", "--scale", "meso", "--preset", "quick", "--direction", "warp"),
        (0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4),
    ),
    "frame": (
        ("picture-frame", "--variant", "2", "--scale", "meso", "--preset", "quick", "--set", "rig.side=50"),
        (5.0, 10.0, 20.0, 30.0, 40.0),
    ),
}


def solver(name: str, root: Path) -> Path:
    """Program of OpenRadioss in double precision: exec/``name``_linux64_gf and the like."""
    found = sorted(path for path in (root / "exec").glob(f"{name}_*") if "_sp" not in path.stem)
    single = [path for path in found if "_ompi" not in path.stem and "_impi" not in path.stem]
    if not single:
        sys.exit(f"{VARIABLE}={root}: no exec/{name}_* for one process in double precision")
    return single[0]


def run_deck(folder: Path, name: str, root: Path) -> Path:
    """Run starter and engine on the deck ``name`` in ``folder``; returns its time history."""
    libraries = [root / "extlib/hm_reader/linux64", root / "extlib/h3d/lib/linux64", os.environ.get("LD_LIBRARY_PATH")]
    environment = os.environ | {
        "RAD_CFG_PATH": str(root / "hm_cfg_files"),
        "OMP_NUM_THREADS": os.environ.get("OMP_NUM_THREADS", "2"),
        "LD_LIBRARY_PATH": os.pathsep.join(str(one) for one in libraries if one),
    }
    for part, number in (("starter", 0), ("engine", 1)):
        command = [str(solver(part, root)), "-i", f"{name}_000{number}.rad"]
        with (folder / f"{name}.{part}.log").open("w") as log:
            if subprocess.run(command, cwd=folder, env=environment, stdout=log, check=False).returncode:
                sys.exit(f"{folder / name}: the {part} failed: see {log.name}")
    return folder / f"{name}T01"


def rows(case: str, folder: Path) -> list[str]:
    """Rows of the table of ``case``: place, force here and there [N], their ratio."""
    (test, *options), places = CASES[case]
    own, deck = folder / case, folder / f"{case}-deck"
    if not (own / "manifest.json").exists() and run([test, *options, "--no-frames", "--quiet", "--out", str(own)]):
        sys.exit(f"{own}: knittest rejects its own run")
    if run(["export", "deck", test, *options, "--format", "openradioss", "--out", str(deck)]):
        sys.exit(f"{deck}: no deck")
    root = os.environ.get(VARIABLE)
    if not root:
        print(f"{VARIABLE} is not set: wrote {deck} only")
        return []
    name = "-".join([test, *(["warp"] if "warp" in options else [])])
    found = resolve(config=own / "config.yaml")
    (other,) = own_curves(found, [run_deck(deck, name, Path(root))])
    report = REPORTS[found.rig.kind]
    table = pd.read_csv(own / "curve.csv")
    columns = report.scale_to_nominal_size(found, {str(n): table[n].to_numpy(float) for n in table})
    y = other.y_name if other.y_name in columns else report.axes.y
    here = np.interp(places, columns[report.axes.x], columns[y])
    there = np.interp(places, other.x, other.mean, right=np.nan)
    return [
        f"| {case} | {place:g} | {a:.4g} | {b:.4g} | {b / a:.3f} |"
        for place, a, b in zip(places, here, there, strict=True)
    ]


if __name__ == "__main__":
    chosen = sys.argv[2:] or list(CASES)
    if len(sys.argv) < 2 or any(case not in CASES for case in chosen):
        sys.exit(f"usage: {VARIABLE}=... python {sys.argv[0]} FOLDER [{'|'.join(CASES)} ...]")
    lines = [line for case in chosen for line in rows(case, Path(sys.argv[1]))]
    if lines:
        head = ["| case | strain [%] or angle [deg] | knittest | OpenRadioss | ratio |", "|---|---|---|---|---|"]
        print("\n".join([*head, *lines]))
