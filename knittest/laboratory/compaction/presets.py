"""Presets of the compaction test."""

from typing import Any

from knittest.base.kinds import Stated

#: side of the plates [mm]
SIDE = {"quick": 15.0, "standard": 25.0, "paper": 50.0}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset``: slow enough for a pressure of 0.1 kPa, which inertia would exceed."""
    model = {"meso": {"elements_per_loop": 30, "elements_per_wave": 4}}
    solver = {"speed": 0.04, "damping": 0.3, "safety": 0.7, "ramp": 2.0}
    return {"model": model, "rig": {"side": SIDE[preset]}, "solver": solver}
