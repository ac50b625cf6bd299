"""Presets of the friction test."""

from typing import Any

from knittest.base.kinds import Stated

#: width of a strip of yarns [mm]
WIDTH = {"quick": 15.0, "standard": 25.0, "paper": 50.0}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset`` at ``scale``.

    What slides must not be held back by damping: m c v is a force; the test is seen from the clamp, where the strip
    hardly moves. Penalties grow with the inverse square of the step: plates want them stiff. What slides of yarns is
    the loops' crowns, and 22 and 6 are the 26,000 beams of the paper's strip; with 30 and 8 the pull force changes by
    0.6 %, the compression by 4 %.
    """
    if scale == "macro":
        return {"model": BEAMS, "solver": {"speed": 1.0, "ramp": 0.5, "damping": 1.0, "safety": 0.55}}
    return {
        "model": BEAMS, "rig": {"width": WIDTH[preset]}, "solver": {"speed": 2.0, "ramp": 0.5, "damping": 5.0},
    }  # fmt: skip


BEAMS = {"meso": {"elements_per_loop": 22, "elements_per_wave": 6}}
