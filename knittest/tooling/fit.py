"""Fit of stamp, die and holder: depth in the die's opening, clearance, and which side is up."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.tooling.stl_tool import CELLS, PROUD, connected_parts
from knittest.tooling.toolset import RigidTool, ToolSet

Array = NDArray[np.float64]
Place = tuple[float, float, float]

#: positions of the stamp along its stroke at which clearances are measured; number of points at each whose distance is
#: taken from triangles, where samples of it are smallest
POSITIONS, NEAREST = 9, 20
#: distance in plan [mm] from the box round the stamp within which clearances are measured
NEAR = 30.0
#: share of the stamp's section that must lie between walls of die and holder; shares of the depth below which a die is
#: rejected, and below which it is suspicious: the face of a die may slope
BETWEEN, ENTERED, FULL = 0.9, 0.5, 0.98
#: share of the area common to holder and die that must be pressed on together, within a thickness
PRESSED = 0.1
#: share of the fabric's thickness by which the clearance may be smaller: files are sampled
SHORT = 0.02
#: width of an edge that is sharp at most, and rounded at least, and the fall in which it is measured, over the
#: thickness of the fabric
SHARP, ROUNDED, FALL = 0.2, 0.5, 2.0
WORKING = {"stamp": "lower edge", "die": "upper edge of the opening", "holder": "lower edge of the opening"}


@dataclass(frozen=True)
class Clearance:
    """Smallest distance [mm] between the stamp and another tool during the stroke, negative where they overlap;
    its ``place`` (x, y, z) and the ``travel`` of the stamp there [mm].
    """

    size: float
    place: Place
    travel: float

    @property
    def place_text(self) -> str:
        """Place and travel in words."""
        x, y, z = self.place
        return f"at x = {x:.1f}, y = {y:.1f}, z = {z:.1f} mm, stamp at {self.travel:.3g} mm"


@dataclass(frozen=True)
class Fit:
    """Fit of tools: the stamp enters the die's opening by ``depth`` of the stroke ``asked`` [mm].

    ``die`` and ``holder`` are the clearances of the stamp. ``problems`` are messages on what is impossible, ``doubts``
    on what is suspicious but stated by the user.
    """

    depth: float
    asked: float
    thickness: float
    die: Clearance
    holder: Clearance | None
    problems: tuple[str, ...]
    fit_warnings: tuple[str, ...]


@dataclass(frozen=True)
class Stroke:
    """Task of the tools: ``depth``, ``thickness`` of the fabric, lengths of the ``blank`` along x and y [mm]."""

    depth: float
    thickness: float
    blank: tuple[float, float]


def measure_fit(tools: ToolSet, stroke: Stroke) -> Fit:
    """Fit of ``tools`` during the ``stroke``."""
    plan = _Plan(tools, stroke)
    die = smallest_clearance(tools.stamp, tools.die, stroke)
    holder = None if tools.holder is None else smallest_clearance(tools.stamp, tools.holder, stroke)
    problems = [*plan.problems(), *_clearance_problems(die, holder, stroke.thickness)]
    inverted = plan.upside_down_warnings()
    stated = [name for name in inverted if getattr(tools.by_name[name].stl, "rotation", None) is not None]
    problems += [text for name, text in inverted.items() if name not in stated]
    doubts = (*(inverted[name] for name in stated), *plan.fit_warnings())
    return Fit(plan.depth, stroke.depth, stroke.thickness, die, holder, tuple(problems), doubts)


def plan_problems(tools: ToolSet, stroke: Stroke) -> list[str]:
    """Problems that height maps show, for ``tools`` that cannot be sampled."""
    return _Plan(tools, stroke).problems()


def filled_share(tools: ToolSet, stroke: Stroke, cells: int) -> float:
    """Share of the die's opening that the stamp fills, by height maps; 0 if they show that the tools do not fit.

    Edges are checked only on maps of :data:`CELLS` cells.
    """
    plan = _Plan(tools, stroke, cells)
    impossible = plan.problems() or plan.gap < (1.0 - SHORT) * stroke.thickness
    return 0.0 if impossible or (cells == CELLS and plan.upside_down_warnings()) else plan.filled_opening_share


def smallest_clearance(stamp: RigidTool, other: RigidTool, stroke: Stroke) -> Clearance:
    """Smallest distance over the blank between ``stamp`` and ``other`` while the stamp moves down."""
    found, top, half = [], float(other.solid.points[:, 2].max()), 0.5 * np.array(stroke.blank)
    own = _points_within(stamp.gap_points, -half, half)
    low, high = own[:, :2].min(axis=0) - NEAR, own[:, :2].max(axis=0) + NEAR
    around = _points_within(other.gap_points, np.maximum(low, -half), np.minimum(high, half))
    for travel in np.linspace(stroke.depth, 0.0, POSITIONS):
        down = np.array([0.0, 0.0, travel])
        moved = own - down
        if other.exact is not None:  # its wall has no end for the kernel, but its mesh has
            moved = moved[moved[:, 2] <= top]
        for tool, points, lift in ((other, moved, 0.0 * down), (stamp, around, down)):
            if len(points):
                points = points[np.argsort(tool.distance(points + lift))[:NEAREST]]
                distance = tool.exact_distance(points + lift)
                k = int(distance.argmin())
                x, y, z = (float(value) for value in points[k])
                found.append(Clearance(float(distance[k]), (x, y, z), float(travel)))
    return min(found, key=lambda clearance: clearance.size)


def _points_within(points: Array, low: Array, high: Array) -> Array:
    """Return the ``points`` (n, 3) between ``low`` and ``high`` (2,) in plan, or all if there are none."""
    inside = ((points[:, :2] >= low) & (points[:, :2] <= high)).all(axis=1)
    return points[inside] if inside.any() else points


class _Plan:
    """Tools as their height maps show them; heights of stamp and holder are counted downwards."""

    def __init__(self, tools: ToolSet, stroke: Stroke, cells: int = CELLS) -> None:
        self.tools, self.stroke = tools, stroke
        self.stamp = tools.stamp.height_map(stroke.blank, below=True, cells=cells)
        self.die = tools.die.height_map(stroke.blank, cells=cells)
        self.holder = None if tools.holder is None else tools.holder.height_map(stroke.blank, below=True, cells=cells)
        #: cells in which the stamp comes to lie below the die's face
        self.entering = self.stamp.covered_cells & (self.stamp.height + stroke.depth > -self.die.face)
        self.between = np.isfinite(self.die.rim()) & self.entering

    @property
    def depth(self) -> float:
        """Depth [mm] of the fabric under the stamp in the die's opening at the end; 0 outside an opening."""
        if not self._within_walls(self.between):
            return 0.0
        half = 0.5 * np.array(self.stroke.blank)
        lowest = float(_points_within(self.tools.stamp.solid.points, -half, half)[:, 2].min()) - self.stroke.depth
        rim = float(self.die.rim()[self.between].max())
        return max(rim - (lowest - self.stroke.thickness), 0.0)

    @property
    def gap(self) -> float:
        """Smallest upright distance [mm] of stamp and die at the end of the stroke, at least their clearance."""
        both = self.stamp.covered_cells & self.die.covered_cells
        return float((-self.stamp.height - self.stroke.depth - self.die.height)[both].min(initial=np.inf))

    @property
    def filled_opening_share(self) -> float:
        """Share of the die's opening in plan that the stamp fills."""
        low = self.die.height < self.die.face - 0.5 * self.stroke.depth
        opening = connected_parts(low, self.entering)
        return float(self.entering.sum()) / max(float((opening | self.entering).sum()), 1.0)

    def problems(self) -> list[str]:
        """Sentences on what is impossible."""
        found = []
        if not self._within_walls(self.between):
            found.append(f"The stamp does not enter an opening of the die: {self._share_message(self.between, 'die')}.")
        elif self.depth < ENTERED * self.stroke.depth:
            found.append(self._shallow_message())
        if self.holder is None:
            return found
        between = np.isfinite(self.holder.rim()) & self.entering
        if self.entering.any() and not self._within_walls(between):
            found.append(
                f"The stamp does not pass through an opening of the holder: {self._share_message(between, 'holder')}."
            )
        gap = -self.holder.height - self.die.height
        common = gap[self.holder.covered_cells & self.die.covered_cells]
        pressed = float(np.mean(common < common.min() + self.stroke.thickness)) if common.size else 0.0
        if pressed < PRESSED:
            found.append(
                f"The holder presses on {100.0 * pressed:.2g} % of the die's face, expected at least "
                f"{100.0 * PRESSED:.0f} %."
            )
        return found

    def fit_warnings(self) -> list[str]:
        """Sentences on what is suspicious."""
        shallow = ENTERED * self.stroke.depth <= self.depth < FULL * self.stroke.depth
        return [self._shallow_message()] if shallow else []

    def _shallow_message(self) -> str:
        return (
            f"The stamp enters the die's opening by {self.depth:.3g} mm, expected {self.stroke.depth:g} mm. The die's "
            f"face is at z = {self.die.face:.3g} mm, where {100.0 * (1.0 - PROUD):.0f} % of the die lie below."
        )

    def upside_down_warnings(self) -> dict[str, str]:
        """Sentence on each tool from a file whose working edge is sharp while its opposite edge is rounded."""
        found = {}
        fall, thickness, blank = FALL * self.stroke.thickness, self.stroke.thickness, self.stroke.blank
        for name, tool in self.tools.by_name.items():
            if tool.stl is None:
                continue
            up, down = tool.height_map(blank), tool.height_map(blank, below=True)
            working, other = (up, down) if name == "die" else (down, up)
            here, there = (
                seen.edge_width(fall, float(seen.height.max()) if name == "stamp" else seen.face,
                                None if name == "stamp" else self.entering)
                for seen in (working, other)
            )  # fmt: skip
            if here < SHARP * thickness and there > ROUNDED * thickness:
                found[name] = (
                    f"The {name} stands upside down: the {WORKING[name]} is sharp, but the opposite edge is rounded "
                    f"({there:.2g} mm wide). If this is intended, state rig.{name}.stl.rotation=[0,0,0]."
                )
        return found

    def _within_walls(self, between: NDArray[np.bool_]) -> bool:
        return bool(between.any()) and between.sum() >= BETWEEN * self.entering.sum()

    def _share_message(self, between: NDArray[np.bool_], name: str) -> str:
        if not self.entering.any():
            return "no part of it lies over the die"
        share = 100.0 * between.sum() / self.entering.sum()
        return f"{share:.0f} % of its area lies between walls of the {name}, expected at least {100.0 * BETWEEN:.0f} %"


def _clearance_problems(die: Clearance, holder: Clearance | None, thickness: float) -> list[str]:
    found = []
    if die.size < (1.0 - SHORT) * thickness:
        size = f"is {die.size:.3g} mm" if die.size > 0.0 else f"is negative, they overlap by {-die.size:.3g} mm"
        found.append(
            f"The clearance between stamp and die {size} ({die.place_text}), expected at least the fabric's thickness, "
            f"{thickness:.3g} mm."
        )
    if holder is not None and holder.size <= 0.0:
        found.append(f"Stamp and holder overlap by {-holder.size:.3g} mm ({holder.place_text}).")
    return found
