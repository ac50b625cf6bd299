"""Config of the bias extension test: fields, presets and the sheet of shells."""

from collections.abc import Mapping
from math import sqrt
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.base.kinds import Stated
from knittest.config.base import BoundsError, Kernel, number
from knittest.config.rigs import Rig
from knittest.config.run import Run


class BiasExtensionRig(Rig):
    """Bias extension: a strip cut at 45 deg to its yarns, one clamp fixed, one pulled."""

    spans = ("gauge_length", "width")

    kind: Literal["bias-extension"] = "bias-extension"
    gauge_length: float = number(200.0, "mm", "distance of the clamps, at least twice the width", gt=0, band=(20, 2000))
    gauge_length_mm: ClassVar[Kernel[float]] = Kernel("gauge_length")
    width: float = number(100.0, "mm", "width of the strip", gt=0, band=(10, 1000))
    width_mm: ClassVar[Kernel[float]] = Kernel("width")
    max_angle: float = number(
        45.0, "deg", "end of the test: shear angle of the middle, of yarns that keep their length", gt=0, le=80
    )
    membrane_share: float = number(
        0.05, "1", "meso: share of the yarns' axial stiffness that is kept: they are far from their strength, and the "
        "step grows", gt=0, le=1,
    )  # fmt: skip

    @model_validator(mode="after")
    def _has_a_middle(self) -> Self:
        if self.gauge_length < 2.0 * self.width:
            raise BoundsError(
                f"must be at least twice the width, {2.0 * self.width:g} mm: else yarns run from clamp to clamp",
                "gauge_length",
            )
        return self


class BiasExtensionRun(Run):
    """A bias extension test."""

    rig: BiasExtensionRig = Field(default_factory=BiasExtensionRig)
    soft_sheet: ClassVar[Mapping[tuple[str, str], float]] = {("solver", "speed"): 0.05, ("solver", "damping"): 0.002}


#: width of a strip of yarns [mm]; it is twice as long
WIDTH = {"quick": 30.0, "standard": 50.0, "paper": 80.0}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset`` at ``scale``.

    The start is slow, as normalisation carries its force on to twice, four and eight times the angle; yarns get faster.
    """
    model = {"meso": {"elements_per_loop": 30, "elements_per_wave": 4}}
    if scale == "macro":
        return {"model": model, "solver": {"speed": 0.2, "ramp": 20.0, "damping": 0.005}}
    width = WIDTH[preset]
    solver = {"speed": 0.1, "ramp": 5.0, "damping": 0.01, "safety": 0.7}
    return {"model": model, "rig": {"width": width, "gauge_length": 2.0 * width}, "solver": solver}


def sheet(run: BiasExtensionRun) -> tuple[float, float]:
    """Length and width [mm] over those of a diamond of four shells, in shells: they are counted by diamonds."""
    diamond = 2.0 * sqrt(2.0)
    return run.rig.gauge_length / diamond, run.rig.width / diamond
