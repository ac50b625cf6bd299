"""zones.png: shear angle of a strip on the bias, over that of pin-jointed yarns and where it is."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from knittest.base.figure import BLACK, BLUE, GREEN, GREY, ORANGE, dress, new_figure, save
from knittest.base.history import Array
from knittest.export.shear_field import shear_field

#: lengths of the picture [inch]: curves across, both parts high, the least width of the map, and what lies around
CURVES, HIGH, NARROW = 4.4, 4.5, 1.7
LEFT, BETWEEN, RIGHT, TOP, BOTTOM = 0.8, 0.95, 1.05, 0.7, 0.65


def zone_picture(
    path: Path, table: Mapping[str, Array], places: Array, angle: Array, *, title: str, where: str
) -> None:
    """Columns of zones.csv, and the shear ``angle`` [deg] at ``places`` [mm]: polygons (n, k, 2) or points (n, 2).

    ``where`` says at which angle. Raises :class:`ResourceError`.
    """
    across = max(HIGH * _slimness(places), NARROW)
    wide = LEFT + CURVES + BETWEEN + across + RIGHT
    figure = new_figure(wide, BOTTOM + HIGH + TOP)
    tall = BOTTOM + HIGH + TOP
    axes = figure.add_axes((LEFT / wide, BOTTOM / tall, CURVES / wide, HIGH / tall))
    dress(axes)
    theory = table["shear_angle_deg"]
    for name, label, colour, share in (
        ("middle_mean_deg", "middle, its inner half", BLUE, 1.0),
        ("half_mean_deg", "one yarn held by a clamp", ORANGE, 0.5),
        ("rigid_mean_deg", "both yarns held", GREEN, 0.0),
    ):
        axes.plot(theory, table[name], "o-", color=colour, markersize=4, linewidth=1.6, label=label)
        axes.plot(
            theory, share * theory, "--", color=GREY, linewidth=1.2, label="pin-jointed" if share == 0.0 else None
        )
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
    drawn = shear_field(plane, places, angle)
    plane.set_title(where, fontsize=10, loc="left")
    place = ((wide - RIGHT + 0.2) / wide, (BOTTOM + 0.1 * HIGH) / tall, 0.18 / wide, 0.8 * HIGH / tall)
    bar = figure.colorbar(drawn, cax=figure.add_axes(place))
    bar.set_label("shear angle [deg]")
    save(figure, path)


def _slimness(places: Array) -> float:
    """Width over height of what ``places`` take up."""
    across, along = np.ptp(places.reshape(-1, 2), axis=0)
    return float(across / along)
