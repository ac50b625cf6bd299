"""Structure of a fabric: the grid of its stitches and its layers of inlays from back to face, and the yarn systems that
they make.
"""

from collections import Counter
from dataclasses import dataclass
from math import lcm
from typing import Literal, Self, get_args

from pydantic import Field, model_validator

from knittest.config.base import BoundsError, Strict
from knittest.config.yarn import ReinforcingYarn

Direction = Literal["warp", "weft"]
DIRECTIONS: tuple[Direction, ...] = get_args(Direction)
#: name of the system of the loops
KNIT = "knit"
#: side to which a stitch is pulled through the loop of the course before: 1 face, -1 back
STITCHES = {"k": 1, "p": -1}
#: most stitches in a repeat of the structure, each way
LARGEST_REPEAT = 8


class InlayLayer(Strict):
    """One layer of inlays of one direction."""

    direction: Direction = Field(description="warp: along the wales, weft: along the courses")
    pattern: str = Field(
        "x", description="wales (of warp inlays) or courses (of weft inlays) with an inlay (x) and without (.), "
        "repeated; x. is every second one",
    )  # fmt: skip
    yarn: ReinforcingYarn | None = Field(None, description="yarn of this layer; none: fabric.reinforcing")

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        if "x" not in self.pattern or set(self.pattern) - set("x."):
            raise BoundsError(
                "expected x for each wale or course with an inlay and . for others, such as x.", "pattern"
            )
        return self


@dataclass(frozen=True)
class Inlays:
    """Yarns of one layer: the ``name`` of the system, its direction, its yarn and the config ``field`` of this yarn.

    ``pattern`` tells for each wale (warp) or course (weft) of a repeat whether it has an inlay.
    """

    name: str
    direction: Direction
    yarn: ReinforcingYarn
    field: str
    pattern: tuple[bool, ...] = (True,)

    @property
    def share(self) -> float:
        """Share of the wales or courses that have an inlay [-]."""
        return sum(self.pattern) / len(self.pattern)

    @property
    def crimp(self) -> float:
        """Crimp [-]."""
        return self.yarn.crimp_fraction.of(self.direction)

    @property
    def bending(self) -> float:
        """Bending stiffness EI of one yarn [N mm2]."""
        return self.yarn.bending_stiffness_n_mm2.of(self.direction)

    @property
    def section_mm(self) -> tuple[float, float]:
        """Width and height [mm] of the contact section."""
        return self.yarn.section_mm(self.direction)

    def has_inlay(self, number: int) -> bool:
        """Tell whether wale or course ``number`` has an inlay."""
        return self.pattern[number % len(self.pattern)]

    def count(self, wales_or_courses: int) -> int:
        """Inlays in the first ``wales_or_courses``."""
        return sum(self.has_inlay(k) for k in range(wales_or_courses))


def direction_of(system: str) -> str:
    """Direction of the inlays of ``system``, as ``weft`` of ``weft2``; loops: its name."""
    return system.rstrip("0123456789")


def grid_of(rows: list[str]) -> tuple[tuple[int, ...], ...]:
    """Sides of the stitches by course and wale from rows such as ``kp``; raises :class:`BoundsError`."""
    for number, row in enumerate(rows):
        if strange := [letter for letter in row if letter not in STITCHES]:
            raise BoundsError(f"{strange[0]!r} is no stitch: expected k (knit) or p (purl)", f"stitches.{number}")
        if len(row) != len(rows[0]) or not row:
            raise BoundsError(
                f"has length {len(row)} and the first course length {len(rows[0])}: expected courses of equal "
                "length, at least 1",
                f"stitches.{number}",
            )
    if not rows:
        raise BoundsError("is empty: expected a row of k and p for each course, such as [k]", "stitches")
    return tuple(tuple(STITCHES[letter] for letter in row) for row in rows)


def inlays_of(layers: list[InlayLayer] | None, reinforcing: ReinforcingYarn | None) -> list[Inlays]:
    """Systems of inlays from back to face; without ``layers`` a warp in every wale behind a weft in every course.

    Raises :class:`BoundsError` for a layer without a yarn.
    """
    if layers is None:
        layers = [] if reinforcing is None else [InlayLayer(direction="warp"), InlayLayer(direction="weft")]
    many, seen = Counter(layer.direction for layer in layers), Counter[str]()
    found: list[Inlays] = []
    for number, layer in enumerate(layers):
        yarn, field = (layer.yarn, f"layers.{number}.yarn") if layer.yarn is not None else (reinforcing, "reinforcing")
        if yarn is None:
            message = "missing: yarn of this layer, or fabric.reinforcing for all layers without one"
            raise BoundsError(message, f"layers.{number}.yarn")
        seen[layer.direction] += 1
        name = layer.direction if many[layer.direction] == 1 else f"{layer.direction}{seen[layer.direction]}"
        found.append(Inlays(name, layer.direction, yarn, field, tuple(c == "x" for c in layer.pattern)))
    return found


def repeat_of(grid: tuple[tuple[int, ...], ...], inlays: list[Inlays]) -> tuple[int, int]:
    """Wales and courses after which the structure repeats; raises :class:`BoundsError` for a very large one."""
    wales = lcm(len(grid[0]), *(len(i.pattern) for i in inlays if i.direction == "warp"))
    courses = lcm(len(grid), *(len(i.pattern) for i in inlays if i.direction == "weft"))
    if max(wales, courses) > LARGEST_REPEAT:
        raise BoundsError(
            f"repeats after {wales} wales and {courses} courses, expected at most {LARGEST_REPEAT}: use shorter rows "
            "and patterns, or such whose lengths divide each other",
            "layers" if inlays else "stitches",
        )
    return wales, courses
