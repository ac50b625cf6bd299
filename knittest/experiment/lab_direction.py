"""The direction that a laboratory file states: in its head, in its name or in that of its folder."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from knittest.base.errors import InputError
from knittest.config.fabric import Direction
from knittest.experiment.lab_names import LONGEST, pattern
from knittest.experiment.lab_rows import Row


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
    directions: tuple[Direction, ...] = ("warp", "weft")
    for where, text, by in places:
        plain = pattern("directions", "fabric").sub(" ", text[:LONGEST].replace("_", " "))
        named = [direction for direction in directions if pattern("directions", direction).search(plain)]
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
