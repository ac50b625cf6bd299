"""Presets of the tensile test."""

from typing import Any

from knittest.base.kinds import Stated

#: clamp distance of yarns [mm]; paper has that of the paper, which a shell model is cheap enough to keep
GAUGE = {"quick": 50.0, "standard": 100.0, "paper": 200.0}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset`` at ``scale``.

    A tension curve is an input of the shells and must come back within 1 %, which takes calm, and a shell breaks at its
    largest strain: central differences swell the waves of an element by 1 / sqrt(1 - (omega dt / 2)^2).
    """
    if scale == "macro":
        return {"solver": {"speed": 0.5, "safety": 0.55}}
    return {"rig": {"gauge_length": GAUGE[preset]}}
