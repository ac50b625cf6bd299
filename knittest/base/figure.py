"""Basis of all pictures: a figure without display, colours, and how it reaches the disk with its stamp below."""

import io
from pathlib import Path
from typing import TYPE_CHECKING

from knittest.base.atomic import write_atomic
from knittest.base.stamp import with_stamp

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito (2008): told apart with any colour vision; lines differ in dash as well.
BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, RED, PINK = (
    "#000000",
    "#E69F00",
    "#56B4E9",
    "#009E73",
    "#C9B800",
    "#0072B2",
    "#D55E00",
    "#CC79A7",
)
GREY = "#6b7178"
DPI = 150


def new_figure(width: float, height: float) -> "Figure":
    """An empty figure of ``width`` x ``height`` [inch] that needs no display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def dress(axes: "Axes") -> None:
    """A light grid behind the data and no frame where there is no scale."""
    axes.grid(True, color="#e4e7ea", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top"]].set_visible(False)


def save(figure: "Figure", path: Path) -> None:
    """Write the figure with its stamp as PNG, whole or not at all; raise :class:`ResourceError`."""
    from matplotlib.image import imsave

    buffer = io.BytesIO()
    imsave(buffer, with_stamp(figure, DPI), format="png", dpi=DPI, metadata={"Software": "knittest"})
    write_atomic(path, buffer.getvalue())
