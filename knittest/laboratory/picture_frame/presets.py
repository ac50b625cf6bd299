"""Presets of the picture frame test."""

from typing import Any

from knittest.base.kinds import Stated

#: side of a square of yarns [mm]
SIDE = {"quick": 50.0, "standard": 100.0, "paper": 200.0}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset`` at ``scale``; shear waves cross a large square later.

    A frame that goes through cycles is driven at a sixth of the speed, of shells at a fifth, with ramps as much longer:
    energies are judged from a small angle on, by which little work is done.
    """
    slower = {"macro": 5.0, "meso": 6.0}[scale] if stated("cycles") else 1.0
    model = {"meso": {"elements_per_loop": 30, "elements_per_wave": 4}}
    if scale == "macro":
        return {"model": model, "solver": {"speed": 0.5 / slower, "ramp": 5.0 * slower, "damping": 0.002}}
    side = SIDE[preset]
    solver = {"speed": 3.0 / slower, "damping": 0.05, "safety": 0.7, "ramp": max(2.0, side / 50.0) * slower}
    return {"model": model, "rig": {"side": side}, "solver": solver}
