"""Config of the biaxial test: fields and presets."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import Field

from knittest.base.kinds import Stated
from knittest.config.base import Kernel, number
from knittest.config.fabric import Direction
from knittest.config.rigs import Rig
from knittest.config.run import Run
from knittest.config.structure import DIRECTIONS


class BiaxialRig(Rig):
    """Biaxial test: a square on needles that slide along its four sides, pulled along warp and weft at once."""

    spans = ("side",)

    kind: Literal["biaxial"] = "biaxial"
    direction: Direction = Field("warp", description="yarn system whose force is read over its strain")
    ratio: float = number(
        1.0, "1", "strain of the other system over that of the direction; 0: it is held at its length", ge=0, le=10
    )
    side: float = number(100.0, "mm", "side of the square between the needles", gt=0, band=(10, 1000))
    side_mm: ClassVar[Kernel[float]] = Kernel("side")
    max_strain: float = number(
        4.0, "%", "stop at this engineering strain of the system that is strained more; meso squares without inlays "
        "in the strained directions: 40, or where their loops lock", gt=0, le=100, band=(0.05, 100),
    )  # fmt: skip
    max_strain_fraction: ClassVar[Kernel[float]] = Kernel("max_strain")
    stop_force_ratio: float = number(
        0.2, "1", "stop when the force of the direction has fallen to this share of its peak", ge=0, le=1
    )


class BiaxialRun(Run):
    """A biaxial test."""

    rig: BiaxialRig = Field(default_factory=BiaxialRig)
    soft_sheet: ClassVar[Mapping[tuple[str, str], float]] = {
        ("rig", "max_strain"): 10.0, ("solver", "speed"): 0.1, ("solver", "damping"): 0.02,
    }  # fmt: skip

    @property
    def pulls_loops(self) -> bool:
        """See :class:`Run`."""
        strained = DIRECTIONS if self.rig.ratio > 0.0 else (self.rig.direction,)
        return self.model.scale == "meso" and not any(self.fabric.inlays_along(one) for one in strained)

    def structure_defaults(self) -> dict[tuple[str, str], float]:
        """Knits stretch by tens of per cent under small forces."""
        return dict(KNIT) if self.pulls_loops else super().structure_defaults()


#: strain [%], speed [m/s] and damping [1/ms] of squares of loops without inlays
KNIT = {("rig", "max_strain"): 40.0, ("solver", "speed"): 0.2, ("solver", "damping"): 0.02}
#: side of a square of yarns [mm]
SIDE = {"quick": 30.0, "standard": 50.0, "paper": 100.0}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset`` at ``scale``; of shells those of the tensile test: the input comes back."""
    if scale == "macro":
        return {"solver": {"speed": 0.5, "safety": 0.55}}
    return {"rig": {"side": SIDE[preset]}}
