"""Runs of a fabric take rig and friction from its own imported tests, and from nowhere else in silence."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from homogenise_cases import with_shipped_card
from report_sample import write_run
from test_lab_frame import frame_file
from test_lab_friction import friction_file

from knittest.base.errors import InputError
from knittest.cli.main import run
from knittest.config.dumping import dump
from knittest.config.loading import resolve
from knittest.experiment.lab_table import Given
from knittest.experiment.origin import assumed_inputs, row_kind
from knittest.laboratory.friction.lab_files import LAB as FRICTION
from knittest.laboratory.given_data import own_curves
from knittest.laboratory.picture_frame.lab_files import LAB as FRAME_LAB
from knittest.laboratory.picture_frame.report import NORMALISED_LABEL
from knittest.laboratory.report_base import TESTS, scatter
from knittest.materials.trellis import NORMALISED, crosshead_force
from knittest.report_page.curves import curve as page_curve
from knittest.report_page.loading import load_run
from knittest.runs.writing import references_of

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
    FRICTION.write(FRICTION.read(path, Given()), OUT, direction, [path.name])


def sheared(place, end=36.04, side=200.0, fabric=170.0):
    path = frame_file(place / "frame.csv", side, fabric, end)
    FRAME_LAB.write(FRAME_LAB.read(path, Given()), OUT, "", [path.name])


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
        match=r"static_coefficient = 0\.2: 0\.2 is less .*set both, here --set rig\.static_coefficient=0\.3 or",
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
    with pytest.raises(InputError, match=r"rig\.max_angle = 45 deg: .* ends at 36\.\d+ deg; --set rig\.max_angle=36 "):
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
    FRAME_LAB.write([FRAME_LAB.read(place / f"{k}.csv", Given())[0] for k in (0, 1)], OUT, "", ["0.csv", "1.csv"])
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    found = references_of(mine("picture-frame"), ())
    rows, gamma = {row.quantity: row for row in found.rows}, np.deg2rad(20.0)
    crosshead = rows["shear_force_n_at_deg.20"]
    assert crosshead.mean == pytest.approx(crosshead_force(0.1 * gamma, gamma, 170.0, 200.0), rel=1e-3)
    assert crosshead.scaled == "" and rows[f"{NORMALISED}_at_deg.20"].unit == "N/mm"
    assert (found.curve.kind, found.curve.y_name) == ("input", NORMALISED) and found.curve.sd is not None
    assert [band.label for band in scatter(found.curves)] == ["input, ± sd"]
    beside = scatter(found.curves)[0]
    assert beside.high - beside.low == pytest.approx(2.0 * found.curve.sd)
    yarns = references_of(mine("picture-frame", scale="meso"), ())
    assert yarns.curve.kind == "measured"  # which no shell was given


def test_friction_stands_beside_its_import_under_the_same_force(place):
    rubbed(place, "warp", 0.2)
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    curve = references_of(mine("friction", direction="warp"), ()).curve
    assert (curve.kind, curve.y_name, curve.mean[-1]) == ("input", "pull_force_n", pytest.approx(200.0, rel=1e-3))
    (against,) = own_curves(mine("friction", direction="warp"), [OUT / "friction-warp/corridor.csv"])
    assert against.kind == "input" and "coefficients were given" in against.note
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
