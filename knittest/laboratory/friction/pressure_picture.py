"""pressure.png: contact pressure of both plates on the fabric, one scale."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from knittest.base.figure import GREY, new_figure, save
from knittest.base.history import Array

#: lengths of the picture [inch]: a map across, what lies left and right of it, above and below both, above each
WIDE, LEFT, RIGHT, TOP, BOTTOM, HEAD = 7.8, 0.8, 1.4, 0.65, 1.0, 0.55
#: least height of the scale [inch]
SCALE = 1.6
#: share of the loaded cells that the colours span; the few above have the last colour
SPANNED = 99.0


def pressure_picture(
    path: Path, x: Array, y: Array, pressure: Mapping[str, Array], *, along: str, title: str, note: str
) -> None:
    """Maps of ``pressure`` [MPa] by face, (n_x, n_y) each, between the edges ``x`` and ``y`` [mm].

    The strip lies across the page: ``along`` is the axis of the pull, ``x`` or ``y``. Raises :class:`ResourceError`.
    """
    long, across = (x, y) if along == "x" else (y, x)
    high = WIDE * float(np.ptp(across) / np.ptp(long))
    both = max(len(pressure) * (high + HEAD), SCALE)
    wide, tall = LEFT + WIDE + RIGHT, TOP + both + BOTTOM
    figure = new_figure(wide, tall)
    loaded = np.concatenate([p[p > 0.0] for p in pressure.values()])
    most = float(np.percentile(loaded, SPANNED)) if len(loaded) else 1.0
    for number, (face, values) in enumerate(pressure.items()):
        down = TOP + number * (high + HEAD) + HEAD - 0.25 + high
        axes = figure.add_axes((LEFT / wide, 1.0 - down / tall, WIDE / wide, high / tall))
        shown = values.T if along == "x" else values
        drawn = axes.pcolormesh(
            long - long[0], across - across[0], np.where(shown > 0.0, shown, np.nan), cmap="viridis", vmin=0.0,
            vmax=most, rasterized=True,
        )  # fmt: skip
        axes.set_aspect("equal")
        axes.set_facecolor("#f3f4f5")
        axes.set_title(f"technical {face}, largest {values.max():.2f} MPa", loc="left", fontsize=10)
        axes.set_ylabel("across [mm]", fontsize=9)
        axes.tick_params(labelbottom=number == len(pressure) - 1)
    axes.set_xlabel("along the pull, clamp to the right [mm]")
    bar = figure.colorbar(
        drawn,
        cax=figure.add_axes(((LEFT + WIDE + 0.25) / wide, BOTTOM / tall, 0.18 / wide, (both - 0.3) / tall)),
        extend="max" if loaded.max(initial=0.0) > (1.0 + 1e-6) * most else "neither",
    )
    bar.set_label("mean contact\npressure [MPa]")
    figure.text(LEFT / wide, 1.0 - 0.35 / tall, title, fontsize=12)
    figure.text(LEFT / wide, 0.15 / tall, note, fontsize=9, color=GREY)
    save(figure, path)
