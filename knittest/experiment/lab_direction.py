"""The direction that a laboratory file states: in its head, in its name or in that of its folder."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from knittest.base.errors import InputError
from knittest.config.fabric import Direction
from knittest.experiment.lab_rows import Row

#: a weft-knitted fabric has both
_FABRIC = re.compile(r"(weft|warp|schuss|schuß|kett)[ -]?(en)?(knit|gewirk|insert|gestrick|beaded)\w*", re.I)
_WORDS: dict[Direction, re.Pattern[str]] = {
    "warp": re.compile(r"(?<![a-zäöü])(warp|wales?(?![a-z])|kett(e|en)?(?![a-zäöü])|kett(richt|f[aä]d|garn))", re.I),
    "weft": re.compile(r"(?<![a-zäöü])(weft|courses?(?![a-z])|filling(?![a-z])|schu(ss|ß))", re.I),
}
_LONGEST = 200


@dataclass(frozen=True)
class Said:
    """A direction and the place that states it: a row of the file, or the name of the file or of its folder."""

    direction: Direction
    where: str
    by: Literal["row", "name", "folder"] = "row"


def said_by(path: Path, head: Iterable[Row]) -> Said | None:
    """Direction by the rows of ``head``, else the file's name, else its folder's; ``None`` if none names just one."""
    places: list[tuple[str, str, Literal["row", "name", "folder"]]] = [
        *((f"{path}:{line}", " ".join(cells), "row") for line, cells in head),
        (f"{path}: its name", path.stem, "name"),
        (f"{path}: its folder", path.parent.name, "folder"),
    ]
    for where, text, by in places:
        plain = _FABRIC.sub(" ", text[:_LONGEST].replace("_", " "))
        named = [direction for direction, word in _WORDS.items() if word.search(plain)]
        if len(named) == 1:
            return Said(named[0], where, by)
    return None


def refuse_other(said: Iterable[Said | None], direction: str) -> None:
    """Raise :class:`InputError` for a file that names the other direction than ``direction``."""
    for one in said:
        if one is not None and one.direction != direction:
            raise InputError(
                f"{one.where} says {one.direction}, --direction says {direction}: which is it? "
                "--trust-direction goes by the option"
            )
