"""A fabric of which one direction was tested: what runs of the other one take over is said, and assumed."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from export_sample import cost, quality, strip
from report_sample import write_run
from test_lab_friction import friction_file

from knittest.base.errors import InputError
from knittest.base.history import History, Specimen
from knittest.base.result_rows import assumed_inputs as inputs_told
from knittest.base.result_rows import result_rows
from knittest.cli.main import run
from knittest.config.loading import resolve
from knittest.experiment.lab_table import Given
from knittest.experiment.origin import assumed_inputs, row_kind
from knittest.laboratory.cantilever.lab_files import LAB as CANTILEVER
from knittest.laboratory.cantilever.test import given_overhang
from knittest.laboratory.friction.lab_files import LAB as FRICTION
from knittest.laboratory.report_base import completed, run_stamp
from knittest.report_page.loading import load_run
from knittest.report_page.results import results as results_of
from knittest.runs.preflight.model import rig_lines
from knittest.runs.preflight.of_tests import test_counterparts as of_tests
from knittest.runs.writing import judge, references_of

OUT = Path("data/mine")
TAKEN = "rig.static_coefficient and rig.kinetic_coefficient (as weft, the only direction tested)"


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """A fabric whose weft alone was pulled between plates, and whose warp alone was bent; resolves its runs."""
    monkeypatch.chdir(tmp_path)
    path = friction_file(tmp_path / "friction.csv", 180.0, 220.0, head="Normalkraft;1000;N\nPlattenlänge;100;mm\n"
                         "Plattenbreite;40;mm\n")  # fmt: skip
    FRICTION.write(FRICTION.read(path, Given()), OUT, "weft", [path.name])
    bent = tmp_path / "bent.csv"
    bent.write_text("overhang [mm]\n164\n168\n")
    sizes = Given(sizes={"area_mass_g_m2": 800.0, "strip_width_mm": 25.0})
    CANTILEVER.write(CANTILEVER.read(bent, sizes), OUT, "warp", [bent.name])
    assert run(["new", "mine", "--from", str(OUT)]) == 0
    return lambda test, **asked: resolve(**({"variant": "mine", "scale": "macro", "test": test} | asked))


def judged(one):
    """Summary of a run that found F_R/F_N and a force."""
    results = {"mu_paper": 0.18, "pull_force_kinetic_n": 180.0, "normal_force_error_pct": 0.1}
    columns = {name: np.linspace(0.0, 1.0, 9) for name in ("displacement_mm", "pull_force_n")}
    specimen = Specimen(History(strip(2, 2)[0], columns, {}, []), results, quality(), cost(), {})
    return judge(one, [specimen], references_of(one, ())).summary


def test_friction_of_the_untested_direction_is_assumed_where_it_is_shown(mine, tmp_path):
    warp, weft = (mine("friction", direction=d) for d in ("warp", "weft"))
    assert warp.rig.kinetic_coefficient == weft.rig.kinetic_coefficient == pytest.approx(0.09, rel=1e-3)
    assert (warp.rig.normal_force, warp.rig.plate_length) == (1000.0, 100.0)  # under the same conditions
    assert assumed_inputs(weft) == () and row_kind(weft, "mu_paper") == "input"
    assert assumed_inputs(warp) == (TAKEN,) and row_kind(warp, "mu_paper") == "assumed"
    summary = judged(warp)
    rows = {row.quantity: row for row in result_rows(summary, refused=False)}
    assert (rows["mu_paper"].kind, rows["mu_paper"].verdict) == ("assumed", "no reference")
    assert rows["normal_force_error_pct"].kind == "-" and inputs_told(summary, list(rows.values())) == [TAKEN]
    assert (summary["assumed"], summary["kinds"]["pull_force_kinetic_n"]) == ([TAKEN], "assumed")
    assert TAKEN in run_stamp(warp, ()).verdict and "assumed" not in run_stamp(weft, ()).verdict
    assert judged(weft)["kinds"] == {} and judged(weft)["assumed"] == []
    # what a user says is his own
    own = mine("friction", direction="warp", sets=["rig.kinetic_coefficient=0.1", "rig.static_coefficient=0.2"])
    assert assumed_inputs(own) == () and row_kind(own, "mu_paper") == "input"
    half = mine("friction", direction="warp", sets=["rig.kinetic_coefficient=0.1"])
    assert assumed_inputs(half) == ("rig.static_coefficient (as weft, the only direction tested)",)


def test_tools_of_forming_know_where_their_friction_is_from(mine):
    forming = mine("forming")
    assert forming.rig.kinetic_coefficient == pytest.approx(0.09, rel=1e-3)
    assert TAKEN in assumed_inputs(forming) and TAKEN in run_stamp(forming, ()).verdict
    summary = {"results": {"draw_in_max_mm": 1.0}, "comparison": [], "assumed": list(assumed_inputs(forming))}
    assert TAKEN in inputs_told(summary, result_rows(summary, refused=False))
    path = friction_file(Path("other.csv"), 220.0, 220.0, head="Normalkraft;1000;N\nPlattenlänge;100;mm\n"
                         "Plattenbreite;40;mm\n")  # fmt: skip
    FRICTION.write(FRICTION.read(path, Given()), OUT, "warp", [path.name])
    assert run(["new", "both", "--from", str(OUT)]) == 0
    both = mine("forming", variant="both")
    assert both.rig.kinetic_coefficient == pytest.approx(0.1, rel=1e-3)
    assert not any("coefficient" in told for told in assumed_inputs(both))


def test_forming_of_a_fabric_without_friction_says_whose_it_has(mine):
    assert run(["new", "bare"]) == 0
    told = assumed_inputs(mine("forming", variant="bare"))
    assert "rig.static_coefficient and rig.kinetic_coefficient (default, measured on the fabrics of pham2019)" in told
    assert not any("coefficient" in one for one in assumed_inputs(resolve(variant="1", test="forming")))


def test_fields_that_one_direction_lacks_are_the_others_and_a_tool_has_one(mine):
    file = Path("configs/mine.yaml")
    rigs = {"friction": {"warp": {"normal_force": 700.0}, "weft": {"kinetic_coefficient": 0.05}, "plate_width": 90.0}}
    file.write_text(yaml.safe_dump(yaml.safe_load(file.read_text()) | {"rigs": rigs}))
    warp = mine("friction", direction="warp")
    assert (warp.rig.normal_force, warp.rig.kinetic_coefficient, warp.rig.plate_width) == (700.0, 0.05, 90.0)
    assert row_kind(warp, "mu_paper") == "assumed"  # not an input: nobody measured it along the warp
    rigs = {"forming": {d: {"static_coefficient": 0.2, "kinetic_coefficient": 0.2} for d in ("warp", "weft")}}
    file.write_text(yaml.safe_dump(yaml.safe_load(file.read_text()) | {"rigs": rigs}))
    with pytest.raises(InputError, match=r"mine\.yaml:\d+: fabric\.rigs\.forming: .*no direction: .*mean"):
        mine("forming")


def test_check_lists_the_rigs_and_judges_their_friction(mine):
    fabric = mine("friction").fabric
    lines = {line.strip().partition(":")[0]: line for line in rig_lines(fabric)}
    assert "kinetic_coefficient 0.09" in lines["friction weft"] and "assumed" not in lines["friction weft"]
    assert "normal_force 1000 N" in lines["friction weft"] and "travel" not in lines["friction weft"]
    for name in ("friction warp", "forming"):
        assert lines[name].endswith("; assumed: as weft, the only direction tested")
    rows = {row.name: row for row in of_tests(fabric) if "coefficient" in row.name}
    weft, warp = rows["weft kinetic coefficient"], rows["warp kinetic coefficient"]
    assert (weft.verdict, weft.source, weft.found) == ("agrees", "stated", pytest.approx(0.09, rel=1e-3))
    assert (warp.verdict, warp.source) == ("no counterpart", "assumed")
    assert rig_lines(resolve(variant="1").fabric) == []
    file = Path("configs/mine.yaml")
    file.write_text(file.read_text().replace('"kinetic_coefficient": 0.09', '"kinetic_coefficient": 0.08'))
    assert {r.name: r.verdict for r in of_tests(mine("friction").fabric)}["weft kinetic coefficient"] == "differs"


def test_bending_of_the_untested_direction_is_that_of_the_other_and_assumed(mine):
    weft = mine("cantilever", direction="weft", sets=["rig.overhang=166"])
    bending = weft.fabric.macro.bending_stiffness
    assert bending.weft.value == bending.warp.value and (bending.warp.source, bending.weft.source) == (
        "derived", "assumed",
    )  # fmt: skip
    assert bending.weft.ref.startswith("as warp")
    assert "macro.bending_stiffness.weft" not in Path("configs/mine.yaml").read_text()  # not among the imported
    assert row_kind(weft, "bending_stiffness_eq2_n_mm_per_width") == "assumed"
    assert assumed_inputs(weft) == ("macro.bending_stiffness.weft",)
    (found,) = completed([mine("cantilever", direction="weft")], quiet=True)
    assert given_overhang(found) == 166.0


def test_the_page_says_it_too(mine, tmp_path):
    folder = write_run(tmp_path / "r", "friction", variant="mine", direction="warp")
    assert any(TAKEN in str(block) for block in results_of(load_run(folder)).blocks)


def test_a_command_for_both_directions_is_refused_before_the_first_has_run(mine, capsys):
    out = Path("runs/bent")
    bent = ["cantilever", "--variant", "mine", "--scale", "macro", "--preset", "quick", "--set", "rig.length=160"]
    assert run([*bent, "--out", str(out)]) == 2
    assert "rig.overhang = 166 mm: longer than the strip" in capsys.readouterr().err and not out.exists()
    wide = ["friction", "--variant", "mine", "--scale", "macro", "--preset", "quick", "--set", "rig.width=60"]
    assert run([*wide, "--out", str(out)]) == 2
    assert "smaller than the strip" in capsys.readouterr().err and not out.exists()
