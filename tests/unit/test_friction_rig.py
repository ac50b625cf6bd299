"""Friction test: its floating plate loses nothing, and its normal force follows the width and the fabric's own test."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.base.history import Quality
from knittest.config.loading import resolve
from knittest.config.templates import new_fabric_text
from knittest.kernels.tool_contact import FREE
from knittest.laboratory.fabric_test import FabricTest
from knittest.laboratory.friction.config import FrictionRun, size_texts
from knittest.laboratory.friction.rig import PRESSED, SETTLE_SOFT, SOFT_DRAG, FrictionTest
from knittest.laboratory.friction.test import Friction, pull_work, static_force
from knittest.laboratory.restart import KINETIC
from knittest.models.boundary import Boundary
from knittest.runs.specimen import prepare
from knittest.solve.state import TooFastError


@pytest.mark.parametrize("variant", ["1", "2"])
def test_the_floating_plate_has_no_drag(variant: str) -> None:
    """Closed form for a linear fabric: drag c of a plate of mass M loses 20/7 c M d / (F T) of the pressing work.

    That was 5 to 9 % of the work of variant 1 with c = 50/ms, F = 2000 N, T = 1 ms, d = 0.3 to 0.36 mm, M = 2.7 g.
    """
    run = resolve(test="friction", variant=variant, scale="macro", direction="warp", preset="quick")
    prepared = Friction().prepare(run)
    assert isinstance(prepared.rig, FrictionTest)
    boundary = Boundary(prepared.model, 1e-3)
    prepared.rig.constrain(boundary)
    (upper,) = [tool for tool in boundary.tools if FREE in tool.motion]
    assert upper.drag == 0.0
    assert np.isclose(upper.mass, prepared.model.mass.sum(), rtol=0.1)


@pytest.mark.parametrize(
    ("sets", "more", "expected"),
    [
        ((), {}, 600.0), ((), {"preset": "standard"}, 1000.0), ((), {"preset": "paper"}, 2000.0),
        ((), {"scale": "macro"}, 2000.0), (("rig.width=30",), {}, 1200.0),
        (("rig.normal_force=700", "rig.width=30"), {}, 700.0),
    ],
)  # fmt: skip
def test_the_force_over_the_width_is_that_of_the_paper_unless_it_is_stated(
    sets: tuple[str, ...], more: dict[str, str], expected: float
) -> None:
    asked = {"variant": "1", "scale": "meso", "preset": "quick"} | more
    assert resolve(test="friction", **asked, sets=list(sets)).rig.normal_force == pytest.approx(expected)


@pytest.mark.parametrize("scale", ["meso", "macro"])
def test_the_force_of_the_fabrics_own_test_counts(scale: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    start = new_fabric_text("mine", resolve(variant="1", parameters="as-measured").fabric)
    file.write_text(f"{start}rigs: {{friction: {{normal_force: 500, width: 40}}}}\n".replace("rigs: {}\n", "", 1))
    rig = resolve(test="friction", fabric=file, scale=scale, preset="quick").rig
    assert rig.normal_force == 500.0  # type: ignore[attr-defined]
    assert rig.width == {"meso": 15.0, "macro": 40.0}[scale], "a size that the preset gives to yarns stays"  # type: ignore[attr-defined]


def test_a_quarter_of_the_axial_stiffness_takes_half_as_many_steps() -> None:
    """Steps go with the root of the stiffness where that of the inlays decides."""
    sets = ("rig.width=11", "rig.length=40", "rig.plate_length=18", "rig.travel=1")
    usual, whole = (
        prepare(
            resolve(test="friction", variant="1", scale="meso", preset="quick", direction="warp", sets=[*sets, *more])
        )
        for more in ((), ("rig.membrane_share=1",))
    )
    assert usual.model.critical_step / whole.model.critical_step == pytest.approx(2.0, rel=0.02)


@pytest.mark.parametrize(
    ("pull", "rise", "message"),
    [
        (1.0, 0.0, "the strip stretches instead of sliding, or its loops come apart: its pull force is 1 N, that of"),
        (80.0, 0.0, "the strip stretches instead of sliding"),
        (89.0, 1.0, ""),
        (89.0, 6.0, "the strip does not slide steadily: its pull force changes by 6.7 % of Coulomb's law"),
        (89.0, -6.0, "the strip does not slide steadily: its pull force changes by -6.7 % of Coulomb's law"),
    ],
)
def test_a_strip_that_does_not_slide_steadily_is_no_friction_test(
    pull: float, rise: float, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two faces with 0.075 under 600 N: 90 N."""
    found = {
        "pull_force_kinetic_n": pull, "normal_force_error_pct": 0.1, "penetration_over_deformation_pct": 1.0
    }  # fmt: skip
    monkeypatch.setattr(FabricTest, "assess", lambda *_: Quality(0.0, 0.0, 0.0, 0.0, 0.0, True, ()))
    monkeypatch.setattr(Friction, "results", lambda *_: found)
    run: Any = resolve(test="friction", variant="1", scale="meso", preset="quick")
    moved = np.linspace(0.0, 10.0, 101)
    history: Any = SimpleNamespace(
        curve={"displacement_mm": moved, "pull_force_n": np.where(moved > 7.5, pull + rise, pull)}
    )
    specimen: Any = SimpleNamespace(restarts=())
    quality = Friction().assess(run, specimen, history, specimen)
    assert len(quality.failures) == bool(message)
    if message:
        assert quality.failures[0].startswith(message)
        assert "rig.normal_force" in quality.failures[0] and "rig.travel" in quality.failures[0]


@pytest.mark.parametrize(
    ("error", "others", "restarts", "expected"),
    [
        (0.9, (), (KINETIC,), ()),
        (2.0, (), (), ("normal force deviates by 2.0 % during the pull (limit 1 %)",)),
        (2.0, ("damping",), (KINETIC,), ("damping",)),
    ],
)
def test_the_normal_force_is_checked_where_no_other_check_fails(
    error: float, others: tuple[str, ...], restarts: tuple[str, ...], expected: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    assert assess_normal_force(error, others, restarts, monkeypatch).failures == expected


def test_a_normal_force_that_rings_lowers_the_speed(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(TooFastError, match=r"normal force deviates by 2.0 % during the pull") as found:
        assess_normal_force(2.0, (), (KINETIC,), monkeypatch)
    assert found.value.share == pytest.approx(0.25), "half of the limit"


def assess_normal_force(
    error: float, others: tuple[str, ...], restarts: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> Quality:
    found = {
        "pull_force_kinetic_n": 90.0, "normal_force_error_pct": error, "penetration_over_deformation_pct": 1.0
    }  # fmt: skip
    monkeypatch.setattr(FabricTest, "assess", lambda *_: Quality(0.0, 0.0, 0.0, 0.0, 0.0, True, others))
    monkeypatch.setattr(Friction, "results", lambda *_: found)
    run: Any = resolve(test="friction", variant="1", scale="meso", preset="quick")
    history: Any = SimpleNamespace(curve={"displacement_mm": np.linspace(0.0, 10.0, 101), "pull_force_n": np.ones(101)})
    specimen: Any = SimpleNamespace(restarts=restarts)
    return Friction().assess(run, specimen, history, specimen)


@pytest.mark.parametrize(("rows", "expected"), [(1000, 5), (5000, 10)])
def test_forces_are_means_of_a_share_of_the_test(rows: int, expected: int) -> None:
    """A peak of one row counts by one over the rows of the mean."""
    moved = np.linspace(0.0, 10.0, rows)
    force = np.where(np.arange(rows) == rows // 4, 1.0, 0.0)
    largest, _ = static_force({"displacement_mm": moved, "pull_force_n": force, "time_ms": moved})
    assert largest == pytest.approx(1.0 / expected)


def test_the_work_of_the_pull_counts_from_its_begin():
    """A ramp to 2 N over 1 mm, then 2 mm at 2 N."""
    curve = {"displacement_mm": np.array([-0.0, 0.0, 1.0, 3.0]), "pull_force_n": np.array([9.0, 0.0, 2.0, 2.0])}
    assert pull_work(curve) == pytest.approx([0.0, 0.0, 1.0, 5.0])


def run_of(variant: str, direction: str, *sets: str) -> FrictionRun:
    run = resolve(test="friction", variant=variant, scale="meso", preset="quick", direction=direction, sets=list(sets))
    assert isinstance(run, FrictionRun)
    return run


def test_soft_loops_are_pressed_by_what_bends_them() -> None:
    """12 EI / s^2 with a quarter of 14.4 mm, four times on a stitch of (100 / 28 mm)^2, 15 mm wide on 150 mm."""
    run = run_of("two-yarns", "warp")
    bending = run.fabric.knitting.bending_stiffness_n_mm2  # type: ignore[union-attr]
    expected = 4.0 * 12.0 * bending / 3.6**2 / (100.0 / 28.0) ** 2 * 150.0 * 15.0
    assert run.rig.normal_force == pytest.approx(expected)
    assert run_of("two-yarns", "warp", "rig.plate_length=75").rig.normal_force == pytest.approx(0.5 * expected)
    assert run_of("two-yarns", "warp", "rig.normal_force=50").rig.normal_force == 50.0
    assert "derived" in size_texts(run)[2]
    assert not any("derived" in text for text in size_texts(run_of("two-yarns", "warp", "rig.normal_force=50")))


@pytest.mark.parametrize("variant", ["1", "2"])
@pytest.mark.parametrize("direction", ["warp", "weft"])
def test_the_fabrics_of_the_paper_keep_its_force_and_times(variant: str, direction: str) -> None:
    run = run_of(variant, direction)
    assert (run.rig.normal_force, run.rig.plate_length, run.rig.length, run.rig.travel) == (600.0, 150.0, 200.0, 10.0)
    assert (run.solver.speed, run.solver.ramp, run.solver.damping) == (4.0, 1.5, 2.0)
    assert size_texts(run)[2] == "pressed by 600 N"
    assert FrictionTest(run, 0, (-1.0, 1.2), np.zeros(0)).pressed == PRESSED


def test_friction_pulls_half_of_the_bending_force_where_loops_carry_the_pull() -> None:
    """28 wales in 100 mm, each with 12 EI / s^2; both faces by Coulomb's law."""
    run = run_of("weft-only", "warp")
    bending = run.fabric.knitting.bending_stiffness_n_mm2  # type: ignore[union-attr]
    friction = 2.0 * run.rig.kinetic_coefficient * run.rig.normal_force
    assert friction == pytest.approx(0.5 * 12.0 * bending / 3.6**2 * 0.28 * 15.0)
    across = run_of("weft-only", "weft")
    assert across.rig.normal_force > 5.0 * run.rig.normal_force and across.rig.plate_length == 150.0
    assert run.rig.plate_length < 150.0 and run.solver.speed < 0.2 * across.solver.speed


def test_the_times_of_the_test_follow_the_fall_of_the_plate() -> None:
    """A quarter of the force takes twice the time, if the plate falls for longer than 0.2 ms."""
    run, light = run_of("two-yarns", "warp", "rig.normal_force=36"), run_of("two-yarns", "warp", "rig.normal_force=9")
    assert light.slowness(2.0, 9.0) == pytest.approx(2.0 * run.slowness(2.0, 36.0))
    assert run.solver.speed == pytest.approx(2.0 * light.solver.speed)
    assert run.solver.ramp == pytest.approx(0.5 * light.solver.ramp)
    slow, slower = (FrictionTest(one, 0, (-1.0, 1.0), np.zeros(0)) for one in (run, light))
    assert slower.pressed - SETTLE_SOFT == pytest.approx(2.0 * (slow.pressed - SETTLE_SOFT))
    assert slower.drag == slow.drag == SOFT_DRAG


def test_strips_of_loops_keep_their_edges_and_those_of_inlays_do_not() -> None:
    for direction, held in (("warp", True), ("weft", False)):
        prepared = prepare(run_of("weft-only", direction, "rig.length=40", "rig.plate_length=18", "rig.travel=1"))
        assert isinstance(prepared.rig, FrictionTest)
        edges, position = prepared.rig.edges, prepared.model.position()
        assert bool(len(edges)) == held
        if held:
            x, width = position[edges, 0], float(np.ptp(position[:, 0]))
            at_sides = np.minimum(x - position[:, 0].min(), position[:, 0].max() - x) < 0.2 * width
            assert at_sides.any(), "cut ends of the courses"


@pytest.mark.parametrize(
    ("variant", "direction", "sets", "message"),
    [
        ("1", "warp", ("rig.plate_length=20", "rig.travel=20"), "must be less than rig.plate_length = 20 mm, or the"),
        ("weft-only", "warp", ("rig.plate_length=60",), "must be less than rig.length = 60 mm, so that the pulled end"),
    ],
)
def test_plates_that_leave_the_strip_or_cover_its_pulled_end_are_refused(
    variant: str, direction: str, sets: tuple[str, ...], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        Friction().check_run(run_of(variant, direction, *sets))
