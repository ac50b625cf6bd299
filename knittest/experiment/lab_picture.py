"""Picture of an import: its specimens, their mean and the band of the standard deviation."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.figure import BLUE, dress, new_figure, save
from knittest.experiment.statistics import Corridor

Array = NDArray[np.float64]


def plot(curves: Sequence[tuple[Array, Array]], band: Corridor, labels: tuple[str, str], path: Path) -> None:
    """Write the picture of ``curves`` (x, y) and their ``band``; ``labels`` name x and y with units."""
    figure = new_figure(7.0, 5.0)
    axes = figure.add_axes((0.12, 0.13, 0.84, 0.8))
    dress(axes)
    for x, y in curves:
        axes.plot(x, y, color="0.6", linewidth=0.8)
    if band.n > 1:
        low, high = band.mean - band.sd, band.mean + band.sd
        axes.fill_between(band.strain, low, high, color=BLUE, alpha=0.25, label="mean ± sd")
    label = f"mean of {band.n}" if band.n > 1 else "one specimen"
    axes.plot(band.strain, band.mean, color=BLUE, linewidth=2.0, label=label)
    axes.set(xlabel=labels[0], ylabel=labels[1])
    axes.legend(frameon=False)
    save(figure, path)
