"""Elements of a page: sections of blocks. Plain data without markup; the templates escape all of it."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

Tone = Literal["", "good", "warn", "bad", "help"]


@dataclass(frozen=True)
class Cell:
    """Text of a cell, with its number ``value``, small print ``note``, and ``href`` (``#ANCHOR`` or a quoted path)."""

    text: str
    value: float | None = None
    note: str = ""
    tone: Tone = ""
    href: str = ""


@dataclass(frozen=True)
class Table:
    """Rows of cells under a ``header``, if any; the first cell names its row, ``numeric`` columns align right."""

    kind: ClassVar[str] = "table"
    caption: str
    header: tuple[str, ...]
    rows: Sequence[tuple[Cell, ...]]
    numeric: tuple[int, ...] = ()


@dataclass(frozen=True)
class Text:
    """A paragraph; with a tone it is a notice."""

    kind: ClassVar[str] = "text"
    text: str
    tone: Tone = ""


@dataclass(frozen=True)
class Picture:
    """An image as a data URI; a ``wide`` one scrolls on a narrow screen."""

    kind: ClassVar[str] = "picture"
    uri: str
    alt: str
    caption: str
    wide: bool = False


@dataclass(frozen=True)
class Gallery:
    """Pictures next to each other, below each other on a narrow screen."""

    kind: ClassVar[str] = "gallery"
    pictures: Sequence[Picture]


@dataclass(frozen=True)
class Code:
    """Text to copy, with an optional ``download`` (file name, data URI); long text starts folded."""

    kind: ClassVar[str] = "code"
    text: str
    caption: str
    download: tuple[str, str] | None = None


Block = Table | Text | Picture | Gallery | Code


@dataclass(frozen=True)
class Section:
    """Part of a page with a heading of ``level`` 2 or 3 and a unique ``anchor``; a ``folded`` one starts closed."""

    anchor: str
    title: str
    blocks: Sequence[Block] = field(default_factory=tuple)
    level: int = 3
    folded: bool = False


@dataclass(frozen=True)
class Page:
    """A whole page; the contents list the sections of level 2."""

    title: str
    subtitle: str
    sections: Sequence[Section]


_JOINTS = re.compile(r"(?<=[._/])(?=[A-Za-z])")
_HASH = re.compile(r"\w{30,}(-dirty)?")
_STEP = 16
_LAST_OF_PLANES = "".join(chr(plane * 0x10000 + last) for plane in range(1, 17) for last in (0xFFFE, 0xFFFF))
#: control characters, halves of surrogate pairs and code points that are no characters
_FORBIDDEN = re.compile(f"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufdd0-\ufdef\ufffe\uffff{_LAST_OF_PLANES}]")
#: characters of a label in a picture
_LABEL = 70


def wrap_points(text: str) -> list[str]:
    """``text`` cut where a line may end (``<wbr>``), so that tables fit a phone."""
    found = []
    for word in _JOINTS.split(text):
        found += [word[i : i + _STEP] for i in range(0, len(word), _STEP)] if _HASH.fullmatch(word) else [word]
    return found


def without_forbidden(text: str) -> str:
    """``text`` with U+FFFD for characters that HTML forbids, from damaged files."""
    return _FORBIDDEN.sub("\N{REPLACEMENT CHARACTER}", text)


def legend_label(text: str) -> str:
    """``text`` as one line of a legend, with dollar signs that begin no formula."""
    plain = "".join(c if c.isprintable() else " " for c in text)
    return (plain if len(plain) <= _LABEL else plain[: _LABEL - 3] + "...").replace("$", r"\$")
