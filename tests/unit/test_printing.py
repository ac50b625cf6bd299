"""Pictures for print: formats and pixels that were asked for, with the stamp below, and fields on one scale."""

import re

import numpy as np
import pytest
from matplotlib.image import imread
from report_sample import write_run

from knittest.base.errors import InputError
from knittest.base.figure import (
    MANY,
    Printing,
    Stamp,
    new_figure,
    parse_printing,
    save,
    use_printing,
    use_stamp,
    vector,
)
from knittest.cli.main import run
from knittest.export.field_pictures import PlanField, fields_figure, interpolate_on_grid, symmetric_colours
from knittest.report_page.page import write_reports


def _figure(points: int = 10):
    figure = new_figure(4.0, 2.0)
    x = np.linspace(0.0, 1.0, points)
    figure.add_subplot().scatter(x, x, c=x)
    return figure


def test_formats_and_pixels_that_were_asked_for(tmp_path):
    with use_printing(Printing(("svg", "pdf"), 300)):
        save(_figure(), tmp_path / "a.png")
    assert sorted(p.suffix for p in tmp_path.iterdir()) == [".pdf", ".png", ".svg"]
    assert imread(tmp_path / "a.png").shape[1] == 4 * 300
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")
    save(_figure(), tmp_path / "b.png")  # only PNG unless more is asked for
    assert [p.name for p in tmp_path.glob("b.*")] == ["b.png"] and imread(tmp_path / "b.png").shape[1] == 4 * 150


def test_a_vector_picture_has_its_stamp_below_and_the_same_bytes_each_time():
    figure = _figure()
    with use_stamp(Stamp(("one fact",), "refused", bad=True)):
        first = vector(figure, "svg")
        assert vector(figure, "svg") == first
    wide, high = (float(v) for v in re.search(rb'width="([\d.]+)pt" height="([\d.]+)pt"', first).groups())
    assert wide == pytest.approx(4 * 72) and high > 2 * 72 + 15 and b"#b3261e" in first
    assert not figure.texts


@pytest.mark.parametrize(("points", "pixels"), [(20, False), (MANY + 1, True)])
def test_fields_of_many_elements_are_pixels_in_a_vector_picture(points, pixels):
    assert (b"<image" in vector(_figure(points), "svg")) is pixels


def test_what_no_picture_can_be_is_refused(capsys):
    for formats, dpi, words in (
        ("svg,tiff", None, "unknown picture format tiff; expected png,svg,pdf"),
        (None, 10, "--dpi 10: expected 50 to 1200"),
    ):
        with pytest.raises(InputError, match=re.escape(words)):
            parse_printing(formats, dpi)
    assert parse_printing(" SVG, png,svg", 200) == Printing(("svg",), 200)
    assert run(["tensile", "--variant", "1", "--no-pictures", "--format", "svg"]) == 2
    assert "leave out --no-pictures" in capsys.readouterr().err


def _plan(shift, more, n=21):
    x, y = np.meshgrid(np.linspace(-10, 10, n) + shift, np.linspace(-8, 8, n))
    return PlanField("one", np.column_stack([x.ravel(), y.ravel()]), (x + 2 * y).ravel() + more)


def test_a_difference_is_taken_at_places_and_only_where_both_are_known():
    """Two linear fields on shifted places: 3 apart everywhere, and nothing beyond either."""
    x, y = np.linspace(-14, 14, 57), np.linspace(-9, 9, 37)
    less = interpolate_on_grid(_plan(2.0, 3.0), x, y) - interpolate_on_grid(_plan(0.0, 0.0), x, y)
    known = np.isfinite(less)
    assert np.allclose(less[known], 3.0) and known.any()
    columns = x[known.any(axis=0)]
    assert columns.min() == -8.0 and columns.max() == 10.0


def test_places_in_a_gap_are_not_known():
    field = _plan(0.0, 0.0)
    hole = np.abs(field.place).max(axis=1) > 4.0
    found = interpolate_on_grid(
        PlanField("hole", field.place[hole], field.value[hole]), np.array([0.0, 8.0]), np.array([0.0])
    )
    assert np.isnan(found[0, 0]) and found[0, 1] == pytest.approx(8.0)


def test_a_signed_scale_is_about_zero_and_says_which_end_is_cut():
    values = np.concatenate([np.full(50, -1.0), np.linspace(-1.0, 1.0, 900), np.full(49, 1.0), [50.0]])
    norm, cut = symmetric_colours(values)
    assert norm.vmin == -norm.vmax and norm.vmax < 1.5 and cut == "max"
    assert symmetric_colours(-values)[1] == "min" and symmetric_colours(np.array([1.0, np.nan]))[1] == "neither"
    assert symmetric_colours(np.concatenate([values, -values]))[1] == "both"


def test_fields_of_several_runs_share_one_scale():
    figure = fields_figure([_plan(0.0, 0.0), _plan(0.5, 5.0), _plan(0.0, -3.0)], title="t", label="l")
    scatters = [
        c for a in figure.axes for c in a.collections if c.get_array() is not None and len(c.get_offsets()) > 100
    ]
    assert len(scatters) == 3 and len({(c.norm.vmin, c.norm.vmax) for c in scatters}) == 1
    images = [i for a in figure.axes for i in a.images]
    assert len(images) == 2 and len({(i.norm.vmin, i.norm.vmax) for i in images}) == 1
    assert scatters[0].norm.vmax != images[0].norm.vmax
    assert all(c.cmap.name == "RdBu_r" for c in [*scatters, *images])


def forming_runs(folder, head="x_mm,y_mm,shear_angle_deg"):
    """Two runs with fields of the shear angle, the second 1 deg larger."""
    runs = [write_run(folder / name, "forming") for name in ("a", "b")]
    for k, one in enumerate(runs):
        rows = "\n".join(f"{x},{y},{x + k}" for x in range(12) for y in range(12))
        (one / "shear-field.csv").write_text(f"{head}\n{rows}\n")
    return runs


def test_a_page_on_runs_leaves_its_curves_and_fields_beside_it(tmp_path):
    page, _ = write_reports(forming_runs(tmp_path), tmp_path / "page.html", Printing(("svg",)))
    left = sorted(p.name for p in tmp_path.glob("page*"))
    pictures = [f"page-forming-{what}.{form}" for what in ("curve", "shear-field") for form in ("png", "svg")]
    assert left == sorted([*pictures, "page.html"])
    assert "one colour scale" in page.read_text()


def test_a_damaged_field_and_a_failed_picture_cost_the_page_nothing_else(tmp_path, monkeypatch):
    page, _ = write_reports(forming_runs(tmp_path, "x_mm,y_mm,angle"), tmp_path / "page.html")
    assert "expected the columns x_mm, y_mm, shear_angle_deg" in page.read_text()

    def fails(png: bytes) -> str:
        raise OSError("encoder error")

    monkeypatch.setattr("knittest.report_page.pictures.compress_picture", fails)
    (tmp_path / "more").mkdir()
    page, _ = write_reports(forming_runs(tmp_path / "more"), tmp_path / "page.html")
    assert "cannot be drawn (encoder error)" in page.read_text()
