"""Files of friction tests as ``knittest data`` takes them: pull force of a strip between two plates over its travel."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knittest.base.errors import InputError
from knittest.experiment import lab_shear as checks
from knittest.experiment.lab_conditions import NORMAL_FORCE, PLATE_LENGTH, PLATE_WIDTH, common_value
from knittest.experiment.lab_recording import Origin, Recording, make_reader
from knittest.experiment.lab_results import Curves, Results
from knittest.experiment.lab_tests import LabTest, Rigs
from knittest.experiment.lab_units import round_number
from knittest.experiment.statistics import Array, band
from knittest.laboratory.friction.config import FrictionRig

#: length of strip outside the plates besides the travel [mm]
FREE_LENGTH = 40.0
#: last share of the travel, whose mean force is the kinetic one; the largest before it is the static one: as in a run
KINETIC_SHARE = 0.5
#: travel of a test [mm], and Coulomb coefficient of one face
TRAVELS, COEFFICIENTS = (1.0, 1000.0), (0.005, 2.0)
SIZES = (NORMAL_FORCE, PLATE_LENGTH, PLATE_WIDTH)
#: coefficients of a face
STATIC, KINETIC = "mu_static_per_face", "mu_per_face"
UNITS = {"pull_force_static_n": "N", "pull_force_kinetic_n": "N", "mu_paper": "1", KINETIC: "1", STATIC: "1"}


@dataclass(frozen=True)
class FrictionSpecimen(Origin):
    """Travel [mm] and pull force [N] of a strip, (n,); ``sizes``: normal force [N], length and width [mm] of plates."""

    travel: Array
    force: Array
    largest: Array
    sizes: tuple[float, float, float]
    faces: int

    @property
    def kinetic(self) -> float:
        """Mean force [N] over the last half of the travel, over travel and not over samples."""
        late = np.linspace((1.0 - KINETIC_SHARE) * self.travel[-1], self.travel[-1], 1001)
        return float(np.interp(late, self.travel, self.force).mean())

    @property
    def static(self) -> float:
        """Largest force [N] before half the travel."""
        return float(self.largest[self.travel <= (1.0 - KINETIC_SHARE) * self.travel[-1]].max())


def _read_specimen(r: Recording) -> FrictionSpecimen:
    origin, given, (normal, long, wide) = r.read(), r.given, r.require(*SIZES)
    force = r.values["force"] if "force" in r.values else r.values["coefficient"] * normal
    travel = checks.to_rising_travel(r.travel(), given.sign)
    rows, _ = checks.first_loading(travel)
    way_out = checks.to_tension_force(force[: rows[-1] + 1], given.sign, r.place)
    travel, force, largest = travel[rows] - travel[0], way_out[rows], np.maximum.reduceat(way_out, rows)
    if len(travel) < 3 or not TRAVELS[0] <= travel[-1] <= TRAVELS[1]:
        raise InputError(
            f"{r.place}: {len(travel)} rows over a travel of {travel[-1]:.4g} mm; expected at least 3, over "
            f"{TRAVELS[0]:g} to {TRAVELS[1]:g} mm: check the unit of the travel"
        )
    free = checks.remove_preload(force, given.preload, r.place)
    if "coefficient" in r.values:
        faces = "both faces together" if given.faces == 2 else "one face"
        origin["notes"] += (
            f"coefficient of friction: read as pull force over normal force, F_R/F_N, of {faces} (--faces)",
        )
    return FrictionSpecimen(
        **origin, travel=travel, force=free, largest=largest + (free[0] - force[0]),
        sizes=(normal, long, wide), faces=given.faces,
    )  # fmt: skip


def _results(strips: Sequence[FrictionSpecimen]) -> Results:
    """Pull forces and coefficients; forces of a strip that rubs on one face are those of another test."""
    sizes = [(what, common_value(what, [s.sizes[k] for s in strips], strips)) for k, what in enumerate(SIZES)]
    static, kinetic = np.array([[s.static, s.kinetic] for s in strips]).T
    faces, normal = strips[0].faces, np.array([s.sizes[0] for s in strips])
    at_rest, per_face = (force / (faces * normal) for force in (static, kinetic))  # F_R / (faces F_N)
    for s, force, mu in zip(strips, kinetic, per_face, strict=True):
        text = f"a pull force of {force:.4g} N under {s.sizes[0]:g} N is a coefficient of {mu:.4g} per face"
        checks.refuse_implausible(s, mu, COEFFICIENTS, text, "", force)
    checks.refuse_outliers(strips, per_face, "coefficient of a face", "")
    found = {"mu_paper": 2.0 * per_face, KINETIC: per_face, STATIC: at_rest}
    if faces == 2:
        scale = sizes[0][1] / normal
        found = {"pull_force_static_n": static * scale, "pull_force_kinetic_n": kinetic * scale} | found
    rubbing = f"{faces} face{'s' * (faces > 1)} rubbing"
    curves = [(s.travel, s.force) for s in strips]
    corridor = band(curves, min(float(s.travel[-1]) for s in strips), "travel")
    return Results(
        found, UNITS, sizes, ("strip", f"under {sizes[0][1]:g} N, {rubbing}"), checks.digests(strips, curves),
        [
            ("static [N]", ".4g", static), ("kinetic [N]", ".4g", kinetic),
            ("F_R/F_N of two faces", ".4g", 2.0 * per_face), ("of a face", ".4g", per_face),
        ],
        [
            f"kinetic: mean over the last half of the travel; static: largest before it; {rubbing} (--faces)",
            "pull forces must be those of the strip alone: subtract the force of the empty rig before",
        ],
        Curves(
            curves, corridor, ("displacement_mm", "pull_force_n", "pull_force_sd_n"), ("travel [mm]", "pull force [N]")
        ),
    )  # fmt: skip


def _rig(test: dict[str, Any]) -> dict[str, float]:
    sizes, kinetic, usual = test["conditions"], test[KINETIC]["mean"], FrictionRig()
    found = {
        "static_coefficient": max(test.get(STATIC, test[KINETIC])["mean"], kinetic), "kinetic_coefficient": kinetic,
        "normal_force": sizes[NORMAL_FORCE.key], "plate_length": sizes[PLATE_LENGTH.key],
        "plate_width": sizes[PLATE_WIDTH.key],
    }  # fmt: skip
    if found["plate_length"] + usual.travel >= usual.length:
        found["length"] = found["plate_length"] + usual.travel + FREE_LENGTH
    if found["plate_width"] < usual.width:
        found["width"] = found["plate_width"]
    return found


def _rigs(rubbed: Rigs) -> Rigs:
    """Fields by direction; tools of forming get the mean friction of both, or one direction's under its name."""
    fields = ("static_coefficient", "kinetic_coefficient")
    forming: dict[str, Any] = {d: {field: one[field] for field in fields} for d, one in rubbed.items()}
    if len(rubbed) > 1:
        forming = {field: round_number(sum(one[field] for one in rubbed.values()) / len(rubbed)) for field in fields}
    return {"friction": dict(rubbed), "forming": forming}


LAB = LabTest(
    "friction",
    make_reader([("force", "coefficient"), ("travel",)], "a pull force and a travel", _read_specimen), _results, SIZES,
    ("sign", "preload", "faces"), _rig, more_rigs=_rigs,
)  # fmt: skip
