"""Writes tables and pictures of docs/forming.md from what runs have left.

python benchmarks/forming.py runs RUN [RUN ...]      the table of runs
python benchmarks/forming.py fields RUN [RUN ...]    the shear of runs on one scale, and by how much it differs
python benchmarks/forming.py window SWEEP            table and picture of configs/sweeps/blank-holder.yaml
"""

import json
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd
import yaml

from knittest.base.figure import Printing, Stamp, use_printing, use_stamp
from knittest.base.result_rows import LABELS, unfold_results
from knittest.export.field_pictures import PlanField, fields_picture

DOCS = Path(__file__).parent.parent / "docs"
FORCE = "rig.blank_holder_force"
WINDOW = ("max_wrinkle_height_mm", "wrinkled_area_pct", "max_yarn_force_n", "stamp_force_max_n")


def column(folder: Path) -> tuple[str, dict[str, str]]:
    """Heading and rows of a run."""
    summary = json.loads((folder / "summary.json").read_text())
    comparison = json.loads((folder / "comparison.json").read_text())
    config = yaml.safe_load((folder / "config.yaml").read_text())
    force = config["rig"]["blank_holder_force"]
    scale = config["model"]["scale"]
    name = f"{scale}, {config['model']['preset']}, {force:g} N"
    if scale == "macro" and config["fabric"]["macro"]["in_plane_bending"] is None:
        name += ", without in-plane bending"
    quality, cost = summary["quality"], summary["cost"]
    rows = {LABELS[k][0]: LABELS[k][1].format(v) for k, v in unfold_results(summary["results"]).items() if k in LABELS}
    rows |= {
        "kinetic energy over work [%]": f"{100.0 * quality['ke_over_ie_max']:.1f}",
        "energy error [%]": f"{100.0 * quality['energy_error_max']:.3f}",
        "quality checks": "rejected" if comparison["refused"] else "passed",
        "elements": f"{cost['elements']}",
        "wall-clock time, CPU time [s]": f"{cost['wall_s']:.0f}, {cost['cpu_s']:.0f}",
    }
    return name, rows


def table(header: list[str], rows: list[list[str]]) -> str:
    """Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def put(mark: str, text: str, name: str = "forming.md") -> None:
    """Replace what stands between the marks of the page ``name``."""
    page = DOCS / name
    before, rest = page.read_text().split(f"<!-- begin: {mark} -->")
    after = rest.split(f"<!-- end: {mark} -->")[1]
    page.write_text(f"{before}<!-- begin: {mark} -->\n\n{text}\n\n<!-- end: {mark} -->{after}")


def runs(folders: list[Path]) -> None:
    """Table of all runs."""
    columns = [column(folder) for folder in folders]
    names = dict.fromkeys(row for _, rows in columns for row in rows)
    cells = [[row, *(rows.get(row, "-") for _, rows in columns)] for row in names]
    put("runs", table(["", *(name for name, _ in columns)], cells))


def fields(folders: list[Path]) -> None:
    """Picture of the shear angles of runs in plan, which their tables have."""
    found = []
    for folder in folders:
        config = yaml.safe_load((folder / "config.yaml").read_text())
        model, bends = config["model"], config["fabric"]["macro"]["in_plane_bending"]
        size = f"shells of {model['macro']['element_size']:g} mm"
        name = "yarns" if model["scale"] == "meso" else f"{size} that bend in the plane" if bends else size
        table = pd.read_csv(folder / "shear-field.csv")
        found.append(PlanField(name, table[["x_mm", "y_mm"]].to_numpy(), table["shear_angle_deg"].to_numpy()))
    rig = config["rig"]
    how = f"drawn by {rig['depth']:g} mm, holder {rig['blank_holder_force']:g} N"
    title = f"Shear angle, blank of {rig['blank_length']:g} mm {how}"
    with use_printing(Printing(dpi=100)), use_stamp(Stamp((config["fabric"]["name"],))):
        fields_picture(DOCS / "forming.png", found, title=title, label="shear angle [deg]")


def window(sweep: Path) -> None:
    """Table and picture of results over the force on the holder."""
    found = pd.read_csv(sweep / "results.csv").sort_values(FORCE)
    header = ["holder force [N]", *(f"{force:g}" for force in found[FORCE])]
    put("window", table(header, [[LABELS[k][0], *(LABELS[k][1].format(v) for v in found[k])] for k in WINDOW]))
    figure, axes = plt.subplots(1, 3, figsize=(11.0, 3.6))
    for panel, name in zip(axes, WINDOW[:3], strict=True):
        panel.plot(found[FORCE], found[name], "o-", color="#0072B2")
        panel.set(xlabel="force on the blank holder [N]", ylabel=LABELS[name][0])
        panel.set_ylim(0.0, None)
        panel.grid(alpha=0.3)
    axes[0].set_yscale("log")  # the blank without a holder rises a hundred times as high
    axes[0].set_ylim(0.1, 300.0)
    axes[0].yaxis.set_major_formatter("{x:g}")
    figure.tight_layout()
    figure.savefig(DOCS / "forming-window.png", dpi=110)


if __name__ == "__main__":
    what, *names = sys.argv[1:]
    commands = {"runs": runs, "fields": fields, "window": lambda paths: window(paths[0])}
    commands[what]([Path(name) for name in names])
