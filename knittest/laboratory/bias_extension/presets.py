"""Presets of the bias extension test."""

from typing import Any

from knittest.base.kinds import Stated

#: width of a strip of yarns [mm]; it is twice as long
WIDTH = {"quick": 30.0, "standard": 50.0, "paper": 80.0}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset`` at ``scale``.

    Slow enough that the force of the start, which the normalisation carries on to twice, four and eight times its
    angle, is small against that of the law. Yarns start at the speed that the softest loops bear and get faster
    (:mod:`knittest.laboratory.bias_extension.rig`).
    """
    model = {"meso": {"elements_per_loop": 30, "elements_per_wave": 4}}
    if scale == "macro":
        return {"model": model, "solver": {"speed": 0.2, "ramp": 20.0, "damping": 0.005}}
    width = WIDTH[preset]
    solver = {"speed": 0.1, "ramp": 5.0, "damping": 0.01, "safety": 0.7}
    return {"model": model, "rig": {"width": width, "gauge_length": 2.0 * width}, "solver": solver}
