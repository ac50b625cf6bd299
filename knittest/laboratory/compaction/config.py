"""Config of the compaction test."""

from typing import ClassVar, Literal

from pydantic import Field

from knittest.config.base import number
from knittest.config.kernel_units import Kernel
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
