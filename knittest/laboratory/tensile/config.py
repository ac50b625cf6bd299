"""Config of the tensile test: fields and presets."""

from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.base.kinds import Stated
from knittest.config.base import BoundsError, Kernel, number
from knittest.config.rigs import StripRig
from knittest.config.run import Run


class TensileRig(StripRig):
    """Strip tensile test after DIN EN ISO 13934-1: one clamp fixed, one pulled to failure."""

    spans = ("width", "gauge_length")

    kind: Literal["tensile"] = "tensile"
    gauge_length: float = number(200.0, "mm", "distance of the clamps", gt=0, band=(5, 2000))
    gauge_length_mm: ClassVar[Kernel[float]] = Kernel("gauge_length")
    jaw_length: float = number(
        10.0, "mm", "length modelled inside each clamp (meso: always one pitch)", gt=0, band=(1, 200)
    )
    jaw_length_mm: ClassVar[Kernel[float]] = Kernel("jaw_length")
    max_strain: float = number(
        4.0,
        "%",
        "stop at this engineering strain; strips without inlays along them: 40",
        gt=0,
        le=300,
    )
    max_strain_fraction: ClassVar[Kernel[float]] = Kernel("max_strain")
    max_force: float | None = number(
        None, "N/mm", "strips without inlays along them: force per width at which the test ends; none: it does not",
        gt=0, le=1000,
    )  # fmt: skip
    stop_force_ratio: float = number(0.2, "1", "stop when the force has fallen to this share of its peak", ge=0, le=1)


class TensileRun(Run):
    """A tensile test."""

    rig: TensileRig = Field(default_factory=TensileRig)

    @model_validator(mode="after")
    def _strip_can_fail(self) -> Self:
        rig = self.rig
        if self.model.scale == "macro" and rig.jaw_length > rig.gauge_length:
            raise BoundsError(f"must be at most rig.gauge_length, {rig.gauge_length:g} mm", "rig.jaw_length")
        inlays = self.fabric.inlays_along(rig.direction)
        quantity, name = (
            (inlays[0].yarn.fracture_strain, f"{inlays[0].field}.fracture_strain") if inlays else (None, "")
        )
        if self.model.scale == "macro":
            if "tension" in self.fabric.macro.missing_card_parts:
                return self  # until the card is derived
            if self.fabric.macro.fracture_strain is None or self.pulls_loops:
                return self  # nothing fails
            quantity, name = (
                self.fabric.macro.fracture_strain.of(rig.direction),
                f"macro.fracture_strain.{rig.direction}",
            )
        if quantity is not None and rig.max_strain <= quantity.value:
            raise BoundsError(
                f"must exceed fabric.{name}, {quantity.value:g} %, or nothing fails; use --set "
                f"rig.max_strain={1.2 * quantity.value:.3g}",
                "rig.max_strain",
            )
        return self

    @property
    def pulls_loops(self) -> bool:
        """See :class:`Run`."""
        return self.fabric.is_carried_by_loops(self.rig.direction, self.model.scale)

    def structure_defaults(self) -> dict[tuple[str, str], float]:
        """Knits stretch by tens of per cent under small forces."""
        if not self.pulls_loops:
            return {}
        return dict(KNIT[self.model.scale]) | (SOFT if self.fabric.has_soft_yarns else {})

    @model_validator(mode="after")
    def _force_is_of_loops(self) -> Self:
        if self.rig.max_force is not None and not self.pulls_loops:
            raise BoundsError("is for strips without inlays along them: remove it", "rig.max_force")
        return self


#: strain [%], speed [m/s] and damping [1/ms] of strips of loops without inlays, by scale
KNIT = {
    "meso": {("rig", "max_strain"): 40.0, ("solver", "speed"): 0.5, ("solver", "damping"): 0.02},
    "macro": {("rig", "max_strain"): 40.0, ("solver", "speed"): 0.1, ("solver", "damping"): 0.005},
}
#: the same of yarns with a soft shell
SOFT = {("rig", "max_strain"): 100.0}
#: clamp distance of a meso strip [mm]; paper is that of the publication, which a macro model always has
GAUGE = {"quick": 50.0, "standard": 100.0, "paper": 200.0}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset`` at ``scale``: slow and of a small step in a macro model, whose input must come back."""
    if scale == "macro":
        return {"solver": {"speed": 0.5, "safety": 0.55}}
    return {"rig": {"gauge_length": GAUGE[preset]}}
