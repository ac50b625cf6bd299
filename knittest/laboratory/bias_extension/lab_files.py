"""Files of bias extension tests as ``knittest data`` takes them: force of the clamp over its travel."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knittest.base.errors import InputError
from knittest.experiment.lab_conditions import GAUGE, STANDARD, WIDTH, common_value, sizes_agree
from knittest.experiment.lab_recording import Array, Recording, make_reader
from knittest.experiment.lab_results import Results
from knittest.experiment.lab_shear import (
    ShearLoading,
    ShearSetup,
    max_angle_field,
    shear_curve,
    shear_curves,
    shear_forces,
    shear_rows,
)
from knittest.experiment.lab_tests import LabTest
from knittest.laboratory.bias_extension.strip import BiasStrip

NAME = "bias-extension"


@dataclass(frozen=True)
class BiasSpecimen(ShearLoading):
    """Specimen whose angle is that of pin-jointed yarns."""

    strip: BiasStrip

    @property
    def normalised_force(self) -> Array:
        """Normalised shear force [N/mm], (n,)."""
        return self.strip.normalised_force(self.force, np.deg2rad(self.angle))


def _read_specimen(r: Recording) -> BiasSpecimen:
    """Convert travel or strain of the clamp to the angle; a measured angle is not read."""
    origin, (length, width) = r.read(), r.require(GAUGE, WIDTH)
    part = r.find(STANDARD) if "travel" in r.values and r.is_kind(r.columns["travel"], "standard") else None
    if part is not None and not sizes_agree(part, length):
        both = f"{part:g} mm, the clamps {length:g} mm"
        raise InputError(f"{r.place}: the standard travel has a gauge length of {both}: keep the right one")
    try:
        strip = BiasStrip(length, width)
    except InputError as error:
        raise InputError(f"{r.path}: {error}") from None
    tested = ShearSetup(
        NAME, strip.angle, strip.longest, f"a strip {width:g} mm wide, {length:g} mm between the clamps,",
        "the strip not yet sheared", f"{GAUGE.option}, {WIDTH.option}", length,
    )  # fmt: skip
    sheared, _ = shear_curve(r, tested)
    return BiasSpecimen(**origin, **sheared, strip=strip)


def _results(strips: Sequence[BiasSpecimen]) -> Results:
    length = common_value(GAUGE, [s.strip.length for s in strips], strips)
    width = common_value(WIDTH, [s.strip.width for s in strips], strips)
    normalised, digests = shear_forces(strips)
    forces = {a: np.array([np.interp(a, s.angle, s.force) for s in strips]) for a in normalised}
    rows = {"bias_normalised_force_n_per_mm": normalised, "bias_force_n": forces}
    found, units = shear_rows(strips, rows, {})
    turned = {True: ", then unloads: first loading only", False: ""}
    return Results(
        found, units, [(GAUGE, length), (WIDTH, width)],
        ("strip", f"on the bias, {width:g} mm wide, {length:g} mm between the clamps"), digests,
        [(f"{a:g} deg [N]", ".4g", values) for a, values in forces.items()],
        [
            *(f"{s.name}: up to {s.angle[-1]:.3g} deg{turned[s.turned]}" for s in strips),
            "angles follow from the travel of the clamp, for yarns that neither stretch nor slip",
        ],
        shear_curves(strips, "shear angle, pin-jointed"),
    )  # fmt: skip


def _rig(test: dict[str, Any]) -> dict[str, float]:
    sizes = test["conditions"]
    return {"gauge_length": sizes[GAUGE.key], "width": sizes[WIDTH.key], **max_angle_field(test)}


LAB = LabTest(
    NAME,
    make_reader([("force",), ("travel", "extensometer")], "a force and a displacement of the clamp", _read_specimen),
    _results, (WIDTH, GAUGE), ("sign", "zero", "preload"), _rig,
)  # fmt: skip
