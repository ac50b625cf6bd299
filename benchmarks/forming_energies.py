"""Difference of the work of stamps, mechanism by mechanism: tables of docs/forming.md.

python benchmarks/forming_energies.py MARK RUN OTHER [OTHER ...]     runs at one speed, with the same tools

Up to the travel that all of them reached. Bending is that in the plane and out of it on both scales. What the law of
shear is for shells, loops, crossings and the torsion of inlays are for yarns: the law is that of a frame of such yarns.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from benchmarks.forming import put, table

#: mechanisms of stamp-work.csv that are one row on both scales
ROWS: dict[str, tuple[str, ...]] = {
    "stretching of inlays": ("stretching",),
    "bending of inlays, out of plane and in plane": ("bending", "in_plane_bending"),
    "shear: law (macro); loops, torsion, contact and friction (meso)": (
        "shear", "loop_stretching", "loop_bending", "loop_torsion", "torsion", "fabric_contact", "fabric_friction",
    ),
    "friction at tools": ("tool_friction",),
    "contact with tools": ("tool_contact",),
    "hourglass control": ("hourglass",),
    "damping": ("damping",),
    "kinetic energy": ("kinetic",),
    "broken elements, energy error": ("torn", "balance_error"),
}  # fmt: skip
OUTSIDE, STAMP = "lifting of holder and weight", "work of the stamp"
#: settings that runs of one table share
EQUAL = (
    ("solver", "speed"), ("solver", "ramp"), ("solver", "damping"), ("rig", "depth"), ("rig", "blank_holder_force"),
    ("rig", "blank_length"), ("rig", "blank_width"), ("rig", "stamp"), ("rig", "die"), ("rig", "static_coefficient"),
    ("rig", "kinetic_coefficient"), ("fabric", "name"),
)  # fmt: skip
Spent = dict[str, float]


def spent(work: pd.DataFrame, travel: float) -> Spent:
    """Energy [mJ] of :data:`ROWS` up to ``travel`` [mm], that from outside taken off; their sum is the stamp's work."""
    at = {name: float(np.interp(travel, work["stamp_travel_mm"], values)) for name, values in work.items()}
    found = {row: sum(at.get(f"{name}_mj", 0.0) for name in names) for row, names in ROWS.items()}
    found[OUTSIDE] = -at["holder_and_weight_mj"]
    return found | {STAMP: sum(found.values())}


def shares(one: Spent, other: Spent) -> Spent:
    """Share of each row in what the stamp does more in one run than in the other [-]."""
    more = one[STAMP] - other[STAMP]
    return {row: (one[row] - other[row]) / more for row in one}


def settings(folder: Path) -> list[object]:
    """Values of :data:`EQUAL`."""
    config = yaml.safe_load((folder / "config.yaml").read_text())
    stamp = config["rig"]["stamp"]
    config["rig"]["stamp"] = stamp["kind"], stamp[stamp["kind"]]
    return [config[part].get(name) for part, name in EQUAL]


def heading(folder: Path) -> str:
    """Name of a run that tells it from the others."""
    config = yaml.safe_load((folder / "config.yaml").read_text())
    if config["model"]["scale"] == "meso":
        return "meso"
    return "macro with in-plane bending" if config["fabric"]["macro"]["in_plane_bending"] else "macro without"


def main(mark: str, folders: list[Path]) -> None:
    """Write the table of ``mark``; runs that differ in more than their model are refused."""
    for folder in folders[1:]:
        differing = [name for name, a, b in zip(EQUAL, settings(folders[0]), settings(folder), strict=True) if a != b]
        if differing:
            sys.exit(f"{folder}: differs from {folders[0]} in {', '.join('.'.join(name) for name in differing)}")
    works = [pd.read_csv(folder / "stamp-work.csv") for folder in folders]
    travel = min(float(work["stamp_travel_mm"].iloc[-1]) for work in works)
    first, *others = (spent(work, travel) for work in works)
    name, *names = (heading(folder) for folder in folders)
    header = [f"energy [mJ] at {travel:.1f} mm", name, *names, *(f"{name} less {one}, its share" for one in names)]
    rows = []
    for row in first:
        more = [f"{first[row] - one[row]:.1f}, {100.0 * shares(first, one)[row]:.0f} %" for one in others]
        rows.append([row, *(f"{one[row]:.1f}" for one in (first, *others)), *more])
    put(mark, table(header, rows))


if __name__ == "__main__":
    main(sys.argv[1], [Path(name) for name in sys.argv[2:]])
