"""Presets of the friction test."""

from typing import Any

from knittest.base.kinds import Stated

#: width of a strip of yarns [mm], and normal force over its width [N/mm]: that of the paper, 2000 N on 50 mm
WIDTH, PRESSED = {"quick": 15.0, "standard": 25.0, "paper": 50.0}, 40.0
BEAMS = {"meso": {"elements_per_loop": 22, "elements_per_wave": 6}}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset`` at ``scale``.

    What slides must not be held back by damping: m c v is a force; the test is seen from the clamp, where the strip
    hardly moves. Penalties grow with the inverse square of the step: plates want them stiff. What slides of yarns is
    the loops' crowns, and 22 and 6 are the 26,000 beams of the paper's strip; with 30 and 8 the pull force changes by
    0.6 %, the compression by 4 %. A narrow strip of yarns is under the pressure of the paper's.

    Speed, ramp and ``rig.membrane_share`` of yarns against half the speed, a third of the ramp and the whole axial
    stiffness, at 2000 N, quick, both directions of variants 1 and 2: kinetic force within 0.15 %, static force -0.6 to
    +1.3 %, compression +0.6 to +4 % (0.007 mm), in 0.25 to 0.33 of the processor time.
    """
    if scale == "macro":
        return {"model": BEAMS, "solver": {"speed": 1.0, "ramp": 0.5, "damping": 1.0, "safety": 0.55}}
    width = WIDTH[preset]
    given = stated("width")
    force = PRESSED * (given if isinstance(given, int | float) and given > 0.0 else width)
    return {
        "model": BEAMS, "rig": {"width": width, "normal_force": force},
        "solver": {"speed": 4.0, "ramp": 1.5, "damping": 2.0},
    }  # fmt: skip
