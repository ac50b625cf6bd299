"""Messages on config files: file:line, field, value, expectation, nearest valid name."""

import re
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from knittest.base.errors import InputError
from knittest.config.base import CSV_FORM, POINTS_FORM, BoundsError, check_bounds, convert_to_field_unit
from knittest.config.fields import ConfigField, all_paths, field_at, most_similar_name
from knittest.config.settings import Layers
from knittest.config.yaml_loader import Document, KeyPath, describe, dotted_path, value_excerpt

MOST_SHOWN = 20
#: parts of the location of a finding that are no keys
NO_KEYS = ("[key]", CSV_FORM, POINTS_FORM)
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?$")
_NUMBER_AND_UNIT = re.compile(r"([-+]?(?:\d+[.,]?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\W\d].*|%.*)$")
_NUMBER_TYPES = ("float_type", "float_parsing", "int_type", "int_parsing", "int_from_float", "finite_number")


def input_error(error: ValidationError, layers: Layers, root: type[BaseModel] | None = None) -> InputError:
    """Make one :class:`InputError` of all findings of ``error``; ``root`` is the model of a file that is not a run."""
    kind = root or layers.get(("rig", "kind"))
    found = error.errors(include_url=False)
    bad_keys = {item["loc"][:-1] for item in found if item["loc"][-1:] == ("[key]",)}
    found = [item for item in found if item["loc"] not in bad_keys]  # a wrong key makes its value no second finding
    found = _without_consequences(found, layers)
    lines = [_finding_line(item, layers, kind) for item in found[:MOST_SHOWN]]
    if len(found) > MOST_SHOWN:
        lines.append(f"... and {len(found) - MOST_SHOWN} more")
    return InputError("\n".join(lines))


#: fields of a fabric that follow from its yarns, unless another field of it is wrong
FROM_YARNS = ("area_mass", "thickness", "contact")


def _without_consequences(found: list[Any], layers: Layers) -> list[Any]:
    """``found`` without unstated fields that follow from the yarns."""
    wrong = [item for item in found if not _follows_from_yarns(item, layers)]
    return wrong or found


def _follows_from_yarns(item: Mapping[str, Any], layers: Layers) -> bool:
    """Tell whether an unstated field is missing or out of bounds because a yarn is wrong."""
    name = item["loc"][-1] if item["loc"] else ""
    if name not in FROM_YARNS:
        return False
    if item["type"] != "missing":
        return layers.get(tuple(item["loc"])) is None
    return name == "contact" or _describes_yarns(item["input"])


def _describes_yarns(fabric: object) -> bool:
    """Tell whether a ``fabric`` file states the yarn of its loops, even in a wrong form."""
    loop = fabric.get("knitting") if isinstance(fabric, Mapping) else None
    return "fibre" in loop if isinstance(loop, Mapping) else loop is not None


def _yarns_instead(item: Mapping[str, Any]) -> str:
    """Advice on a missing number of a fabric that follows from its loop length and yarns, without one of these."""
    fabric, needed = item["input"], ("loop_length", "knitting")
    if item["loc"][-1] not in FROM_YARNS or not isinstance(fabric, Mapping):
        return ""
    lacking = [name for name in needed if fabric.get(name) is None]
    return f"; with {' and '.join(lacking)} it follows from the yarns" if len(lacking) == 1 else ""


def unknown_name_text(name: str, names: list[str], kind: str = "field") -> str:
    """Say that ``name`` is unknown, with the nearest of ``names``, else all of them."""
    close = most_similar_name(name, names)
    return f"unknown {kind} " + (f'(did you mean "{close}"?)' if close else f"(known: {', '.join(names)})")


def _finding_line(item: Mapping[str, Any], layers: Layers, kind: object) -> str:
    path: KeyPath = tuple(part for part in item["loc"] if part not in NO_KEYS)
    cause = item.get("ctx", {}).get("error")
    if isinstance(cause, BoundsError) and cause.part:
        path = (*path, *(int(part) if part.isdigit() else part for part in cause.part.split(".")))
    value, at, stated = layers.get(path), path, ""
    if item["type"] == "missing":
        field = field_at(path, kind)
        needed = "one more entry of the list" if isinstance(path[-1], int) else "the field is required"
        what = f"missing: {_append_unit(field.description, field) if field else needed}"
        what += _yarns_instead(item)
    elif item["type"] == "extra_forbidden":
        what = _unknown_field_text(path, kind)
    elif "[key]" in item["loc"]:
        what = f"unknown field, {_choice_expectation(item['ctx']['expected'], path[-1])}"
    else:
        if isinstance(value, dict) and "value" in value:
            value, at = value["value"], (*path, "value")
        stated = "" if value is None or isinstance(value, dict) else f" = {value_excerpt(value)}"
        what = _expectation(item, value, field_at(path, kind))
    return f"{layers.place_of(at) or 'defaults'}: {dotted_path(path)}{stated}: {what}"


def _append_unit(text: str, field: ConfigField | None, before: str = " [", after: str = "]") -> str:
    return f"{text}{before}{field.unit}{after}" if field and field.unit not in ("", "1") else text


def _unknown_field_text(path: KeyPath, kind: object) -> str:
    holder, name = field_at(path[:-1], kind), str(path[-1])
    names = holder.names if holder else []
    elsewhere = [p for p in all_paths(kind) if p.rpartition(".")[2] == name]
    if most_similar_name(name, names) is None and elsewhere:
        return f'unknown field (did you mean "{elsewhere[0]}"?)'
    return unknown_name_text(name, names)


def _expectation(item: Mapping[str, Any], value: object, field: ConfigField | None) -> str:
    kind, context = item["type"], item.get("ctx", {})
    if isinstance(cause := context.get("error"), BoundsError):
        return cause.expected
    if kind == "value_error":
        return str(context["error"])
    if kind in _NUMBER_TYPES or (kind == "model_type" and field and field.is_quantity):
        return _number_expectation("whole number" if kind.startswith("int") else "number", value, field)
    if kind == "model_type" and field and "fibre" in field.names:
        return f"expected a mapping such as {{fibre: E-glass, linear_density: 50 tex}}, found {describe(value)}"
    if kind == "model_type":
        return f"expected a mapping with {', '.join(field.names) if field else 'fields'}, found {describe(value)}"
    if kind == "literal_error":
        return _choice_expectation(context["expected"], value)
    if kind == "list_type":
        entry = f"{{{field.names[0]}: ...}}" if field and field.names else value if isinstance(value, str) else "..."
        return f"expected a list, such as [{entry}], found {describe(value)}"
    if kind == "tuple_type":
        return f"expected a list of numbers in brackets, found {describe(value)}"
    if kind == "too_long":
        return f"expected at most {context['max_length']} entries, found {context['actual_length']}"
    if kind == "dict_type":
        return f"expected a mapping, found {describe(value)}"
    if kind == "string_type":
        return f"expected text, found {describe(value)} (put text in quotes)"
    if kind == "string_pattern_mismatch":
        return "expected letters, digits, '.', '_' or '-', at most 40, the first a letter or digit"
    return _append_unit(str(item["msg"]).replace("Input should be", "must be"), field, " ", "")


def _number_expectation(number: str, value: object, field: ConfigField | None) -> str:
    expected = _append_unit(f"expected a {number}", field, " in ", "")
    mapping = ", or a mapping of value, sd, source, ref" if field and field.is_quantity else ""
    hint = ""
    if isinstance(value, str) and _DECIMAL_COMMA.match(value):
        hint = f" (decimal comma? write {value.replace(',', '.')})"
    elif isinstance(value, str) and (stated := _NUMBER_AND_UNIT.match(value)):
        unit = field.unit if field else ""
        converted = convert_to_field_unit(float(stated[1].replace(",", ".")), stated[2], unit)
        hint = f" (write {converted or _append_unit('the number without unit', field, ', in ', '')})"
        if converted and field:
            try:
                check_bounds(float(converted), field.meta)
            except BoundsError as error:
                hint = f" ({_append_unit(converted, field, ' ', '')}: {error.expected.partition(' (')[0]})"
    return f"{expected}{mapping}, found {describe(value)}{hint}"


def _choice_expectation(expected: str, value: object) -> str:
    names = re.findall(r"'([^']*)'", expected) or re.split(", | or ", expected)  # numbers have no quotes
    close = most_similar_name(value, names) if isinstance(value, str) else None
    choices = " or ".join(filter(None, (", ".join(names[:-1]), names[-1])))
    return f"expected {choices}" + (f' (did you mean "{close}"?)' if close else "")


Parsed = TypeVar("Parsed", bound=BaseModel)


def parse_as(model: type[Parsed], document: Document) -> Parsed:
    """Read ``document`` as a ``model``; raises :class:`InputError` with all findings, each with file and line."""
    try:
        return model.model_validate(document.data)
    except ValidationError as error:
        layers = Layers(origin={(): document.place_of(())})
        for key, value in document.data.items():
            layers.lay(value, document.place_of, (key,))
        raise input_error(error, layers, model) from None


def number_path(name: str, where: str, kinds: Sequence[str]) -> KeyPath:
    """Key path of ``name``, a number of the fabric or the rig of one of ``kinds``; raises :class:`InputError`."""
    path: KeyPath = tuple(name.split("."))
    known = [p for kind in kinds for p in all_paths(kind) if p.split(".")[0] in ("fabric", "rig")]
    if path[0] not in ("fabric", "rig"):
        same = (p for p in known if p.split(".")[-1] == path[-1])
        example = next(same, "fabric.macro.bending_stiffness.warp")
        raise InputError(f"{where}: {name}: expected a field of the fabric or the rig, such as {example}")
    field = next((f for f in (field_at(path, kind) for kind in kinds) if f is not None), None)
    if field is None:
        names = sorted({p for p in known if p.split(".")[0] == path[0]})
        raise InputError(f"{where}: {name}: {unknown_name_text(name, names) if names else 'unknown field'}")
    if field.model is not None and not field.is_quantity:
        raise InputError(f"{where}: {name}: expected a number, but this is a group: {', '.join(field.names)}")
    return path
