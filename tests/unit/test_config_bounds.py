"""Every bound of every field of the configs has its value stored here and is crossed here."""

from pathlib import Path

import pytest
from bounds_cases import Bounded, bounded_fields
from pydantic import ValidationError

from knittest.base.errors import InputError
from knittest.config.messages import parse_as
from knittest.config.yaml_loader import Document, value_excerpt

TABLE = Path(__file__).with_name("config-bounds.txt")
FIELDS = bounded_fields()
NUMBERS = [f for f in FIELDS if f.kind in (int, float)]
#: numbers without two bounds, and what else holds them
OPEN = {
    **dict.fromkeys(("Quantity.value", "Quantity.sd"), "the field that holds the quantity; sd by its value"),
    **dict.fromkeys(
        ("Distribution.low", "Distribution.high", "Distribution.mean", "Distribution.sd", "Range.low", "Range.high",
         "Parameter.low", "Parameter.high", "Parameter.start", "Parameter.mean", "Parameter.sd"),
        "the field that gets the values",
    ),
    **dict.fromkeys(("Target.value", "Target.sd", "Statement.below", "Statement.above"), "any result, in its unit"),
    "StudyQuantity.at": "the results that the test has",
    **dict.fromkeys(("Sample.n", "Range.steps"), "the number of runs of the sweep, which is counted and limited"),
    "PictureFrameRig.reversal_angles": "max_angle",
}  # fmt: skip

#: entry of a mapping that takes others than bounds
ENTRIES = {
    "Uncertainty.fabrics": {"variant": "1"},
    "Uncertainty.parameters": {"low": 1.0, "high": 2.0, "reason": "a reason of some length"},
    "Uncertainty.shorter_ends": [1.0],
}


def test_the_bounds_are_those_that_were_decided():
    """A bound changes here and there, or not at all: config-bounds.txt is written by hand."""
    stored = [line.split(maxsplit=1) for line in TABLE.read_text(encoding="utf-8").splitlines() if line[:1] != "#"]
    assert [f"{f} {f.stated}" for f in FIELDS if f.limits] == [" ".join(row) for row in stored]


def test_every_number_is_held_on_both_sides():
    assert {str(f) for f in NUMBERS if not f.two_sided} == set(OPEN)


@pytest.mark.parametrize("field", [f for f in NUMBERS if f.limits], ids=str)
def test_just_outside_is_refused_by_name(field: Bounded):
    for value in field.outside():
        for path, data in field.placed(value):
            with pytest.raises(InputError) as error:
                parse_as(field.model, Document("f.yaml", data))
            lines = [line for line in str(error.value).splitlines() if f": {path} = {value_excerpt(value)}: " in line]
            assert len(lines) == 1 and ("must be" in lines[0] or "implausible" in lines[0]), str(error.value)


@pytest.mark.parametrize("field", [f for f in NUMBERS if f.limits], ids=str)
def test_just_inside_is_taken(field: Bounded):
    for value in field.inside():
        for _, data in field.placed(value):
            try:
                field.model.model_validate(data)
            except ValidationError as error:  # other fields are missing, or contradict it: no bound of its own
                assert not [e for e in error.errors() if e["loc"][:1] == (field.name,)], value


@pytest.mark.parametrize("field", [f for f in FIELDS if "multiple_of" in f.limits], ids=str)
def test_multiples(field: Bounded):
    with pytest.raises(ValidationError, match=f"{field.name}\n"):
        field.model.model_validate({field.name: field.inside()[0] + 1})


@pytest.mark.parametrize("field", [f for f in FIELDS if {"min_length", "max_length"} & f.limits.keys()], ids=str)
def test_lengths(field: Bounded):
    lengths = [n for n in (field.limits.get("min_length", 0) - 1, field.limits.get("max_length", -2) + 1) if n >= 0]
    mapping = "dict" in str(field.model.model_fields[field.name].annotation)
    entry = ENTRIES.get(str(field), {"low": 1.0, "high": 2.0})
    for length in lengths:
        names = [f"a{k}" for k in range(length)]
        with pytest.raises(ValidationError) as error:
            field.model.model_validate({field.name: dict.fromkeys(names, entry) if mapping else names})
        assert any(e["loc"] == (field.name,) and "at " in e["msg"] for e in error.value.errors())
