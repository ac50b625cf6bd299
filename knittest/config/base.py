"""Base of all config models: strict fields with unit, bounds and plausibility band; their numbers in kernel units."""

from collections.abc import Mapping
from operator import ge, gt, le
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
from knittest.base.units import ratio, suffix, to_kernel, to_plain_letters

T = TypeVar("T", bound="float | DirectionalNumber | None")


class DirectionalNumber(NamedTuple):
    """Number for each direction."""

    warp: float
    weft: float

    def of(self, direction: str) -> float:
        """Return the number of ``direction``; raise ``KeyError`` unless it is warp or weft."""
        return self._asdict()[direction]


class Kernel(Generic[T]):
    """Number of ``field`` in kernel units: ``gauge_length_mm: ClassVar[Kernel[float]] = Kernel("gauge_length")``.

    It stands next to its field in the class of a config. ``T``: one number, one for each direction, or none.
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
        return _to_kernel_units(getattr(instance, self.field), field_meta(owner, self.field)["unit"])


def check_names(model: type[BaseModel]) -> None:
    """Raise ``TypeError`` unless each :class:`Kernel` is named after its field and unit: ``gauge_length_mm``."""
    for name, attribute in vars(model).items():
        if not isinstance(attribute, Kernel):
            continue
        unit = field_meta(model, attribute.field).get("unit") if attribute.field in model.model_fields else None
        expected = f"{attribute.field}_{suffix(unit)}" if unit else "a field with a unit"
        if name != expected:
            raise TypeError(f"{model.__name__}.{name}: expected {expected} for {attribute.field} in {unit}")


def field_meta(model: type[BaseModel], name: str) -> dict[str, Any]:
    """Unit, bounds and plausibility band of a field; empty if it has none."""
    extra = model.model_fields[name].json_schema_extra
    return dict(extra) if isinstance(extra, dict) else {}


def _to_kernel_units(value: Any, unit: str) -> float | DirectionalNumber | None:
    """Convert a number, a quantity or one quantity per direction to kernel units; None stays None."""
    if value is None or isinstance(value, int | float):
        return None if value is None else to_kernel(float(value), unit)
    if hasattr(value, "warp"):
        return DirectionalNumber(to_kernel(value.warp.value, unit), to_kernel(value.weft.value, unit))
    return to_kernel(value.value, unit)


def _check_test_name(value: object) -> object:
    """Return ``value`` if it is the name of a test, else raise an error as of a literal."""
    if not isinstance(value, str) or value not in kinds():
        expected = " or ".join(repr(name) for name in kinds())
        raise PydanticCustomError("literal_error", "Input should be {expected}", {"expected": expected})
    return value


class _Names:
    """Names of the tests in the JSON schema."""

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"enum": list(kinds()), "type": "string"}


TestName = Annotated[str, BeforeValidator(_check_test_name), _Names]


#: unit of a field -> other units in which its number is often given, the commonest first
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
    """Hint at the unit in which ``number`` would fall into ``band`` (given in ``unit``); empty if there is none."""
    low, high = band
    read = [(name, number * ratio(name, unit)) for name in ALTERNATIVES.get(unit, ())]
    guesses = [f"{name}: {value:.6g} {unit}" for name, value in read if low <= value <= high]
    return f" (it looks like {' or '.join(guesses[:2])})" if guesses else ""


def convert_to_field_unit(number: float, written: str, unit: str) -> str | None:
    """Convert ``number`` from the unit ``written`` to ``unit``, as text; ``None`` for a unit that does not fit."""
    names = {_normalised_unit(name): name for name in (*ALTERNATIVES.get(unit, ()), unit)}
    name = names.get(_normalised_unit(written))
    if name is None:
        return None
    return f"{number if name == unit else number * ratio(name, unit):.6g}"


def _normalised_unit(unit: str) -> str:
    """Spell a unit without blanks, with plain letters and the yarn in the singular."""
    return to_plain_letters(unit).replace(" ", "").replace("yarns/", "yarn/")


Source = Literal["measured", "derived", "tuned", "predicted", "assumed", "user"]


class Strict(BaseModel):
    """Immutable config model: no unknown keys, no coerced types (``true`` is no number), fields with units."""

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True, allow_inf_nan=False, strict=True)

    @field_validator("*", mode="after")
    @classmethod
    def _check_bounds(cls, value: object, info: ValidationInfo) -> Any:
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
    """Number with scatter and origin; a bare number means ``source: user``."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)

    value: float = Field(description="number in the unit of the field")
    sd: float | None = Field(None, ge=0, description="standard deviation, same unit")
    source: Source = Field(description="measured, derived, tuned, predicted, assumed, or user (command line)")
    ref: str = Field("", description="table, equation or reasoning behind the number")
    tuned_on: list[str] = Field(default_factory=list, description="results to which a tuned number was fitted")
    chosen_by: list[str] = Field(
        default_factory=list, description="results that guided the choice of the number, so they do not validate it"
    )

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Allow a bare number or the full mapping, as the validator does."""
        mapping = handler.resolve_ref_schema(handler(core))
        return {"title": "Quantity", "anyOf": [{"type": "number"}, mapping]}

    @model_validator(mode="before")
    @classmethod
    def _from_number(cls, data: object) -> Any:
        if isinstance(data, int | float) and not isinstance(data, bool):
            return {"value": data, "source": "user", "ref": "given by the user"}
        return data

    @model_validator(mode="after")
    def _has_rows_if_tuned(self) -> Self:
        if self.source == "tuned" and not self.tuned_on:
            raise ValueError("source tuned needs tuned_on: the results to which the value was fitted")
        return self


class PerDirection(Strict):
    """Quantity for each direction, in the unit of the field; one number stands for both."""

    warp: Quantity
    weft: Quantity

    @model_validator(mode="before")
    @classmethod
    def _from_one(cls, data: object) -> Any:
        single = isinstance(data, int | float) and not isinstance(data, bool)
        return {"warp": data, "weft": data} if single or (isinstance(data, Mapping) and "value" in data) else data

    def of(self, direction: str) -> Quantity:
        """Return the quantity of ``direction``; raise ``KeyError`` unless it is warp or weft."""
        return {"warp": self.warp, "weft": self.weft}[direction]


#: names of the forms of a field that is a text or a mapping; they are no part of its path
CSV_FORM, POINTS_FORM = "$CSV", "$points"


class BoundsError(ValueError):
    """Error of a number outside its bounds; ``part`` is the direction or field inside, if any."""

    def __init__(self, message: str, part: str | None = None) -> None:
        super().__init__(message if part is None else f"{part}: {message}")
        self.expected = message
        self.part = part


def check_bounds(number: float, meta: dict[str, Any], part: str | None = None) -> None:
    """Raise :class:`BoundsError` if ``number`` is outside the hard or plausible bounds in ``meta``."""
    unit = "" if meta.get("unit", "1") in ("", "1") else f" {meta['unit']}"
    for name, holds, words in (("gt", gt, "greater than"), ("ge", ge, "at least"), ("le", le, "at most")):
        if name in meta and not holds(number, meta[name]):
            raise BoundsError(f"must be {words} {meta[name]:g}{unit}", part)
    if "band" in meta and not meta["band"][0] <= number <= meta["band"][1]:
        low, high = meta["band"]
        guess = likely_unit(number, meta.get("unit", ""), meta["band"])
        raise BoundsError(f"implausible, expected {low:g} to {high:g}{unit}{guess}", part)
    if "least" in meta and 0.0 < number < meta["least"]:
        guess = likely_unit(number, meta.get("unit", ""), (meta["least"], meta["le"]))
        raise BoundsError(f"implausible, expected 0 or at least {meta['least']:g}{unit}{guess}", part)


def _check_scatter(quantity: Quantity, part: str) -> None:
    """Check that a standard deviation is no larger than its mean."""
    if quantity.sd is not None and quantity.sd > quantity.value > 0.0:
        raise BoundsError(f"exceeds the value {quantity.value:g}: give the sd of this value, or null", part)


def measure(unit: str, description: str, **meta: Any) -> Any:
    """Field of a required :class:`Quantity` in ``unit``; ``meta``: gt, ge, le, band, least (smallest except 0)."""
    return Field(description=description, json_schema_extra={"unit": unit, **meta})


def number(default: "float | Quantity | None", unit: str, description: str, **meta: Any) -> Any:
    """Field with a default in ``unit``; ``meta`` as of :func:`measure`."""
    return Field(default, description=description, json_schema_extra={"unit": unit, **meta})
