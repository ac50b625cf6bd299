"""Shear law of a fabric that follows from its picture frames."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from knittest.experiment.lab_conditions import FABRIC_SIDE, FRAME_SIDE
from knittest.experiment.lab_folder import SHEAR, counted, folder_name

NAME = "picture-frame"


def fabric_of(tests: Mapping[str, dict[str, Any]], place: Path) -> dict[str, Any]:
    """Curve of the shear law."""
    own = folder_name(NAME, "")
    return {"macro": {"shear": _shear(tests[own], (place / own / SHEAR).as_posix())}} if own in tests else {}


def _shear(test: dict[str, Any], curve: str) -> dict[str, Any]:
    frame, fabric = (test["conditions"][side.key] for side in (FRAME_SIDE, FABRIC_SIDE))
    count = next(value["n"] for name, value in test.items() if name.startswith("shear_force_n_at_deg"))
    ref = f"{counted(count, 'picture frame')} of {frame:g} mm, fabric of {fabric:g} mm"
    return {"kind": "table", "curve": curve, "source": "measured", "ref": ref}
