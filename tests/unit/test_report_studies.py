"""Studies that a page shows beside a run: the shipped studies of speed and of yarn-yarn friction."""

from pathlib import Path

import numpy as np
import pytest
from html_page import HtmlPage
from report_sample import write_run

from knittest.experiment import tables
from knittest.experiment.tables import friction_curves
from knittest.materials.trellis import crosshead_of_normalised, normalised_force
from knittest.report_page.page import write_report

SPEED = """# kind: simulated
test,scale,variant,direction,preset,setting,unit,value,quantity,result,result_half
friction,macro,1,warp,quick,solver.speed,m/s,1,pull_force_kinetic_n,300,290
friction,macro,1,warp,quick,solver.speed,m/s,1,mu_paper,0.15,0.1501
"""


@pytest.fixture
def shipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Made-up studies: a frame of yarns of 0.01 N/mm times ten times the coefficient, at all angles."""
    folder = tmp_path / "data" / "simulated"
    folder.mkdir(parents=True)
    (folder / "speed-study.csv").write_text(SPEED)
    rows = [f"1,{mu},{angle},{0.1 * mu}" for mu in (0.1, 0.5) for angle in (1, 39, 41)]
    head = "variant,friction_coefficient,frame_shear_angle_deg,normalised_shear_force_n_per_mm"
    (folder / "yarn-friction.csv").write_text("\n".join([head, *rows]) + "\n")
    (folder / "shear-bands.csv").write_text("fabric,shear_angle_deg,p5,p50,p95,count,points\nmine,10,1,2,3,30,32\n")
    monkeypatch.setattr(tables, "data_dir", lambda: folder.parent)


def test_the_change_at_half_speed_is_shown_and_what_moves_is_marked(tmp_path: Path, shipped: None) -> None:
    page = HtmlPage(write_report(write_run(tmp_path / "r", "friction")))
    ((caption, rows),) = page.tables(page.section("run-1-studies")).items()
    assert "solver.speed halved from 1 m/s" in caption and "not this run" in caption
    assert rows[1] == ["pull force, kinetic [N]", "300.0", "290.0", "-3.33 % above 2 %"]
    assert rows[2][-1] == "+0.07 %"


def test_a_test_without_a_study_says_how_to_make_one(tmp_path: Path, shipped: None) -> None:
    page = HtmlPage(write_report(write_run(tmp_path / "r", "picture-frame")))
    section = page.section("run-1-studies")
    assert not page.tables(section)
    assert "knittest check picture-frame --convergence" in "".join(section.itertext())


def test_a_frame_of_yarns_stands_beside_other_friction_in_its_own_size(tmp_path: Path, shipped: None) -> None:
    """Normalised force times L^2 / L_frame: 100 mm take twice the force of 50 mm."""
    found = {}
    for side in ("50", "100"):
        sets = (f"rig.side={side}", "fabric.contact.friction_coefficient=0.2")
        run = write_run(tmp_path / side, "picture-frame", scale="meso", sets=sets)
        page = HtmlPage(write_report(run))
        ((caption, found[side]),) = page.tables(page.section("run-1-studies")).items()
        assert "shipped sweep" in caption
    _, low, high, own = found["50"]
    assert own[0] == "this run, 0.2 (user)" and own[1] == "2.70" and own[2] == "-"
    assert low[0] == "sweep, 0.1" and float(high[1]) == pytest.approx(5.0 * float(low[1]), abs=0.05)
    force = crosshead_of_normalised(0.05, np.deg2rad(10.0), 50.0, 50.0)
    assert high[1] == f"{force:.2f}" and high[4] != "-"
    assert found["100"][2][1] == f"{2.0 * force:.2f}"


def test_the_shipped_sweep_rises_with_friction() -> None:
    for variant in ("pham2019-v1", "pham2019-v2"):
        curves = friction_curves(variant)
        assert [curve.coefficient for curve in curves] == [0.1, 0.3, 0.5]
        at_20 = [np.interp(20.0, curve.angle, curve.force) for curve in curves]
        assert at_20 == sorted(at_20) and at_20[0] > 0.0
    assert friction_curves("cao2008-weave") == []


def test_normalised_force_and_crosshead_force_are_inverse() -> None:
    angle = np.deg2rad([5.0, 40.0])
    force = crosshead_of_normalised(np.array([0.01, 0.2]), angle, 140.0, 216.0)
    assert normalised_force(force, angle, 140.0, 216.0) == pytest.approx([0.01, 0.2])
