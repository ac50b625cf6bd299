"""Presets of the pull-out test."""

from typing import Any

from knittest.base.kinds import Stated

#: width and length of the piece, way of the clamp [mm]
SIZES = {"quick": (18.0, 22.0, 8.0), "standard": (25.0, 30.0, 10.0), "paper": (50.0, 60.0, 20.0)}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset``; eight beams a wave, since the inlay's own wave is bent as it slides."""
    model = {"meso": {"elements_per_loop": 24, "elements_per_wave": 8}}
    solver = {"speed": 0.14, "damping": 0.05, "safety": 0.7, "ramp": 2.0}
    rig = dict(zip(("width", "length", "travel"), SIZES[preset], strict=True))
    return {"model": model, "rig": rig, "solver": solver}
