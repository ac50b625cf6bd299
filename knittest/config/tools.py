"""The rigid tools of forming: stamp, die and blank holder, by dimensions or by STL files of one's own.

The paper shows its T-shaped stamp but prints no dimension of it. The defaults are chosen for a blank of 330 x 330 mm
and 2.6 mm thickness, drawn 40 mm deep; the reasons stand in docs/forming-tools.md.
"""

from math import cos, sin, tan
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.config.base import BoundsError, Kernel, Strict, number

#: narrowest flat bottom of a T [mm]
FLAT = 1.0


class StlTool(Strict):
    """A tool of one's own: its x and y are those of the rig, z points up; the rig puts it on the fabric in z."""

    path: str = Field(description="STL file, ASCII or binary; a closed body, or the skin that the fabric touches")
    spacing: float = number(
        1.0, "mm", "grid on which its distance is sampled: edges are rounded within a cell", gt=0, band=(0.05, 10)
    )
    spacing_mm: ClassVar[Kernel[float]] = Kernel("spacing")
    scale: float = number(
        1.0, "1", "mm per unit of length of the file: 25.4 for inches, 1000 for metres", gt=0, band=(1e-4, 1e4)
    )
    rotation: Annotated[tuple[float, float, float], Field(strict=False)] | None = Field(
        None,
        description="rotation about the axes x, y and z, in this order [deg], before scale and offset; [90, 0, 0] for "
        "a file with y up; stated, also as [0, 0, 0], it overrules the check which side is up",
    )
    offset_x: float = number(0.0, "mm", "moves it along x, the weft, after scaling", band=(-5000, 5000))
    offset_x_mm: ClassVar[Kernel[float]] = Kernel("offset_x")
    offset_y: float = number(0.0, "mm", "moves it along y, the warp, after scaling", band=(-5000, 5000))
    offset_y_mm: ClassVar[Kernel[float]] = Kernel("offset_y")


class TStamp(Strict):
    """A stamp of T-shape: the bar along x, the stem from its middle along -y; lengths are those of the sharp outline at
    its bottom, which a draft widens upwards.
    """

    bar_length: float = number(150.0, "mm", "length of the bar", gt=0, band=(20, 1000))
    bar_length_mm: ClassVar[Kernel[float]] = Kernel("bar_length")
    bar_width: float = number(50.0, "mm", "width of the bar", gt=0, band=(5, 500))
    bar_width_mm: ClassVar[Kernel[float]] = Kernel("bar_width")
    stem_length: float = number(100.0, "mm", "length of the stem, from the bar's side to its end", gt=0, band=(5, 1000))
    stem_length_mm: ClassVar[Kernel[float]] = Kernel("stem_length")
    stem_width: float = number(50.0, "mm", "width of the stem", gt=0, band=(5, 500))
    stem_width_mm: ClassVar[Kernel[float]] = Kernel("stem_width")
    draft_angle: float = number(2.0, "deg", "slope of the walls against the direction of pressing", ge=0, le=45)
    draft_angle_rad: ClassVar[Kernel[float]] = Kernel("draft_angle")
    edge_radius: float = number(8.0, "mm", "radius of the edge round the bottom", gt=0, band=(0.5, 200))
    edge_radius_mm: ClassVar[Kernel[float]] = Kernel("edge_radius")
    outer_corner_radius: float = number(12.0, "mm", "radius of the six outer corners in plan", gt=0, band=(0.5, 200))
    outer_corner_radius_mm: ClassVar[Kernel[float]] = Kernel("outer_corner_radius")
    inner_corner_radius: float = number(
        20.0, "mm", "radius of the two corners between bar and stem in plan", gt=0, band=(0.5, 200)
    )
    inner_corner_radius_mm: ClassVar[Kernel[float]] = Kernel("inner_corner_radius")

    @property
    def edge_reach(self) -> float:
        """Reach of the rounded edge inwards from the sharp outline [mm]."""
        draft = self.draft_angle_rad
        return self.edge_radius * (1.0 - sin(draft)) / cos(draft)

    @model_validator(mode="after")
    def _radii_fit(self) -> Self:
        outer, inner = self.outer_corner_radius, self.inner_corner_radius
        if self.stem_width > self.bar_length:
            raise BoundsError(f"must be at most the bar's length, {self.bar_length:g} mm", "stem_width")
        narrow = 0.5 * min(self.bar_width, self.stem_width)
        if outer > narrow:
            raise BoundsError(f"must be at most half of bar and stem, {narrow:g} mm", "outer_corner_radius")
        room = min(0.5 * (self.bar_length - self.stem_width), self.stem_length) - outer
        if inner > room:
            raise BoundsError(
                f"must be at most {room:g} mm: what an outer corner of {outer:g} mm leaves of the bar beside the stem "
                f"and of the stem",
                "inner_corner_radius",
            )
        if self.edge_reach > narrow - 0.5 * FLAT:
            raise BoundsError(
                f"reaches {self.edge_reach:.4g} mm inwards, must leave a flat bottom {FLAT:g} mm wide", "edge_radius"
            )
        if self.edge_reach > outer:
            raise BoundsError(
                f"reaches {self.edge_reach:.4g} mm inwards, must be at most outer_corner_radius, {outer:g} mm, or the "
                f"edge is creased at the corners",
                "edge_radius",
            )
        return self


class DomeStamp(Strict):
    """A hemisphere, and above it a cylinder."""

    radius: float = number(50.0, "mm", "radius of the hemisphere", gt=0, band=(5, 500))
    radius_mm: ClassVar[Kernel[float]] = Kernel("radius")


class Stamp(Strict):
    """The stamp, which moves down through holder and die."""

    kind: Literal["t", "hemisphere", "stl"] = Field("t", description="shape; says which of the next fields counts")
    t: TStamp = Field(default_factory=TStamp, description="T-shape (kind t)")
    hemisphere: DomeStamp = Field(default_factory=DomeStamp, description="hemisphere (kind hemisphere)")
    stl: StlTool | None = Field(None, description="file of one's own (kind stl)")

    @model_validator(mode="after")
    def _stl_is_given(self) -> Self:
        if self.kind == "stl" and self.stl is None:
            raise BoundsError("missing: kind stl needs it, with the path of a file", "stl")
        if self.kind != "stl" and self.stl is not None:
            raise BoundsError(f"is given, but kind is {self.kind}: set kind to stl, or leave it away", "stl")
        return self

    @property
    def draft(self) -> float:
        """Slope of its walls [rad]."""
        return self.t.draft_angle_rad if self.kind == "t" else 0.0


class Opening(Strict):
    """A plate with an opening of the stamp's outline."""

    clearance: float = number(
        8.0,
        "mm",
        "gap between the opening and the stamp's wall, at full depth and the face's height: room for fabric and folds",
        gt=0, band=(0.1, 200),
    )  # fmt: skip
    clearance_mm: ClassVar[Kernel[float]] = Kernel("clearance")
    edge_radius: float = number(8.0, "mm", "radius of the edge round the opening", gt=0, band=(0.2, 100))
    edge_radius_mm: ClassVar[Kernel[float]] = Kernel("edge_radius")
    stl: StlTool | None = Field(None, description="file of one's own, instead of the dimensions above")


class Die(Opening):
    """The die: a block under the blank, with a vertical opening and a flat floor.

    Without the floor the fabric between the walls may sag below the stamp, and need not shear at its inner corners.
    """

    floor_gap: float | None = number(
        3.0, "mm", "gap between the floor and the fabric under the drawn stamp: room for folds; null: no floor",
        ge=0, le=100,
    )  # fmt: skip


class Holder(Opening):
    """The blank holder: a plate on the blank, pressed by a force."""

    edge_radius: float = number(3.0, "mm", "radius of the edge round the opening", gt=0, band=(0.2, 100))
    mass: float | None = number(
        None,
        "kg",
        "mass that follows the force; none: that of the blank. The press is slower than the model, in which a "
        "true plate would be too inert to follow the fabric",
        gt=0, band=(1e-4, 1000),
    )  # fmt: skip
    mass_g: ClassVar[Kernel[float | None]] = Kernel("mass")
    drag: float = number(
        1.0, "1/ms", "damping of its motion, as a rate: drag times mass times its speed is a force", ge=0, le=1000
    )
    drag_per_ms: ClassVar[Kernel[float]] = Kernel("drag")


def stl_tools(rig: Strict) -> dict[str, StlTool]:
    """STL files of the tools of ``rig`` by the name of the tool; none for a rig without such tools."""
    tools = {name: getattr(rig, name) for name in type(rig).model_fields}
    return {name: t.stl for name, t in tools.items() if isinstance(t, Stamp | Opening) and t.stl is not None}


def check_fit(stamp: Stamp, die: Die, holder: Holder | None, depth: float) -> None:
    """Raise :class:`BoundsError` when openings cannot be made round the ``stamp`` drawn ``depth`` [mm] deep.

    The inner corners of a T are the narrowest places: an opening wider than the stamp has a smaller radius there, of
    which its own edge takes a share.
    """
    for name, opening in (("die", die), ("holder", holder)):
        if opening is None or opening.stl is not None:
            continue
        if stamp.kind == "stl":
            raise BoundsError("missing: a stamp by STL needs die and holder by STL too", f"{name}.stl")
        if stamp.kind != "t":
            continue
        room = stamp.t.inner_corner_radius - opening_offset(stamp, opening, depth)
        if opening.edge_radius > room:
            raise BoundsError(
                f"must be at most {room:.4g} mm: inner_corner_radius of the stamp ({stamp.t.inner_corner_radius:g} mm) "
                f"less the clearance ({opening.clearance:g} mm) and what the draft widens the stamp",
                f"{name}.edge_radius",
            )


def check_blank(stamp: Stamp, width: float, length: float) -> None:
    """Raise :class:`BoundsError` when a blank of ``width`` by ``length`` [mm] does not cover the ``stamp``."""
    if stamp.kind == "stl":
        return
    sphere = 2.0 * stamp.hemisphere.radius
    t = (stamp.t.bar_length, stamp.t.bar_width + stamp.t.stem_length)
    across, along = t if stamp.kind == "t" else (sphere, sphere)
    for name, blank, needed in (("blank_width", width, across), ("blank_length", length, along)):
        if blank < needed:
            raise BoundsError(f"smaller than the stamp: must be at least {needed:g} mm", name)


def opening_offset(stamp: Stamp, opening: Opening, depth: float) -> float:
    """Distance in plan of ``opening`` from the sharp outline of the stamp's bottom [mm].

    The clearance is the gap to the wall of the stamp where this passes the face of the opening at full ``depth`` [mm].
    """
    return opening.clearance_mm + depth * tan(stamp.draft)
