"""Clamps, plates and frame in the frames and on the pictures of a run."""

from collections.abc import Sequence
from dataclasses import replace
from math import cos, pi, radians, sqrt
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from export_sample import beam_history

from knittest.base.figure import new_figure
from knittest.base.history import Body, Frame, History
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.export.meshes import write_frames
from knittest.export.yarn_pictures import _colourbar_ends, _force_scale
from knittest.laboratory.base import PreparedSpecimen
from knittest.laboratory.cantilever.report import side_picture
from knittest.laboratory.forming.pictures import _scale_extension as cut_of_plan
from knittest.laboratory.friction.report import pressure_picture
from knittest.laboratory.friction.rig import pull_axis
from knittest.laboratory.picture_frame.pictures import FrameShape, _levels, draw_frame
from knittest.laboratory.picture_frame.rig import PictureFrameTest, start_up_angle
from knittest.laboratory.report_base import REPORTS
from knittest.materials.trellis import crosshead
from knittest.models.boundary import Boundary
from knittest.report_page.moving.recording import Recording, read_recording
from knittest.runs.specimen import prepare, run_specimen

FRICTION = ("rig.length=60", "rig.plate_length=30", "rig.travel=2", "output.frames=4", "output.samples=101")


def resolved(test: str, *sets: str, scale: str = "macro", direction: str | None = None) -> Run:
    return resolve(variant="1", scale=scale, preset="quick", test=test, direction=direction, sets=list(sets))


def kept(folder: Path, run: Run) -> Recording:
    """Frames of a real specimen with its bodies, as they are read back from a folder."""
    specimen = run_specimen(run)
    write_frames(folder, specimen.history, REPORTS[run.rig.kind].bodies(run, specimen))
    return read_recording(folder)


def places(body: Body) -> np.ndarray:
    """Corners of ``body`` at all frames, (k, n, 3)."""
    return body.points + body.offset[:, None, :]


def same_as_tools(bodies: Sequence[Body], run: Run, prepared: PreparedSpecimen) -> None:
    """Compare ``bodies`` at the first frame with the tools that the rig makes."""
    boundary = Boundary(prepared.model, run.solver.safety * prepared.model.critical_step)
    prepared.rig.constrain(boundary)
    for body, tool in zip(bodies, boundary.tools, strict=True):
        first = places(body)[0]
        np.testing.assert_allclose(0.5 * (first.min(axis=0) + first.max(axis=0)), tool.position, atol=1e-5)
        np.testing.assert_allclose(0.5 * np.ptp(first, axis=0), tool.size[:3], atol=1e-9)


@pytest.mark.parametrize("mode", ["angle", "overhang"])
def test_a_cantilever_lies_on_its_board_and_its_tip_meets_the_plane(tmp_path: Path, mode: str) -> None:
    recording = kept(tmp_path, resolved("cantilever", f"rig.mode={mode}", "rig.width=20", direction="warp"))
    board, plane = recording.bodies
    flat, bent = recording.position[0], recording.position[-1]
    half = recording.radius.mean()
    assert board.name == "board" and board.points[:, 2].max() == pytest.approx(-half) and board.points[:, 1].max() == 0
    down = plane.points[plane.points[:, 2].argmin(), 2] - plane.points[:, 2].max()
    reach = plane.points[:, 1].max()
    assert np.degrees(np.arctan2(-down, reach)) == pytest.approx(41.5)
    above = (bent[:, 2] - (-half + bent[:, 1] * down / reach))[flat[:, 1] >= 0.0]
    assert above.min() > 0.5 * half and above.max() > 10.0
    assert above[-1] < 1.5 * half  # the tip's middle is half a thickness from its face


@pytest.mark.parametrize("direction", ["warp", "weft"])
def test_plates_of_friction_are_those_that_press(tmp_path: Path, direction: str) -> None:
    run = resolved("friction", *FRICTION, direction=direction)
    recording = kept(tmp_path, run)
    same_as_tools(recording.bodies, run, prepare(run))
    lower, upper = (places(body) for body in recording.bodies)
    assert lower[-1, 0, 1] - lower[0, 0, 1] == pytest.approx(-2.0, abs=0.1)  # drawn off the pulled end
    gap = upper[:, :, 2].min(axis=1) - lower[:, :, 2].max(axis=1)
    assert gap[0] == pytest.approx(2.0 * recording.radius.mean(), rel=1e-5)
    assert (gap[1:] < gap[0]).all() and (gap > 1.9).all()


def test_plates_of_compaction_close_by_half_the_way_each() -> None:
    run = resolved("compaction", "rig.side=7", scale="meso")
    prepared = prepare(run)
    frames = [Frame(time, 0.0, 0.0, prepared.model.position(), {}) for time in (0.0, 5.0, 10.0)]
    curve = {"time_ms": np.array([0.0, 10.0]), "compaction_mm": np.array([0.0, 0.4])}
    history = History(prepared.model.mesh, curve, frames=frames)
    specimen: Any = SimpleNamespace(history=history, facts=prepared.facts)
    bodies = REPORTS["compaction"].bodies(run, specimen)
    same_as_tools(bodies, run, prepared)
    np.testing.assert_allclose(bodies[0].offset[:, 2], [0.0, 0.1, 0.2])
    np.testing.assert_allclose(bodies[1].offset[:, 2], [0.0, -0.1, -0.2])


@pytest.mark.parametrize("test", ["compaction", "friction"])
def test_a_specimen_that_an_earlier_version_finished_has_no_plates(test: str) -> None:
    """A resumed ensemble reads it from its checkpoint, without the places of the plates."""
    specimen: Any = SimpleNamespace(history=None, facts={"area_mm2": 100.0})
    assert REPORTS[test].bodies(resolved(test, scale="meso"), specimen) == []


@pytest.mark.parametrize("angle", [0.0, 25.0, 44.0])
def test_a_drawn_frame_keeps_its_sides_and_has_the_angle(angle):
    right, top, left, bottom = FrameShape(200.0, 140.0, angle).corners(200.0)
    for a, b in ((right, top), (top, left), (left, bottom), (bottom, right)):
        assert np.linalg.norm(b - a) == pytest.approx(200.0)
    cosine = (right - top) @ (left - top) / 200.0**2
    assert cosine == pytest.approx(cos(pi / 2 - radians(angle)))
    assert top[1] - bottom[1] == pytest.approx(200.0 * sqrt(2.0) + crosshead(radians(angle), 200.0))


@pytest.mark.parametrize(("fabric", "arms"), [(200.0, 0), (140.0, 4)])
def test_a_wider_frame_holds_the_fabric_by_arms(fabric, arms):
    axes = new_figure(4.0, 4.0).add_subplot()
    draw_frame(axes, FrameShape(200.0, fabric, 30.0))
    assert len([p for p in axes.patches if len(p.get_xy()) == 5]) == 4 + arms
    assert len(axes.texts) == 2 and axes.get_ylim()[1] > FrameShape(200.0, fabric, 30.0).corners(200.0)[1, 1]


@pytest.mark.parametrize("sets", [[], ["solver.ramp=20"], ["rig.frame_side=300"]])
def test_the_start_up_of_a_frame_ends_where_its_rate_is_reached(sets):
    run = resolve(test="picture-frame", variant="1", scale="macro", preset="quick", sets=sets)
    rig = PictureFrameTest(run, np.arange(4), run.rig.side_mm**2)
    rate = np.array(rig.shear.value)
    full = rig.shear.time[int(np.argmax(rate > (1.0 - 1e-9) * rate.max()))]
    assert np.rad2deg(rig.angle(full)) == pytest.approx(start_up_angle(run), rel=1e-6)
    assert start_up_angle(run) < 0.2 * run.rig.max_angle


@pytest.mark.parametrize(("more", "cut"), [(0.0, "neither"), (5.0, "max"), (-5.0, "min")])
def test_a_bar_of_forces_has_an_arrow_where_forces_lie_beyond(more, cut):
    frame = beam_history().frames[1]
    scale = _force_scale(
        "axial_force", replace(frame, fields={"axial_force": np.array([0.0, 1.0]), "alive": np.ones(2)})
    )
    assert _colourbar_ends(scale, [np.array([0.0, 1.0]), np.array([more, 0.5])]) == cut


def test_a_bar_in_plan_is_cut_but_for_rounding():
    from matplotlib.colors import Normalize

    norm = Normalize(0.0, 1.0)
    assert cut_of_plan(np.array([0.0, 1.0 + 1e-9]), norm) == "neither"
    assert cut_of_plan(np.array([0.0, 1.1]), norm) == "max" and cut_of_plan(np.array([-0.1, 1.1]), norm) == "both"


def test_a_cantilever_lies_on_its_board_up_to_the_edge(tmp_path, monkeypatch):
    kept = []
    monkeypatch.setattr("knittest.laboratory.cantilever.report.save", lambda figure, path: kept.append(figure))
    along, height = np.array([-10.0, 0.0, 50.0, 90.0]), np.array([0.0, 0.0, -15.0, -70.0])
    segments = np.array([[0, 1], [1, 2], [2, 3]])
    side_picture(
        tmp_path / "a.png", along, height, segments, overhang=120.0, angle=37.9, plane=41.5, thickness=2.0, yarns=False,
        title="t",
    )  # fmt: skip
    axes = kept[0].axes[0]
    board = next(p for p in axes.patches if p.get_label() == "board")
    assert board.get_x() + board.get_width() == pytest.approx(0.0) and board.get_y() + board.get_height() == -1.0
    box, (wide, tall) = axes.get_position(), kept[0].get_size_inches()
    across, down = np.ptp(axes.get_xlim()) / (box.width * wide), np.ptp(axes.get_ylim()) / (box.height * tall)
    assert across == pytest.approx(down)  # to scale


@pytest.mark.parametrize(("along", "across"), [("y", 0.25), ("x", 0.075)])
def test_maps_of_pressure_fill_their_sheet_to_scale_along_the_pull(tmp_path, monkeypatch, along, across):
    kept = []
    monkeypatch.setattr("knittest.laboratory.friction.report.save", lambda figure, path: kept.append(figure))
    long, short = np.linspace(0.0, 200.0, 21), np.linspace(0.0, 200.0 * across, 6)
    x, y = (short, long) if along == "y" else (long, short)
    pressure = {face: np.ones((len(x) - 1, len(y) - 1)) for face in ("back", "face")}
    pressure_picture(tmp_path / "a.png", x, y, pressure, along=along, title="t", note="n")
    wide, tall = kept[0].get_size_inches()
    for axes in kept[0].axes[:2]:
        box = axes.get_position()
        assert np.ptp(axes.get_xlim()) == 200.0
        assert box.height * tall == pytest.approx(across * box.width * wide)
    maps = sum(axes.get_position().height * tall for axes in kept[0].axes[:2])
    assert tall - maps < 3.0  # inch of title, labels and note


def test_strips_of_shells_are_pulled_along_y_whichever_way_they_are_cut():
    def axis(scale, direction):
        return pull_axis(resolve(test="friction", variant="1", scale=scale, preset="quick", direction=direction))

    assert [axis("macro", d) for d in ("warp", "weft")] == [1, 1]
    assert [axis("meso", d) for d in ("warp", "weft")] == [1, 0]


@pytest.mark.parametrize("most", [0.33, 2.08, 7.0, 0.0021, 50.0])
def test_levels_of_wrinkles_are_round_and_about_zero(most):
    levels = _levels(most)
    step = levels[1] - levels[0]
    assert 0.0 in levels and np.allclose(levels, -levels[::-1]) and most <= levels[-1] < most + step
    assert 11 <= len(levels) <= 25 and float(f"{step:.2g}") == pytest.approx(step)
