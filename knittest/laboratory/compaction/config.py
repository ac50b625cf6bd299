"""Config of the compaction test: fields and presets."""

from typing import Any, ClassVar, Literal

from pydantic import Field

from knittest.base.kinds import Stated
from knittest.config.base import Kernel, number
from knittest.config.rigs import Rig
from knittest.config.run import Run


class CompactionRig(Rig):
    """Compaction: two smooth square plates close on a larger piece of fabric until a pressure is reached."""

    spans = ("side",)

    kind: Literal["compaction"] = "compaction"
    side: float = number(
        25.0, "mm", "side of the plates, in whole pitches; the piece is a pitch larger all round", gt=0, band=(5, 200)
    )
    side_mm: ClassVar[Kernel[float]] = Kernel("side")
    max_pressure: float = number(
        1000.0, "kPa", "mean pressure of the plates at which the test ends", gt=0, band=(10, 1e4)
    )
    max_pressure_mpa: ClassVar[Kernel[float]] = Kernel("max_pressure")
    membrane_share: float = number(
        0.05, "1", "share of the yarns' axial stiffness that is kept: none is pulled, and the step grows", gt=0, le=1
    )


class CompactionRun(Run):
    """A compaction test."""

    rig: CompactionRig = Field(default_factory=CompactionRig)


#: side of the plates [mm]
SIDE = {"quick": 15.0, "standard": 25.0, "paper": 50.0}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset``: slow enough for a pressure of 0.1 kPa, which inertia would exceed."""
    model = {"meso": {"elements_per_loop": 30, "elements_per_wave": 4}}
    solver = {"speed": 0.04, "damping": 0.3, "safety": 0.7, "ramp": 2.0}
    return {"model": model, "rig": {"side": SIDE[preset]}, "solver": solver}
