"""Zones of a strip on the bias, by the yarns that a clamp holds, the shear angles in them, and zones.png."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.figure import BLACK, BLUE, GREEN, GREY, ORANGE, new_figure, save, style_axes
from knittest.base.history import Array, Frame, History
from knittest.export.field_pictures import draw_shear_field
from knittest.laboratory.bias_extension.config import BiasExtensionRun
from knittest.laboratory.bias_extension.strip import BiasStrip, cut_bias_yarns, strip_of
from knittest.laboratory.shear_law_end import shell_areas
from knittest.laboratory.strips import angle_scatter, has_all_crossings, shell_angles
from knittest.materials.trellis import ANGLE


@dataclass(frozen=True)
class MaterialPoints:
    """Points or shells of the strip: ``places`` (n, 2) [mm] at the start and ``weights`` (n,).

    Of a frame: shear ``angles`` [rad], (n,), positive where the pull shears; polygons (n, 4, 2) or points (n, 2) [mm]
    that are ``drawn``; ``slip`` [mm] of crossing inlays, (n,).
    """

    places: Array
    weights: Array
    angles: Callable[[Frame], Array]
    drawn: Callable[[Frame], Array]
    slip: Callable[[Frame], Array] | None = None


def material_points(run: BiasExtensionRun, history: History) -> MaterialPoints:
    """Material of the first specimen of ``run``."""
    start, cells = history.frames[0], history.mesh.cells
    if history.mesh.kind == "shells":
        corners = start.position[cells]
        drawn = lambda frame: frame.position[cells][:, :, :2]  # noqa: E731
        return MaterialPoints(corners.mean(axis=1)[:, :2], shell_areas(corners), shell_angles, drawn)
    found = cut_bias_yarns(run, strip_of(run)).crossings(run)
    places = found.places(start)
    slip = partial(found.slip, start) if has_all_crossings(run.fabric) else None
    return MaterialPoints(places, np.ones(len(places)), found.angles, found.places, slip)


#: zones by the number of yarns of a crossing that a clamp holds
MIDDLE, HALF, RIGID = 0, 1, 2
#: share of the middle, about its centre, in which the angle is read, and of the crossings that slip less [%]
READ, SLIPPED = 0.5, 95.0


def zones(points: Array, strip: BiasStrip) -> NDArray[np.int64]:
    """Number of yarns (0, 1, 2) through each of ``points`` (n, 2) [mm] that a clamp of ``strip`` holds, (n,)."""
    x, y = points[:, 0], points[:, 1]
    held = np.zeros(len(points), np.int64)
    for lean in (1.0, -1.0):
        ends = [x + lean * (clamp - y) for clamp in (0.5 * strip.length, -0.5 * strip.length)]
        held += np.any([np.abs(end) <= 0.5 * strip.width for end in ends], axis=0)
    return held


def is_inner_middle(points: Array, strip: BiasStrip) -> NDArray[np.bool_]:
    """Tell which of ``points`` (n, 2) [mm] lie in the inner half of the middle."""
    outer = points[:, :2] / READ
    in_strip = (np.abs(outer) <= [0.5 * strip.width, 0.5 * strip.length]).all(axis=1)
    return np.asarray(in_strip & (zones(outer, strip) == MIDDLE))


def zone_table(history: History, strip: BiasStrip, material: MaterialPoints) -> dict[str, Array]:
    """Columns of zones.csv [deg], slip [mm]: pin-jointed yarns, the middle's inner half, the zones at the clamps."""
    zone, read = zones(material.places, strip), is_inner_middle(material.places, strip)
    rows: list[dict[str, float]] = []
    for frame in history.frames:
        if rows and frame.coordinate <= rows[-1][ANGLE]:
            continue
        angle = material.angles(frame)
        middle = angle_scatter(angle[read])
        row = {
            ANGLE: frame.coordinate, "middle_mean_deg": middle.mean, "middle_sd_deg": middle.sd,
            "middle_percentile_5_deg": middle.low, "middle_percentile_95_deg": middle.high,
            "half_mean_deg": _mean_angle(angle, material.weights, zone == HALF),
            "rigid_mean_deg": _mean_angle(angle, material.weights, zone == RIGID),
        }  # fmt: skip
        if material.slip is not None:
            row["slip_percentile_95_mm"] = float(np.percentile(material.slip(frame), SLIPPED))
        rows.append(row)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _mean_angle(angle: Array, weights: Array, of: NDArray[np.bool_]) -> float:
    """Mean [deg] of ``angle`` [rad] ``of`` some points; nan of none, as in the corners of narrow strips."""
    return float(np.rad2deg(np.average(angle[of], weights=weights[of]))) if of.any() else np.nan


#: lengths of the picture [inch]: curves across, both parts high, the least width of the map, and what lies around
CURVES, HIGH, NARROW = 4.4, 4.5, 1.7
LEFT, BETWEEN, RIGHT, TOP, BOTTOM = 0.8, 0.95, 1.05, 0.7, 0.65


def zone_picture(
    path: Path, table: Mapping[str, Array], places: Array, angle: Array, *, title: str, where: str
) -> None:
    """Draw zones.csv, and ``angle`` [deg] at ``places`` [mm] of the frame ``where``. Raises :class:`ResourceError`."""
    width, height = np.ptp(places.reshape(-1, 2), axis=0)
    across = max(HIGH * float(width / height), NARROW)
    wide, tall = LEFT + CURVES + BETWEEN + across + RIGHT, BOTTOM + HIGH + TOP
    figure = new_figure(wide, tall)
    axes = figure.add_axes((LEFT / wide, BOTTOM / tall, CURVES / wide, HIGH / tall))
    style_axes(axes)
    theory = table["shear_angle_deg"]
    for name, label, colour, share in (
        ("middle_mean_deg", "middle, its inner half", BLUE, 1.0),
        ("half_mean_deg", "one yarn held by a clamp", ORANGE, 0.5),
        ("rigid_mean_deg", "both yarns held", GREEN, 0.0),
    ):
        axes.plot(theory, table[name], "o-", color=colour, markersize=4, linewidth=1.6, label=label)
        label = "pin-jointed" if share == 0.0 else ""
        axes.plot(theory, share * theory, "--", color=GREY, linewidth=1.2, label=label or None)
        if share == 1.0:
            axes.fill_between(
                theory, table["middle_percentile_5_deg"], table["middle_percentile_95_deg"], color=BLUE, alpha=0.2,
                linewidth=0, label="5 to 95 % of it",
            )  # fmt: skip
    axes.set(xlabel="shear angle of the middle, pin-jointed [deg]", ylabel="shear angle of the material [deg]")
    axes.set_xlim(left=0.0)
    axes.legend(loc="best", frameon=False)
    figure.text(LEFT / wide, 1.0 - 0.3 / tall, title, fontsize=12, color=BLACK)
    plane = figure.add_axes(((LEFT + CURVES + BETWEEN) / wide, BOTTOM / tall, across / wide, HIGH / tall))
    drawn = draw_shear_field(plane, places, angle)
    plane.set_title(where, fontsize=10, loc="left")
    place = ((wide - RIGHT + 0.2) / wide, (BOTTOM + 0.1 * HIGH) / tall, 0.18 / wide, 0.8 * HIGH / tall)
    figure.colorbar(drawn, cax=figure.add_axes(place)).set_label("shear angle [deg]")
    save(figure, path)
