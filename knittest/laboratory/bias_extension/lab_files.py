"""Files of bias extension tests as ``knittest data`` takes them: force of the clamp over its travel."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment.lab_checks import common, digests, refuse_apart, refuse_implausible
from knittest.experiment.lab_conditions import GAUGE, WIDTH
from knittest.experiment.lab_given import Given
from knittest.experiment.lab_recording import Origin, Recording, of, recordings
from knittest.experiment.lab_results import Curves, Results
from knittest.experiment.lab_shear import Tested, shear_curve
from knittest.experiment.lab_tests import LabTest, Rigs
from knittest.experiment.lab_units import plain
from knittest.experiment.statistics import band
from knittest.laboratory.bias_extension.pin_jointed import BiasStrip
from knittest.laboratory.bias_extension.rig import ANGLES
from knittest.materials.trellis import ANGLE, NORMALISED

Array = NDArray[np.float64]

NAME = "bias-extension"
#: row of the largest angle of each strip
END = "end_of_first_loading_deg"
#: largest normalised shear force of textiles [N/mm]: from a loose knit to carbon fabrics beyond locking
FORCES = (5e-4, 20.0)
NAMES = (ANGLE, NORMALISED, "normalised_shear_force_sd_n_per_mm")


@dataclass(frozen=True)
class Pulled(Origin):
    """Shear angle of pin-jointed yarns [deg], rising, and force [N] of one specimen on its first loading, (n,) each.

    ``turned`` says that more loading follows, which is left out.
    """

    angle: Array
    force: Array
    strip: BiasStrip
    turned: bool

    @property
    def normalised(self) -> Array:
        """Normalised shear force [N/mm], (n,)."""
        return self.strip.normalised(self.force, np.deg2rad(self.angle))


def read_strips(path: Path, given: Given) -> list[Pulled]:
    """Specimens in one export.

    The travel of the clamp, or its strain, becomes the angle by the strip's length and width; an angle that was
    measured is another one, and not read. Raises :class:`InputError` where the size is not known or too short, and as
    :func:`knittest.experiment.lab_shear.shear_curve`.
    """
    wanted = [("force",), ("travel", "extensometer")]
    return [_pulled(r, given) for r in recordings(path, given, wanted, "a force and a displacement of the clamp")]


def _pulled(r: Recording, given: Given) -> Pulled:
    length, width = r.needed([GAUGE, WIDTH], given)
    try:
        strip = BiasStrip(length, width)
    except InputError as error:
        raise InputError(f"{r.origin.path}: {error}") from None
    tested = Tested(
        NAME, strip, f"a strip {width:g} mm wide, {length:g} mm between the clamps,", "the strip not yet sheared",
        f"{GAUGE.option}, {WIDTH.option}", length,
    )  # fmt: skip
    curve = shear_curve(r, tested, given)
    return Pulled(**of(r), angle=curve.angle, force=curve.force, strip=strip, turned=curve.turned)


def strip_results(strips: Sequence[Pulled], direction: str, files: Sequence[str]) -> Results:
    """Forces at angles of ``strips`` of one series; raises :class:`InputError` for sizes, copies and forces that are
    not of one.
    """
    paths, curves = [s.path for s in strips], [(s.angle, s.normalised) for s in strips]
    length = common(GAUGE, [s.strip.length for s in strips], paths)
    width = common(WIDTH, [s.strip.width for s in strips], paths)
    end = min(float(s.angle[-1]) for s in strips)
    for s in strips:
        top, force = float(s.normalised.max()), float(s.force.max())
        refuse_implausible(s, top, FORCES, f"maximum force {force:.6g} N, normalised {top:.4g} N/mm", "N/mm", force)
    at_end = np.array([np.interp(end, *curve) for curve in curves])
    refuse_apart(strips, at_end, f"normalised force at {end:.3g} deg", "N/mm")
    angles = [a for a in ANGLES if a <= end]
    if not angles:
        raise InputError(f"{paths[0]}: all specimens together go to {end:.3g} deg: expected at least {ANGLES[0]:g} deg")
    forces = {a: np.array([np.interp(a, s.angle, s.force) for s in strips]) for a in angles}
    free = {a: np.array([np.interp(a, *curve) for curve in curves]) for a in angles}
    found = {f"bias_normalised_force_n_per_mm_at_deg.{a:g}": values for a, values in free.items()}
    found |= {f"bias_force_n_at_deg.{a:g}": values for a, values in forces.items()}
    found[END] = np.array([s.angle[-1] for s in strips])
    units = {name: "N/mm" if "n_per_mm" in name else "N" for name in found} | {END: "deg"}
    turned = {True: ", turns there: first loading alone", False: ""}
    return Results(
        NAME, "", found, units, [(GAUGE, length), (WIDTH, width)],
        ("strip", f"on the bias, {width:g} mm wide, {length:g} mm between the clamps"), files,
        digests(strips, [(s.angle, s.force) for s in strips]), [s.name for s in strips],
        [(f"{a:g} deg [N]", ".4g", values) for a, values in forces.items()],
        [
            *(f"{s.name}: up to {s.angle[-1]:.3g} deg{turned[s.turned]}" for s in strips),
            "angles are those of yarns that keep their length and do not slip, from the travel of the clamp",
        ],
        Curves(
            curves, band(curves, end, "shear angles"), NAMES,
            ("shear angle, pin-jointed [deg]", "normalised shear force [N/mm]"),
        ),
    )  # fmt: skip


def _rigs(tests: Mapping[str, dict[str, Any]]) -> Rigs:
    """Both lengths, and the angle that all specimens reach."""
    if NAME not in tests:
        return {}
    sizes, end = tests[NAME]["conditions"], math.floor(10.0 * min(tests[NAME][END]["values"])) / 10.0
    found = {"gauge_length": sizes[GAUGE.key], "width": sizes[WIDTH.key], "max_angle": end}
    return {NAME: {name: plain(value) for name, value in found.items()}}


LAB = LabTest(read_strips, strip_results, (WIDTH, GAUGE), ("sign", "zero", "preload"), rigs=_rigs)
