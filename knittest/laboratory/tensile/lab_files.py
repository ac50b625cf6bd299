"""Files of tensile tests as ``knittest data`` takes them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from knittest.experiment.lab_checks import digests
from knittest.experiment.lab_conditions import GAUGE, WIDTH
from knittest.experiment.lab_folder import DIRECTIONS, TENSION, counted, quantity
from knittest.experiment.lab_results import Curves, Results, table_lines
from knittest.experiment.lab_strips import one_series, per_width, plausible_strips, read_strips
from knittest.experiment.lab_tests import LabTest
from knittest.experiment.statistics import Specimen, corridor, mean_sd, peaks, tension_curve
from knittest.experiment.tables import TENSILE

UNITS = {"peak_force_n": "N", "fracture_strain_pct": "%"}
NAMES = ("strain_pct", "force_n_per_mm", "force_sd_n_per_mm")
RISING = "# from the origin and rising; preload and noise are taken out"


def summary_lines(specimens: Sequence[Specimen]) -> list[str]:
    """Table of maximum force [N] and strain at it [%], with mean and sd, and of the strips' sizes."""
    plausible_strips(specimens)
    force, strain = peaks(specimens)
    shown = [("max. force [N]", ".1f", force), ("strain at it [%]", ".3f", strain)]
    lines = table_lines([s.name for s in specimens], shown)
    for what, found in ((WIDTH, {s.width for s in specimens}), (GAUGE, {s.gauge for s in specimens})):
        sizes = ["not stated" if v is None else f"{v:g} mm" for v in sorted(found, key=lambda v: v or 0.0)]
        lines.append(f"{what.name}: {', '.join(sizes)}")
    return lines


def tensile_results(specimens: Sequence[Specimen], direction: str, files: Sequence[str]) -> Results:
    """Peaks of one series, its curves per width and the curve for a material; raises :class:`InputError` as
    :func:`one_series`.
    """
    strips, sizes = one_series(specimens)
    narrow = per_width(strips)
    found = dict(zip(TENSILE, peaks(strips), strict=True))
    means = [f"# {name}: {mean_sd(values)[0]:.6g}" for name, values in found.items()]
    tension: dict[str, np.ndarray] = dict(zip(NAMES, tension_curve(narrow), strict=False))
    labels = ("strain [%]", "force per width [N/mm]")
    more = {TENSION: (tension, [*means, RISING])}
    curves = Curves([(s.strain, s.force) for s in narrow], corridor(narrow), NAMES, labels, more, means)
    return Results(
        "tensile", direction, found, UNITS, [(what, sizes[what.key]) for what in (WIDTH, GAUGE) if what.key in sizes],
        ("strip", f"of {sizes[WIDTH.key]:g} mm"), files, digests(specimens, [(s.strain, s.force) for s in specimens]),
        [s.name for s in specimens], curves=curves,
    )  # fmt: skip


def _fabric(tests: Mapping[str, dict[str, Any]], place: Path) -> dict[str, Any]:
    """Curves and fracture strains of the shells, by direction."""
    own = {direction: tests[direction] for direction in DIRECTIONS if direction in tests}
    macro = {
        "tension": {direction: (place / direction / TENSION).as_posix() for direction in own},
        "fracture_strain": {direction: _fracture_strain(test) for direction, test in own.items()},
    }
    return {"macro": macro} if own else {}


def _fracture_strain(test: dict[str, Any]) -> dict[str, Any]:
    conditions = test["conditions"]
    gauge = f", {conditions[GAUGE.key]:g} mm between the clamps" if GAUGE.key in conditions else ""
    strips = counted(test["fracture_strain_pct"]["n"], "strip")
    width = f"{conditions[WIDTH.key]:g} mm"
    return quantity(test["fracture_strain_pct"], "measured", f"{strips}, {width} wide{gauge}; an input of the shells")


LAB = LabTest(read_strips, tensile_results, (WIDTH, GAUGE), ("sign",), fabric=_fabric, show=summary_lines)
