"""Presets of the picture frame test."""

from typing import Any

from knittest.base.kinds import Stated

#: side of a square of yarns [mm]
SIDE = {"quick": 50.0, "standard": 100.0, "paper": 200.0}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset`` at ``scale``; shear waves cross a large square later."""
    model = {"meso": {"elements_per_loop": 30, "elements_per_wave": 4}}
    if scale == "macro":
        return {"model": model, "solver": {"speed": 0.5, "ramp": 5.0, "damping": 0.002}}
    side = SIDE[preset]
    solver = {"speed": 3.0, "damping": 0.01, "safety": 0.7, "ramp": max(2.0, side / 50.0)}
    return {"model": model, "rig": {"side": side}, "solver": solver}
