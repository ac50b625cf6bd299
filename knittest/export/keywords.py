"""Keyword files of LS-DYNA: cards of fixed columns, numbers with as many digits as their columns hold."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from knittest.base.errors import InputError

Value = float | int | str | None

#: columns of a field where its name does not say otherwise
WIDTH = 10
#: digits of a double that are never noise
DIGITS = 15
#: columns of a line of comment
LINE = 80
_EXPONENT = re.compile(r"e([+-])0*(\d+)")


def number(value: float, width: int) -> str:
    """Text of ``value`` in at most ``width`` columns, rounded to the digits that fit; raises :class:`InputError` for
    a number that is not finite, or fits in no form.
    """
    if not np.isfinite(value):
        raise InputError(f"{value} cannot be written to a deck: expected a finite number")
    for digits in range(min(width, DIGITS), 0, -1):
        for text in (f"{value:.{digits}g}", f"{value:.{digits - 1}e}"):
            if len(text := _EXPONENT.sub(_short, text)) <= width:
                return text
    raise InputError(f"{value!r} does not fit into {width} columns of a deck")


def _short(found: re.Match[str]) -> str:
    return f"e{'-' if found[1] == '-' else ''}{found[2]}"


@dataclass(frozen=True)
class _Field:
    name: str
    width: int

    def cell(self, value: Value) -> str:
        """The columns of ``value``, right-aligned."""
        if isinstance(value, (float, np.floating)):
            text = number(float(value), self.width)
        else:
            text = "" if value is None else str(value)
        if len(text) > self.width:
            raise InputError(f"{self.name} = {text} does not fit into {self.width} columns: the model is too large")
        return text.rjust(self.width)


def _fields(names: str) -> list[_Field]:
    """Fields of ``"nid:8 x:16"``: a name and the columns it has."""
    split = [name.partition(":") for name in names.split()]
    return [_Field(name, int(width or WIDTH)) for name, _, width in split]


@dataclass
class KeywordFile:
    """Lines of a keyword file as they are added, and the numbers that were given to entities of each kind."""

    lines: list[str] = field(default_factory=lambda: ["*KEYWORD"])
    given: dict[str, int] = field(default_factory=dict)

    def number_for(self, kind: str) -> int:
        """The next free number of ``kind``, from 1 on."""
        self.given[kind] = self.given.get(kind, 0) + 1
        return self.given[kind]

    def comment(self, *texts: str) -> None:
        """Add lines of comment."""
        self.lines += [f"$ {text}".rstrip() for text in texts]

    def keyword(self, name: str, title: str | None = None) -> None:
        """Begin keyword ``name``, with its line of text where it has one; a comma there would say columns are free."""
        self.lines.append(f"*{name}")
        if title is not None:
            self.lines.append(title.replace(",", ";")[:LINE])

    def card(self, names: str, *values: Value) -> None:
        """Add one card of the fields ``names``, each ``name`` or ``name:columns``, below a line that names them."""
        self.rows(names, [values])

    def rows(self, names: str, rows: Iterable[Sequence[Value]]) -> None:
        """Add a card a row, below one line that names their fields; values left out are blank."""
        fields = _fields(names)
        heading = "".join(f.name[: f.width].rjust(f.width) for f in fields)
        self.lines.append("$#" + heading[2:])
        self.lines += ["".join(f.cell(v) for f, v in zip(fields, row, strict=False)) for row in rows]

    def numbers(self, values: Iterable[int]) -> None:
        """Add whole ``values``, eight a card."""
        given = list(values)
        self.lines += ["".join(f"{v:>{WIDTH}d}" for v in given[k : k + 8]) for k in range(0, len(given), 8)]

    def curve(self, title: str, abscissa: Iterable[float], ordinate: Iterable[float]) -> int:
        """Add a curve; returns its number."""
        lcid = self.number_for("curve")
        self.keyword("DEFINE_CURVE_TITLE", title)
        self.card("lcid sidr sfa sfo offa offo dattyp lcint", lcid, 0, 1.0, 1.0, 0.0, 0.0, 0, 0)
        self.rows("a1:20 o1:20", zip(map(float, abscissa), map(float, ordinate), strict=True))
        return lcid

    def text(self) -> str:
        """The whole file."""
        return "\n".join([*self.lines, "*END", ""])
