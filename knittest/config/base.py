"""The base of all config models: strict fields with a unit, hard bounds and a plausibility band, and their numbers in
kernel units.
"""

from typing import Annotated, Any, Generic, Literal, NamedTuple, Self, TypeVar, overload

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import CoreSchema, PydanticCustomError

from knittest.base.kinds import kinds
from knittest.base.units import plainly, ratio, suffix, to_kernel

T = TypeVar("T", bound="float | Directed | None")


class Directed(NamedTuple):
    """One number for each direction."""

    warp: float
    weft: float

    def of(self, direction: str) -> float:
        """Return that of ``direction``; raise ``KeyError`` where it is neither warp nor weft."""
        return self._asdict()[direction]


class Kernel(Generic[T]):
    """Number of ``field`` in kernel units: ``gauge_length_mm: ClassVar[Kernel[float]] = Kernel("gauge_length")``.

    Stands beside its field in the class of a config, of which it is no field itself. ``T`` says what the field holds:
    one number, one for each direction, and whether there may be none.
    """

    def __init__(self, field: str) -> None:
        self.field = field

    @overload
    def __get__(self, instance: None, owner: type[BaseModel]) -> Self: ...
    @overload
    def __get__(self, instance: BaseModel, owner: type[BaseModel]) -> T: ...
    def __get__(self, instance: BaseModel | None, owner: type[BaseModel]) -> Any:
        if instance is None:
            return self
        return _converted(getattr(instance, self.field), field_meta(owner, self.field)["unit"])


def check_names(model: type[BaseModel]) -> None:
    """Raise ``TypeError`` where an attribute of ``model`` in kernel units has no field, or another name than its unit.

    ``gauge_length`` in mm is ``gauge_length_mm``: who reads the name knows the unit.
    """
    for name, attribute in vars(model).items():
        if not isinstance(attribute, Kernel):
            continue
        unit = field_meta(model, attribute.field).get("unit") if attribute.field in model.model_fields else None
        expected = f"{attribute.field}_{suffix(unit)}" if unit else "a field with a unit"
        if name != expected:
            raise TypeError(f"{model.__name__}.{name}: expected {expected}, of {attribute.field} in {unit}")


def field_meta(model: type[BaseModel], name: str) -> dict[str, Any]:
    """Unit, bounds and plausibility band of a field; empty for fields without."""
    extra = model.model_fields[name].json_schema_extra
    return dict(extra) if isinstance(extra, dict) else {}


def _converted(value: Any, unit: str) -> float | Directed | None:
    """Number, quantity or quantities of both directions in kernel units; None stays None."""
    if value is None or isinstance(value, int | float):
        return None if value is None else to_kernel(float(value), unit)
    if hasattr(value, "warp"):
        return Directed(to_kernel(value.warp.value, unit), to_kernel(value.weft.value, unit))
    return to_kernel(value.value, unit)


def _known(value: object) -> object:
    """``value``; a finding as that of a literal, for what is none of the names."""
    if not isinstance(value, str) or value not in kinds():
        expected = " or ".join(repr(name) for name in kinds())
        raise PydanticCustomError("literal_error", "Input should be {expected}", {"expected": expected})
    return value


class _Names:
    """Lists the names in the JSON schema."""

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"enum": list(kinds()), "type": "string"}


TestName = Annotated[str, BeforeValidator(_known), _Names]


#: field unit -> other units it is often given in; the commonest first
ALTERNATIVES: dict[str, tuple[str, ...]] = {
    "GPa": ("MPa", "Pa"),
    "mm": ("m", "cm", "um"),
    "mm2": ("um2", "cm2", "m2"),
    "%": ("a fraction",),
    "tex": ("dtex", "kg/m", "g/m"),
    "g/m2": ("kg/m2", "g/cm2"),
    "yarn/100 mm": ("yarns/cm", "yarns/mm", "yarns/m", "yarns/dm"),
    "N mm": ("N m", "N cm", "mN cm"),
    "N mm2": ("N m2", "N cm2", "mN cm2"),
    "N/mm": ("N/m", "kN/mm"),
    "m/s": ("mm/s", "mm/min", "cm/s", "m/min", "km/h"),
    "N": ("kN", "daN", "cN", "mN"),
    "ms": ("us", "s"),
    "us": ("s", "ns"),
    "1": ("%",),
    "kg": ("g", "t"),
    "s": ("ms", "min", "h"),
}


def likely_unit(number: float, unit: str, band: tuple[float, float]) -> str:
    """Name the unit in which ``number`` would fall into ``band`` (given in ``unit``), or say nothing ("")."""
    low, high = band
    read = [(name, number * ratio(name, unit)) for name in ALTERNATIVES.get(unit, ())]
    guesses = [f"{name}: {value:.6g} {unit}" for name, value in read if low <= value <= high]
    return f" (it looks like {' or '.join(guesses[:2])})" if guesses else ""


def in_field_unit(number: float, written: str, unit: str) -> str | None:
    """``number``, given in the unit ``written``, in the ``unit`` of its field; ``None`` for a unit not known there."""
    names = {_plain(name): name for name in (*ALTERNATIVES.get(unit, ()), unit)}
    name = names.get(_plain(written))
    if name is None:
        return None
    return f"{number if name == unit else number * ratio(name, unit):.6g}"


def _plain(unit: str) -> str:
    """A unit without blanks, with plain letters and the yarn in the singular."""
    return plainly(unit).replace(" ", "").replace("yarns/", "yarn/")


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
