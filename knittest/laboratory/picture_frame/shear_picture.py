"""shear-angle.png: by how much the material's shear angle differs from the frame's, and where."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from knittest.base.figure import BLUE, GREY, dress, new_figure, save
from knittest.base.history import Array
from knittest.export.shear_field import shear_field

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def shear_picture(
    path: Path, table: Mapping[str, Array], places: Array, difference: Array, *, title: str, where: str
) -> None:
    """Columns of shear-angle.csv, and the difference [deg] at ``places`` [mm]: polygons (n, k, 2) or points (n, 2).

    ``where`` says at which angle of the frame. Raises :class:`ResourceError`.
    """
    figure = new_figure(10.0, 5.6)
    axes = figure.add_axes((0.08, 0.12, 0.44, 0.76))
    dress(axes)
    _over_angle(axes, table)
    figure.text(0.08, 0.93, title, fontsize=12)
    plane = figure.add_axes((0.6, 0.12, 0.26, 0.76))
    plane.set_anchor("W")
    drawn = shear_field(plane, places, difference)
    plane.set_title(where, fontsize=10, loc="left")
    bar = figure.colorbar(drawn, cax=figure.add_axes((0.89, 0.2, 0.018, 0.6)))
    bar.set_label("material less frame [deg]")
    save(figure, path)


def _over_angle(axes: "Axes", table: Mapping[str, Array]) -> None:
    frame = table["frame_shear_angle_deg"]
    low, high = table["percentile_5_deg"] - frame, table["percentile_95_deg"] - frame
    axes.axhline(0.0, color=GREY, linestyle="--", linewidth=1.2)
    axes.fill_between(frame, low, high, color=BLUE, alpha=0.2, linewidth=0, label="5 to 95 % of the material")
    axes.plot(frame, table["mean_deg"] - frame, "o-", color=BLUE, markersize=4, linewidth=1.6, label="mean")
    axes.set(xlabel="shear angle of the frame [deg]", ylabel="shear angle, material less frame [deg]")
    axes.set_xlim(left=0.0)
    axes.legend(loc="best", frameon=False)
