"""zones.png: shear angle of a strip on the bias, over that of pin-jointed yarns and where it is."""

from collections.abc import Mapping
from pathlib import Path

from knittest.base.figure import BLACK, BLUE, GREEN, GREY, ORANGE, dress, new_figure, save
from knittest.base.history import Array
from knittest.export.shear_field import shear_field


def zone_picture(
    path: Path, table: Mapping[str, Array], places: Array, angle: Array, *, title: str, where: str
) -> None:
    """Columns of zones.csv, and the shear ``angle`` [deg] at ``places`` [mm]: polygons (n, k, 2) or points (n, 2).

    ``where`` says at which angle. Raises :class:`ResourceError`.
    """
    figure = new_figure(10.0, 5.6)
    axes = figure.add_axes((0.08, 0.12, 0.44, 0.76))
    dress(axes)
    theory = table["shear_angle_deg"]
    axes.fill_between(
        theory, table["middle_percentile_5_deg"], table["middle_percentile_95_deg"], color=BLUE, alpha=0.2, linewidth=0,
        label="5 to 95 % of it",
    )  # fmt: skip
    for name, label, colour, share in (
        ("middle_mean_deg", "middle, its inner half", BLUE, 1.0),
        ("half_mean_deg", "one yarn held by a clamp", ORANGE, 0.5),
        ("rigid_mean_deg", "both yarns held", GREEN, 0.0),
    ):
        axes.plot(theory, table[name], "o-", color=colour, markersize=4, linewidth=1.6, label=label)
        axes.plot(
            theory, share * theory, "--", color=GREY, linewidth=1.2, label="pin-jointed" if share == 1.0 else None
        )
    axes.set(xlabel="shear angle of the middle, pin-jointed [deg]", ylabel="shear angle of the material [deg]")
    axes.set_xlim(left=0.0)
    axes.legend(loc="best", frameon=False)
    figure.text(0.08, 0.93, title, fontsize=12, color=BLACK)
    plane = figure.add_axes((0.62, 0.12, 0.24, 0.76))
    plane.set_anchor("W")
    drawn = shear_field(plane, places, angle)
    plane.set_title(where, fontsize=10, loc="left")
    bar = figure.colorbar(drawn, cax=figure.add_axes((0.89, 0.2, 0.018, 0.6)))
    bar.set_label("shear angle [deg]")
    save(figure, path)
