"""Basis of all pictures: figures without display, file formats, resolution, and the stamp below a picture."""

import io
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from knittest import __version__
from knittest.base.errors import InputError
from knittest.base.files import write_atomic

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox


T = TypeVar("T")
#: default, smallest and largest number of pixels per inch
DPI, LEAST, MOST = 150, 50, 1200
#: formats of pictures; PNG is always written, because pages show it
FORMATS = ("png", "svg", "pdf")


@dataclass(frozen=True)
class Printing:
    """Vector ``formats`` in addition to PNG, and pixels per inch of PNG and of fields in vector pictures."""

    formats: tuple[str, ...] = ()
    dpi: int = DPI

    @property
    def pixels(self) -> float:
        """Number of pixels over that at the default resolution."""
        return (self.dpi / DPI) ** 2


_PRINTING: ContextVar[Printing] = ContextVar("printing", default=Printing())  # noqa: B039 - it does not change


@contextmanager
def _override_context(variable: ContextVar[T], value: T) -> Iterator[None]:
    token = variable.set(value)
    try:
        yield
    finally:
        variable.reset(token)


def use_printing(printing: Printing) -> AbstractContextManager[None]:
    """Write all pictures inside the block by ``printing``."""
    return _override_context(_PRINTING, printing)


def current_printing() -> Printing:
    """Printing of the current block."""
    return _PRINTING.get()


def parse_printing(formats: str | None, dpi: int | None) -> Printing:
    """Read ``formats``, such as "svg,pdf", and ``dpi``; raises :class:`InputError` for bad ones."""
    asked = [one.strip().lower() for one in (formats or "").split(",") if one.strip()]
    if unknown := [one for one in asked if one not in FORMATS]:
        raise InputError(f"--format {formats}: unknown picture format {unknown[0]}; expected {','.join(FORMATS)}")
    if dpi is not None and not LEAST <= dpi <= MOST:
        raise InputError(f"--dpi {dpi}: expected {LEAST} to {MOST} pixels per inch")
    return Printing(tuple(dict.fromkeys(one for one in asked if one != "png")), DPI if dpi is None else dpi)


#: font size [points], mean width of a letter over it, height of a line over it, margins aside, above and below [inch]
LETTER, WIDE, LINE, MARGIN, ABOVE, BELOW = 7.5, 0.58, 1.45, 0.12, 0.09, 0.06
BETWEEN = " · "
FACTS, BAD = "#4a4f55", "#b3261e"


@dataclass(frozen=True)
class Stamp:
    """Lines below a picture: ``facts`` of the run and its ``verdict``, which may be ``bad``."""

    facts: Sequence[str] = ()
    verdict: str = ""
    bad: bool = False


_STAMP: ContextVar[Stamp] = ContextVar("stamp", default=Stamp())  # noqa: B039 - a stamp does not change


def use_stamp(stamp: Stamp) -> AbstractContextManager[None]:
    """Put ``stamp`` on all pictures that are written inside the block."""
    return _override_context(_STAMP, stamp)


def stamp_lines(stamp: Stamp, width: float) -> list[tuple[str, str]]:
    """Lines of text with colours for a picture ``width`` [inch] wide, with version and date."""
    letters = int((width - 2.0 * MARGIN) * 72.0 / (WIDE * LETTER))
    today = datetime.now(UTC).date().isoformat()
    facts = [_plain_line(fact) for fact in [*filter(None, stamp.facts), f"knittest {__version__}", today]]
    least = len(_wrap_facts(facts, letters))
    even = next(n for n in range(1, letters + 1) if len(_wrap_facts(facts, n)) <= least)  # no line with the date alone
    lines = [(line, FACTS) for line in _wrap_facts(facts, even)]
    return lines + [(line, BAD if stamp.bad else FACTS) for line in textwrap.wrap(_plain_line(stamp.verdict), letters)]


def _wrap_facts(facts: Sequence[str], letters: int) -> list[str]:
    """Wrap ``facts`` to lines of at most ``letters``, each fact on one line unless it is longer."""
    found = [""]
    for fact in facts:
        joined = BETWEEN.join(filter(None, (found[-1], fact)))
        found[-1:] = [joined] if len(joined) <= letters or not found[-1] else [found[-1], fact]
    return [part for line in found for part in textwrap.wrap(line, letters)]


def with_stamp(figure: "Figure", dpi: int) -> np.ndarray:
    """Pixels of ``figure``, (height, width, 4), with the current stamp in a strip below."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    above = _pixels(figure, dpi)
    width = above.shape[1] / dpi
    lines = stamp_lines(_STAMP.get(), width)
    step = LETTER * LINE / 72.0
    strip = Figure(figsize=(width, ABOVE + step * len(lines) + BELOW), dpi=dpi, facecolor="white")
    FigureCanvasAgg(strip)
    high = strip.get_size_inches()[1]
    for number, (line, colour) in enumerate(lines):
        top = 1.0 - (ABOVE + number * step) / high
        strip.text(MARGIN / width, top, line, fontsize=LETTER, color=colour, va="top")
    below = _pixels(strip, dpi)
    return np.concatenate([above, below[:, : above.shape[1]]])


@contextmanager
def draw_stamp_below(figure: "Figure") -> Iterator["Bbox"]:
    """Put the current stamp below ``figure`` while it is written; gives the page [inch] with both."""
    from matplotlib.transforms import Bbox

    width, high = figure.get_size_inches()
    lines = stamp_lines(_STAMP.get(), width)
    step = LETTER * LINE / 72.0
    texts = [
        figure.text(MARGIN / width, -(ABOVE + k * step) / high, line, fontsize=LETTER, color=colour, va="top")
        for k, (line, colour) in enumerate(lines)
    ]
    yield Bbox.from_extents(0.0, -(ABOVE + step * len(lines) + BELOW), width, high)
    for text in texts:
        text.remove()


def _pixels(figure: "Figure", dpi: int) -> np.ndarray:
    figure.set_dpi(dpi)
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())  # type: ignore[attr-defined]


def _plain_line(text: str) -> str:
    """Make one line without formulas: a dollar sign is printed."""
    return " ".join(text.split()).replace("$", r"\$")


# Okabe and Ito (2008): distinct with any colour vision; lines also differ in dash.
BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#C9B800"
BLUE = "#0072B2"
RED = "#D55E00"
PINK = "#CC79A7"
GREY = "#6b7178"
#: number of elements above which vector pictures have a field as pixels
MANY = 1500
#: letters as outlines in SVG, which has no fonts, and as text in PDF; the same bytes each time
_VECTOR: Any = {"svg.fonttype": "path", "svg.hashsalt": "knittest", "pdf.fonttype": 42}
_UNDATED: dict[str, dict[str, Any]] = {"svg": {"Date": None, "Creator": "knittest"}, "pdf": {"CreationDate": None}}


def new_figure(width: float, height: float) -> "Figure":
    """Empty figure of ``width`` x ``height`` [inch] that needs no display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def style_axes(axes: "Axes") -> None:
    """Draw a light grid behind the data, and no frame at the top."""
    axes.grid(True, color="#e4e7ea", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top"]].set_visible(False)


def save(figure: "Figure", path: Path) -> None:
    """Write the figure with its stamp as PNG and in the requested formats; raises :class:`ResourceError`."""
    write_atomic(path, png(figure))
    for form in current_printing().formats:
        write_atomic(path.with_suffix(f".{form}"), vector(figure, form))


def png(figure: "Figure") -> bytes:
    """PNG of the figure with its stamp."""
    from matplotlib.image import imsave

    buffer, dpi = io.BytesIO(), current_printing().dpi
    imsave(buffer, with_stamp(figure, dpi), format="png", dpi=dpi, metadata={"Software": "knittest"})
    return buffer.getvalue()


def vector(figure: "Figure", form: str) -> bytes:
    """File ``svg`` or ``pdf`` of the figure with its stamp; fields of many elements are pixels."""
    from matplotlib import rc_context
    from matplotlib.collections import Collection

    for one in figure.findobj(Collection):
        field: Any = one
        field.set_rasterized(max(len(field.get_paths()), len(field.get_offsets())) > MANY)
    buffer = io.BytesIO()
    with rc_context(_VECTOR), draw_stamp_below(figure) as page:
        figure.savefig(buffer, format=form, bbox_inches=page, dpi=current_printing().dpi, metadata=_UNDATED[form])
    return buffer.getvalue()
