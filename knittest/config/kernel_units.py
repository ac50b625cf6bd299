"""Fields of configs in kernel units, as attributes whose name states the unit: ``rig.gauge_length_mm``."""

from typing import Any, Generic, NamedTuple, Self, TypeVar, overload

from pydantic import BaseModel

from knittest.base.units import suffix, to_kernel

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
