"""Block files of OpenRadioss: a keyword line, a title, then cards with fields of 10 or 20 columns.

The format is that of the Radioss reference guide, "Block Format Keywords", input version :data:`VERSION`. Lines that
begin with # are comments.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

from knittest.export.keywords import CardFile

#: version of the input format in /BEGIN and /VERS
VERSION = 2026
#: columns of a title
TITLE = 100
#: columns of a real number
REAL = 20


@dataclass
class BlockFile(CardFile):
    """A starter file of OpenRadioss."""

    mark: ClassVar[str] = "#"
    numbers_per_card: ClassVar[int] = 10

    def block(self, name: str, title: str | None = None) -> None:
        """Begin the block /``name``, with an optional title."""
        self.lines.append(f"/{name}")
        if title is not None:
            self.lines.append(title[:TITLE])

    def function(self, title: str, abscissa: Iterable[float], ordinate: Iterable[float]) -> int:
        """Add /FUNCT; returns its number."""
        number = self.number_for("function")
        self.block(f"FUNCT/{number}", title)
        self.rows("X:20 Y:20", zip(map(float, abscissa), map(float, ordinate), strict=True))
        return number

    def node_group(self, title: str, nodes: Iterable[int]) -> int:
        """Add /GRNOD/NODE; returns its number."""
        number = self.number_for("node group")
        self.block(f"GRNOD/NODE/{number}", title)
        self.numbers(nodes)
        return number

    def text(self) -> str:
        """Text of the whole file."""
        return "\n".join([*self.lines, "/END", ""])
