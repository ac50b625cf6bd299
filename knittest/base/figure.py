"""Basis of all pictures: a figure without display, colours, and how it reaches the disk with its stamp below."""

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knittest.base.atomic import write_atomic
from knittest.base.printing import DPI, present
from knittest.base.stamp import below, with_stamp

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito (2008): told apart with any colour vision; lines differ in dash as well.
BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#C9B800"
BLUE = "#0072B2"
RED = "#D55E00"
PINK = "#CC79A7"
GREY = "#6b7178"
#: elements of a field above which vector pictures hold it as pixels
MANY = 1500
#: letters as outlines where a reader may lack the font, as text where the file carries it; the same bytes each time
_VECTOR: Any = {"svg.fonttype": "path", "svg.hashsalt": "knittest", "pdf.fonttype": 42}
_UNDATED: dict[str, dict[str, Any]] = {"svg": {"Date": None, "Creator": "knittest"}, "pdf": {"CreationDate": None}}


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
    """Write the figure with its stamp as PNG, and beside it in the formats asked for (:mod:`knittest.base.printing`).

    Each file is whole or not there; raises :class:`ResourceError`.
    """
    write_atomic(path, png(figure))
    for form in present().formats:
        write_atomic(path.with_suffix(f".{form}"), vector(figure, form))


def png(figure: "Figure") -> bytes:
    """The figure with its stamp as PNG."""
    from matplotlib.image import imsave

    buffer, dpi = io.BytesIO(), present().dpi
    imsave(buffer, with_stamp(figure, dpi), format="png", dpi=dpi, metadata={"Software": "knittest"})
    return buffer.getvalue()


def vector(figure: "Figure", form: str) -> bytes:
    """The figure with its stamp as ``svg`` or ``pdf``; fields of many elements are pixels in it."""
    from matplotlib import rc_context
    from matplotlib.collections import Collection

    for one in figure.findobj(Collection):
        field: Any = one
        field.set_rasterized(max(len(field.get_paths()), len(field.get_offsets())) > MANY)
    buffer = io.BytesIO()
    with rc_context(_VECTOR), below(figure) as page:
        figure.savefig(buffer, format=form, bbox_inches=page, dpi=present().dpi, metadata=_UNDATED[form])
    return buffer.getvalue()
