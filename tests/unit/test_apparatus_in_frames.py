"""Board and plane of the cantilever, plates of friction and compaction: where frames show them, and the specimen."""

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from knittest.base.history import Body, Frame, History
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.export.meshes import write_frames
from knittest.laboratory.base import Prepared
from knittest.laboratory.report_base import REPORTS
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


def same_as_tools(bodies: Sequence[Body], run: Run, prepared: Prepared) -> None:
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
    assert (
        gap[0] == pytest.approx(2.0 * recording.radius.mean(), rel=1e-5)
        and (gap[1:] < gap[0]).all()
        and (gap > 1.9).all()
    )


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
