"""Axes, colours and labels that the pictures of studies share."""

from typing import TYPE_CHECKING, Any

import numpy as np

from knittest.base.figure import BLUE, GREEN, GREY, ORANGE, PINK, RED, SKY, style_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

COLOURS = (BLUE, ORANGE, GREEN, PINK, SKY, GREY)
DASHED: Any = (0, (4, 2))


def dress_panel(axes: "Axes") -> "Axes":
    """Dress ``axes`` without a frame on the right; returns them."""
    style_axes(axes)
    axes.spines["right"].set_visible(False)
    return axes


def log_scale(axis: "Axis", subs: tuple[float, ...] = (1.0, 2.0, 5.0)) -> None:
    """Give ``axis`` a logarithmic scale with plain numbers at ``subs`` of each decade."""
    from matplotlib.ticker import LogLocator, NullLocator

    axes: Any = axis.axes
    (axes.set_xscale if axis is axes.xaxis else axes.set_yscale)("log")
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_locator(NullLocator())


def unit_label(unit: str) -> str:
    """``unit`` in brackets, to be written behind the name of an axis; a dash for a plain number."""
    return f" [{'-' if unit == '1' else unit}]" if unit else ""


def mark_lost_runs(axes: "Axes", places: np.ndarray, **look: Any) -> None:
    """Draw a cross at the bottom of ``axes`` for every run without a result."""
    if len(places):
        usual: dict[str, Any] = {"color": RED, "markersize": 6, "transform": axes.get_xaxis_transform()}
        axes.plot(places, np.full(len(places), 0.04), "x", **(usual | look))
