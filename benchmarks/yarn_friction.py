"""Runs configs/sweeps/yarn-friction.yaml, writes data/simulated/yarn-friction.csv and a table in docs/picture-frame.md.

python benchmarks/yarn_friction.py FOLDER runs what is missing in FOLDER. Some eight minutes on two idle cores.
"""

import json
import sys
from pathlib import Path

import pandas as pd

from knittest import __version__
from knittest.cli.main import run
from knittest.config.loading import resolve
from knittest.experiment.tables import ANGLE, FOLDER, FORCE, YARN_FRICTION
from knittest.laboratory.picture_frame.shear_law import START

ROOT = Path(__file__).parents[1]
SWEEP = ROOT / "configs" / "sweeps" / "yarn-friction.yaml"
BEGIN, END = "<!-- begin: benchmarks/yarn_friction.py -->", "<!-- end: benchmarks/yarn_friction.py -->"
ANGLES = ("10", "20", "30", "40")


def curves(folder: Path) -> pd.DataFrame:
    """Means over a degree about each whole degree above START: variant, coefficient, angle, force."""
    tables = []
    for path in sorted(folder.glob("trials/*/curve.csv")):
        given, curve = resolve(config=path.parent / "config.yaml"), pd.read_csv(path)
        mean = curve.groupby(curve[ANGLE].round())[[FORCE]].mean()
        mean = mean[(mean.index > START) & (mean.index < given.rig.max_angle)].rename_axis(ANGLE).reset_index()
        mean.insert(0, "friction_coefficient", given.fabric.contact.friction_coefficient.value)
        mean.insert(0, "variant", given.fabric.experiment_variant)
        tables.append(mean)
    return pd.concat(tables).sort_values(["variant", "friction_coefficient", ANGLE])


def write_data(table: pd.DataFrame, side: float) -> None:
    """Write the shipped table with what it is in its head."""
    head = (
        "# kind: simulated\n"
        f"# source: {SWEEP.relative_to(ROOT)}, picture frame of yarns, {side:g} mm, version {__version__}\n"
        "# means over 1 deg; the friction coefficients are assumed, none is published\n"
    )
    text = table.to_csv(index=False, float_format="%.6g")
    (ROOT / "data" / FOLDER / YARN_FRICTION).write_text(head + text)


def rows(folder: Path) -> list[str]:
    """Markdown: forces of every run."""
    lines = ["| variant | friction | " + " | ".join(f"{a} deg [N]" for a in ANGLES) + " | energy error |"]
    lines.append("|---" * (len(ANGLES) + 3) + "|")
    found = []
    for path in folder.glob("trials/*/summary.json"):
        given, summary = resolve(config=path.parent / "config.yaml"), json.loads(path.read_text())
        forces = [summary["results"]["shear_force_n_at_deg"][a] for a in ANGLES]
        cells = " | ".join(f"{f:.2f}" for f in forces)
        friction, error = given.fabric.contact.friction_coefficient, summary["quality"]["energy_error_max"]
        refused = " (rejected)" if summary["refused"] else ""
        key = (given.fabric.experiment_variant, friction.value)
        found.append((key, f"| V{key[0]} | {key[1]:g}{refused} | {cells} | {100.0 * error:.3f} % |"))
    return lines + [line for _, line in sorted(found)]


def main(folder: Path) -> None:
    """Run, then write the data and the table."""
    if run(["batch", str(SWEEP), "--out", str(folder), "--workers", "1"]):
        raise SystemExit("the sweep failed")
    (ROOT / "data" / FOLDER).mkdir(exist_ok=True)
    side = resolve(config=next(folder.glob("trials/*/config.yaml"))).rig.side
    write_data(curves(folder), side)
    page = ROOT / "docs" / "picture-frame.md"
    before, rest = page.read_text().split(BEGIN)
    text = "\n".join(["", f"Squares of {side:g} mm (simulated).", "", *rows(folder), ""])
    page.write_text(before + BEGIN + "\n" + text + END + rest.split(END)[1])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
