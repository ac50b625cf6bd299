"""The legend of a picture of curves lies below its axis, however many rows it has."""

import numpy as np
import pytest

from knittest.export import line_picture as drawn
from knittest.export.line_picture import Band, Level, Line, line_picture


@pytest.mark.parametrize("levels", [0, 2, 5])
def test_the_legend_does_not_reach_the_label_of_the_axis(tmp_path, monkeypatch, levels):
    figures = []
    monkeypatch.setattr(drawn, "save", lambda figure, path: figures.append(figure))
    x = np.linspace(0.0, 1.0, 5)
    long = "a name that is much too long for half of the width of a picture"
    line_picture(
        tmp_path / "p.png", [Line(x, x, long), Line(x, x, "b")], title="t", xlabel="travel", ylabel="y",
        levels=[Level(0.1 * k, f"level {k}") for k in range(levels)], bands=[Band(x, x, x, "± sd")],
    )  # fmt: skip
    (figure,) = figures
    figure.draw_without_rendering()
    legend, (axes,) = figure.legends[0].get_window_extent(), figure.axes
    assert legend.y1 <= axes.xaxis.label.get_window_extent().y0
    assert legend.y0 >= 0.0
