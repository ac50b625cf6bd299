"""Presets of the biaxial test."""

from typing import Any

from knittest.base.kinds import Stated

#: side of a square of yarns [mm]
SIDE = {"quick": 30.0, "standard": 50.0, "paper": 100.0}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset`` at ``scale``; of shells those of the tensile test: the input comes back."""
    if scale == "macro":
        return {"solver": {"speed": 0.5, "safety": 0.55}}
    return {"rig": {"side": SIDE[preset]}}
