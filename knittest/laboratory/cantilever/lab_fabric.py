"""Fields of a fabric that follow from its overhangs."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from knittest.experiment.lab_conditions import AREA_MASS
from knittest.experiment.lab_folder import DIRECTIONS, counted, folder_name, quantity


def fabric_of(tests: Mapping[str, dict[str, Any]], place: Path) -> dict[str, Any]:
    """Bending stiffness of the shells by direction, and the area mass that came with the overhangs and made it."""
    names = {direction: folder_name("cantilever", direction) for direction in DIRECTIONS}
    own = {direction: tests[name] for direction, name in names.items() if name in tests}
    if not own:
        return {}
    masses = [test["conditions"][AREA_MASS.key] for test in own.values()]
    mean = {"mean": sum(masses) / len(masses), "sd": None}
    bending = {direction: _stiffness(test) for direction, test in own.items()}
    if len(bending) == 1:
        bending |= _as_the_other(*bending.items())
    said = f"stated with {place.as_posix()}: {', '.join(names[direction] for direction in own)}"
    return {
        "area_mass": quantity(mean, "measured", said),
        "macro": {"bending_stiffness": {direction: bending[direction] for direction in DIRECTIONS}},
    }


def _as_the_other(known: tuple[str, dict[str, Any]]) -> dict[str, Any]:
    """The bending stiffness of a direction without overhangs, assumed to be that of the tested one."""
    (other,) = (d for d in DIRECTIONS if d != known[0])
    return {other: quantity({"mean": known[1]["value"], "sd": None}, "assumed", f"as {known[0]}: none of the {other}")}


def _stiffness(test: dict[str, Any]) -> dict[str, Any]:
    """Bending stiffness of the shells, by Eq. 2, from each strip's overhang."""
    found, overhang = test["bending_stiffness_n_mm_per_width"], test["overhang_mm"]
    mass = test["conditions"][AREA_MASS.key]
    of = f"{counted(found['n'], 'strip')}, overhang {overhang['mean']:.4g} mm, {mass:g} g/m2"
    return quantity(found, "derived", f"area mass x g x (overhang / 2)^3; {of}")
