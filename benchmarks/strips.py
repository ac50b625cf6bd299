"""Runs strips on the bias and squares pulled both ways; writes tables of docs/bias-extension.md and docs/biaxial.md.

python benchmarks/strips.py FOLDER [MARK ...]     runs what is missing in FOLDER; all tables if none is named
"""

import json
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.forming import put, table
from knittest.base.result_rows import LABELS, unfold_results
from knittest.cli.main import run
from knittest.config.loading import resolve
from knittest.laboratory.base import PreparedSpecimen, shear_curve
from knittest.laboratory.bias_extension.strip import BiasStrip, bias_mesh
from knittest.laboratory.bias_extension.test import WARP, BiasExtension, BiasExtensionTest, ends_of
from knittest.laboratory.bias_extension.zones import material_points, zone_table
from knittest.materials.shear import shear_table
from knittest.models.macro import build_sheet
from knittest.pose import linear_laminate
from knittest.solve.state import SILENT

ANGLES = np.array([10.0, 20.0, 30.0, 40.0])
#: strip of the table over the stiffness of fibres [mm], and its shear force by angle [N/mm]
STRIP, SHEAR = BiasStrip(200.0, 100.0), 0.1
RATIOS, SIZES = (1e2, 1e3, 1e4), (10.0, 5.0)
#: options of every run by the name of its folder
RUNS: dict[str, list[str]] = {
    "bias-quick": ["bias-extension", "--variant", "2", "--scale", "meso", "--preset", "quick", "--verify"],
    "bias-standard": ["bias-extension", "--variant", "2", "--scale", "meso", "--preset", "standard"],
    "bias-shells": ["bias-extension", "--variant", "1", "--scale", "macro", "--preset", "quick", "--verify"],
    **{
        f"biaxial-{scale}": [
            "biaxial", "--variant", variant, "--scale", scale, "--preset", "quick", "--direction", "warp", "--verify",
        ]
        for scale, variant in (("meso", "2"), ("macro", "1"))
    },
}  # fmt: skip


def ran(folder: Path, name: str) -> Path:
    """Folder of a run, which is made if it is missing."""
    out = folder / name
    if not (out / "summary.json").exists():
        run([*RUNS[name], "--threads", "1", "--no-frames", "--quiet", "--out", str(out)])
    return out


def summary(folder: Path) -> dict[str, Any]:
    """Contents of summary.json."""
    found: dict[str, Any] = json.loads((folder / "summary.json").read_text())
    return found


def pulled(ratio: float, size: float) -> tuple[list[float], float, float]:
    """Force over that of pin-jointed yarns at 10, 20, 30 deg, angle of the middle for 30 deg [deg], and hourglass over
    internal energy at the end [%], of fibres ``ratio`` times as stiff as the shear on shells of ``size`` [mm].
    """
    sets = ("rig.max_angle=31", "solver.speed=0.4", "solver.damping=0.02")
    card = linear_laminate((SHEAR * ratio,) * 2, (0.05, 0.05), SHEAR, 1.0, drilling=0.0)
    config: Any = resolve(variant="cao2008-weave", scale="macro", preset="quick", test="bias-extension", sets=sets)
    points, cells = bias_mesh(STRIP.length, STRIP.width, size)
    prepared = PreparedSpecimen(
        build_sheet(points, cells, card, 7e-4, 1.0, WARP), BiasExtensionTest(config, STRIP, *ends_of(points, STRIP))
    )
    history, _ = BiasExtension().solve(prepared, config, SILENT)
    angle, force = history.curve["shear_angle_deg"], history.curve["force_n"]
    over = []
    for at in ANGLES[:3]:
        gamma = np.deg2rad([at])
        expected = float(STRIP.force(SHEAR * gamma, 0.5 * SHEAR * gamma, gamma)[0])
        over.append(float(force[np.abs(angle - at) < 1.0].mean()) / expected)
    zones = zone_table(history, STRIP, material_points(config, history))
    middle = float(np.interp(30.0, zones["shear_angle_deg"], zones["middle_mean_deg"]))
    return (
        over,
        middle,
        100.0 * float(history.energies["hourglass_mj"][-1] / history.energies["internal_fabric_mj"][-1]),
    )


def stiffness(_: Path) -> None:
    """Table over the stiffness of fibres."""
    rows = []
    for ratio in RATIOS:
        found = [pulled(ratio, size) for size in SIZES]
        forces = [", ".join(f"{one:.2f}" for one in over) for over, _, _ in found]
        rows.append([
            f"1e{np.log10(ratio):.0f}", *forces, ", ".join(f"{middle:.1f}°" for _, middle, _ in found),
            ", ".join(f"{held:.1f}" for *_, held in found) + " %",
        ])  # fmt: skip
    header = ["E / shear", "10°, 20°, 30°, elements of 10 mm", "5 mm", "middle, 10 and 5 mm", "hourglass energy"]
    put("stiffness", table(header, rows), "bias-extension.md")


def law(folder: Path, angle: np.ndarray) -> np.ndarray:
    """Normalised force [N/mm] of the shear law of the shells of a run's fabric at ``angle`` [deg]."""
    config = resolve(config=folder / "config.yaml", scale="macro")
    card = shear_table(config.fabric, shear_curve(config))
    gamma = np.deg2rad(angle)
    found: np.ndarray = np.maximum(gamma[:, None] - card.knee, 0.0) @ card.slope / np.cos(gamma)
    return found


def yarns(folder: Path) -> None:
    """Tables of yarns at two presets beside the law of their shells."""
    rows = []
    for name in ("bias-quick", "bias-standard"):
        out = ran(folder, name)
        of, results = name.removeprefix("bias-"), summary(out)["results"]
        zones = pd.read_csv(out / "zones.csv")
        middle = np.interp(ANGLES, zones["shear_angle_deg"], zones["middle_mean_deg"])
        given = (
            ("force [N]", "{:.2f}", "bias_force_n_at_deg"),
            ("normalised force [N/mm]", "{:.4f}", "bias_normalised_force_n_per_mm_at_deg"),
            ("real angle of the middle [deg]", "{:.1f}", "middle_shear_angle_deg_at_deg"),
            ("slip, 95th percentile [mm]", "{:.2f}", "crossing_slip_mm_at_deg"),
        )
        for label, shape, key in given:
            rows.append([f"{of}: {label}", *(shape.format(results[key][f"{a:g}"]) for a in ANGLES)])
        rows.append([f"{of}: law at the real angle [N/mm]", *(f"{v:.4f}" for v in law(out, middle))])
    rows.append(["law at the angle of pin-jointed yarns [N/mm]", *(f"{v:.4f}" for v in law(out, ANGLES))])
    put("yarns", table(["angle of pin-jointed yarns", *(f"{a:g}°" for a in ANGLES)], rows), "bias-extension.md")


def changes(folder: Path, names: tuple[str, str], page: str) -> None:
    """Table of what ``--verify`` found of two runs."""
    rows = []
    for name in names:
        found = summary(ran(folder, name))
        results = unfold_results(found["results"])
        for key, one in (found.get("numerical_error") or {}).items():
            mesh = next((one[k] for k in ("coarser_mesh_pct", "finer_mesh_pct") if one.get(k) is not None), None)
            shown = ["-" if v is None else f"{v:+.1f} %" for v in (one.get("half_speed_pct"), mesh)]
            error = f"± {one['error']:.2g}" if one.get("error") is not None else one.get("reason", "-")
            label = f"{found['scale']}, {LABELS[key][0] if key in LABELS else key}"
            rows.append([label, f"{results[key]:.3g}", error, *shown])
    header = ["result", "value", "error", "at half the speed", "on the other mesh"]
    put("verify", table(header, by_angle(rows)), page)


def by_angle(rows: list[list[str]]) -> list[list[str]]:
    """One row for all angles of a result: "force at 10 deg" and "force at 20 deg" become "force at 10, 20 deg"."""
    groups: dict[str, list[list[str]]] = {}
    for row in rows:
        groups.setdefault(re.sub(r"at [\d.]+ deg", "at {} deg", row[0]), []).append(row)
    found = []
    for label, same in groups.items():
        angles = ", ".join(re.findall(r"at ([\d.]+) deg", " ".join(row[0] for row in same)))
        found.append([label.format(angles), *(_joined(cells) for cells in list(zip(*same, strict=True))[1:])])
    return found


def _joined(cells: tuple[str, ...]) -> str:
    """Cells of one column with their sign ± and their unit % once."""
    first, *others = cells
    texts = [first, *(text.removeprefix("± ") for text in others)]
    return ", ".join([*(text.removesuffix(" %") for text in texts[:-1]), texts[-1]])


TABLES: dict[str, Callable[[Path], None]] = {
    "stiffness": stiffness,
    "yarns": yarns,
    "verify-bias": lambda folder: changes(folder, ("bias-shells", "bias-quick"), "bias-extension.md"),
    "verify-biaxial": lambda folder: changes(folder, ("biaxial-macro", "biaxial-meso"), "biaxial.md"),
}

if __name__ == "__main__":
    place, *marks = sys.argv[1:]
    for mark in marks or TABLES:
        TABLES[mark](Path(place))
