"""Sections in the picture of a cell: where each layer lies."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.ndimage import label

from knittest.config.loading import resolve
from knittest.export import yarn_pictures
from knittest.fabric.relaxation import relaxed_cell


def test_sections_cut_the_inlays_across(tmp_path, monkeypatch):
    """Four wales and four courses of variant 1: the cut inlays are as many separate circles, the warp at the back."""
    figures: list[Figure] = []
    monkeypatch.setattr(yarn_pictures, "save", lambda figure, path: figures.append(figure))
    yarn_pictures.cell_picture(tmp_path / "cell.png", relaxed_cell(resolve(variant="1").fabric), "V1")
    axes = {one.get_title(): one.images[0] for one in figures[0].axes}
    assert [name.partition(",")[0] for name in axes] == [
        "face", "back", "oblique", "section across the wales", "section across the courses",
    ]  # fmt: skip
    wales, courses = (axes[f"section across the {one}, face up"] for one in ("wales", "courses"))
    assert wales.get_extent()[1] - wales.get_extent()[0] == pytest.approx(4 * 100 / 28)
    for image, colour in ((wales, yarn_pictures._LAYER_COLOURS["warp"][0]), (courses, (0.30, 0.46, 0.78))):
        rgba = np.asarray(image.get_array())
        share = rgba[..., :3] / np.maximum(rgba[..., :3].sum(axis=2, keepdims=True), 1e-9)
        inlay = (rgba[..., 3] > 0) & (np.abs(share - np.array(colour) / sum(colour)).max(axis=2) < 0.02)
        assert label(inlay)[1] == 4
