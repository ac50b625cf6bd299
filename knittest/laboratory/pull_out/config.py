"""Config of the pull-out test: fields, presets and the size that is shown."""

from typing import Any, ClassVar, Literal

from pydantic import Field

from knittest.base.kinds import Stated
from knittest.config.base import Kernel, number
from knittest.config.rigs import StripRig
from knittest.config.run import Run


class PullOutRig(StripRig):
    """Pull-out: the middle inlay of a direction is pulled out of a piece of fabric whose other yarns are clamped."""

    spans = ("width", "length")

    kind: Literal["pull-out"] = "pull-out"
    width: float = number(25.0, "mm", "width of the piece, across the pulled inlay", gt=0, band=(10, 200))
    width_mm: ClassVar[Kernel[float]] = Kernel("width")
    length: float = number(30.0, "mm", "embedded length: that of the piece along the inlay", gt=0, band=(10, 500))
    length_mm: ClassVar[Kernel[float]] = Kernel("length")
    travel: float = number(10.0, "mm", "way of the inlay's clamp", gt=0, band=(0.5, 400))
    travel_mm: ClassVar[Kernel[float]] = Kernel("travel")
    clamped_edges: Literal["sides", "far"] = Field(
        "sides",
        description="edges of the piece that are clamped, a pitch wide: both sides along the inlay, or the far end, "
        "where the inlay is cut loose",
    )
    membrane_share: float = number(
        0.05, "1", "share of the yarns' axial stiffness that is kept: forces are small, and the step grows", gt=0, le=1
    )


class PullOutRun(Run):
    """A pull-out test."""

    rig: PullOutRig = Field(default_factory=PullOutRig)


#: width and length of the piece, way of the clamp [mm]
SIZES = {"quick": (18.0, 22.0, 8.0), "standard": (25.0, 30.0, 10.0), "paper": (50.0, 60.0, 20.0)}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset``; eight beams a wave, since the inlay's own wave is bent as it slides."""
    model = {"meso": {"elements_per_loop": 24, "elements_per_wave": 8}}
    solver = {"speed": 0.14, "damping": 0.05, "safety": 0.7, "ramp": 2.0}
    rig = dict(zip(("width", "length", "travel"), SIZES[preset], strict=True))
    return {"model": model, "rig": rig, "solver": solver}


def size_texts(run: PullOutRun) -> tuple[str, ...]:
    """Size of the piece, where it is clamped and how far the inlay is pulled, in words."""
    rig = run.rig
    where = "both sides" if rig.clamped_edges == "sides" else "its far end"
    return f"piece {rig.length:g} x {rig.width:g} mm", f"clamped at {where}", f"inlay pulled by {rig.travel:g} mm"
