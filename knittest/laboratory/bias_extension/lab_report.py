"""Writes what an import of bias extension tests yields: forces at angles, and the corridor of the normalised force."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.atomic import write_atomic
from knittest.base.errors import InputError
from knittest.experiment.lab_checks import common, digest, refuse_apart, refuse_copies
from knittest.experiment.lab_conditions import GAUGE, WIDTH
from knittest.experiment.lab_fabric import finish
from knittest.experiment.lab_folder import curve_text
from knittest.experiment.lab_lines import table_lines
from knittest.experiment.lab_picture import plot
from knittest.experiment.lab_series import Results, write_results
from knittest.experiment.lab_units import likely_force
from knittest.experiment.statistics import Corridor, band
from knittest.laboratory.bias_extension.lab_curves import Pulled
from knittest.laboratory.bias_extension.rig import ANGLES
from knittest.materials.trellis import ANGLE, NORMALISED

Array = NDArray[np.float64]

#: row of the largest angle of each strip
END = "end_of_first_loading_deg"
#: largest normalised shear force of textiles [N/mm]: from a loose knit to carbon fabrics beyond locking
FORCES = (5e-4, 20.0)
NORMALISED_SD = "normalised_shear_force_sd_n_per_mm"


def strip_results(strips: Sequence[Pulled], files: Sequence[str]) -> Results:
    """Forces at angles of ``strips`` of one series; raises :class:`InputError` for sizes, copies and forces that are
    not of one.
    """
    paths = [s.path for s in strips]
    length = common(GAUGE, [s.strip.length for s in strips], paths)
    width = common(WIDTH, [s.strip.width for s in strips], paths)
    end = common_end(strips)
    for s in strips:
        _refuse_implausible(s)
    at_end = np.array([np.interp(end, s.angle, s.normalised) for s in strips])
    refuse_apart([(s.name, s.path) for s in strips], at_end, f"normalised force at {end:.3g} deg", "N/mm")
    digests = [digest(s.angle, s.force) for s in strips]
    refuse_copies([(s.name, known) for s, known in zip(strips, digests, strict=True)])
    angles = [a for a in ANGLES if a <= end]
    if not angles:
        raise InputError(f"{paths[0]}: all specimens together go to {end:.3g} deg: expected at least {ANGLES[0]:g} deg")
    forces = {f"bias_force_n_at_deg.{a:g}": _at(a, strips, [s.force for s in strips]) for a in angles}
    free = {
        f"bias_normalised_force_n_per_mm_at_deg.{a:g}": _at(a, strips, [s.normalised for s in strips]) for a in angles
    }
    units = dict.fromkeys(free, "N/mm") | dict.fromkeys(forces, "N") | {END: "deg"}
    found = free | forces | {END: np.array([s.angle[-1] for s in strips])}
    return Results(
        "bias-extension", "", found, units, [(GAUGE, length), (WIDTH, width)],
        ("strip", f"on the bias, {width:g} mm wide, {length:g} mm between the clamps"), files, digests,
    )  # fmt: skip


def common_end(strips: Sequence[Pulled]) -> float:
    """Shear angle [deg] that all ``strips`` reach."""
    return min(float(s.angle[-1]) for s in strips)


def strip_corridor(strips: Sequence[Pulled]) -> Corridor:
    """Mean and sd of the normalised shear force."""
    return band([(s.angle, s.normalised) for s in strips], common_end(strips), "shear angles")


def strip_lines(strips: Sequence[Pulled]) -> list[str]:
    """Table of the forces [N] at angles, with mean and sd, and of the size."""
    results = strip_results(strips, [])
    columns = {name: values for name, values in results.found.items() if name.startswith("bias_force_n")}
    heads = [(f"{name.rpartition('.')[2]} deg [N]", ".4g") for name in columns]
    table = np.array(list(columns.values())).T
    lines = table_lines(heads, [(s.name, values) for s, values in zip(strips, table, strict=True)])
    for s in strips:
        turned = ", turns there: first loading alone" if s.turned else ""
        lines.append(f"{s.name}: up to {s.angle[-1]:.3g} deg{turned}")
    lines.append("angles are those of yarns that keep their length and do not slip, from the travel of the clamp")
    return lines + [f"{what.name}: {value:g} {what.unit}" for what, value in results.conditions]


def write_strips(strips: Sequence[Pulled], out: Path, files: Sequence[str]) -> str:
    """Write ``bias-extension.csv`` and ``bias-extension/`` into the experiment ``out``; returns its variant.

    Curves and corridor are of the normalised shear force. Raises as :func:`strip_results` does, and when ``out`` holds
    what no import wrote.
    """
    results, corridor = strip_results(strips, files), strip_corridor(strips)
    inner, notes = write_results(out, results), results.notes(out)
    for number, s in enumerate(strips, 1):
        text = curve_text([f"# specimen: {s.name}", *notes[1:]], {ANGLE: s.angle, NORMALISED: s.normalised})
        write_atomic(inner / f"specimen-{number:02d}.csv", text)
    mean = {ANGLE: corridor.strain, NORMALISED: corridor.mean, NORMALISED_SD: corridor.sd}
    write_atomic(inner / "corridor.csv", curve_text(notes, mean))
    labels = ("shear angle, pin-jointed [deg]", "normalised shear force [N/mm]")
    plot([(s.angle, s.normalised) for s in strips], corridor, labels, inner / "curves.png")
    finish(out)
    return out.resolve().name


def _at(angle: float, strips: Sequence[Pulled], values: Sequence[Array]) -> Array:
    return np.array([np.interp(angle, s.angle, v) for s, v in zip(strips, values, strict=True)])


def _refuse_implausible(strip: Pulled) -> None:
    """Raise :class:`InputError` for a force that no textile has."""
    top, force = float(strip.normalised.max()), float(strip.force.max())
    if FORCES[0] <= top <= FORCES[1]:
        return
    limits = (FORCES[0] * force / top, FORCES[1] * force / top) if top > 0.0 else FORCES
    raise InputError(
        f"{strip.path}: specimen {strip.name}: maximum force {force:.6g} N, normalised {top:.4g} N/mm: implausible, "
        f"expected {FORCES[0]:g} to {FORCES[1]:g} N/mm{likely_force(force, strip.unit, limits)}: check the unit"
    )
