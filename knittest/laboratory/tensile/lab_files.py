"""Files of tensile tests as ``knittest data`` takes them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from knittest.experiment.lab_conditions import GAUGE, WIDTH
from knittest.experiment.lab_results import (
    TENSION,
    Results,
    Tests,
    count_text,
    quantity_entry,
    statistics_by_direction,
    table_lines,
)
from knittest.experiment.lab_shear import digests
from knittest.experiment.lab_strips import check_strips, make_series, read_strips, strip_curves
from knittest.experiment.lab_tests import LabTest
from knittest.experiment.statistics import Specimen, mean_sd, peaks, tension_curve
from knittest.experiment.tables import TENSILE

UNITS = {"peak_force_n": "N", "fracture_strain_pct": "%"}
RISING = "# from the origin and rising; preload and noise are removed"


def summary_lines(specimens: Sequence[Specimen]) -> list[str]:
    """Table of maximum force [N] and strain at it [%], with mean and sd, and the strips' sizes."""
    check_strips(specimens)
    force, strain = peaks(specimens)
    shown = [("max. force [N]", ".1f", force), ("strain at it [%]", ".3f", strain)]
    lines = table_lines([s.name for s in specimens], shown)
    for what, found in ((WIDTH, {s.width for s in specimens}), (GAUGE, {s.gauge for s in specimens})):
        sizes = ["not stated" if v is None else f"{v:g} mm" for v in sorted(found, key=lambda v: v or 0.0)]
        lines.append(f"{what.name}: {', '.join(sizes)}")
    return lines


def _results(specimens: Sequence[Specimen]) -> Results:
    strips, narrow, sizes = make_series(specimens)
    found = dict(zip(TENSILE, peaks(strips), strict=True))
    means = [f"# {name}: {mean_sd(values)[0]:.6g}" for name, values in found.items()]
    curves = strip_curves(narrow)
    tension: dict[str, np.ndarray] = dict(zip(curves.names, tension_curve(narrow), strict=False))
    return Results(
        found, UNITS, list(sizes.items()), ("strip", f"of {sizes[WIDTH]:g} mm"),
        digests(specimens, [(s.strain, s.force) for s in specimens]),
        curves=replace(curves, more={TENSION: (tension, [*means, RISING])}, head=means),
    )  # fmt: skip


def _fabric(tests: Tests, place: Path) -> dict[str, Any]:
    tension, fracture = {}, {}
    for direction, test in statistics_by_direction(tests, "tensile").items():
        conditions, found = test["conditions"], test["fracture_strain_pct"]
        gauge = f", {conditions[GAUGE.key]:g} mm between the clamps" if GAUGE.key in conditions else ""
        strips = f"{count_text(found['n'], 'strip')}, {conditions[WIDTH.key]:g} mm wide{gauge}"
        tension[direction] = (place / direction / TENSION).as_posix()
        fracture[direction] = quantity_entry(found, "measured", f"{strips}; an input of the macro model")
    return {"macro": {"tension": tension, "fracture_strain": fracture}} if tension else {}


LAB = LabTest("tensile", read_strips, _results, (WIDTH, GAUGE), ("sign",), fabric=_fabric, show=summary_lines)
