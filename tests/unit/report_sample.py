"""Run folders of every test as runs write them, from made-up curves, for the tests of the report pages."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from export_sample import cost, curve, energies, quality
from homogenise_cases import with_shipped_card

from knittest.base.files import data_dir
from knittest.base.kinds import kinds
from knittest.config.loading import resolve
from knittest.config.yaml_writer import dump
from knittest.experiment.comparison import compare_results
from knittest.experiment.origin import assumed_inputs, row_kind
from knittest.experiment.tables import published_rows
from knittest.export.folder import RunFolder
from knittest.export.line_picture import Line, curve_picture, line_picture
from knittest.export.summary import build_summary

RESULTS = {
    "tensile": {"peak_force_n": 5666.25, "fracture_strain_pct": 1.578125, "force_per_yarn_n": 404.75},
    "picture-frame": {"shear_force_n_at_deg.10": 2.703125, "wrinkle_onset_deg": float("nan")},
    "bias-extension": {"bias_force_n_at_deg.10": 1.65625, "middle_shear_angle_deg_at_deg.10": 9.96875},
    "cell": {"cell_warp_n_per_mm": 38.5, "cell_thickness_mm": 2.25},
    "biaxial": {"biaxial_force_n_per_mm": 116.375, "cross_strain_pct": 0.8125},
    "pull-out": {"pull_out_peak_n": 2.34375, "crossing_friction_n": 0.140625, "clamp_difference_pct": 0.0625},
    "compaction": {"thickness_mm_at_kpa.1": 2.203125, "plate_difference_pct": 0.5, "plate_sunk_pct": 1.5},
    "cantilever": {"chord_angle_deg": 41.5625, "overhang_mm": 171.0, "moment_error_pct": 0.4375, "residual": 3.0e-7},
    "friction": {
        "pull_force_kinetic_n": 300.5,
        "mu_paper": 0.15025,
        "normal_force_error_pct": 0.0078125,
        "penetration_over_deformation_pct": 2.5,
    },
    "forming": {"stamp_force_max_n": 95.8125, "max_wrinkle_height_mm": 4.78125, "tool_penetration_max_um": 70.25},
}
RIGS = list(RESULTS)


def write_run(
    path: Path,
    kind: str = "tensile",
    *,
    direction: str = "warp",
    failures: tuple[str, ...] = (),
    specimens: int = 1,
    config_text: str | None = None,
    results: dict[str, float] | None = None,
    **chosen: Any,
) -> Path:
    """A completed run in ``path``; ``failures`` refuse it, ``chosen`` goes to the config's loader."""
    scale = "macro" if "macro" in kinds()[kind].scales else "meso"
    chosen = {"scale": scale, "variant": "1"} | ({"specimens": specimens} if specimens > 1 else {}) | chosen
    run = resolve(test=kind, direction=None if not kinds()[kind].directional else direction, **chosen)
    run = with_shipped_card(run)
    files = [data_dir() / name for name in run.fabric.macro.curve_files.values() if "shear" not in name]
    rows = [{**RESULTS[kind], **(results or {})}]
    rows += [{name: value * (1.0 + 0.1 * k) for name, value in rows[0].items()} for k in range(1, specimens)]
    fabric = run.fabric
    tables = data_dir() / str(fabric.experiment)
    quantities = kinds()[kind].published
    references = (
        published_rows(tables, str(fabric.experiment_variant), run.direction, quantities) if fabric.experiment else []
    )
    compared = compare_results(rows[0], references, {r.quantity: row_kind(run, r.quantity) for r in references})
    compared = [row | {"assumed": list(assumed_inputs(run))} for row in compared]
    text = config_text or dump(run)
    metrics = METRICS if fabric.name.startswith("pham2019") else METRICS | {"compared_with": "a curve of its own"}
    with RunFolder.create(path, run, config_text=text, threads=2, data_files=files) as folder:
        columns = curves(kind) if specimens == 1 else ensemble()
        folder.write_table("curve.csv", columns)
        folder.write_table("energies.csv", trials() if kind == "cantilever" else energies(("fabric",)))
        if kind == "tensile":
            curve_picture(path / "curve.png", [curve(5800.0)], title="t")
        names = list(columns)
        line_picture(
            path / "deformed.png", [Line(columns[names[0]], columns[names[1]], "x")], title="t", xlabel="x", ylabel="y"
        )
        folder.write_json(
            "comparison.json", {"refused": list(failures), "rows": [], "curves": [metrics] if kind == "tensile" else []}
        )
        known = {row.quantity for row in references}
        alone = {q: row_kind(run, q) for q in quantities if q in rows[0] and q not in known}
        told = alone, assumed_inputs(run)
        folder.write_json("summary.json", build_summary(run, rows, quality(failures), cost(), compared, *told))  # type: ignore[arg-type]
        if failures:
            folder.finish("completed", 3, "comparison refused: " + "; ".join(failures))
    return path


METRICS = {
    "compared_with": "Table 3, variant 1, warp", "reference_kind": "reconstructed", "comparable": True,
    "peak_error_pct": -2.625, "fracture_strain_error_pct": -1.375, "rmse_pct_of_peak": 1.9375,
    "rating": {"overall": 0.98125, "grade": "excellent"},
}  # fmt: skip


def curves(kind: str) -> dict[str, np.ndarray]:
    """Columns of curve.csv of a test."""
    x = np.linspace(0.0, 40.0, 81)
    return {
        "tensile": curve(5800.0),
        "picture-frame": {
            "time_ms": x, "displacement_mm": x, "frame_shear_angle_deg": x, "shear_force_n": 0.4 * x,
            "normalised_shear_force_n_per_mm": 0.002 * x,
        },
        "bias-extension": {"time_ms": x, "shear_angle_deg": x, "force_n": 0.3 * x},
        "cell": {"time_ms": x, "path_pct": x, "conjugate_force": 0.5 * x},
        "biaxial": {"time_ms": x, "strain_pct": x / 25.0, "force_n_per_mm": 70.0 * x / 25.0},
        "pull-out": {"time_ms": x, "displacement_mm": x / 5.0, "pull_force_n": 0.1 * x},
        "compaction": {"time_ms": x, "pressure_kpa": 0.1 + x, "thickness_mm": 2.2 - x / 100.0},
        "cantilever": {"steps": 50.0 + 1000.0 * x, "residual": np.exp(-0.3 * x)},
        "friction": {"time_ms": x, "displacement_mm": x / 4.0, "pull_force_n": 300.0 * np.minimum(x, 1.0)},
        "forming": {"time_ms": x, "stamp_travel_mm": x, "stamp_force_n": 2.0 * x},
    }[kind]  # fmt: skip


def ensemble() -> dict[str, np.ndarray]:
    """Mean and standard deviation of specimens of a tensile test."""
    one = curve(5800.0)
    return {"strain_pct": one["strain_pct"], "force_mean_n": one["force_n"], "force_sd_n": 0.05 * one["force_n"]}


def trials() -> dict[str, np.ndarray]:
    """States of a cantilever at rest."""
    return {"overhang_mm": np.array([171.0]), "chord_angle_deg": np.array([41.5625]), "steps": np.array([118600.0])}


def edit_json(path: Path, **changed: Any) -> None:
    """Change fields of a JSON file."""
    path.write_text(json.dumps(json.loads(path.read_text()) | changed))
