"""Messages on config files: file:line, field, value, what was expected, the nearest valid name."""

import re
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from knittest.base.errors import InputError
from knittest.config.base import BoundsError, in_field_unit
from knittest.config.fields import Place, all_paths, nearest, place
from knittest.config.settings import Layers
from knittest.config.yaml_loader import Document, KeyPath, describe, dotted, shown

MOST_SHOWN = 20
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?$")
_NUMBER_AND_UNIT = re.compile(r"([-+]?(?:\d+[.,]?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\W\d].*|%.*)$")
_NUMBER_TYPES = ("float_type", "float_parsing", "int_type", "int_parsing", "int_from_float", "finite_number")


def input_error(error: ValidationError, layers: Layers, root: type[BaseModel] | None = None) -> InputError:
    """One :class:`InputError` that lists every finding of ``error`` with the place it came from.

    ``root`` is the model of a file that is not a run.
    """
    kind = root or layers.get(("rig", "kind"))
    found = error.errors(include_url=False)
    bad_keys = {item["loc"][:-1] for item in found if item["loc"][-1:] == ("[key]",)}
    found = [item for item in found if item["loc"] not in bad_keys]  # a wrong key makes its value no second finding
    lines = [_line(item, layers, kind) for item in found[:MOST_SHOWN]]
    if len(found) > MOST_SHOWN:
        lines.append(f"... and {len(found) - MOST_SHOWN} more")
    return InputError("\n".join(lines))


def unknown(name: str, names: list[str], kind: str = "field") -> str:
    """Say that ``name`` is none of ``names``, with the nearest one, else all of them."""
    close = nearest(name, names)
    return f"unknown {kind} " + (f'(did you mean "{close}"?)' if close else f"(known: {', '.join(names)})")


def _line(item: Mapping[str, Any], layers: Layers, kind: object) -> str:
    path: KeyPath = tuple(part for part in item["loc"] if part != "[key]")
    cause = item.get("ctx", {}).get("error")
    if isinstance(cause, BoundsError) and cause.part:
        path = (*path, *cause.part.split("."))
    value, at = layers.get(path), path
    if item["type"] in ("missing", "extra_forbidden") or "[key]" in item["loc"]:
        return f"{layers.where(path) or 'defaults'}: {dotted(path)}: {_misplaced(item, path, kind)}"
    if isinstance(value, dict) and "value" in value:
        value, at = value["value"], (*path, "value")
    stated = "" if value is None or isinstance(value, dict) else f" = {shown(value)}"
    return f"{layers.where(at) or 'defaults'}: {dotted(path)}{stated}: {_expected(item, value, place(path, kind))}"


def _misplaced(item: Mapping[str, Any], path: KeyPath, kind: object) -> str:
    if item["type"] == "missing":
        return f"missing: {_required(place(path, kind))}"
    if item["type"] == "extra_forbidden":
        return _unknown_field(path, kind)
    return f"unknown field, {_choice_expected(item['ctx']['expected'], path[-1])}"


def _required(field: Place | None) -> str:
    if field is None:
        return "the field is required"
    return f"{field.description}{f' [{field.unit}]' if field.unit else ''}"


def _unknown_field(path: KeyPath, kind: object) -> str:
    holder, name = place(path[:-1], kind), str(path[-1])
    names = holder.names if holder else []
    elsewhere = [p for p in all_paths(kind) if p.rpartition(".")[2] == name]
    if nearest(name, names) is None and elsewhere:
        return f'unknown field (did you mean "{elsewhere[0]}"?)'
    return unknown(name, names)


def _expected(item: Mapping[str, Any], value: object, field: Place | None) -> str:
    kind, context = item["type"], item.get("ctx", {})
    if isinstance(cause := context.get("error"), BoundsError):
        return cause.expected
    if kind == "value_error":
        return str(context["error"])
    if kind in _NUMBER_TYPES or (kind == "model_type" and field and field.is_quantity):
        return _number_expected("whole number" if kind.startswith("int") else "number", value, field)
    if kind == "model_type":
        return f"expected a mapping with {', '.join(field.names) if field else 'fields'}, found {describe(value)}"
    if kind == "literal_error":
        return _choice_expected(context["expected"], value)
    if kind == "string_type":
        return f"expected text, found {describe(value)} (put it in quotes if text is meant)"
    if kind == "string_pattern_mismatch":
        return "expected letters, digits, '.', '_' or '-', at most 40, the first a letter or digit"
    unit = f" {field.unit}" if field and field.unit not in ("", "1") else ""
    return f"{str(item['msg']).replace('Input should be', 'must be')}{unit}"


def _number_expected(number: str, value: object, field: Place | None) -> str:
    unit = f" in {field.unit}" if field and field.unit not in ("", "1") else ""
    mapping = ", or a mapping of value, sd, source, ref" if field and field.is_quantity else ""
    return (
        f"expected a {number}{unit}{mapping}, found {describe(value)}{_number_hint(value, field.unit if field else '')}"
    )


def _number_hint(value: object, unit: str) -> str:
    if not isinstance(value, str):
        return ""
    if _DECIMAL_COMMA.match(value):
        return f" (decimal comma? write {value.replace(',', '.')})"
    if stated := _NUMBER_AND_UNIT.match(value):
        number = in_field_unit(float(stated[1].replace(",", ".")), stated[2], unit)
        alone = f", in {unit}" if unit not in ("", "1") else ""
        return f" (write {number})" if number else f" (write the number alone{alone})"
    return ""


def _choice_expected(expected: str, value: object) -> str:
    names = re.findall(r"'([^']*)'", expected) or re.split(", | or ", expected)  # numbers have no quotes
    close = nearest(value, names) if isinstance(value, str) else None
    return f"expected {', '.join(names[:-1])} or {names[-1]}".replace("expected  or", "expected") + (
        f' (did you mean "{close}"?)' if close else ""
    )


Parsed = TypeVar("Parsed", bound=BaseModel)


def parse_as(model: type[Parsed], document: Document) -> Parsed:
    """The ``model`` in ``document``; raises :class:`InputError` with every finding, each with file and line."""
    try:
        return model.model_validate(document.data)
    except ValidationError as error:
        layers = Layers(origin={(): document.where(())})
        for key, value in document.data.items():
            layers.lay(value, document.where, (key,))
        raise input_error(error, layers, model) from None


def number_path(name: str, where: str, kinds: Sequence[str]) -> KeyPath:
    """The key path of ``name``, a number of the fabric or the rig of one of ``kinds``; raises :class:`InputError`."""
    path: KeyPath = tuple(name.split("."))
    if path[0] not in ("fabric", "rig"):
        raise InputError(f"{where}: {name}: expected a field of the fabric or the rig, such as {_example(name, kinds)}")
    field = next((f for f in (place(path, kind) for kind in kinds) if f is not None), None)
    if field is None:
        known = sorted({p for kind in kinds for p in all_paths(kind) if p.split(".")[0] == path[0]})
        raise InputError(f"{where}: {name}: {unknown(name, known) if known else 'unknown field'}")
    if field.model is not None and not field.is_quantity:
        raise InputError(f"{where}: {name}: expected a number, this is a group of {', '.join(field.names)}")
    return path


def _example(name: str, kinds: Sequence[str]) -> str:
    last = name.split(".")[-1]
    known = (p for kind in kinds for p in all_paths(kind) if p.split(".")[0] in ("fabric", "rig"))
    return next((p for p in known if p.split(".")[-1] == last), "fabric.macro.bending_stiffness.warp")
