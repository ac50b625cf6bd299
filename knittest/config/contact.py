"""Contact between the yarns of a fabric: penalty, friction, and the patches of their crossings."""

from typing import Any, ClassVar, Literal, Self

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from knittest.config.base import BoundsError, Quantity, Strict, measure
from knittest.config.kernel_units import Kernel

#: least sticking stiffness of a contact [N/mm]: the share of friction in the work of a sheared cell is 6 % less at it
#: than at 100 N/mm, 21 % less at 3 N/mm and 57 % less at 1 N/mm (variant 1)
LEAST_STICKING = 10.0
#: least normal stiffness [N/mm], and what a contact has that states nothing: coefficient of friction and sticking
#: stiffness over the normal one
LEAST_STIFFNESS, FRICTION, TANGENTIAL = 100.0, 0.3, 0.1


class Compaction(Strict):
    """Progressive yarn contact: F = k d (1 + (d / depth)^exponent), d the penetration, k the normal stiffness."""

    exponent: Literal[1, 2, 3] = Field(2, description="power with which the stiffness grows")
    depth: Quantity = measure("mm", "penetration at which the force is twice the linear one", gt=0, band=(1e-3, 10))
    depth_mm: ClassVar[Kernel[float]] = Kernel("depth")


class PatchRadius(Strict):
    """Radius of the patch over which crossed yarns touch, a disc of even pressure; 0: free spin."""

    inlay_inlay: Quantity = measure("mm", "where a warp crosses a weft", ge=0, le=5)
    inlay_inlay_mm: ClassVar[Kernel[float]] = Kernel("inlay_inlay")
    inlay_loop: Quantity = measure("mm", "where a loop crosses an inlay", ge=0, le=5)
    inlay_loop_mm: ClassVar[Kernel[float]] = Kernel("inlay_loop")
    loop_loop: Quantity = measure("mm", "where loops cross each other", ge=0, le=5)
    loop_loop_mm: ClassVar[Kernel[float]] = Kernel("loop_loop")

    @property
    def largest(self) -> float:
        """Largest of the radii [mm]."""
        return max(self.inlay_inlay_mm, self.inlay_loop_mm, self.loop_loop_mm)


class LateralCompaction(Strict):
    """Lateral compaction of the yarns, pressure = modulus x (share of the height)^exponent, from which patches grow."""

    exponent: Literal[1, 3] = Field(1, description="power of the share of its height by which a yarn is compacted")
    reinforcing: Quantity = measure("MPa", "modulus of the inlays across", gt=0, band=(1e-4, 1e4))
    reinforcing_mpa: ClassVar[Kernel[float]] = Kernel("reinforcing")
    knitting: Quantity = measure("MPa", "modulus of the loop yarn across", gt=0, band=(1e-4, 1e4))
    knitting_mpa: ClassVar[Kernel[float]] = Kernel("knitting")


class Patch(Strict):
    """Patch over which crossed yarns touch and resist spin, up to 2/3 of friction, force and its radius.

    Its radius is given or follows from the force and the lateral compaction of the yarns.
    """

    radius: PatchRadius | None = Field(None, description="given radii")
    compaction: LateralCompaction | None = Field(None, description="or what the yarns give way by across")

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.radius is None) == (self.compaction is None):
            raise ValueError("give either radius or compaction")
        return self


class YarnContact(Strict):
    """Penalty contact between yarns with Coulomb friction.

    A fabric with yarns may leave out the coefficient, the stiffness and the ratio: see ``contact_of`` of
    :mod:`knittest.config.fabric`.
    """

    friction_coefficient: Quantity = measure("1", "yarn-yarn Coulomb coefficient; 0.3 where it is left out", ge=0, le=2)
    static_friction_coefficient: Quantity | None = Field(
        None,
        description="the same before a contact slips; none: equal",
        json_schema_extra={"unit": "1", "ge": 0, "le": 2},
    )
    normal_stiffness: Quantity = measure(
        "N/mm", "penalty stiffness of one crossing; left out: breaking force of the loop yarn over its radius",
        gt=0, band=(LEAST_STIFFNESS, 1e6),
    )  # fmt: skip
    normal_stiffness_n_per_mm: ClassVar[Kernel[float]] = Kernel("normal_stiffness")
    tangential_ratio: Quantity = measure(
        "1", "sticking stiffness over normal stiffness; 0.1 where it is left out", gt=0, le=1
    )
    compaction: Compaction | None = Field(None, description="progressive normal force; none: linear")
    patch: Patch | None = Field(None, description="where crossings resist spin; none: they spin freely")

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Schema without required fields: what a file leaves out is derived."""
        found = handler(core)
        handler.resolve_ref_schema(found).pop("required", None)
        return found

    @model_validator(mode="after")
    def _sticks(self) -> Self:
        """Soft sticking yarns creep against each other where they would rub: no energy is lost in friction."""
        sticking = self.normal_stiffness_n_per_mm * self.tangential_ratio.value
        if sticking < LEAST_STICKING:
            raise BoundsError(
                f"times normal_stiffness is {sticking:.3g} N/mm: contacts that stick would creep instead of rubbing, "
                f"expected at least {LEAST_STICKING:g} N/mm, a ratio of at least "
                f"{LEAST_STICKING / self.normal_stiffness_n_per_mm:.2g}",
                "tangential_ratio",
            )
        return self

    @model_validator(mode="after")
    def _static_not_below(self) -> Self:
        static = self.static_friction_coefficient
        if static is not None and static.value < self.friction_coefficient.value:
            raise BoundsError("must be at least friction_coefficient", "static_friction_coefficient")
        return self
