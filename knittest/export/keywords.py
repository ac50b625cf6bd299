"""Files of cards with fixed columns, numbers with as many digits as their columns hold; keyword files of LS-DYNA."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from knittest.base.errors import InputError

Value = float | int | str | None

#: default columns of a field
WIDTH = 10
#: significant digits of a double
DIGITS = 15
#: columns of a line of comment
LINE = 80
_EXPONENT = re.compile(r"e([+-])0*(\d+)")


def number(value: float, width: int) -> str:
    """Write ``value`` in at most ``width`` columns, rounded to the digits that fit, else raise :class:`InputError`."""
    if not np.isfinite(value):
        raise InputError(f"{value} cannot be written to a deck: expected a finite number")
    for digits in range(min(width, DIGITS), 0, -1):
        for text in (f"{value:.{digits}g}", f"{value:.{digits - 1}e}"):
            text = _EXPONENT.sub(lambda found: f"e{found[1].strip('+')}{found[2]}", text)
            if len(text) <= width:
                return text
    raise InputError(f"{value!r} does not fit into {width} columns of a deck")


def _cell(name: str, width: int, value: Value) -> str:
    if isinstance(value, (float, np.floating)):
        text = number(float(value), width)
    else:
        text = "" if value is None else str(value)
    if len(text) > width:
        raise InputError(f"{name} = {text} does not fit into {width} columns: the model is too large")
    return text.rjust(width)


@dataclass
class CardFile:
    """Lines of a file of cards as they are added, and the numbers that were given to entities of each kind."""

    #: begins a line of comment; whole numbers that :meth:`numbers` writes in one card
    mark: ClassVar[str] = "$"
    numbers_per_card: ClassVar[int] = 8

    lines: list[str] = field(default_factory=list)
    given: dict[str, int] = field(default_factory=dict)

    def number_for(self, kind: str) -> int:
        """Return the next free number of ``kind``, from 1 on."""
        self.given[kind] = self.given.get(kind, 0) + 1
        return self.given[kind]

    def comment(self, *texts: str) -> None:
        """Add lines of comment."""
        self.lines += [f"{self.mark} {text}".rstrip() for text in texts]

    def card(self, names: str, *values: Value) -> None:
        """Add one card of the fields ``names``, such as ``nid:8 x:16`` (name and columns), below a line of names."""
        self.rows(names, [values])

    def rows(self, names: str, rows: Iterable[Sequence[Value]]) -> None:
        """Add a card for each row, below a line of field names; missing values are blank."""
        split = (name.partition(":") for name in names.split())
        fields = [(name, int(width or WIDTH)) for name, _, width in split]
        mark = f"{self.mark}#" if self.mark != "#" else "#"
        self.lines.append(mark + "".join(name[:width].rjust(width) for name, width in fields)[len(mark) :])
        self.lines += ["".join(_cell(*field, v) for field, v in zip(fields, row, strict=False)) for row in rows]

    def numbers(self, values: Iterable[int]) -> None:
        """Add whole ``values``, as many in a card as it holds."""
        given, n = list(values), self.numbers_per_card
        self.lines += ["".join(f"{v:>{WIDTH}d}" for v in given[k : k + n]) for k in range(0, len(given), n)]

    def text(self) -> str:
        """Text of the whole file."""
        return "\n".join([*self.lines, ""])


@dataclass
class KeywordFile(CardFile):
    """A keyword file of LS-DYNA."""

    lines: list[str] = field(default_factory=lambda: ["*KEYWORD"])

    def keyword(self, name: str, title: str | None = None) -> None:
        """Begin keyword ``name``, with an optional title; commas, which mean free format, are replaced."""
        self.lines.append(f"*{name}")
        if title is not None:
            self.lines.append(title.replace(",", ";")[:LINE])

    def curve(self, title: str, abscissa: Iterable[float], ordinate: Iterable[float]) -> int:
        """Add a curve; returns its number."""
        lcid = self.number_for("curve")
        self.keyword("DEFINE_CURVE_TITLE", title)
        self.card("lcid sidr sfa sfo offa offo dattyp lcint", lcid, 0, 1.0, 1.0, 0.0, 0.0, 0, 0)
        self.rows("a1:20 o1:20", zip(map(float, abscissa), map(float, ordinate), strict=True))
        return lcid

    def text(self) -> str:
        """Text of the whole file."""
        return "\n".join([*self.lines, "*END", ""])
