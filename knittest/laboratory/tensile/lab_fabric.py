"""Fields of a fabric that follow from its tensile tests."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from knittest.experiment.lab_conditions import GAUGE, WIDTH
from knittest.experiment.lab_folder import DIRECTIONS, TENSION, counted, quantity


def fabric_of(tests: Mapping[str, dict[str, Any]], place: Path) -> dict[str, Any]:
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
