"""Config of the wire."""

from typing import Any, Literal

from pydantic import Field

from knittest.base.kinds import Stated
from knittest.config.base import number
from knittest.config.rigs import Rig
from knittest.config.run import Run


class WireRig(Rig):
    """A straight wire, one end held, the other pulled."""

    kind: Literal["wire"] = "wire"
    length: float = number(20.0, "mm", "length of the wire", gt=0, band=(1, 1000))
    stiffness: float = number(1000.0, "N", "axial stiffness EA", gt=0, band=(1, 1e6))
    max_strain: float = number(1.0, "%", "strain at the end", gt=0, le=10)


class WireRun(Run):
    """A wire that is pulled."""

    rig: WireRig = Field(default_factory=WireRig)


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset``: the length, and a speed that a wire follows."""
    length = {"quick": 10.0, "standard": 20.0, "paper": 50.0}[preset]
    return {"rig": {"length": length}, "solver": {"speed": 0.05, "ramp": 0.5, "damping": 0.05}}
