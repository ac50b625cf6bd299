"""Files of bias extension tests as ``knittest data`` takes them: force of the clamp over its travel."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment import lab_names
from knittest.experiment.lab_checks import common
from knittest.experiment.lab_conditions import GAUGE, STANDARD, WIDTH, agreeing, stated
from knittest.experiment.lab_folder import Tests
from knittest.experiment.lab_given import Given
from knittest.experiment.lab_recording import Recording, of, reader
from knittest.experiment.lab_results import Results
from knittest.experiment.lab_shear import END, Sheared, Tested, reached, shear_curve, shear_curves, shear_forces
from knittest.experiment.lab_tests import LabTest, Rigs
from knittest.experiment.lab_units import plain
from knittest.laboratory.bias_extension.pin_jointed import BiasStrip

Array = NDArray[np.float64]

NAME = "bias-extension"


@dataclass(frozen=True)
class Pulled(Sheared):
    """Specimen whose angle is that of pin-jointed yarns; ``turned`` says that more loading follows."""

    strip: BiasStrip
    turned: bool

    @property
    def normalised(self) -> Array:
        """Normalised shear force [N/mm], (n,)."""
        return self.strip.normalised(self.force, np.deg2rad(self.angle))


def _pulled(r: Recording, given: Given) -> Pulled:
    """The travel of the clamp, or its strain, becomes the angle; one that was measured is another one, and not read."""
    length, width = r.needed([GAUGE, WIDTH], given)
    standard = stated(STANDARD, r.table)
    if "travel" in r.values and lab_names.is_kind("standard", r.title("travel")) and standard:
        agreeing(GAUGE, [(length, f"{r.where}: the clamps"), standard])  # that of a part is none of the clamp
    try:
        strip = BiasStrip(length, width)
    except InputError as error:
        raise InputError(f"{r.origin.path}: {error}") from None
    tested = Tested(
        NAME, strip.angle, strip.longest, f"a strip {width:g} mm wide, {length:g} mm between the clamps,",
        "the strip not yet sheared", f"{GAUGE.option}, {WIDTH.option}", length,
    )  # fmt: skip
    curve = shear_curve(r, tested, given)
    return Pulled(**of(r), angle=curve.angle, force=curve.force, strip=strip, turned=curve.turned)


def _results(strips: Sequence[Pulled]) -> Results:
    """Forces at angles, and the same normalised."""
    length = common(GAUGE, [s.strip.length for s in strips], strips)
    width = common(WIDTH, [s.strip.width for s in strips], strips)
    normalised, digests = shear_forces(strips)
    forces = {a: np.array([np.interp(a, s.angle, s.force) for s in strips]) for a in normalised}
    found = {f"bias_normalised_force_n_per_mm_at_deg.{a:g}": values for a, values in normalised.items()}
    found |= {f"bias_force_n_at_deg.{a:g}": values for a, values in forces.items()}
    units = {name: "N/mm" if "n_per_mm" in name else "N" for name in found} | {END: "deg"}
    turned = {True: ", turns there: first loading alone", False: ""}
    return Results(
        found | {END: np.array([s.angle[-1] for s in strips])}, units, [(GAUGE, length), (WIDTH, width)],
        ("strip", f"on the bias, {width:g} mm wide, {length:g} mm between the clamps"), digests,
        [(f"{a:g} deg [N]", ".4g", values) for a, values in forces.items()],
        [
            *(f"{s.name}: up to {s.angle[-1]:.3g} deg{turned[s.turned]}" for s in strips),
            "angles are those of yarns that keep their length and do not slip, from the travel of the clamp",
        ],
        shear_curves(strips, "shear angle, pin-jointed"),
    )  # fmt: skip


def _rigs(tests: Tests) -> Rigs:
    """Both lengths, and the angle that all specimens reach."""
    if NAME not in tests:
        return {}
    sizes = tests[NAME]["conditions"]
    found = {"gauge_length": sizes[GAUGE.key], "width": sizes[WIDTH.key], "max_angle": reached(tests[NAME])}
    return {NAME: {name: plain(value) for name, value in found.items()}}


LAB = LabTest(
    NAME, reader([("force",), ("travel", "extensometer")], "a force and a displacement of the clamp", _pulled),
    _results, (WIDTH, GAUGE), ("sign", "zero", "preload"), _rigs,
)  # fmt: skip
