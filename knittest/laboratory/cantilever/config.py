"""Config of the cantilever test: fields, presets and the origin of its results."""

from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.base.kinds import Stated
from knittest.config.base import BoundsError, Kernel, number
from knittest.config.rigs import StripRig
from knittest.config.run import Run
from knittest.experiment.origin import Origin, RowKind


class CantileverRig(StripRig):
    """Cantilever after DIN 53362: a strip bends over an edge under its own weight."""

    spans = ("width", "length")
    usual = {"membrane_share": 0.01}  # noqa: RUF012

    kind: Literal["cantilever"] = "cantilever"
    mode: Literal["angle", "overhang"] = Field(
        "angle",
        description="angle: the overhang is given, the chord angle comes out (the paper's simulation); "
        "overhang: the strip is advanced until its chord has the angle of the plane (the laboratory)",
    )
    overhang: float | None = number(
        None, "mm", "overhang; none: the mean measured one of the fabric's experiment, or an estimate by Eq. 2 for a "
        "chord angle of 41.5 deg", gt=0, band=(5, 1000),
    )  # fmt: skip
    overhang_mm: ClassVar[Kernel[float | None]] = Kernel("overhang")
    plane_angle: float = number(41.5, "deg", "angle of the plane", gt=0, le=80)
    length: float = number(300.0, "mm", "length of the strip", gt=0, band=(10, 2000))
    length_mm: ClassVar[Kernel[float]] = Kernel("length")
    gravity: float = number(9.81, "m/s2", "gravity", gt=0, band=(0.1, 100))
    gravity_mm_per_ms2: ClassVar[Kernel[float]] = Kernel("gravity")
    membrane_share: float | None = number(
        None, "1", "share of the membrane stiffness that is kept: bending decides, and the step grows; none: 0.01, of "
        "shells what bending needs where that is more", gt=0, le=1,
    )  # fmt: skip
    tolerance: float = number(
        1e-4, "1", "residual force over weight, and drift over deflection, of shells at rest", gt=0, le=0.1
    )

    @model_validator(mode="after")
    def _strip_reaches_out(self) -> Self:
        if self.overhang is not None and self.overhang >= self.length:
            raise BoundsError(f"must be less than rig.length = {self.length:g} mm", "overhang")
        return self


class CantileverRun(Run):
    """A cantilever test."""

    rig: CantileverRig = Field(default_factory=CantileverRig)


#: width of a strip of yarns [mm]; in a strip of four, one yarn that sticks out prevents the equilibrium
WIDTH = {"quick": 25.0, "standard": 25.0, "paper": 50.0}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, object]:
    """Settings of ``preset`` at ``scale``."""
    found: dict[str, object] = {"model": {"meso": {"elements_per_loop": 24, "elements_per_wave": 4}}}
    return found if scale == "macro" else found | {"rig": {"width": WIDTH[preset]}}


class CantileverOrigin(Origin[CantileverRun]):
    """See :class:`knittest.experiment.origin.Origin`."""

    def given_results(self, run: CantileverRun) -> tuple[str, ...]:
        """The overhang, in the mode angle."""
        return ("overhang_mm",) if run.rig.mode == "angle" else ()

    def input_row_kind(self, run: CantileverRun) -> RowKind:
        """Tuned in the mode overhang: the input bending stiffness follows from it by Eq. 2."""
        return "tuned" if run.rig.mode == "overhang" else "input"
