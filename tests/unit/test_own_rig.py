"""Runs of a fabric take rig and friction from its own tests; what is taken over from the other direction is assumed."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from export_sample import cost, quality, strip
from homogenise_cases import with_shipped_card
from report_sample import write_run
from test_lab_frame import frame_file
from test_lab_friction import friction_file

from knittest.base.errors import InputError
from knittest.base.history import History, Specimen
from knittest.base.result_rows import assumed_inputs as inputs_told
from knittest.base.result_rows import result_rows
from knittest.cli.main import run
from knittest.config.loading import resolve
from knittest.config.yaml_writer import dump
from knittest.experiment.lab_table import ReadOptions
from knittest.experiment.origin import assumed_inputs, row_kind
from knittest.laboratory.cantilever.lab_files import LAB as CANTILEVER
from knittest.laboratory.cantilever.test import given_overhang
from knittest.laboratory.friction.lab_files import LAB as FRICTION
from knittest.laboratory.picture_frame.lab_files import LAB as FRAME_LAB
from knittest.laboratory.picture_frame.report import NORMALISED_LABEL
from knittest.laboratory.reference_curves import own_curves
from knittest.laboratory.report_base import TESTS, run_stamp, scatter_bands, with_estimates
from knittest.materials.trellis import NORMALISED, crosshead_force
from knittest.report_page.curves import curve_section as page_curve
from knittest.report_page.loaded_run import load_run
from knittest.runs.preflight.measured_counterparts import test_counterparts as of_tests
from knittest.runs.preflight.model import rig_lines
from knittest.runs.run_files import compare_run, references_of

OUT = Path("data/mine")


@pytest.fixture
def place(tmp_path, monkeypatch):
    """An empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def rubbed(place, direction, mu, static=None, head="Normalkraft;500;N\nPlattenlänge;300;mm\nPlattenbreite;40;mm\n"):
    """Import a pull of two faces at 500 N, whose coefficients of a face are ``mu`` and ``static``."""
    top = mu if static is None else static
    path = friction_file(place / f"friction-{direction}.csv", 1000.0 * mu, 1000.0 * top, head=head)
    FRICTION.write(FRICTION.read(path, ReadOptions()), OUT, direction, [path.name])


def sheared(place, end=36.04, side=200.0, fabric=170.0):
    path = frame_file(place / "frame.csv", side, fabric, end)
    FRAME_LAB.write(FRAME_LAB.read(path, ReadOptions()), OUT, "", [path.name])


def mine(test, **asked):
    return resolve(**({"variant": "mine", "scale": "macro", "test": test} | asked))


def test_friction_and_forming_take_the_measured_coefficient(place):
    rubbed(place, "warp", 0.2, 0.23)
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    for direction in ("warp", "weft"):  # one direction was tested: the other is assumed to be like it
        rig = mine("friction", direction=direction).rig
        assert (rig.static_coefficient, rig.kinetic_coefficient) == pytest.approx((0.23, 0.2), rel=1e-3)
        assert (rig.normal_force, rig.plate_length, rig.plate_width) == (500.0, 300.0, 40.0)
    forming = mine("forming").rig
    assert (forming.static_coefficient, forming.kinetic_coefficient) == pytest.approx((0.23, 0.2), rel=1e-3)
    found = mine("friction", direction="warp")
    TESTS["friction"].prepare(with_shipped_card(found))  # the strip fits the plates, and sticks out of them
    assert row_kind(found, "mu_paper") == "input" and assumed_inputs(found) == ()
    assert "#   rigs.friction\n#   rigs.forming\n" in Path("configs/mine.yaml").read_text()


def test_each_direction_has_its_own_friction_and_tools_the_mean(place):
    rubbed(place, "warp", 0.2)
    rubbed(place, "weft", 0.3, 0.34)
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    found = {d: mine("friction", direction=d).rig.kinetic_coefficient for d in ("warp", "weft")}
    assert found == pytest.approx({"warp": 0.2, "weft": 0.3}, rel=1e-3)
    forming = mine("forming").rig
    assert (forming.kinetic_coefficient, forming.static_coefficient) == pytest.approx((0.25, 0.27), rel=1e-3)


def test_what_a_user_says_goes_over_the_fabric_and_a_repeat_keeps_it(place):
    rubbed(place, "warp", 0.2)
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    sets = ["rig.kinetic_coefficient=0.1", "rig.static_coefficient=0.15"]
    found = mine("friction", sets=sets)
    assert (found.rig.kinetic_coefficient, found.rig.static_coefficient) == (0.1, 0.15)
    Path("whole.yaml").write_text(dump(found))
    assert resolve(config="whole.yaml") == found
    with pytest.raises(
        InputError,
        match=r"static_coefficient = 0\.2: must be at least .* --set rig\.static_coefficient=0\.3",
    ):
        mine("friction", sets=["rig.kinetic_coefficient=0.3"])
    with pytest.raises(InputError, match=r"fabric\.rigs\.friction\.kinetic_coefficient: .* --set rig\.kinetic_coeffi"):
        mine("friction", sets=["fabric.rigs.friction.kinetic_coefficient=0.3"])


def test_a_frame_is_that_of_the_import_and_ends_with_it(place):
    sheared(place)
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    rig = mine("picture-frame").rig
    assert (rig.side, rig.frame_side, rig.max_angle) == (170.0, 200.0, 36.0)
    TESTS["picture-frame"].prepare(with_shipped_card(mine("picture-frame")))
    alone = mine("picture-frame", sets=["rig.side=100"]).rig  # a square of one's own has a frame of its own
    assert (alone.side, alone.frame_side, alone.max_angle) == (100.0, None, 36.0)
    yarns = mine("picture-frame", scale="meso", preset="quick").rig  # the preset's small square
    assert (yarns.side, yarns.frame_side, yarns.max_angle) == (50.0, None, 36.0)
    words = r"rig\.max_angle = 45 deg: .* ends at 36\.\d+ deg; .*--set rig\.max_angle=36,"
    with pytest.raises(InputError, match=words):
        TESTS["picture-frame"].prepare(with_shipped_card(mine("picture-frame", sets=["rig.max_angle=45"])))


@pytest.mark.parametrize(
    ("rigs", "phrase"),
    [
        ({"friction": {"kinetic": 0.2}}, r"configs/mine\.yaml:\d+: rig\.kinetic: unknown field"),
        ({"friction": {"kinetic_coefficient": 3.0}}, r"configs/mine\.yaml:\d+: rig\.kinetic_coefficient = 3\.0: must"),
        ({"friction": {"kinetic_coefficient": "0,2"}}, r"configs/mine\.yaml:\d+: .*kinetic_coefficient.*: .*number"),
        ({"friction": {"warp": 0.3}}, r"configs/mine\.yaml:\d+: rig\.warp: unknown field"),
        ({"rubbing": {}}, r"configs/mine\.yaml:\d+: fabric\.rigs\.rubbing: unknown field"),
    ],
)
def test_what_no_rig_has_is_refused_with_its_line(place, rigs, phrase):
    assert run(["new", "mine"]) == 0
    path = Path("configs/mine.yaml")
    assert mine("friction").fabric.rigs == {}
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | {"rigs": rigs}))
    with pytest.raises(InputError, match=phrase):
        mine("friction")


def test_what_is_said_of_one_direction_is_assumed_for_the_other(place):
    assert run(["new", "mine"]) == 0
    path, own = Path("configs/mine.yaml"), {"static_coefficient": 0.2, "kinetic_coefficient": 0.2}
    rigs = {"friction": {"warp": own, "plate_width": 60.0}, "forming": {"weft": dict(own)}}
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | {"rigs": rigs}))
    warp, weft = (mine("friction", direction=d) for d in ("warp", "weft"))
    assert (warp.rig.kinetic_coefficient, weft.rig.kinetic_coefficient) == (0.2, 0.2)
    assert (warp.rig.plate_width, weft.rig.plate_width) == (60.0, 60.0)
    assert "rig.kinetic_coefficient" not in str(assumed_inputs(warp))
    taken = "rig.static_coefficient and rig.kinetic_coefficient (as warp, the only direction tested)"
    assert assumed_inputs(weft) == (taken,) and row_kind(weft, "mu_paper") == "assumed"
    assert taken.replace("warp", "weft") in assumed_inputs(mine("forming"))  # of no direction
    Path("rig.yaml").write_text("rig:\n  direction: [warp]\n")
    with pytest.raises(InputError, match=r"rig\.yaml:2: rig\.direction"):
        mine("friction", config="rig.yaml")


def test_an_import_says_what_its_static_friction_is(place):
    rubbed(place, "warp", 0.2, 0.23)
    part = yaml.safe_load((OUT / "fabric.yaml").read_text())
    own = part["rigs"]["friction"]["warp"]
    assert own["length"] > 310.0 and own["width"] == 40.0
    rubbed(place, "weft", 0.2, 0.19, head="Normalkraft;500;N\nPlattenlänge;150;mm\nPlattenbreite;50;mm\n")
    weft = yaml.safe_load((OUT / "fabric.yaml").read_text())["rigs"]["friction"]["weft"]
    assert weft["static_coefficient"] == weft["kinetic_coefficient"] and {"length", "width"}.isdisjoint(weft)
    assert np.isclose(weft["kinetic_coefficient"], 0.2, rtol=2e-3)


def test_a_frame_stands_beside_its_import(place):
    """Force of the crosshead in the same frame, and the corridor as an input of the shells' law."""
    for k, stiffness in enumerate((0.09, 0.11)):
        frame_file(place / f"{k}.csv", 200.0, 170.0, 36.04, stiffness=stiffness)
    FRAME_LAB.write([FRAME_LAB.read(place / f"{k}.csv", ReadOptions())[0] for k in (0, 1)], OUT, "", ["0.csv", "1.csv"])
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    found = references_of(mine("picture-frame"), ())
    rows, gamma = {row.quantity: row for row in found.rows}, np.deg2rad(20.0)
    crosshead = rows["shear_force_n_at_deg.20"]
    assert crosshead.mean == pytest.approx(crosshead_force(0.1 * gamma, gamma, 170.0, 200.0), rel=1e-3)
    assert crosshead.scaled == "" and rows[f"{NORMALISED}_at_deg.20"].unit == "N/mm"
    assert (found.curve.kind, found.curve.y_name) == ("input", NORMALISED) and found.curve.sd is not None
    assert [band.label for band in scatter_bands(found.curves)] == ["input, ± sd"]
    beside = scatter_bands(found.curves)[0]
    assert beside.high - beside.low == pytest.approx(2.0 * found.curve.sd)
    yarns = references_of(mine("picture-frame", scale="meso"), ())
    assert yarns.curve.kind == "measured"  # which no shell was given


def test_friction_stands_beside_its_import_under_the_same_force(place):
    rubbed(place, "warp", 0.2)
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    curve = references_of(mine("friction", direction="warp"), ()).curve
    assert (curve.kind, curve.y_name, curve.mean[-1]) == ("input", "pull_force_n", pytest.approx(200.0, rel=1e-3))
    (against,) = own_curves(mine("friction", direction="warp"), [OUT / "friction-warp/corridor.csv"])
    assert against.kind == "input" and "uses its coefficients" in against.note
    lighter = references_of(mine("friction", direction="warp", sets=["rig.normal_force=400"]), ())
    assert lighter.curve is None
    rows = {row.quantity: row for row in lighter.rows}
    assert rows["pull_force_kinetic_n"].mean == pytest.approx(0.2 * 2 * 400, rel=1e-3)
    assert rows["pull_force_kinetic_n"].scaled == "under 400 instead of 500 N"
    assert (rows["mu_paper"].mean, rows["mu_per_face"].mean) == pytest.approx((0.4, 0.2), rel=1e-3)
    assert rows["mu_paper"].scaled == rows["mu_per_face"].scaled == ""
    assert references_of(mine("friction", direction="weft"), ()).curve is None


def test_the_page_of_a_frame_shows_both_curves_normalised(place):
    """A force of the crosshead [N] in one picture with a normalised one [N/mm] would be a hundred times too high."""
    sheared(place)
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    folders = [write_run(place / f"r{k}", "picture-frame", variant=v) for k, v in enumerate(("mine", "1"))]
    own, paper = (page_curve(load_run(folder))[0].blocks for folder in folders)
    assert own[0].alt.startswith(NORMALISED_LABEL) and "Reference: mine, 1 frame of 200 mm" in own[0].alt
    assert paper[0].alt.startswith("force of the crosshead [N]") and "differ in size" not in own[0].alt


TAKEN = "rig.static_coefficient and rig.kinetic_coefficient (as weft, the only direction tested)"


@pytest.fixture
def tested(tmp_path, monkeypatch):
    """A fabric whose weft alone was pulled between plates, and whose warp alone was bent."""
    monkeypatch.chdir(tmp_path)
    path = friction_file(tmp_path / "friction.csv", 180.0, 220.0, head="Normalkraft;1000;N\nPlattenlänge;100;mm\n"
                         "Plattenbreite;40;mm\n")  # fmt: skip
    FRICTION.write(FRICTION.read(path, ReadOptions()), OUT, "weft", [path.name])
    bent = tmp_path / "bent.csv"
    bent.write_text("overhang [mm]\n164\n168\n")
    sizes = ReadOptions(sizes={"area_mass_g_m2": 800.0, "strip_width_mm": 25.0})
    CANTILEVER.write(CANTILEVER.read(bent, sizes), OUT, "warp", [bent.name])
    assert run(["new", "mine", "--from", str(OUT)]) == 0


def judged(one):
    """Summary of a run that found F_R/F_N and a force."""
    results = {"mu_paper": 0.18, "pull_force_kinetic_n": 180.0, "normal_force_error_pct": 0.1}
    columns = {name: np.linspace(0.0, 1.0, 9) for name in ("displacement_mm", "pull_force_n")}
    specimen = Specimen(History(strip(2, 2)[0], columns, {}, []), results, quality(), cost(), {})
    return compare_run(one, [specimen], references_of(one, ())).summary


def test_friction_of_the_untested_direction_is_assumed_where_it_is_shown(tested, tmp_path):
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


def test_tools_of_forming_know_where_their_friction_is_from(tested):
    forming = mine("forming")
    assert forming.rig.kinetic_coefficient == pytest.approx(0.09, rel=1e-3)
    assert TAKEN in assumed_inputs(forming) and TAKEN in run_stamp(forming, ()).verdict
    summary = {"results": {"draw_in_max_mm": 1.0}, "comparison": [], "assumed": list(assumed_inputs(forming))}
    assert TAKEN in inputs_told(summary, result_rows(summary, refused=False))
    path = friction_file(Path("other.csv"), 220.0, 220.0, head="Normalkraft;1000;N\nPlattenlänge;100;mm\n"
                         "Plattenbreite;40;mm\n")  # fmt: skip
    FRICTION.write(FRICTION.read(path, ReadOptions()), OUT, "warp", [path.name])
    assert run(["new", "both", "--from", str(OUT)]) == 0
    both = mine("forming", variant="both")
    assert both.rig.kinetic_coefficient == pytest.approx(0.1, rel=1e-3)
    assert not any("coefficient" in told for told in assumed_inputs(both))


def test_forming_of_a_fabric_without_friction_says_whose_it_has(tested):
    assert run(["new", "bare"]) == 0
    told = assumed_inputs(mine("forming", variant="bare"))
    assert "rig.static_coefficient and rig.kinetic_coefficient (default, measured on the fabrics of pham2019)" in told
    assert not any("coefficient" in one for one in assumed_inputs(resolve(variant="1", test="forming")))


def test_fields_that_one_direction_lacks_are_the_others_and_a_tool_has_one(tested):
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


def test_check_lists_the_rigs_and_judges_their_friction(tested):
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


def test_bending_of_the_untested_direction_is_that_of_the_other_and_assumed(tested):
    weft = mine("cantilever", direction="weft", sets=["rig.overhang=166"])
    bending = weft.fabric.macro.bending_stiffness
    assert bending.weft.value == bending.warp.value and bending.warp.source == "derived"
    assert bending.weft.source == "assumed"
    assert bending.weft.ref.startswith("as warp")
    assert "macro.bending_stiffness.weft" not in Path("configs/mine.yaml").read_text()  # not among the imported
    assert row_kind(weft, "bending_stiffness_eq2_n_mm_per_width") == "assumed"
    assert assumed_inputs(weft) == ("macro.bending_stiffness.weft",)
    (found,) = with_estimates([mine("cantilever", direction="weft")], quiet=True)
    assert given_overhang(found) == 166.0


def test_a_command_for_both_directions_is_refused_before_the_first_has_run(tested, capsys):
    out = Path("runs/bent")
    bent = ["cantilever", "--variant", "mine", "--scale", "macro", "--preset", "quick", "--set", "rig.length=160"]
    assert run([*bent, "--out", str(out)]) == 2
    assert "rig.overhang = 166 mm: rig.length = 160 mm is too short" in capsys.readouterr().err and not out.exists()
    wide = ["friction", "--variant", "mine", "--scale", "macro", "--preset", "quick", "--set", "rig.width=60"]
    assert run([*wide, "--out", str(out)]) == 2
    assert "expected at least rig.width = 60 mm" in capsys.readouterr().err and not out.exists()
