"""Outlines of the tools from their dimensions, centred on the blank."""

from knittest.config.tools import DomeStamp, Stamp, TStamp
from knittest.tooling.outline import Outline, circle, rounded_polygon


def stamp_outline(stamp: Stamp) -> Outline:
    """Sharp outline of the bottom of a stamp by dimensions; the box round it is centred on the origin."""
    return _t_outline(stamp.t) if stamp.kind == "t" else _dome_outline(stamp.hemisphere)


def stamp_edge(stamp: Stamp) -> float:
    """Radius of the edge round the stamp's bottom [mm]: a hemisphere is all edge."""
    return stamp.t.kernel("edge_radius") if stamp.kind == "t" else stamp.hemisphere.kernel("radius")


def _t_outline(t: TStamp) -> Outline:
    bar, stem = 0.5 * t.kernel("bar_length"), 0.5 * t.kernel("stem_width")
    top = 0.5 * (t.kernel("bar_width") + t.kernel("stem_length"))
    side = top - t.kernel("bar_width")
    corners = [
        (stem, -top), (stem, side), (bar, side), (bar, top), (-bar, top), (-bar, side), (-stem, side), (-stem, -top),
    ]  # fmt: skip
    outer, inner = t.kernel("outer_corner_radius"), t.kernel("inner_corner_radius")
    return rounded_polygon(corners, [outer, inner, outer, outer, outer, outer, inner, outer])


def _dome_outline(dome: DomeStamp) -> Outline:
    return circle(dome.kernel("radius"))
