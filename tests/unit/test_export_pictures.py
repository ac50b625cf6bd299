"""Pictures: the renderer against geometry, and what the figures say. Meshes for Abaqus as meshio reads them back."""

from pathlib import Path

import meshio
import numpy as np
import pytest
from export_sample import beam_history, curve, shell_history

from knittest.base.history import checked_rows
from knittest.export import line_picture, yarn_pictures
from knittest.export import line_picture as curves
from knittest.export.line_picture import Band, Level, Line
from knittest.export.meshes import write_abaqus
from knittest.export.shading import View, render_tubes

VIEW = View(-2.0, 2.0, -1.0, 1.0, 0.01)
RED, BLUE = [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]


def tubes(start, end, radius, colour) -> np.ndarray:
    return render_tubes(np.array(start, float), np.array(end, float), np.array(radius), np.array(colour), VIEW)


def test_a_tube_covers_the_area_of_a_capsule():
    image = tubes([[-1, 0, 0]], [[1, 0.2, 0.5]], [0.3], [RED])
    length = np.hypot(2, 0.2)
    assert image[..., 3].sum() * 0.01**2 == pytest.approx(2 * 0.3 * length + np.pi * 0.3**2, rel=0.01)


def test_the_upper_yarn_hides_the_lower_whatever_the_order():
    start, end = [[-1, 0, 0.5], [0, -1, 0]], [[1, 0, 0.5], [0, 1, 0]]
    for order in (slice(None), slice(None, None, -1)):
        image = tubes(start[order], end[order], [0.2, 0.2], [RED, BLUE][order])
        centre, below = image[100, 200], image[30, 200]
        assert centre[0] > 0.5 and centre[2] == 0 and below[2] > 0.5 and below[0] == 0


def test_crossing_tubes_interpenetrate_by_height():
    image = tubes([[-1, 0, -0.5], [-1, 0, 0.5]], [[1, 0, 0.5], [1, 0, -0.5]], [0.2, 0.2], [RED, BLUE])
    assert image[100, 120, 2] > image[100, 120, 0] and image[100, 280, 0] > image[100, 280, 2]


def test_many_chunks_draw_what_one_does(monkeypatch):
    generator = np.random.default_rng(3)
    start = generator.uniform(-2, 2, (40, 3))
    end, radius, colour = start + generator.uniform(-0.4, 0.4, (40, 3)), np.full(40, 0.1), generator.random((40, 3))
    whole = render_tubes(start, end, radius, colour, VIEW)
    monkeypatch.setattr("knittest.export.shading._CHUNK_PIXELS", 1)
    np.testing.assert_array_equal(render_tubes(start, end, radius, colour, VIEW), whole)


def test_light_comes_from_the_upper_left():
    image = tubes([[0, 0, 0]], [[0, 0, 0]], [0.8], [RED])
    assert image[150, 150, 0] > image[50, 250, 0] + 0.3


def saved(monkeypatch, module):
    """Figures handed to ``save`` by ``module``."""
    kept: list = []
    monkeypatch.setattr(module, "save", lambda figure, path: kept.append(figure))
    return kept


def test_broken_yarns_leave_gaps_and_crosses(monkeypatch):
    kept = saved(monkeypatch, yarn_pictures)
    history = beam_history()
    yarn_pictures.strip_picture(Path("x.png"), history, direction="warp", title="t")
    left, right, *windows = kept[0].axes[:4]
    assert len(windows) == 2 and len(left.lines[0].get_xdata()) == 0 and len(right.lines[0].get_xdata()) == 4
    history.frames[2].fields["alive"][:] = 1.0
    yarn_pictures.strip_picture(Path("x.png"), history, direction="warp", title="t")
    broken, whole = (figure.axes[1].images[0].get_array()[..., 3].sum() for figure in kept)
    assert broken < whole
    assert "broken" in right.get_title() and "unbroken" in kept[1].axes[1].get_title()


def test_the_aspect_is_true(monkeypatch):
    kept = saved(monkeypatch, yarn_pictures)
    yarn_pictures.strip_picture(Path("x.png"), beam_history(), direction="warp", title="t")
    for axes in kept[0].axes[:4]:
        box = axes.get_window_extent()
        wide, tall = np.ptp(axes.get_xlim()) / box.width, np.ptp(axes.get_ylim()) / box.height
        assert wide == pytest.approx(tall, rel=1e-6)


def test_deleted_shells_are_not_drawn_and_the_strip_stands(monkeypatch):
    kept = saved(monkeypatch, yarn_pictures)
    yarn_pictures.strip_picture(Path("x.png"), shell_history(), direction="warp", title="t")
    left, right = kept[0].axes[:2]
    assert len(left.collections[0].get_paths()) == 40 and len(right.collections[0].get_paths()) == 36
    assert np.ptp(left.get_ylim()) > np.ptp(left.get_xlim())  # pulled along x, drawn upright


@pytest.mark.parametrize(("kind", "along"), [("beams", 1), ("shells", 0)])
def test_the_pull_is_upright_though_the_strip_is_wider_than_long(monkeypatch, kind, along):
    kept = saved(monkeypatch, yarn_pictures)
    history = beam_history(wales=9, courses=3) if kind == "beams" else shell_history(columns=10, rows=3)
    start = history.frames[0].position
    assert np.ptp(start[:, 1 - along]) > 1.5 * np.ptp(start[:, along])
    yarn_pictures.strip_picture(Path("x.png"), history, direction="warp", title="t")
    strip = kept[0].axes[0]
    assert np.ptp(strip.get_xlim()) > 1.2 * np.ptp(strip.get_ylim())
    for axes in kept[0].axes:
        assert min(axes.get_window_extent().size) > 0
        assert kept[0].bbox.contains(*axes.get_window_extent().max)


def labels(figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


KINDS = {"simulated": "another simulation", "input": "input of the model"}


@pytest.mark.parametrize("kind", ["measured", "digitised", "reconstructed", "simulated", "input"])
def test_the_legend_says_what_a_reference_is(monkeypatch, kind):
    kept, line = saved(monkeypatch, curves), np.linspace(0, 1.6, 5)
    references, yarns = [curves.Reference(line, 3600 * line, kind, "lab.csv")], (14.0, "14 yarns", "warp")
    curves.curve_picture(Path("x.png"), [curve(5820.0)], title="t", references=references, yarns=yarns)
    expected = [f"{KINDS.get(kind, kind)} (lab.csv)", "simulated", "simulated peak, 5820 N at 1.60 %"]
    assert labels(kept[0]) == expected


def test_the_box_is_one_sd_each_way(monkeypatch):
    kept = saved(monkeypatch, curves)
    point = curves.EndPoint(1.6, 0.2, 7332.0, 380.0)
    curves.curve_picture(Path("x.png"), [curve(7000.0)], title="t", end_point=point)
    box = kept[0].axes[0].patches[0].get_bbox()
    np.testing.assert_allclose([box.x0, box.x1, box.y0, box.y1], [1.4, 1.8, 6952, 7712])


def test_an_ensemble_shows_specimens_corridor_and_its_spread(monkeypatch):
    kept = saved(monkeypatch, curves)
    grid = np.linspace(0, 1.5, 10)
    corridor = curves.Corridor(grid, 3000 * grid, 100 * grid, curves.EndPoint(1.6, 0.02, 5500.0, 500.0))
    specimens = [curve(peak) for peak in (5000.0, 5500.0, 6000.0)]
    curves.curve_picture(Path("x.png"), specimens, title="t", corridor=corridor)
    assert labels(kept[0]) == [
        "3 simulated specimens (circles: peaks)",
        "simulated, ± sd",
        "simulated, mean up to the earliest peak",
        "simulated peaks 5500 ± 500 N at 1.60 ± 0.02 %",
    ]
    marked = [line.get_ydata()[line.get_markevery()[0]] for line in kept[0].axes[0].lines if line.get_markevery()]
    assert marked[:3] == [one["force_n"].max() for one in specimens]


def test_limits_and_first_failure_are_marked(monkeypatch):
    kept = saved(monkeypatch, line_picture)
    history = beam_history()
    line_picture.energy_picture(Path("x.png"), history, kinetic_limit=0.05, energy_limit=0.02, title="t")
    upper, lower = kept[0].axes
    said = [text.get_text() for axes in (upper, lower) for text in axes.get_legend().get_texts()]
    assert {"first failure", "its limit, 5 %", "its limit, 2 %", "internal, knit", "external work"} <= set(said)
    assert "hourglass" not in said  # nothing to see for beams
    marks = [line.get_xdata()[0] for line in upper.lines if line.get_label() == "first failure"]
    assert marks == [history.energies["time_ms"][160]]


def test_shaded_is_what_is_not_judged_and_nothing_lies_over_it_or_is_cut(monkeypatch):
    kept = saved(monkeypatch, line_picture)
    history = shell_history()
    line_picture.energy_picture(Path("x.png"), history, kinetic_limit=0.05, energy_limit=0.02, title="t")
    figure, time = kept[0], history.energies["time_ms"]
    figure.canvas.draw()
    for axes in figure.axes:
        spans = sorted((box.x0, box.x1) for box in (patch.get_extents() for patch in axes.patches))
        edges = axes.transData.inverted().transform([(x, 0) for span in spans for x in span])[:, 0]
        begin = time[checked_rows(history).start]
        np.testing.assert_allclose(edges, [time[0], begin, time[160], time[-1]], atol=1e-9)
        legend = axes.get_legend().get_window_extent()
        assert legend.x0 >= axes.get_window_extent().x1 and legend.x1 <= figure.bbox.x1
    assert "not evaluated" in figure.axes[1].get_legend().get_texts()[-1].get_text()


def test_files_are_pictures_and_no_window_system_is_touched(tmp_path, monkeypatch):
    import sys

    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delitem(sys.modules, "matplotlib.pyplot", raising=False)
    yarn_pictures.strip_picture(tmp_path / "deformed.png", beam_history(), direction="warp", title="t")
    assert (tmp_path / "deformed.png").read_bytes().startswith(b"\x89PNG")
    assert "matplotlib.pyplot" not in sys.modules


@pytest.mark.parametrize("levels", [0, 2, 5])
def test_the_legend_does_not_reach_the_label_of_the_axis(tmp_path, monkeypatch, levels):
    figures = saved(monkeypatch, line_picture)
    x = np.linspace(0.0, 1.0, 5)
    long = "a name that is much too long for half of the width of a picture"
    curves.line_picture(
        tmp_path / "p.png", [Line(x, x, long), Line(x, x, "b")], title="t", xlabel="travel", ylabel="y",
        levels=[Level(0.1 * k, f"level {k}") for k in range(levels)], bands=[Band(x, x, x, "± sd")],
    )  # fmt: skip
    (figure,) = figures
    figure.draw_without_rendering()
    legend, (axes,) = figure.legends[0].get_window_extent(), figure.axes
    assert legend.y1 <= axes.xaxis.label.get_window_extent().y0
    assert legend.y0 >= 0.0


@pytest.mark.parametrize(("make", "kind", "shape"), [(beam_history, "B31", "line"), (shell_history, "S4R", "quad")])
def test_a_mesh_is_read_back(tmp_path, make, kind, shape):
    """Not as axisymmetric elements, which meshio writes for any four corners."""
    history = make()
    mesh, position = history.mesh, history.frames[0].position
    write_abaqus(tmp_path / "a.inp", mesh, position)
    types = [line for line in (tmp_path / "a.inp").read_text().splitlines() if line.startswith("*ELEMENT")]
    assert types == [f"*ELEMENT, TYPE={kind}"]
    read = meshio.read(tmp_path / "a.inp", file_format="abaqus")
    assert np.array_equal(read.points, position) and np.array_equal(read.cells_dict[shape], mesh.cells)
    for number, name in enumerate(mesh.part_names):
        if (mesh.part == number).any():
            assert np.array_equal(np.sort(np.concatenate(read.cell_sets[name])), np.flatnonzero(mesh.part == number))


def test_energies_of_any_number_of_systems_are_drawn() -> None:
    """A fabric with four layers has five systems; each has a style of its own."""
    from knittest.base.figure import new_figure
    from knittest.export.line_picture import _draw_energies

    axes, time = new_figure(4.0, 3.0).subplots(), np.linspace(0.0, 1.0, 3)
    systems = ("warp1", "weft1", "warp2", "weft2", "knit")
    _draw_energies(axes, {f"internal_{name}_mj": time for name in systems}, time)
    assert [line.get_label() for line in axes.lines] == [f"internal, {name}" for name in systems]
    assert len({(line.get_color(), line.get_linestyle()) for line in axes.lines}) == 5
