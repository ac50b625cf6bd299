"""Presets of the cantilever."""

from knittest.base.kinds import Stated

#: width of a strip of yarns [mm]; with four yarns one that sticks out keeps the strip from its rest
WIDTH = {"quick": 25.0, "standard": 25.0, "paper": 50.0}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, object]:
    """Settings of ``preset`` at ``scale``."""
    found: dict[str, object] = {"model": {"meso": {"elements_per_loop": 24, "elements_per_wave": 4}}}
    return found if scale == "macro" else found | {"rig": {"width": WIDTH[preset]}}
