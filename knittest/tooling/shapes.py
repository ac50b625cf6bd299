"""Outlines of the tools from their dimensions, centred on the blank."""

from knittest.config.tools import DomeStamp, Stamp, TStamp
from knittest.tooling.outline import Outline, circle, rounded_polygon


def stamp_outline(stamp: Stamp) -> Outline:
    """Sharp outline of the bottom of a stamp by dimensions; the box round it is centred on the origin."""
    return _t_outline(stamp.t) if stamp.kind == "t" else _dome_outline(stamp.hemisphere)


def stamp_edge(stamp: Stamp) -> float:
    """Radius of the edge round the stamp's bottom [mm]: a hemisphere is all edge."""
    return stamp.t.edge_radius_mm if stamp.kind == "t" else stamp.hemisphere.radius_mm


def _t_outline(t: TStamp) -> Outline:
    bar, stem = 0.5 * t.bar_length_mm, 0.5 * t.stem_width_mm
    top = 0.5 * (t.bar_width_mm + t.stem_length_mm)
    side = top - t.bar_width_mm
    corners = [
        (stem, -top), (stem, side), (bar, side), (bar, top), (-bar, top), (-bar, side), (-stem, side), (-stem, -top),
    ]  # fmt: skip
    outer, inner = t.outer_corner_radius_mm, t.inner_corner_radius_mm
    return rounded_polygon(corners, [outer, inner, outer, outer, outer, outer, inner, outer])


def _dome_outline(dome: DomeStamp) -> Outline:
    return circle(dome.radius_mm)
