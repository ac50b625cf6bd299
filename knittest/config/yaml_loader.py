"""YAML reader: scalars by the core schema of YAML 1.2 (chapter 10.3), line numbers, safe constructs only.

It reads the events of PyYAML's SafeLoader and checks each before anything is constructed: it rejects duplicate keys,
anchors, aliases, merge keys, tags, several documents, deep nesting, huge files and non-finite numbers.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from knittest.base.errors import InputError
from knittest.base.files import read_regular
from knittest.config.aliases import KeyPath, present_names

#: tag -> pattern of a plain scalar and the characters it can start with
CORE_SCHEMA: dict[str, tuple[re.Pattern[str], str]] = {
    "tag:yaml.org,2002:null": (re.compile(r"(?:null|Null|NULL|~|)$"), "nN~"),
    "tag:yaml.org,2002:bool": (re.compile(r"(?:true|True|TRUE|false|False|FALSE)$"), "tTfF"),
    "tag:yaml.org,2002:int": (re.compile(r"(?:[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+)$"), "-+0123456789"),
    "tag:yaml.org,2002:float": (
        re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?$"),
        "-+.0123456789",
    ),
}
NON_FINITE = re.compile(r"(?:[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$")
INTEGER_DIGITS = 18  # fits 64 bits

Scalar = str | int | float | bool | None


def read_plain(text: str) -> Scalar:
    """Value of a plain scalar; raises ``ValueError`` for an unusable number (infinite, nan, huge)."""
    if NON_FINITE.match(text):
        raise ValueError("expected a finite number")
    tag = next((tag for tag, (pattern, _) in CORE_SCHEMA.items() if pattern.match(text)), "")
    match tag.rpartition(":")[2]:
        case "null":
            return None
        case "bool":
            return text.lower() == "true"
        case "int":
            if len(text.lstrip("+-")) > INTEGER_DIGITS:
                raise ValueError(f"expected an integer of at most {INTEGER_DIGITS} digits")
            return int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))
        case "float":
            if math.isinf(number := float(text)):
                raise ValueError("expected a number below 1.8e308")
            return number
    return text


MAX_BYTES = 1_000_000
MAX_DEPTH = 24
MAX_NODES = 20_000


@dataclass
class Document:
    """Parsed file: plain ``data`` (a mapping) and the ``lines`` (from 1) of every key path in it."""

    source: str
    data: dict[str, Any]
    lines: dict[KeyPath, int] = field(default_factory=dict)

    def place_of(self, path: KeyPath) -> str:
        """``file:line`` of ``path``, or of its nearest ancestor in the file."""
        while path and path not in self.lines:
            path = path[:-1]
        return f"{self.source}:{self.lines.get(path, 1)}"


def load_yaml(path: Path) -> Document:
    """Read a config file; raises :class:`InputError` with file and line unless it is one plain mapping."""
    raw = read_regular(path, MAX_BYTES, "not a config file")
    try:
        return _parsed(raw.decode("utf-8"), str(path))
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise InputError(f"{path}:{line}: not UTF-8 text (byte {error.start}): save the file as UTF-8") from None


def parse_document(text: str, source: str, loader: Any = yaml.SafeLoader) -> Document:
    """Parse YAML text whose top level is a mapping; ``source`` is the file name in messages.

    The ``loader`` of the C library is six times faster, but its messages are less clear.
    """
    builder = _Builder(text, source, loader)
    data = builder.document()
    if data is None:
        raise InputError(f"{source}:1: the file is empty: expected a mapping of fields")
    if not isinstance(data, dict):
        raise InputError(f"{source}:1: expected a mapping of fields (name: value), found {describe(data)}")
    return Document(source, *present_names(data, builder.lines, source))


_parsed = lru_cache(maxsize=16)(parse_document)  # a sweep reads the same fabric for each run; nobody changes it


def parse_value(text: str, source: str) -> Any:
    """Parse one YAML value of the command line; an empty text is null."""
    return _Builder(text, source).document()


def describe(value: object) -> str:
    """Describe a YAML value for a message."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return "a list"
    if value is None:
        return "nothing"
    return f"{'text ' if isinstance(value, str) else ''}{value_excerpt(value)}"


def value_excerpt(value: object, limit: int = 60) -> str:
    """Short single line of a value for a message."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    text = ascii(value) if isinstance(value, str) and not value.isprintable() else repr(value)
    return text if len(text) <= limit else f"{text[: limit - 3]}..."


class _Builder:
    """Builder of plain data from parser events, with the line of every key path."""

    def __init__(self, text: str, source: str, loader: Any = yaml.SafeLoader) -> None:
        self.source, self.loader = source, loader
        self.text = text
        self.lines: dict[KeyPath, int] = {}
        self.nodes = 0

    def document(self) -> Any:
        """Document of the text; ``None`` if there is none."""
        try:
            events = yaml.parse(self.text, Loader=self.loader)
            return self._only_document(events)
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            problem = error.problem or error.context or "invalid"
            problem += ": indent with spaces" if "\\t" in problem else ""
            raise self._error(mark, f"not valid YAML: {problem}") from None
        except yaml.reader.ReaderError as error:
            line = self.text.count("\n", 0, error.position) + 1
            message = f"{self.source}:{line}: not valid YAML: the character U+{error.character:04X} is not allowed"
            raise InputError(message) from None
        except (ValueError, OverflowError):  # PyYAML lets these through from \U escapes and %YAML directives
            raise InputError(f"{self.source}: not valid YAML: a bad escape or directive") from None

    def _only_document(self, events: Iterator[Any]) -> Any:
        data, seen = None, False
        for event in events:
            if isinstance(event, yaml.DocumentStartEvent):
                if seen:
                    raise self._error(event.start_mark, "expected one YAML document, found another")
                if event.tags or event.version not in (None, (1, 2)):
                    raise self._error(event.start_mark, "expected YAML 1.2 without directives")
                seen = True
                data = self._value(next(events), events, ())
        return data

    def _value(self, event: Any, events: Iterator[Any], path: KeyPath) -> Any:
        self._check(event, path)
        self.lines.setdefault(path, event.start_mark.line + 1)
        if isinstance(event, yaml.ScalarEvent):
            return self._scalar(event)
        return self._mapping(events, path) if isinstance(event, yaml.MappingStartEvent) else self._list(events, path)

    def _check(self, event: Any, path: KeyPath) -> None:
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
            found = value_excerpt(f"{'*' if isinstance(event, yaml.AliasEvent) else '&'}{event.anchor}")
            raise self._error(
                event.start_mark, f"anchors and aliases are not allowed: write the value out instead of {found}"
            )
        if event.tag is not None:
            raise self._error(event.start_mark, f"tags are not allowed: remove {value_excerpt(event.tag)}")
        self.nodes += 1
        if self.nodes > MAX_NODES:
            raise self._error(event.start_mark, f"more than {MAX_NODES} values: not a config file")
        if len(path) > MAX_DEPTH:
            raise self._error(event.start_mark, f"nested deeper than {MAX_DEPTH} levels")

    def _mapping(self, events: Iterator[Any], path: KeyPath) -> dict[str, Any]:
        data: dict[str, Any] = {}
        while not isinstance(event := next(events), yaml.MappingEndEvent):
            key = self._key(event, path)
            place = (*path, key)
            if key in data:
                first = self.lines[place]
                raise self._error(event.start_mark, f"{dotted_path(place)}: duplicate key, first given in line {first}")
            self.lines[place] = event.start_mark.line + 1
            data[key] = self._value(next(events), events, place)
        return data

    def _key(self, event: Any, path: KeyPath) -> str:
        self._check(event, path)
        if not isinstance(event, yaml.ScalarEvent):
            raise self._error(event.start_mark, "expected a field name before ':', found a mapping or list")
        if event.implicit[0] and event.value == "<<":
            raise self._error(event.start_mark, "merge keys (<<) are not allowed: write the fields out")
        key = self._scalar(event)
        if not isinstance(key, str):
            raise self._error(event.start_mark, f"expected a field name before ':', found {describe(key)}")
        return key

    def _list(self, events: Iterator[Any], path: KeyPath) -> list[Any]:
        data: list[Any] = []
        while not isinstance(event := next(events), yaml.SequenceEndEvent):
            data.append(self._value(event, events, (*path, len(data))))
        return data

    def _scalar(self, event: Any) -> Scalar:
        if any("\ud800" <= c <= "\udfff" for c in event.value):
            raise self._error(event.start_mark, "an incomplete surrogate pair is no character")
        if not event.implicit[0]:
            return str(event.value)
        try:
            return read_plain(event.value)
        except ValueError as error:
            raise self._error(event.start_mark, f"{value_excerpt(event.value)}: {error}") from None

    def _error(self, mark: Any, problem: str) -> InputError:
        place = self.source if mark is None else f"{self.source}:{mark.line + 1}"
        return InputError(f"{place}: {problem}")


def dotted_path(path: KeyPath) -> str:
    """Key path as for ``--set``: ``law.points[2]``."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")
