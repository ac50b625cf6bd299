"""One table of units for fields, slips and laboratory files."""

import math

import pytest

from knittest.base.units import FACTOR, UNITS, ratio, ratios, to_kernel
from knittest.config.base import ALTERNATIVES, convert_to_field_unit
from knittest.experiment import lab_units

#: one of each quantity in SI, and in kernel units (mm, ms, g, N, MPa)
IN_SI = {
    "m": 1e3, "m2": 1e6, "kg": 1e3, "kg/m": 1.0, "kg/m2": 1e-3, "s": 1e3, "m/s": 1.0, "m/s2": 1e-3, "N": 1.0,
    "Pa": 1e-6, "N/m": 1e-3, "N m": 1e3, "N m2": 1e6, "rad": 1.0, "yarns/m": 1e-3,
}  # fmt: skip


@pytest.mark.parametrize("unit", IN_SI)
def test_si_units_in_kernel_units(unit: str) -> None:
    assert to_kernel(1.0, unit) == pytest.approx(IN_SI[unit], rel=1e-15)


def test_a_unit_stands_for_one_quantity() -> None:
    assert len(FACTOR) == sum(len(units) for units in UNITS.values())


@pytest.mark.parametrize(
    ("unit", "other", "expected"),
    [
        ("lbf", "N", 0.45359237 * 9.80665), ("kgf", "cN", 980.665), ("inch", "cm", 2.54), ("rad", "deg", 180 / math.pi),
        ("oz/yd2", "g/m2", 28.349523 / 0.9144**2), ("mm/min", "m/s", 1e-3 / 60), ("km/h", "m/s", 1 / 3.6),
        ("dtex", "tex", 0.1), ("mN cm2", "N mm2", 0.1), ("mN cm", "N mm", 0.01), ("h", "s", 3600.0), ("%", "1", 0.01),
        ("kg/m2", "g/m2", 1000.0),
        ("yarns/cm", "yarn/100 mm", 10.0), ("a fraction", "%", 100.0), ("t", "kg", 1000.0), ("Pa", "GPa", 1e-9),
    ],
)  # fmt: skip
def test_a_unit_in_another(unit: str, other: str, expected: float) -> None:
    assert ratio(unit, other) == pytest.approx(expected, rel=1e-7)


def test_units_of_different_quantities_have_no_ratio() -> None:
    with pytest.raises(KeyError):
        ratio("kN", "mm")
    with pytest.raises(KeyError):
        ratios("N", "furlong")


def test_slips_and_files_know_no_other_factors() -> None:
    assert all(
        ratio(name, unit) != 1.0 or unit == "yarn/100 mm" for unit, names in ALTERNATIVES.items() for name in names
    )
    assert lab_units.QUANTITIES["force"] == {
        "N": 1.0, "kN": 1e3, "daN": 10.0, "cN": 1e-2, "mN": 1e-3, "kgf": 9.80665, "lbf": 4.4482216152605,
    }  # fmt: skip
    assert lab_units.find_unit("kg/m²", lab_units.QUANTITIES["mass per area"]) == "kg/m2"
    assert lab_units.find_unit("μm", lab_units.QUANTITIES["length"]) == "um"
    assert convert_to_field_unit(12.0, "N/m", "N/mm") == "0.012" and convert_to_field_unit(7.0, "rows", "rows") == "7"
    assert convert_to_field_unit(7.0, "m", "N") is None
