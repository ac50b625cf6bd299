"""Rigs that imported tests were done with, and the friction that they found, as fields of the rigs of runs."""

import math
from collections.abc import Mapping
from typing import Any

from knittest.config.rigs import FrictionRig
from knittest.experiment.lab_conditions import FABRIC_SIDE, FRAME_SIDE, NORMAL_FORCE, PLATE_LENGTH, PLATE_WIDTH
from knittest.experiment.lab_folder import DIRECTIONS, folder_name

#: rows that rigs are made of: largest angle of each frame, and coefficients of a face
END, STATIC, KINETIC = "end_of_first_loading_deg", "mu_static_per_face", "mu_per_face"
#: length of strip that sticks out of long plates besides the travel [mm]
STICKS_OUT = 40.0

Rigs = dict[str, dict[str, Any]]


def rigs_of(tests: Mapping[str, dict[str, Any]]) -> Rigs:
    """Fields by test, of friction by direction where both were tested; ``tests`` are the statistics of an experiment.

    Tools of forming get the mean friction of the directions.
    """
    found: Rigs = {}
    if (frame := tests.get("picture-frame")) is not None:
        found["picture-frame"] = _frame(frame)
    names = {d: folder_name("friction", d) for d in DIRECTIONS}
    rubbed = {d: _friction(tests[name]) for d, name in names.items() if name in tests}
    if rubbed:
        found["friction"] = dict(rubbed) if len(rubbed) > 1 else next(iter(rubbed.values()))
        found["forming"] = {
            field: _plain(sum(one[field] for one in rubbed.values()) / len(rubbed))
            for field in ("static_coefficient", "kinetic_coefficient")
        }
    return found


def _frame(test: Mapping[str, Any]) -> dict[str, float]:
    """Both sides, and the angle that all specimens reach."""
    sides = test["conditions"]
    found = {"side": sides[FABRIC_SIDE.key], "frame_side": max(sides[FRAME_SIDE.key], sides[FABRIC_SIDE.key])}
    if END in test:
        found["max_angle"] = math.floor(10.0 * min(test[END]["values"])) / 10.0
    return {name: _plain(value) for name, value in found.items()}


def _friction(test: Mapping[str, Any]) -> dict[str, float]:
    """Coefficients of a face, normal force and plates, with a strip that they cover and that can be gripped."""
    sizes, kinetic = test["conditions"], test[KINETIC]["mean"]
    long, wide, usual = sizes[PLATE_LENGTH.key], sizes[PLATE_WIDTH.key], FrictionRig()
    found = {
        "static_coefficient": max(test.get(STATIC, test[KINETIC])["mean"], kinetic), "kinetic_coefficient": kinetic,
        "normal_force": sizes[NORMAL_FORCE.key], "plate_length": long, "plate_width": wide,
    }  # fmt: skip
    if long + usual.travel >= usual.length:
        found["length"] = long + usual.travel + STICKS_OUT
    if wide < usual.width:
        found["width"] = wide
    return {name: _plain(value) for name, value in found.items()}


def _plain(value: float) -> float:
    return float(f"{value:.6g}")
