"""Time histories of OpenRadioss as text: records as its engine writes them, and the curves of strips and frames."""

import numpy as np
import pytest
from deck_reader import BEAM, SHELL
from radioss_reader import history_text

from knittest.base.errors import InputError
from knittest.config.loading import resolve_test_runs
from knittest.experiment.time_history import is_time_history, read_time_history
from knittest.laboratory.picture_frame.rig import PictureFrameTest
from knittest.laboratory.reactions import reactions_of
from knittest.laboratory.reference_curves import own_curves
from knittest.materials.trellis import NORMALISED, normalised_force

CODES = [1, 2, 620, 621]
TIME = np.linspace(0.0, 10.0, 41)


def _write(path, moved, impulse, before=(), **options):
    values = np.concatenate([moved, impulse], axis=2)
    group = (0, CODES, range(7, 7 + values.shape[1]), values)
    path.write_text(history_text(TIME, [*before, group], **options), encoding="ascii")
    return path


def _run(kind, direction=None, sets=(), **chosen):
    (run,) = resolve_test_runs(kind, direction, {"config": None, "sets": tuple(sets), **chosen})
    return run


def _strip(share=1.0, sign=1.0):
    """Three nodes that are pulled along y with a force of 20 t + 3 t^2 [N]; the impulse is its integral."""
    moved = np.zeros((len(TIME), 3, 2))
    moved[:, :, 1] = 0.01 * TIME[:, None] * share
    impulse = np.zeros_like(moved)
    impulse[:, :, 1] = sign * ((10.0 * TIME**2 + TIME**3) * 1.0)[:, None] * np.array([0.5, 0.3, 0.2])
    return moved, impulse


@pytest.mark.parametrize("version", [3040, 3041, 3050, 4021])
def test_it_is_read_back_whatever_comes_before(tmp_path, version):
    """Groups of beams, and nodes with other variables behind them, are passed over."""
    beams = (5, [1, 2, 3], [1, 2], np.full((len(TIME), 2, 3), 1e-120))
    moved, impulse = _strip()
    moved[:, 0, 0] = 3e-101  # an exponent of three digits
    path = _write(tmp_path / "T01", moved, impulse, [beams], version=version, parts=4, subsets=2)
    found = read_time_history(path)
    assert is_time_history(path) and np.allclose(found.time, TIME, atol=1e-8)
    assert found.displacement[5, 0, 0] == pytest.approx(3e-101, rel=1e-7, abs=0.0)
    assert np.allclose(found.displacement, moved, atol=1e-9) and np.allclose(found.impulse, impulse, rtol=1e-7)


def test_what_an_interrupted_run_has_left_is_read(tmp_path):
    path = _write(tmp_path / "T01", *_strip())
    lines = path.read_text(encoding="ascii").splitlines()
    path.write_text("\n".join(lines[:-2]) + "\n", encoding="ascii")
    assert len(read_time_history(path).time) == len(TIME) - 1
    path.write_text("\n".join(lines[:-6]) + "\n", encoding="ascii")
    assert len(read_time_history(path).time) == len(TIME) - 1


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_force_is_the_derivative_of_the_impulse(tmp_path, sign):
    found = reactions_of(read_time_history(_write(tmp_path / "T01", *_strip(sign=sign))))
    expected = 20.0 * found.time + 3.0 * found.time**2 + 0.25 * 0.25**2  # mean over a step of 0.25 ms
    assert np.abs(found.force[:, 1] - expected).max() < 1e-4 and np.abs(found.force[:, 0]).max() == 0.0
    assert found.work == pytest.approx(expected * 0.01 * 0.25, rel=2e-3, abs=1e-5)


@pytest.mark.parametrize("direction", ["warp", "weft"])
def test_a_strip_of_shells_has_a_curve(tmp_path, direction):
    run = _run("tensile", direction, ["rig.width=30", "rig.gauge_length=50"], **SHELL)
    (curve,) = own_curves(run, [_write(tmp_path / "strip-T01", *_strip())])
    assert (curve.kind, curve.source, curve.x_name) == ("simulated", "OpenRadioss, strip-T01", "strain_pct")
    time = 0.5 * (TIME[1:] + TIME[:-1])
    assert curve.x == pytest.approx(100.0 * 0.01 * time / 50.0) and curve.conditions.strip_width_mm == 30.0
    assert np.abs(curve.mean - (20.0 * time + 3.0 * time**2)).max() < 0.02


def test_a_strip_of_yarns_has_the_strain_of_its_whole_pitches(tmp_path):
    run = _run("tensile", "weft", ["rig.width=12", "rig.gauge_length=12"], **BEAM)
    moved, impulse = _strip()
    (curve,) = own_curves(run, [_write(tmp_path / "T01", moved[:, :, ::-1], impulse[:, :, ::-1])])
    pitch = run.fabric.wale_spacing
    gauge = round(12.0 / pitch) * pitch
    assert curve.x[-1] == pytest.approx(100.0 * 0.01 * 0.5 * (TIME[-1] + TIME[-2]) / gauge)


def _frame(run, speed=1.0):
    """Needles at four places that move with the frame of ``run``; forces make its force 4 N + 2 N per radian."""
    rig = PictureFrameTest(run, np.zeros(0, np.int64), run.rig.side_mm**2)
    time = np.linspace(0.0, rig.duration, 101)
    at = np.minimum(time * speed, rig.duration)
    p, q = np.array([rig.stretches(t) for t in at]).T * (1.0 - np.interp(at, rig.close.time, rig.close.value))
    place = np.array([[20.0, 5.0], [-20.0, 5.0], [5.0, -30.0], [0.0, 30.0]])
    moved = np.stack([np.outer(q - 1.0, place[:, 0]), np.outer(p - 1.0, place[:, 1])], axis=2)
    angle = np.array([rig.angle(t) for t in at])
    travel = np.sqrt(2.0) * rig.side * (np.cos(0.5 * angle) + np.sin(0.5 * angle) - 1.0)
    step = np.diff(time)
    middle = 0.5 * (angle[1:] + angle[:-1])
    work = (4.0 + 2.0 * middle) * np.diff(travel)
    pulled = np.diff(moved[:, 3, 1])
    force = np.divide(work, pulled, out=np.zeros_like(work), where=np.abs(pulled) > 1e-12)  # on one needle alone
    impulse = np.zeros_like(moved)
    impulse[1:, 3, 1] = np.cumsum(force * step)
    return time, moved, impulse, np.degrees(middle)


@pytest.mark.parametrize("slack", [0.0, 0.4])
def test_a_frame_has_the_force_of_all_its_needles(tmp_path, slack):
    run = _run("picture-frame", None, ["rig.side=60", f"rig.mounting_slack={slack}"], **SHELL)
    time, moved, impulse, angle = _frame(run)
    values = np.concatenate([moved, impulse], axis=2)
    path = tmp_path / "T01"
    path.write_text(history_text(time, [(0, CODES, [1, 2, 3, 4], values)]), encoding="ascii")
    (curve,) = own_curves(run, [path])
    late = curve.x > 5.0
    expected = normalised_force(4.0 + 2.0 * np.deg2rad(curve.x[late]), np.deg2rad(curve.x[late]), 60.0, 60.0)
    assert curve.y_name == NORMALISED and curve.mean[late] == pytest.approx(expected, rel=1e-4)
    assert curve.x[-1] == pytest.approx(angle[-1], abs=0.05)


def test_a_frame_of_another_speed_is_rejected(tmp_path):
    run = _run("picture-frame", None, ["rig.side=60"], **SHELL)
    time, moved, impulse, _ = _frame(run, speed=1.1)
    path = tmp_path / "T01"
    values = np.concatenate([moved, impulse], axis=2)
    path.write_text(history_text(time, [(0, CODES, [1, 2, 3, 4], values)]), encoding="ascii")
    with pytest.raises(InputError, match=r"move otherwise than those of the run; .*solver.speed"):
        own_curves(run, [path])


def test_files_without_what_is_needed_are_rejected(tmp_path):
    moved, impulse = _strip()
    path = tmp_path / "T01"
    run = _run("tensile", "warp", ["rig.width=30"], **SHELL)
    for groups, text in [
        ([(0, [1, 2, 620], [1], np.zeros((len(TIME), 1, 3)))], r"/TH/NODE has no REACY; expected DX, DY, REACX, REACY"),
        ([(5, [1], [1], np.zeros((len(TIME), 1, 1)))], r"no group of nodes; expected /TH/NODE"),
        ([(0, CODES, [1], np.full((len(TIME), 1, 4), np.nan))], r"not finite: the run has failed"),
    ]:
        path.write_text(history_text(TIME, groups), encoding="ascii")
        with pytest.raises(InputError, match=text):
            own_curves(run, [path])
    path.write_text(history_text(TIME[:2], [(0, CODES, [1], np.zeros((2, 1, 4)))]), encoding="ascii")
    with pytest.raises(InputError, match="2 times; at least three"):
        own_curves(run, [path])
    path.write_bytes(b"\x00\x00\x00\x54" + bytes(200))
    with pytest.raises(InputError, match=r"binary time history .*/TFILE/3"):
        own_curves(run, [path])
    _write(path, moved, impulse)
    path.write_text("\n".join(path.read_text(encoding="ascii").splitlines()[:9]), encoding="ascii")
    with pytest.raises(InputError, match="not a time history as OpenRadioss writes it"):
        own_curves(run, [path])
    with pytest.raises(InputError, match=r"cantilever has no such deck, only tensile, picture-frame have"):
        own_curves(_run("cantilever", "warp", **SHELL), [_write(path, moved, impulse)])
