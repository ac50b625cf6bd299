"""shear-angle.png: by how much the material's shear angle differs from the frame's, and where."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from knittest.base.figure import BLUE, GREY, dress, new_figure, save
from knittest.base.history import Array
from knittest.export.fields_picture import SIGNED, symmetric
from knittest.export.shear_field import shear_field
from knittest.laboratory.picture_frame.frame_drawing import FrameShape, draw_frame

if TYPE_CHECKING:
    from matplotlib.axes import Axes


#: lengths of the picture [inch]: curves and plane, what lies between and around them
TALL, CURVE, LEFT, GAP, RIGHT, AROUND = 4.3, 4.4, 0.8, 0.85, 1.1, 1.2
#: share of the material within the colours [%]
SPANNED = 99.5


def shear_picture(
    path: Path, table: Mapping[str, Array], places: Array, difference: Array, *, title: str, shape: FrameShape
) -> None:
    """Columns of shear-angle.csv, and the difference [deg] at ``places`` [mm]: polygons (n, k, 2) or points (n, 2).

    ``shape`` is the frame's then. Raises :class:`ResourceError`.
    """
    x, y = shape.reach
    wide = TALL * x / y
    figure = new_figure(LEFT + CURVE + GAP + wide + RIGHT, TALL + AROUND)
    width, height = figure.get_size_inches()
    axes = figure.add_axes((LEFT / width, 0.65 / height, CURVE / width, TALL / height))
    dress(axes)
    _over_angle(axes, table)
    figure.text(LEFT / width, 1.0 - 0.3 / height, title, fontsize=12)
    plane = figure.add_axes(((LEFT + CURVE + GAP) / width, 0.65 / height, wide / width, TALL / height))
    norm, cut = symmetric(difference, SPANNED)
    drawn = shear_field(plane, places, difference, SIGNED, norm)
    draw_frame(plane, shape)
    plane.set_title(f"frame at {shape.angle:.1f} deg", fontsize=10, loc="left")
    cax = figure.add_axes(
        (1.0 - (RIGHT - 0.2) / width, (0.65 + 0.1 * TALL) / height, 0.16 / width, 0.8 * TALL / height)
    )
    figure.colorbar(drawn, cax=cax, extend=cut).set_label("shear angle, material less frame [deg]")
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
