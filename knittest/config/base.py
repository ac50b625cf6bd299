"""The base of all config models: strict fields with a unit, hard bounds and a plausibility band."""

from typing import Any, Literal, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import CoreSchema

from knittest.config.kernel_units import check_names, field_meta
from knittest.config.unit_slips import likely_unit

Source = Literal["measured", "derived", "tuned", "predicted", "assumed", "user"]


class Strict(BaseModel):
    """A config model: no unknown keys, no coerced types (``true`` is no number), immutable, units beside the fields."""

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True, allow_inf_nan=False, strict=True)

    @field_validator("*", mode="after")
    @classmethod
    def _within_bounds(cls, value: object, info: ValidationInfo) -> Any:
        if info.field_name is None:
            return value
        meta = field_meta(cls, info.field_name)
        for direction in ("warp", "weft"):
            if isinstance(value, Strict) and isinstance(quantity := getattr(value, direction, None), Quantity):
                check_bounds(quantity.value, meta, direction)
                _check_scatter(quantity, f"{direction}.sd")
        number = value.value if isinstance(value, Quantity) else value
        if isinstance(number, int | float) and not isinstance(number, bool):
            check_bounds(number, meta)
        if isinstance(value, Quantity):
            _check_scatter(value, "sd")
        return value

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        check_names(cls)


class Quantity(BaseModel):
    """A number with its scatter and where it comes from; a bare number means ``source: user``."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)

    value: float = Field(description="the number, in the unit of the field")
    sd: float | None = Field(None, ge=0, description="standard deviation, same unit")
    source: Source = Field(
        description="measured, derived, tuned, predicted, assumed, or user (given on the command line)"
    )
    ref: str = Field("", description="table, equation or reasoning behind the number")
    tuned_on: list[str] = Field(default_factory=list, description="rows a tuned number was fitted to")
    chosen_by: list[str] = Field(
        default_factory=list, description="rows that were in view when the number was chosen, so they do not test it"
    )

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """A bare number or the full mapping, as the validator reads it."""
        mapping = handler.resolve_ref_schema(handler(core))
        return {"title": "Quantity", "anyOf": [{"type": "number"}, mapping]}

    @model_validator(mode="before")
    @classmethod
    def _from_number(cls, data: object) -> Any:
        if isinstance(data, int | float) and not isinstance(data, bool):
            return {"value": data, "source": "user", "ref": "given by the user"}
        return data

    @model_validator(mode="after")
    def _tuned_says_on_what(self) -> Self:
        if self.source == "tuned" and not self.tuned_on:
            raise ValueError("a tuned value must say in tuned_on which rows it was fitted to")
        return self


class PerDirection(Strict):
    """One quantity for each direction; the unit is that of the field which holds it."""

    warp: Quantity
    weft: Quantity

    def of(self, direction: str) -> Quantity:
        """Return that of ``direction``; raise ``KeyError`` where it is neither warp nor weft."""
        return {"warp": self.warp, "weft": self.weft}[direction]


class BoundsError(ValueError):
    """A number breaks a hard bound or its plausibility band; ``part`` names the direction or field inside, if any."""

    def __init__(self, message: str, part: str | None = None) -> None:
        super().__init__(message if part is None else f"{part}: {message}")
        self.expected = message
        self.part = part


def check_bounds(number: float, meta: dict[str, Any], part: str | None = None) -> None:
    """Raise :class:`BoundsError` when ``number`` breaks the hard bounds or the plausibility bounds in ``meta``."""
    unit = meta.get("unit", "")
    unit = "" if unit == "1" else f" {unit}"
    if "gt" in meta and not number > meta["gt"]:
        raise BoundsError(f"must be greater than {meta['gt']:g}{unit}", part)
    if "ge" in meta and not number >= meta["ge"]:
        raise BoundsError(f"must be at least {meta['ge']:g}{unit}", part)
    if "le" in meta and not number <= meta["le"]:
        raise BoundsError(f"must be at most {meta['le']:g}{unit}", part)
    if "band" in meta and not meta["band"][0] <= number <= meta["band"][1]:
        low, high = meta["band"]
        guess = likely_unit(number, meta.get("unit", ""), meta["band"])
        raise BoundsError(f"implausible, expected {low:g} to {high:g}{unit}{guess}", part)
    if "least" in meta and 0.0 < number < meta["least"]:
        guess = likely_unit(number, meta.get("unit", ""), (meta["least"], meta["le"]))
        raise BoundsError(f"implausible, expected 0, or at least {meta['least']:g}{unit}{guess}", part)


def _check_scatter(quantity: Quantity, part: str) -> None:
    """A standard deviation is no larger than its mean: all these quantities are positive or zero."""
    if quantity.sd is not None and quantity.sd > quantity.value > 0.0:
        raise BoundsError(f"is larger than the value itself, {quantity.value:g}: state its own, or null", part)


def measure(unit: str, description: str, **meta: Any) -> Any:
    """Field of a required :class:`Quantity` in ``unit``; ``meta``: gt, ge, le, band, and ``least``, the smallest number
    but 0 (beside le).
    """
    return Field(description=description, json_schema_extra={"unit": unit, **meta})


def number(default: "float | Quantity | None", unit: str, description: str, **meta: Any) -> Any:
    """Field of a plain number with a default, in ``unit``; ``meta`` as of :func:`measure`."""
    return Field(default, description=description, json_schema_extra={"unit": unit, **meta})
