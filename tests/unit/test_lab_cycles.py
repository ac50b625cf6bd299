"""Import of cyclic picture frames: loops of a law with friction in closed form, and loops that are none."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from strip_reading import refused

from knittest.config.loading import resolve
from knittest.experiment.lab_table import ReadOptions
from knittest.experiment.tables import published_rows
from knittest.laboratory.picture_frame.lab_files import CYCLE_QUANTITIES, force_free_angle
from knittest.laboratory.picture_frame.lab_files import LAB as FRAME_LAB
from knittest.laboratory.report_base import REPORTS
from knittest.materials.trellis import crosshead, crosshead_force

FRAME, FABRIC, STIFFNESS = 200.0, 160.0, 0.1
SHARE, TURN = 0.6, 20.0
TOP = np.deg2rad(TURN)
#: of S = s gamma with a share of friction behind a spring as stiff as the law [mJ, mJ, deg]
WORK = 0.5 * STIFFNESS * TOP**2 * FABRIC**2
LOSS = SHARE * STIFFNESS * TOP**2 * (1.0 - SHARE) / (1.0 + SHARE) * FABRIC**2
GONE = TURN * (1.0 - SHARE) / (2.0 - SHARE)


def law(stops, share=SHARE, points=400):
    """Shear angle [rad] from stop to stop [deg] from 0 on, and S [N/mm] of a slider behind a spring."""
    ways = [np.linspace(a, b, points) for a, b in zip([0.0, *stops[:-1]], stops, strict=True)]
    angle = np.deg2rad(np.concatenate(ways))
    slider, force = 0.0, []
    for before, now in zip(np.append(0.0, angle[:-1]), angle, strict=True):
        slider = float(np.clip(slider + now - before, -share * now, share * now))
        force.append(STIFFNESS * ((1.0 - share) * now + slider))
    return angle, np.array(force)


#: file of a frame; ``noise`` is the sd over the largest force, ``mirrored`` lets friction push
HOW = {
    "stops": (TURN, 0.0), "noise": 0.0, "head": "Weg [mm];Kraft [N]", "travel": 1.0, "gain": 1.0, "preload": 0.0,
    "share": SHARE, "mirrored": False, "side": FRAME, "fabric": FABRIC,
}  # fmt: skip


def export(path, **how):
    """Write the file of a frame, described as by ``HOW``, to ``path``."""
    one = SimpleNamespace(**(HOW | how))
    angle, shear = law(one.stops, one.share)
    shear = 2.0 * STIFFNESS * (1.0 - one.share) * angle - shear if one.mirrored else shear
    force = crosshead_force(shear, angle, one.fabric, one.side)
    force = force + one.noise * force.max() * np.random.default_rng(3).standard_normal(len(force))
    way = [one.travel * crosshead(a, one.side) for a in angle]
    rows = [f"{d:.6f};{one.gain * f + one.preload:.7f}" for d, f in zip(way, force, strict=True)]
    lines = [f"Rahmenlänge;{one.side:g};mm", f"Gewebeseite: {one.fabric:g} mm", one.head, *rows]
    path.write_text("\n".join(lines).replace(".", ",") + "\n", encoding="utf-8")
    return path


def cycles(path, **given):
    (one,) = FRAME_LAB.read(path, ReadOptions(**given))
    return one.cycles


@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize(("side", "fabric"), [(FRAME, FABRIC), (50.0, 50.0)])
def test_a_loop_has_the_area_and_the_angle_of_its_closed_form(tmp_path, noise, side, fabric):
    (one,) = cycles(export(tmp_path / "a.csv", noise=noise, side=side, fabric=fabric))
    area = (fabric / FABRIC) ** 2
    assert one.work == pytest.approx(WORK * area, rel=2e-3 + 0.2 * noise)
    assert one.loss == pytest.approx(LOSS * area, rel=4e-3 + noise)
    assert one.share == pytest.approx(100.0 * LOSS / WORK, rel=4e-3 + noise)
    assert one.residual == pytest.approx(GONE, abs=0.03 + 10.0 * noise)


@pytest.mark.parametrize(("head", "gain", "travel"), [("Weg [cm];Kraft [cN]", 100.0, 0.1), ("Weg;Kraft", 1.0, 1.0)])
def test_units_of_both_columns_count(tmp_path, head, gain, travel):
    (one,) = cycles(export(tmp_path / "a.csv", head=head, gain=gain, travel=travel))
    assert (one.work, one.loss) == pytest.approx((WORK, LOSS), rel=4e-3)


def test_a_pull_counted_negative_turns_the_loop_round_and_not_its_loss(tmp_path):
    path = export(tmp_path / "a.csv", gain=-1.0)
    refused("but tension counts as positive; give --sign negative", cycles, path)
    assert cycles(path, sign="negative")[0].loss == pytest.approx(LOSS, rel=4e-3)


def test_a_preload_is_subtracted_on_both_ways(tmp_path):
    (one,) = cycles(export(tmp_path / "a.csv", preload=1.0), preload="subtract")
    assert (one.work, one.loss) == pytest.approx((WORK, LOSS), rel=4e-3)
    assert one.residual == pytest.approx(GONE, abs=0.03)


def test_the_number_of_cycles_is_found(tmp_path):
    found = cycles(export(tmp_path / "a.csv", stops=(TURN, 0.0) * 3, noise=0.01))
    assert len(found) == 3 and found[0].work == pytest.approx(WORK, rel=5e-3)
    assert found[2].share == pytest.approx(100.0 * LOSS / WORK, rel=0.05)
    assert len(cycles(export(tmp_path / "b.csv"), loading="first")) == 0
    assert len(cycles(export(tmp_path / "c.csv", stops=(TURN,)))) == 0


@pytest.mark.parametrize(
    ("stops", "said"),
    [
        ((TURN,), r"the frame does not return from 20 deg; expected unloading to 0 deg"),
        ((TURN, 5.0), r"cycle 1 returns to 5 deg, with -?[\d.]+ N; expected 0 deg"),
        ((TURN, 0.8), r"cycle 1 returns to 0\.8 deg"),
        ((TURN, -TURN), r"cycle 1 returns to -20 deg"),
        ((TURN, 0.0, TURN), r"loading 2 does not return from 20 deg"),
        ((TURN, 0.0, 12.0), r"loading 2 does not return from 12 deg"),
        ((TURN, 0.0, 1.2 * TURN, 0.0), r"cycle 2 turns at 24 deg, the first at 20 deg"),
        ((TURN, 15.0, TURN, 0.0), r"cycle 1 returns to 15 deg"),
    ],
)
def test_loops_that_are_none_of_a_run_are_refused_if_asked_for_and_said_otherwise(tmp_path, stops, said):
    mirrored = export(tmp_path / "b.csv", share=0.3, mirrored=True)
    words = r"cycle 1 takes [\d.]+ mJ and returns [\d.]+ mJ, expected less"
    refused(words, FRAME_LAB.read, mirrored, ReadOptions(loading="cycles"))
    path = export(tmp_path / "a.csv", stops=stops)
    refused(rf"a\.csv: specimen a: {said}", lambda: FRAME_LAB.read(path, ReadOptions(loading="cycles")))
    (one,) = FRAME_LAB.read(path, ReadOptions())
    assert not one.cycles and one.angle[-1] == pytest.approx(TURN, abs=0.01)
    told = next(line for line in FRAME_LAB.lines([one]) if line.startswith("a: up to"))
    assert ("first loading only; no cycle: " in told) == (len(stops) > 1)


def test_frames_of_one_series_have_the_same_cycles(tmp_path):
    one = FRAME_LAB.read(export(tmp_path / "a.csv"), ReadOptions())[0]
    for stops, said in (
        ((TURN,), r"b\.csv: specimen b: 0 cycles, specimen a has 1: use --loading first"),
        ((TURN, 5.0), r"specimen b: 0 cycles \(.*returns to 5 deg.*\), specimen a has 1"),
        ((TURN, 0.0) * 2, r"specimen b: 2 cycles, specimen a has 1"),
        ((21.0, 0.0), r"specimen b: cycles turn at 21 deg, those of specimen a at 20 deg"),
    ):
        other = FRAME_LAB.read(export(tmp_path / "b.csv", stops=stops, noise=0.01), ReadOptions())
        refused(said, FRAME_LAB.results, [one, *other], "", [])


def test_work_is_that_of_the_mean_square_of_a_series(tmp_path):
    files = [export(tmp_path / f"{side:g}.csv", fabric=side) for side in (160.0, 156.0)]
    rows = FRAME_LAB.results([FRAME_LAB.read(path, ReadOptions())[0] for path in files], "", []).found
    assert rows["cycle_work_mj"] == pytest.approx([WORK * (158.0 / FABRIC) ** 2] * 2, rel=3e-3)
    assert rows["cycle_loss_mj"] == pytest.approx([LOSS * (158.0 / FABRIC) ** 2] * 2, rel=4e-3)


def test_a_force_that_stays_has_no_angle(tmp_path):
    one = FRAME_LAB.read(export(tmp_path / "a.csv", stops=(TURN, 0.4)), ReadOptions(loading="cycles"))[0]
    assert one.cycles[0].residual == pytest.approx(GONE, abs=0.03)
    assert np.isnan(force_free_angle(np.array([20.0, 10.0, 0.0]), np.array([3.0, 2.0, 1.0])))
    assert force_free_angle(np.array([20.0, 10.0, 0.0]), np.array([3.0, 1.0, -1.0])) == pytest.approx(5.0)
    assert force_free_angle(np.array([20.0, 10.0]), np.array([-1.0, -2.0])) == 20.0


def written(tmp_path, **how):
    """Experiment of two frames whose stiffness differs by 20 %."""
    frames = [
        FRAME_LAB.read(export(tmp_path / f"{k}.csv", gain=g, **how), ReadOptions())[0] for k, g in enumerate((0.9, 1.1))
    ]
    FRAME_LAB.write(frames, tmp_path / "mine", "", ["0.csv", "1.csv"])
    return published_rows(tmp_path / "mine", "mine", "", CYCLE_QUANTITIES)


def frame(*sets, side=FABRIC):
    return resolve(
        test="picture-frame", variant="1", scale="macro", sets=[f"rig.side={side}", "rig.frame_side=200", *sets]
    )


def test_cycles_are_rows_with_mean_and_sd_for_the_square_of_the_run(tmp_path):
    rows = written(tmp_path, stops=(TURN, 0.0) * 2)
    work, loss, share, residual, last = rows
    assert [row.unit for row in rows] == ["mJ", "mJ", "%", "deg", "%"] and work.n == 2
    assert (work.mean, loss.mean) == pytest.approx((WORK, LOSS), rel=4e-3)
    assert work.sd == pytest.approx(0.1 * np.sqrt(2.0) * WORK, rel=4e-3) and share.sd == pytest.approx(0.0, abs=1e-3)
    assert residual.mean == pytest.approx(GONE, abs=0.03) and last.mean > 0.0
    assert (work.conditions.cycles, work.conditions.cycle_angle_deg) == (2.0, pytest.approx(TURN, abs=0.01))
    report = REPORTS["picture-frame"]
    small = frame("rig.cycles=2", f"rig.max_angle={TURN}", side=80.0)
    found = report.scaled(small, rows)
    assert not report.apart(small, rows) and len(found) == 5
    assert found[0].mean == pytest.approx(0.25 * work.mean) and found[1].sd == pytest.approx(0.25 * loss.sd)
    assert "for a square of 80 instead of 160 mm" in found[0].table and found[2].mean == share.mean
    statistics = json.loads((tmp_path / "mine" / "picture-frame" / "statistics.json").read_text())
    assert statistics["conditions"]["cycles"] == 2.0


def test_cycles_up_to_another_angle_are_not_compared_and_it_is_said(tmp_path):
    rows, report = written(tmp_path, stops=(TURN, 0.0) * 2), REPORTS["picture-frame"]
    other = frame("rig.cycles=2", "rig.max_angle=25")
    assert report.scaled(other, rows) == []
    (told,) = report.apart(other, rows)
    assert "not compared: cycle_work_mj, cycle_loss_mj" in told and "cycles up to 20 deg, in the run up to 25" in told
    assert "--set rig.max_angle=20" in told
    three = frame("rig.cycles=3", f"rig.max_angle={TURN}")
    assert [row.quantity for row in report.scaled(three, rows)] == list(CYCLE_QUANTITIES[:4])
    assert "the last of 2 cycles, the run has 3: compare with --set rig.cycles=2" in report.apart(three, rows)[0]
    once = frame("rig.cycles=1", f"rig.max_angle={TURN}")
    assert not report.apart(once, rows) and "the first of 2" in report.scaled(once, rows)[0].table
    assert not report.apart(frame(), rows)  # no cycle in it: nothing to compare
