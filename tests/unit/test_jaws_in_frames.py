"""Jaws, rails, clamps and bars of tests that pull and shear: where frames show them, and the nodes that they hold."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_apparatus_in_frames import resolved

from knittest.base.history import Body, Frame, History
from knittest.config.run import Run
from knittest.export.meshes import write_frames
from knittest.laboratory.report_base import REPORTS
from knittest.models.boundary import Boundary
from knittest.report_page.moving.recording import Recording, read_recording
from knittest.runs.checkpoints import specimen_of, specimen_state
from knittest.runs.specimen import prepare, run_specimen

MOMENTS, ROWS = 7, 601
SIZES = {
    "tensile": ("rig.gauge_length=24", "rig.width=10"),
    "bias-extension": ("rig.gauge_length=40", "rig.width=20"),
    "biaxial": ("rig.side=20",),
    "picture-frame": ("rig.side=20", "rig.mounting_slack=0"),
    "pull-out": ("rig.width=18", "rig.length=22", "rig.travel=5"),
}
HELD = [
    *((test, scale, way) for test in ("tensile", "biaxial") for scale in ("macro", "meso") for way in ("warp", "weft")),
    ("bias-extension", "macro", None),
    ("bias-extension", "meso", None),
]


def driven(run: Run) -> tuple[Any, list[np.ndarray]]:
    """A specimen whose frames have the nodes that its rig drives where its tables bring them, all others as at the
    start, and those nodes by the motion that drives them.
    """
    prepared = prepare(run)
    boundary, rig = Boundary(prepared.model, run.solver.safety * prepared.model.critical_step), prepared.rig
    start = prepared.model.position().copy()
    rig.constrain(boundary)
    frames = []
    for time in np.linspace(0.0, rig.duration, MOMENTS):
        place = start.copy()
        for node, dof, table, scale, _, _ in boundary._motions:
            place[node, dof] += scale * boundary.tables[int(table[0])].integral(float(time))
        frames.append(Frame(float(time), 0.0, 0.0, place, {}))
    nothing: Any = SimpleNamespace(reaction=np.zeros(9), tool_force=np.zeros((2, 3)))
    times = np.linspace(0.0, rig.duration, ROWS)
    rows = [rig.channels(float(time), nothing) for time in times]
    curve = {"time_ms": times} | {name: np.array([row[name] for row in rows]) for name in rows[0]}
    history = History(prepared.model.mesh, curve, frames=frames)
    groups = [np.unique(node) for node, *_ in boundary._motions]
    return SimpleNamespace(history=history, facts=prepared.facts), groups


def bodies_of(run: Run, specimen: Any) -> dict[str, Body]:
    return {body.name: body for body in REPORTS[run.rig.kind].bodies(run, specimen)}


def box(body: Body, frame: int) -> tuple[np.ndarray, np.ndarray]:
    place = body.place(frame)
    return place.min(axis=0), place.max(axis=0)


def holds(body: Body, frames: list[Frame], nodes: np.ndarray, axis: int, way: int, pitch: float) -> None:
    """Compare the inner face with the line of the first held nodes, at every frame; the block holds them all."""
    for k, frame in enumerate(frames):
        low, high = box(body, k)
        face, place = (low if way > 0 else high)[axis], frame.position[nodes]
        first = place[:, axis].min() if way > 0 else place[:, axis].max()
        assert 0.0 <= way * (first - face) + 1e-3 < pitch + 2e-3
        assert (place >= low - 1e-3).all() and (place <= high + 1e-3).all()


@pytest.mark.parametrize(("test", "scale", "direction"), [row for row in HELD if row[0] != "biaxial"])
def test_jaws_hold_the_clamped_nodes_of_a_strip(test: str, scale: str, direction: str | None) -> None:
    run = resolved(test, *SIZES[test], scale=scale, direction=direction)
    specimen, (fixed, moving) = driven(run)
    bodies, frames = bodies_of(run, specimen), specimen.history.frames
    axis = 0 if (scale, direction) == ("meso", "weft") else 1
    assert list(bodies) == ["fixed jaw", "moving jaw"]
    travel = frames[-1].position[moving[0], axis] - frames[0].position[moving[0], axis]
    assert travel > 0.5 and bodies["moving jaw"].offset[-1, axis] == pytest.approx(travel, rel=1e-3)
    pitch = run.fabric.course_spacing if scale == "meso" else run.model.macro.element_size_mm
    holds(bodies["fixed jaw"], frames, fixed, axis, -1, pitch)
    holds(bodies["moving jaw"], frames, moving, axis, 1, pitch)
    free = np.setdiff1d(np.arange(len(frames[0].position)), np.concatenate([fixed, moving]))
    low, high = box(bodies["fixed jaw"], 0)[1][axis], box(bodies["moving jaw"], 0)[0][axis]
    between = frames[0].position[free, axis]
    assert (between > low).all() and (between < high).all()  # nothing that moves by itself is inside a jaw
    assert high - low == pytest.approx(specimen.facts["gauge_mm"])


@pytest.mark.parametrize(("scale", "direction"), [row[1:] for row in HELD if row[0] == "biaxial"])
def test_rails_stay_at_the_needles_of_all_four_sides(scale: str, direction: str) -> None:
    """The other system is strained by half as much: a rail that took the wrong strain would leave its needles."""
    run = resolved("biaxial", *SIZES["biaxial"], "rig.ratio=0.5", "rig.max_strain=8", scale=scale, direction=direction)
    specimen, (needles, *_) = driven(run)
    bodies, frames = bodies_of(run, specimen), specimen.history.frames
    sides = [specimen.facts[f"{system}_side_mm"] for system in ("weft", "warp")]
    pitch = max(run.fabric.wale_spacing, run.fabric.course_spacing)
    for name, axis, way in (("left", 0, -1), ("right", 0, 1), ("lower", 1, -1), ("upper", 1, 1)):
        along = way * frames[0].position[needles, axis]
        own = needles[along >= 0.5 * sides[axis] - 1e-6]
        assert len(own) >= 3
        for k, frame in enumerate(frames):
            low, high = box(bodies[f"{name} rail"], k)
            beyond = way * (frame.position[own, axis] - (low if way > 0 else high)[axis])
            assert beyond.min() == pytest.approx(0.0, abs=1e-3) and beyond.max() < pitch
            assert beyond.max() <= high[axis] - low[axis]
    travel = [bodies[f"{name} rail"].offset[-1].max() for name in ("right", "upper")]
    own_axis = 1 if direction == "warp" else 0
    assert travel[own_axis] / sides[own_axis] == pytest.approx(2.0 * travel[1 - own_axis] / sides[1 - own_axis])


def corners(sides: tuple[float, float], frame: Frame, history: History) -> np.ndarray:
    """Hinges of a frame of ``sides`` (weft, warp) at its shear angle at ``frame``: right, top, left, bottom, (4, 2)."""
    angle = np.interp(frame.time, history.curve["time_ms"], history.curve["frame_shear_angle_deg"])
    half = 0.5 * np.deg2rad(angle)
    weft = 0.5 * sides[0] * np.array([np.cos(np.pi / 4 + half), np.sin(np.pi / 4 + half)])
    warp = 0.5 * sides[1] * np.array([-np.cos(np.pi / 4 + half), np.sin(np.pi / 4 + half)])
    return np.array([weft - warp, weft + warp, warp - weft, -weft - warp])


#: hinges (right, top, left, bottom) that a bar joins
BETWEEN = {
    "upper right bar": (0, 1), "upper left bar": (1, 2), "lower left bar": (2, 3), "lower right bar": (3, 0),
}  # fmt: skip
FRAMES = [
    (scale, more)
    for scale in ("macro", "meso")
    for more in ((), ("rig.cycles=1", "rig.max_angle=30"), ("rig.frame_side=32",), ("rig.reversal_angles=[30,5]",))
]


@pytest.mark.parametrize(("scale", "more"), FRAMES)
def test_bars_join_the_hinges_and_carry_the_needles(scale: str, more: tuple[str, ...]) -> None:
    run = resolved("picture-frame", *SIZES["picture-frame"], *more, scale=scale)
    specimen, (needles, *_) = driven(run)
    history, bodies = specimen.history, bodies_of(run, specimen)
    wide = specimen.facts["frame_weft_mm"], specimen.facts["frame_warp_mm"]
    own = run.rig.frame_side is None
    size = np.sqrt(specimen.facts["area_mm2"])
    assert wide == (pytest.approx(size, rel=0.1), pytest.approx(size, rel=0.1)) if own else wide == (32.0, 32.0)
    gap, pitch = 0.0 if own else 0.5 * (32.0 - size), max(run.fabric.wale_spacing, run.fabric.course_spacing)
    assert set(bodies) == set(BETWEEN) | (set() if own else {"arms"})
    for k, frame in enumerate(history.frames):
        hinge, near = corners(wide, frame, history), np.full(len(needles), np.inf)
        for name, ends in BETWEEN.items():
            outline = bodies[name].place(k)[:, :2]
            apart = np.linalg.norm(outline[:, None] - hinge[list(ends)], axis=2)
            assert apart.min(axis=0) == pytest.approx([0.0, 0.0], abs=1e-2)
            along = np.subtract(*hinge[list(ends)][::-1]) / np.linalg.norm(np.subtract(*hinge[list(ends)]))
            out = np.array([along[1], -along[0]])
            assert ((outline - hinge[ends[0]]) @ out).min() > -1e-2  # the bar lies outside the fabric
            near = np.minimum(near, np.abs((frame.position[needles, :2] - hinge[ends[0]]) @ out))
        assert near.max() < (gap + pitch if scale == "meso" else gap + 1e-2)
        if not own:  # an end of each arm is where the needles are, the other where the bars are
            ends = bodies["arms"].place(k)[:, None, :2]
            to_needles = np.linalg.norm(ends - frame.position[needles, :2], axis=2).min(axis=1)
            assert (np.sort(to_needles)[:8] < (1e-2 if scale == "macro" else pitch)).all()
            normals = {(a, b): (hinge[b] - hinge[a])[::-1] * [-1.0, 1.0] / wide[0] for a, b in BETWEEN.values()}
            inside = [(ends[:, 0] - hinge[a]) @ normal for (a, _), normal in normals.items()]
            assert np.sort(np.min(inside, axis=0))[:8] == pytest.approx(np.zeros(8), abs=1e-2)
        if scale == "macro" and own:  # corners of the shells are the hinges
            nodes = frame.position[needles, :2]
            assert np.linalg.norm(nodes[:, None] - hinge, axis=2).min(axis=0) == pytest.approx(np.zeros(4), abs=1e-2)


@pytest.mark.parametrize("direction", ["warp", "weft"])
@pytest.mark.parametrize("clamped", ["sides", "far"])
def test_clamps_of_a_pull_out_hold_the_piece_and_draw_the_inlay(clamped: str, direction: str) -> None:
    run = resolved("pull-out", *SIZES["pull-out"], f"rig.clamped_edges={clamped}", scale="meso", direction=direction)
    specimen, (pulled, held) = driven(run)
    bodies, frames = bodies_of(run, specimen), specimen.history.frames
    axis, first = (1 if direction == "warp" else 0), frames[0].position
    for k, frame in enumerate(frames):
        low, high = box(bodies["inlay clamp"], k)
        end = frame.position[pulled[0]]
        assert low[axis] == pytest.approx(end[axis], abs=2e-3)
        assert (np.delete(end - low, axis) > 0.0).all() and (np.delete(high - end, axis) > 0.0).all()
    assert bodies["inlay clamp"].offset[-1, axis] == pytest.approx(run.rig.travel, rel=1e-3)
    pitch = max(run.fabric.wale_spacing, run.fabric.course_spacing)
    if clamped == "far":
        return holds(bodies["far clamp"], frames, held, axis, -1, pitch)
    upper = first[held, 1 - axis] > first[:, 1 - axis].mean()
    holds(bodies["first side clamp"], frames, held[~upper], 1 - axis, -1, pitch)
    holds(bodies["second side clamp"], frames, held[upper], 1 - axis, 1, pitch)


@pytest.mark.parametrize(
    ("test", "more"),
    [
        ("tensile", ("solver.speed=2",)),
        ("picture-frame", ("rig.cycles=1", "rig.max_angle=20", "solver.speed=2", "solver.ramp=1")),
    ],
)
def test_a_real_run_is_shown_with_them_also_when_it_was_kept_and_without_them_by_an_earlier_version(
    tmp_path: Path, test: str, more: tuple[str, ...]
) -> None:
    run = resolved(test, *SIZES[test], *more, "output.frames=5", "output.samples=301")
    specimen = run_specimen(run)
    report = REPORTS[test]
    bodies = report.bodies(run, specimen_of(specimen_state(specimen, frames=True)))
    write_frames(tmp_path, specimen.history, bodies)
    recording = read_recording(tmp_path)
    assert [body.name for body in recording.bodies] == [body.name for body in bodies] != []
    for read, body in zip(recording.bodies, bodies, strict=True):
        for k in range(len(recording.time)):
            np.testing.assert_allclose(read.place(k), body.place(k), atol=1e-9)
        assert (read.turn is None) == (test == "tensile")
    for fact in report.placement_facts:
        without = {name: value for name, value in specimen.facts.items() if name != fact}
        assert report.bodies(run, replace(specimen, facts=without)) == []
    touches(recording, test)


def touches(recording: Recording, test: str) -> None:
    """Nodes that lie on a block's inner face, or at its corner, stay there over all frames of a real run."""
    for body in recording.bodies:
        for k, place in enumerate(recording.position):
            block = body.place(k)
            apart = np.linalg.norm(place[:, None, :2] - block[None, :, :2], axis=2).min(axis=0)
            if test == "picture-frame":  # four of its eight points are at two corner nodes
                assert (np.sort(apart)[:4] < 0.02).all()
            else:
                face = block[:, 1].min() if body.name == "moving jaw" else block[:, 1].max()
                assert np.abs(place[:, 1] - face).min() < 2e-3
