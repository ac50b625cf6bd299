"""Rigid tools of forming: stamp, die and blank holder, by dimensions or by STL files.

The paper prints no dimension of its T-shaped stamp. The defaults are chosen for a blank of 330 x 330 mm and 2.6 mm
thickness, formed 40 mm deep; docs/forming-tools.md has the reasons.
"""

from math import cos, sin, tan
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.config.base import BoundsError, Kernel, Strict, number

#: smallest width of the flat bottom of a T [mm]
FLAT = 1.0


class StlTool(Strict):
    """Tool from an STL file in the x and y of the rig, z up; the rig places it on the fabric in z."""

    path: str = Field(description="STL file, ASCII or binary: a closed body, or the surface that touches the fabric")
    spacing: float = number(
        1.0, "mm", "grid of the distance field; edges are rounded within a cell", gt=0, band=(0.05, 10)
    )
    spacing_mm: ClassVar[Kernel[float]] = Kernel("spacing")
    scale: float = number(
        1.0, "1", "mm per length unit of the file: 25.4 for inches, 1000 for metres", gt=0, band=(1e-4, 1e4)
    )
    rotation: Annotated[tuple[float, float, float], Field(strict=False)] | None = Field(
        None,
        description="rotation about x, y and z, in this order [deg], before scale and offset; [90, 0, 0] for a file "
        "with y up; if given, also as [0, 0, 0], the check of the upper side is skipped",
    )
    offset_x: float = number(0.0, "mm", "shift along x, the weft, after scaling", band=(-5000, 5000))
    offset_x_mm: ClassVar[Kernel[float]] = Kernel("offset_x")
    offset_y: float = number(0.0, "mm", "shift along y, the warp, after scaling", band=(-5000, 5000))
    offset_y_mm: ClassVar[Kernel[float]] = Kernel("offset_y")


class TStamp(Strict):
    """T-shaped stamp: bar along x, stem along -y; lengths of the sharp outline at the bottom, widened by the draft."""

    bar_length: float = number(150.0, "mm", "length of the bar", gt=0, band=(20, 1000))
    bar_length_mm: ClassVar[Kernel[float]] = Kernel("bar_length")
    bar_width: float = number(50.0, "mm", "width of the bar", gt=0, band=(5, 500))
    bar_width_mm: ClassVar[Kernel[float]] = Kernel("bar_width")
    stem_length: float = number(
        100.0, "mm", "length of the stem, from the side of the bar to its end", gt=0, band=(5, 1000)
    )
    stem_length_mm: ClassVar[Kernel[float]] = Kernel("stem_length")
    stem_width: float = number(50.0, "mm", "width of the stem", gt=0, band=(5, 500))
    stem_width_mm: ClassVar[Kernel[float]] = Kernel("stem_width")
    draft_angle: float = number(2.0, "deg", "draft angle of the walls", ge=0, le=45)
    draft_angle_rad: ClassVar[Kernel[float]] = Kernel("draft_angle")
    edge_radius: float = number(8.0, "mm", "radius of the bottom edge", gt=0, band=(0.5, 200))
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
        narrow = 0.5 * min(self.bar_width, self.stem_width)
        room = min(0.5 * (self.bar_length - self.stem_width), self.stem_length) - outer
        if self.stem_width > self.bar_length:
            raise BoundsError(f"must be at most bar_length, {self.bar_length:g} mm", "stem_width")
        if outer > narrow:
            raise BoundsError(f"must be at most half the width of bar and stem, {narrow:g} mm", "outer_corner_radius")
        if inner > room:
            raise BoundsError(
                f"must be at most {room:g} mm, the straight sides of bar and stem next to an outer corner of {outer:g} "
                "mm",
                "inner_corner_radius",
            )
        for limit, reason in (
            (narrow - 0.5 * FLAT, f"to leave a flat bottom {FLAT:g} mm wide"),
            (outer, "outer_corner_radius, or the edge is creased at the corners"),
        ):
            if self.edge_reach > limit:
                raise BoundsError(
                    f"the rounding reaches {self.edge_reach:.4g} mm inwards, expected at most {limit:g} mm, {reason}",
                    "edge_radius",
                )
        return self


class DomeStamp(Strict):
    """Hemisphere with a cylinder above it."""

    radius: float = number(50.0, "mm", "radius of the hemisphere", gt=0, band=(5, 500))
    radius_mm: ClassVar[Kernel[float]] = Kernel("radius")


class Stamp(Strict):
    """Stamp, which moves down through holder and die."""

    kind: Literal["t", "hemisphere", "stl"] = Field("t", description="shape")
    t: TStamp = Field(default_factory=TStamp, description="T-shape (kind t)")
    hemisphere: DomeStamp = Field(default_factory=DomeStamp, description="hemisphere (kind hemisphere)")
    stl: StlTool | None = Field(None, description="STL file (kind stl)")

    @model_validator(mode="after")
    def _stl_is_given(self) -> Self:
        if self.kind == "stl" and self.stl is None:
            raise BoundsError("missing: kind stl needs the path of a file", "stl")
        if self.kind != "stl" and self.stl is not None:
            raise BoundsError(f"needs kind stl, but kind is {self.kind}: set kind to stl, or leave out stl", "stl")
        return self

    @property
    def draft(self) -> float:
        """Draft angle of the walls [rad]."""
        return self.t.draft_angle_rad if self.kind == "t" else 0.0


class Opening(Strict):
    """Plate with an opening of the outline of the stamp."""

    clearance: float = number(
        8.0, "mm", "gap between opening and wall of the stamp at full depth, at the face: room for fabric and folds",
        gt=0, band=(0.1, 200),
    )  # fmt: skip
    clearance_mm: ClassVar[Kernel[float]] = Kernel("clearance")
    edge_radius: float = number(8.0, "mm", "radius of the edge of the opening", gt=0, band=(0.2, 100))
    edge_radius_mm: ClassVar[Kernel[float]] = Kernel("edge_radius")
    stl: StlTool | None = Field(None, description="STL file instead of the dimensions above")


class Die(Opening):
    """Die: block with a vertical opening; without its floor the fabric may sag between the walls below the stamp."""

    floor_gap: float | None = number(
        3.0, "mm", "gap between floor and fabric under the stamp at full depth: room for folds; null: no floor",
        ge=0, le=100,
    )  # fmt: skip


class Holder(Opening):
    """Blank holder: plate that a force presses on the blank."""

    edge_radius: float = number(3.0, "mm", "radius of the edge of the opening", gt=0, band=(0.2, 100))
    mass: float | None = number(
        None, "kg", "moving mass; none: mass of the blank, because a real plate is too inert at the speed of the model",
        gt=0, band=(1e-4, 1000),
    )  # fmt: skip
    mass_g: ClassVar[Kernel[float | None]] = Kernel("mass")
    damping_rate: float = number(1.0, "1/ms", "damping: force = rate x mass x speed", ge=0, le=1000)
    damping_rate_per_ms: ClassVar[Kernel[float]] = Kernel("damping_rate")


def stl_tools(rig: Strict) -> dict[str, StlTool]:
    """STL files of the tools of ``rig`` by name of the tool."""
    tools = {name: getattr(rig, name) for name in type(rig).model_fields}
    return {name: t.stl for name, t in tools.items() if isinstance(t, Stamp | Opening) and t.stl is not None}


def check_fit(stamp: Stamp, die: Die, holder: Holder | None, depth: float) -> None:
    """Raise :class:`BoundsError` if an opening does not fit the inner corners of the ``stamp`` at ``depth`` [mm]."""
    for name, opening in (("die", die), ("holder", holder)):
        if opening is None or opening.stl is not None:
            continue
        if stamp.kind == "stl":
            raise BoundsError("missing: a stamp from STL needs die and holder from STL too", f"{name}.stl")
        if stamp.kind != "t":
            continue
        room = stamp.t.inner_corner_radius - opening_offset(stamp, opening, depth)
        if opening.edge_radius > room:
            raise BoundsError(
                f"must be at most {room:.4g} mm: inner_corner_radius of the stamp ({stamp.t.inner_corner_radius:g} mm) "
                f"minus clearance ({opening.clearance:g} mm) and widening by the draft",
                f"{name}.edge_radius",
            )


def check_blank(stamp: Stamp, width: float, length: float) -> None:
    """Raise :class:`BoundsError` if a blank of ``width`` by ``length`` [mm] does not cover the ``stamp``."""
    if stamp.kind == "stl":
        return
    sphere = 2.0 * stamp.hemisphere.radius
    t = (stamp.t.bar_length, stamp.t.bar_width + stamp.t.stem_length)
    across, along = t if stamp.kind == "t" else (sphere, sphere)
    for name, blank, needed in (("blank_width", width, across), ("blank_length", length, along)):
        if blank < needed:
            raise BoundsError(f"must be at least {needed:g} mm, the size of the stamp", name)


def opening_offset(stamp: Stamp, opening: Opening, depth: float) -> float:
    """Distance in plan [mm] of ``opening`` from the sharp outline of the bottom of the stamp.

    The clearance is the gap to the wall of the stamp where it passes the face of the opening at full ``depth`` [mm].
    """
    return opening.clearance_mm + depth * tan(stamp.draft)
