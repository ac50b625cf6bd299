"""Fields in kernel units: what every attribute converts, what it is called, and that no config takes it for a field."""

import importlib
import math
from collections.abc import Iterator
from typing import ClassVar, get_args

import pytest
from pydantic import BaseModel

from knittest.base.kinds import kinds
from knittest.config import fabric, laws, rigs, run, tools, yarn
from knittest.config.base import DirectionalNumber, Kernel, PerDirection, Quantity, Strict, field_meta, number
from knittest.config.loading import resolve

#: kernel units are mm, ms, g, N, MPa, rad: of one unit of the user, written out
IN_KERNEL = {
    "mm": (1.0, "mm"),
    "mm2": (1.0, "mm2"),
    "deg": (math.pi / 180.0, "rad"),
    "%": (1.0 / 100.0, "fraction"),
    "kg": (1000.0, "g"),
    "tex": (1.0 / 1e6, "g_per_mm"),  # g over a kilometre
    "g/m2": (1.0 / 1000.0**2, "g_per_mm2"),
    "g/cm3": (1e-3, "g_per_mm3"),
    "GPa": (1000.0, "mpa"),
    "MPa": (1.0, "mpa"),
    "kPa": (1e-3, "mpa"),
    "N": (1.0, "n"),
    "N/mm": (1.0, "n_per_mm"),
    "N/mm3": (1.0, "n_per_mm3"),
    "N mm": (1.0, "n_mm"),
    "N mm2": (1.0, "n_mm2"),
    "yarn/100 mm": (1.0 / 100.0, "per_mm"),
    "m/s": (1000.0 / 1000.0, "mm_per_ms"),
    "m/s2": (1000.0 / 1000.0**2, "mm_per_ms2"),
    "ms": (1.0, "ms"),
    "us": (1.0 / 1000.0, "ms"),
    "1/ms": (1.0, "per_ms"),
}


def attributes() -> Iterator[tuple[type[Strict], str, Kernel]]:
    """Every attribute in kernel units of the models of a run."""
    of_tests = [importlib.import_module(kind.run.partition(":")[0]) for kind in kinds().values()]
    for module in (fabric, rigs, run, laws, tools, yarn, *of_tests):
        for model in vars(module).values():
            if isinstance(model, type) and issubclass(model, Strict) and model.__module__ == module.__name__:
                yield from ((model, name, found) for name, found in vars(model).items() if isinstance(found, Kernel))


ALL = list(attributes())


def sample(annotation: object) -> object:
    """Return a value such as the field holds: a number, a quantity, or one a direction."""
    kinds = [annotation, *get_args(annotation)]
    if PerDirection in kinds:
        return PerDirection.model_construct(warp=Quantity(value=3.0, source="user"), weft=Quantity.model_validate(7.0))
    return Quantity.model_validate(3.0) if Quantity in kinds else 3.0


def test_there_are_as_many_as_the_models_need() -> None:
    assert len(ALL) > 55


@pytest.mark.parametrize(("model", "name", "found"), ALL, ids=[f"{m.__name__}.{n}" for m, n, _ in ALL])
def test_converts_with_the_unit_of_its_field(model: type[Strict], name: str, found: Kernel) -> None:
    field, unit = model.model_fields[found.field], field_meta(model, found.field)["unit"]
    factor, suffix = IN_KERNEL[unit]
    assert name == f"{found.field}_{suffix}"
    value = getattr(model.model_construct(**{found.field: sample(field.annotation)}), name)
    pair = isinstance(value, DirectionalNumber)
    assert value == pytest.approx((3.0 * factor, 7.0 * factor) if pair else 3.0 * factor, rel=1e-15, abs=0.0)
    annotation = field.annotation
    (kernel,) = get_args(model.__annotations__[name])
    (declared,) = get_args(kernel)
    optional, pair = type(None) in get_args(annotation), PerDirection in (annotation, *get_args(annotation))
    assert declared == {
        (False, False): float, (True, False): float | None,
        (False, True): DirectionalNumber, (True, True): DirectionalNumber | None,
    }[optional, pair]  # fmt: skip
    if optional:
        assert getattr(model.model_construct(**{found.field: None}), name) is None


def test_no_config_takes_one_for_a_field() -> None:
    found = resolve(variant="2", test="forming", scale="macro")
    names = {name for _, name, _ in ALL}
    assert not names & keys(found.model_dump()) and not names & keys(type(found).model_json_schema())
    for model, name, _ in ALL:
        assert name not in model.model_fields


def test_a_name_of_another_unit_is_no_class() -> None:
    with pytest.raises(TypeError, match=r"Strip\.width_m: expected width_mm"):

        class Strip(Strict):
            width: float = number(1.0, "mm", "width")
            width_m: ClassVar[Kernel[float]] = Kernel("width")


@pytest.mark.parametrize("field", ["height", "bare"])
def test_an_attribute_of_no_field_or_of_none_with_a_unit_is_no_class(field: str) -> None:
    with pytest.raises(TypeError, match="expected a field with a unit"):

        class Strip(Strict):
            bare: float = 1.0
            height_mm: ClassVar[Kernel[float]] = Kernel(field)


def test_yarns_over_a_length_across_them() -> None:
    dense = resolve(variant="2").fabric
    assert dense.density_per_mm == pytest.approx((dense.warp_density.value / 100.0, dense.weft_density.value / 100.0))
    assert dense.density_per_mm.of("weft") == dense.density_per_mm.weft != dense.density_per_mm.of("warp")
    with pytest.raises(KeyError):
        dense.density_per_mm.of("knit")


def keys(data: object) -> set[str]:
    """All keys of nested mappings and lists."""
    if isinstance(data, BaseModel):
        return keys(data.model_dump())
    if isinstance(data, dict):
        return set(data) | {k for value in data.values() for k in keys(value)}
    return {k for value in data for k in keys(value)} if isinstance(data, list) else set()
