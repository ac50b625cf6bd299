"""Picture frame: its motion, its cycles in closed form and by hand, and its end by the law and by locking."""

from math import radians
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.laboratory.picture_frame.rig import PictureFrameTest
from knittest.laboratory.picture_frame.test import cycle_results, cycles_of
from knittest.laboratory.quality_checks import locking_warning
from knittest.laboratory.shear_law_end import end_with_shear_law
from knittest.materials.trellis import crosshead
from knittest.runs.specimen import prepare
from knittest.solve.simulation import START_ROWS, is_locked
from knittest.solve.state import LOCKED


def frame_rig(*sets: str) -> PictureFrameTest:
    run = resolve(test="picture-frame", variant="1", scale="macro", sets=["rig.side=180", "solver.ramp=1", *sets])
    return PictureFrameTest(run, np.zeros(0, np.int64), 180.0**2)


@pytest.mark.parametrize("side", [180.0, 250.0])
def test_the_crosshead_starts_at_the_speed_of_the_run(side):
    """d' = sqrt(2) L p' = L gamma' / sqrt(2) at small angles, with the frame's side L, not the fabric's."""
    rig = frame_rig("solver.speed=0.5", f"rig.frame_side={side}")
    now, later = (crosshead(rig.angle(t), side) for t in (2.0, 3.0))  # after the closing and the start, 1 ms each
    assert later - now == pytest.approx(0.5, rel=0.01)


def test_it_ends_at_the_largest_angle_after_its_turns():
    rig = frame_rig("solver.speed=2", "rig.max_angle=20")
    assert rig.angle(rig.duration) == pytest.approx(radians(20.0), rel=1e-6)
    turning = frame_rig("solver.speed=2", "rig.max_angle=30", "rig.reversal_angles=[20, 5]")
    angles = np.array([turning.angle(t) for t in np.linspace(0.0, turning.duration, 400)])
    first = int(np.argmax(np.diff(angles) < 0.0))
    assert angles[first] == pytest.approx(radians(20.0), abs=0.002)
    assert angles[first:].min() == pytest.approx(radians(5.0), abs=0.002)
    assert angles[-1] == pytest.approx(radians(30.0), rel=1e-6)


def loops(share: float, count: int, most: float = 20.0) -> dict[str, np.ndarray]:
    """Curve of S = gamma with a share of friction behind a spring as stiff, the way being the angle; per unit area."""
    way = np.linspace(0.0, most, 4001)
    angle = np.concatenate([np.append(way, way[-2::-1]) for _ in range(count)])
    slider, force = 0.0, []
    for before, now in zip(np.append(0.0, angle[:-1]), angle, strict=True):
        slider = float(np.clip(slider + now - before, -share * now, share * now))
        force.append((1.0 - share) * now + slider)
    time = np.arange(len(angle), dtype=float)
    return {
        "frame_shear_angle_deg": angle, "displacement_mm": angle, "shear_force_n": np.array(force), "time_ms": time,
    }  # fmt: skip


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3, 0.6])
def test_a_law_with_friction_loses_what_its_closed_form_says(share):
    """Loss f s gamma^2 (1 - f) / (1 + f) of s gamma^2 / 2."""
    (one,) = cycles_of(loops(share, 1), 1)
    assert one.work == pytest.approx(200.0, rel=1e-3)
    assert one.loss == pytest.approx(share * 400.0 * (1.0 - share) / (1.0 + share), rel=2e-3, abs=0.2)
    assert one.share == pytest.approx(200.0 * share * (1.0 - share) / (1.0 + share), rel=2e-3, abs=0.1)


def test_the_force_is_gone_where_friction_holds_what_springs_back():
    """With f = 0.6: elastic 0.4 gamma, friction 12 - (20 - gamma) down to -0.6 gamma: gone at 8 / 1.4 deg."""
    (one,) = cycles_of(loops(0.6, 1), 1)
    assert one.residual == pytest.approx(8.0 / 1.4, abs=0.02)


def test_each_cycle_is_one_and_energies_say_what_rubs():
    curve = loops(0.3, 3)
    found = cycles_of(curve, 3)
    assert len(found) == 3 and found[2].loss == pytest.approx(found[0].loss, rel=0.01)
    assert found[0].end == found[1].begin == 8000.0
    energies = {"time_ms": curve["time_ms"], "friction_mj": np.linspace(0.0, 30.0, len(curve["time_ms"]))}
    results = cycle_results(curve, energies, 3)
    assert results["cycle_friction_share_pct"] == pytest.approx(100.0 * 10.0 / found[0].loss, rel=1e-3)
    assert results["last_cycle_loss_share_pct"] == pytest.approx(found[2].share)
    assert cycle_results(curve, energies, 0) == {}
    short = {name: values[:3000] for name, values in curve.items()}
    assert np.isnan(cycle_results(short, energies, 3)["cycle_loss_mj"])


def test_cycles_end_where_they_began_and_stand_alone():
    run = resolve(
        variant="1", scale="macro", preset="quick", test="picture-frame", sets=["rig.max_angle=20", "rig.cycles=2"]
    )
    assert run.rig.stops == [20.0, 0.0, 20.0, 0.0]
    once = resolve(variant="1", scale="macro", preset="quick", test="picture-frame", sets=["rig.max_angle=20"])
    assert run.solver.speed == pytest.approx(once.solver.speed / 5.0)
    rig = PictureFrameTest(run, np.zeros(0, np.int64), 100.0)
    assert np.interp(rig.duration, rig.shear.time, rig.shear.value) == 0.0  # at rest, as it began
    assert np.rad2deg(rig.angle(rig.duration)) == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(InputError, match=r"cannot be combined with cycles"):
        resolve(variant="1", test="picture-frame", sets=["rig.reversal_angles=[20, 5]", "rig.cycles=1"])


@pytest.mark.parametrize("preset", ["quick", "standard", "paper"])
def test_frames_of_yarns_go_through_cycles_at_a_sixth_of_their_speed(preset):
    """At 0.5 m/s the kinetic energy of variant 2 is 1.5 % of the work, at 1.0 m/s 15.7 %, which the gate refuses."""
    once, cycled = (
        resolve(variant="2", scale="meso", preset=preset, test="picture-frame", sets=sets).solver
        for sets in ((), ("rig.cycles=1", "rig.max_angle=20"))
    )
    assert cycled.speed == pytest.approx(0.5) and cycled.ramp == pytest.approx(6.0 * once.ramp)


SHORT = ("fabric.macro.shear.curve=null", "fabric.macro.shear.points=[[0, 0], [20, 0.01], [33.37, 0.03]]")


def frame(*sets: str, test: str = "picture-frame", **more: Any) -> Any:
    return resolve(test=test, variant="1", scale="macro", preset="quick", sets=[*SHORT, *sets], **more)


@pytest.mark.parametrize("test", ["picture-frame", "bias-extension"])
def test_a_run_without_an_end_takes_that_of_its_law(test: str) -> None:
    run, said = end_with_shear_law(frame(test=test))
    assert run.rig.max_angle == 33.3  # type: ignore[attr-defined]
    assert said == "rig.max_angle = 33.3 deg instead of the default 45 deg, because macro.shear ends there"
    prepare(run)


@pytest.mark.parametrize("stated", ["rig.max_angle=45", "rig.reversal_angles=[40, 10]"])
def test_a_stated_end_stays_and_is_refused(stated: str) -> None:
    run = frame(stated)
    assert end_with_shear_law(run) == (run, "")
    with pytest.raises(InputError, match=r"--set rig\.max_angle=33\.3"):
        prepare(run)


@pytest.mark.parametrize(
    ("sets", "more"),
    [
        ((SHORT[0], "fabric.macro.shear.points=[[0, 0], [0.04, 0.01], [0.05, 0.03]]"), {}),  # of no angle
        ((), {}),  # the shipped one, which has no end
        ((), {"test": "tensile", "direction": "warp"}),
        ((), {"scale": "meso"}),
    ],
)
def test_a_law_of_no_angle_or_none_at_all_leaves_the_run_as_it_is(sets: tuple[str, ...], more: dict[str, Any]) -> None:
    asked = {"test": "picture-frame", "variant": "1", "scale": "macro", "preset": "quick"} | more
    run = resolve(**asked, sets=list(sets))
    assert end_with_shear_law(run) == (run, "")


def rows(contact, work, n=START_ROWS + 1):
    return [{"contact_mj": contact, "external_mj": work} for _ in range(n)]


def test_contacts_that_bear_a_tenth_of_the_work_lock():
    assert is_locked(rows(1.01 * LOCKED, 1.0)) and not is_locked(rows(0.99 * LOCKED, 1.0))
    assert is_locked(rows(0.04, 1.0), 0.03) and not is_locked(rows(0.02, 1.0), 0.03)
    assert not is_locked(rows(1.0, 1.0, START_ROWS)), "the start has no work yet"
    assert not is_locked([*rows(0.05, 1.0), *rows(0.05, 0.1)]), "work that a frame gives back counts"


def test_the_angle_is_named():
    history = SimpleNamespace(curve={"frame_shear_angle_deg": np.array([0.0, 24.2])})
    (said,) = locking_warning(history, 45.0)
    assert "locks at 24.2 deg" in said and "before 45 deg" in said
    assert locking_warning(history, 24.5) == ()
