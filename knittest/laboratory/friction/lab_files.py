"""Files of friction tests as ``knittest data`` takes them, and the rigs that their coefficients hold for."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from knittest.experiment.lab_conditions import NORMAL_FORCE, PLATE_LENGTH, PLATE_WIDTH
from knittest.experiment.lab_folder import DIRECTIONS, folder_name
from knittest.experiment.lab_kind import LabTest, Rigs
from knittest.experiment.lab_numbers import plain
from knittest.laboratory.friction.config import FrictionRig
from knittest.laboratory.friction.lab_pulls import KINETIC, STATIC, friction_lines, read_friction, write_friction

#: length of strip that sticks out of long plates besides the travel [mm]
STICKS_OUT = 40.0
COEFFICIENTS = ("static_coefficient", "kinetic_coefficient")
_RUBBED = re.compile(r"friction|reib(ung|versuch|kraft|beiwert|zahl)", re.I)
_NAMED = re.compile(r"friction|reib", re.I)


def _looks(cells: Sequence[str]) -> bool:
    return any(PLATE_LENGTH.names(cell, 0) or PLATE_WIDTH.names(cell, 0) or _RUBBED.search(cell) for cell in cells)


def _rigs(tests: Mapping[str, dict[str, Any]]) -> Rigs:
    """Fields by direction; tools of forming get the mean friction of both, or that of the one that was tested, under
    its name: so runs of the other and of forming know that it is taken over.
    """
    names = {d: folder_name("friction", d) for d in DIRECTIONS}
    rubbed = {d: _friction(tests[name]) for d, name in names.items() if name in tests}
    if not rubbed:
        return {}
    coefficients = {d: {field: one[field] for field in COEFFICIENTS} for d, one in rubbed.items()}
    if len(rubbed) == 1:
        return {"friction": dict(rubbed), "forming": dict(coefficients)}
    mean = {field: plain(sum(one[field] for one in rubbed.values()) / len(rubbed)) for field in COEFFICIENTS}
    return {"friction": dict(rubbed), "forming": mean}


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
    return {name: plain(value) for name, value in found.items()}


LAB = LabTest(
    read_friction, friction_lines, write_friction, (NORMAL_FORCE, PLATE_LENGTH, PLATE_WIDTH),
    ("sign", "preload", "faces"), _looks, _NAMED, _rigs,
)  # fmt: skip
