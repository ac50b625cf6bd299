"""pressure.png: contact pressure of both plates on the fabric, one scale."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from knittest.base.figure import GREY, new_figure, save
from knittest.base.history import Array

#: share of the loaded cells that the colours span; the few above have the last colour
SPANNED = 99.0


def pressure_picture(
    path: Path, x: Array, y: Array, pressure: Mapping[str, Array], *, along: str, title: str, note: str
) -> None:
    """Maps of ``pressure`` [MPa] by face, (n_x, n_y) each, between the edges ``x`` and ``y`` [mm].

    The strip lies across the page: ``along`` is the axis of the pull, ``x`` or ``y``. Raises :class:`ResourceError`.
    """
    figure = new_figure(10.0, 6.2)
    long, across = (x, y) if along == "x" else (y, x)
    loaded = np.concatenate([p[p > 0.0] for p in pressure.values()])
    most = float(np.percentile(loaded, SPANNED)) if len(loaded) else 1.0
    for number, (face, values) in enumerate(pressure.items()):
        axes = figure.add_axes((0.08, 0.53 - 0.4 * number, 0.78, 0.33))
        shown = values.T if along == "x" else values
        drawn = axes.pcolormesh(
            long - long[0], across - across[0], np.where(shown > 0.0, shown, np.nan), cmap="viridis", vmin=0.0,
            vmax=most, rasterized=True,
        )  # fmt: skip
        axes.set_aspect("equal")
        axes.set_facecolor("#f3f4f5")
        axes.set_title(f"technical {face}, largest {values.max():.2f} MPa", loc="left", fontsize=10)
        axes.set_ylabel("across [mm]")
    axes.set_xlabel("along the pull, clamp to the right [mm]")
    bar = figure.colorbar(
        drawn,
        cax=figure.add_axes((0.885, 0.2, 0.018, 0.6)),
        extend="max" if loaded.max(initial=0.0) > (1.0 + 1e-6) * most else "neither",
    )
    bar.set_label("mean contact pressure [MPa]")
    figure.text(0.08, 0.94, title, fontsize=12)
    figure.text(0.08, 0.02, note, fontsize=9, color=GREY)
    save(figure, path)
