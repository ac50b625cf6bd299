"""A fabric started from imported tests has their numbers, all others assumed; what cuts its own curve is refused."""

from pathlib import Path

import pytest
import yaml

from knittest.base.errors import InputError
from knittest.base.files import configs_dir
from knittest.cli.main import run
from knittest.config.loading import resolve
from knittest.experiment.origin import quantities
from knittest.laboratory.base import curve_coverages, cut_curve_warnings, fabric_laminate, tension_curves
from knittest.runs import specimen

STRAIN = {"warp": 2.31, "weft": 1.9}
PART = """# Written by knittest data import
macro:
  tension:
    warp: mine/warp/tension.csv
    weft: mine/weft/tension.csv
  fracture_strain:
    warp: {"value": 2.31, "sd": 0.11, "source": "measured", "ref": "5 strips, 100 mm wide"}
    weft: {"value": 1.9, "sd": 0.2, "source": "measured", "ref": "4 strips, 100 mm wide"}
  bending_stiffness:
    warp: {"value": 4.5, "sd": 0.3, "source": "derived", "ref": "overhang"}
  shear: {kind: linear, stiffness: {"value": 0.02, "source": "assumed", "ref": "mine"}}
experiment: "mine"
experiment_variant: "mine"
"""


@pytest.fixture
def imported(tmp_path, monkeypatch):
    """A folder in which tests were imported to ``data/mine``."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "data" / "mine"
    for direction, strain in STRAIN.items():
        (folder / direction).mkdir(parents=True)
        head = f"# kind: measured\n# source: mine, {direction}\n# strip_width_mm: 100\n"
        rows = f"strain_pct,force_n_per_mm\n0,0\n{0.5 * strain},30\n{strain},80\n"
        (folder / direction / "tension.csv").write_text(head + rows)
        rows = f"mine,{direction},fracture_strain_pct,{strain},0.11,5,%,mine\n"
        rows += f"mine,{direction},peak_force_n,8000,200,5,N,mine\nmine,{direction},strip_width_mm,100,,,mm,mine\n"
        (folder / f"tensile-{direction}.csv").write_text("variant,direction,quantity,mean,sd,n,unit,table\n" + rows)
    (folder / "fabric.yaml").write_text(PART)
    return folder


def shells(**asked):
    return resolve(**({"variant": "mine", "scale": "macro"} | asked))


def test_imported_numbers_keep_their_sources_and_all_others_are_assumed(imported):
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    fabric = shells().fabric
    stated = {
        "warp": (2.31, 0.11, "measured", "5 strips, 100 mm wide"),
        "weft": (1.9, 0.2, "measured", "4 strips, 100 mm wide"),
    }
    for direction, expected in stated.items():
        found = getattr(fabric.macro.fracture_strain, direction)
        assert (found.value, found.sd, found.source, found.ref) == expected
        assert fabric.macro.tension[direction] == str(imported / direction / "tension.csv")
    assert fabric.macro.bending_stiffness.warp.source == "derived"
    assert (fabric.experiment, fabric.experiment_variant) == (str(imported), "mine")
    sources = [q.source for q in quantities(fabric)]
    assert sources.count("assumed") == len(sources) - 4
    assert fabric.contact.normal_stiffness.source == "derived"
    others = [q for q in quantities(fabric) if q.source == "assumed" and q != fabric.macro.shear.stiffness]
    assert all(q.ref == "as pham2019-v1" and not q.chosen_by for q in others)
    assert fabric.macro.bending_stiffness.weft.ref == "as pham2019-v1"
    text = Path("configs/mine.yaml").read_text()
    assert "#   macro.fracture_strain.warp\n" in text and "CF/PA 6.6" in fabric.reinforcing.description
    assert fabric.reinforcing.description.startswith("as pham2019-v1: ")


def test_without_an_import_nothing_is_measured_or_predicted(imported):
    assert run(["new", "mine"]) == 0
    data = yaml.safe_load(Path("configs/mine.yaml").read_text())
    assert data["macro"]["shear"] is data["macro"]["tension"] is data["macro"]["fracture_strain"] is None
    fabric = shells().fabric
    assert {q.source for q in quantities(fabric) if q != fabric.contact.normal_stiffness} == {"assumed"}


def test_what_was_not_imported_of_the_card_of_the_shells_is_left_out_unless_there_are_no_yarns(imported):
    whole = (imported / "fabric.yaml").read_text()
    part = "".join(line for line in whole.splitlines(keepends=True) if "shear" not in line)
    (imported / "fabric.yaml").write_text(part)
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    assert shells().fabric.macro.missing_card_parts == ("shear",)
    light = (
        part + "area_mass: {value: 100, source: measured, ref: x}\nthickness: {value: 0.5, source: measured, ref: x}\n"
    )
    (imported / "fabric.yaml").write_text(light)
    for path in Path("configs").iterdir():
        path.unlink()
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    assert shells().fabric.macro.shear.ref == "as pham2019-v1"


def test_a_shear_law_of_its_own_replaces_the_other_whole(imported):
    (imported / "fabric.yaml").write_text(
        PART.replace(
            '{kind: linear, stiffness: {"value": 0.02, "source": "assumed", "ref": "mine"}}',
            "{kind: table, points: [[0, 0], [40, 0.2]], source: measured, ref: own}",
        )
    )
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    law = shells().fabric.macro.shear
    assert (law.curve, law.source, law.ref, law.points[-1]) == (None, "measured", "own", (40.0, 0.2))
    assert law.friction_share.source == "assumed"


@pytest.mark.parametrize(
    ("old", "new", "phrase"),
    [
        ("value\": 2.31", "value\": 0.0231", "fabric.yaml:7: fabric.macro.fracture_strain.warp"),
        ("fracture_strain:", "fracture_stain:", 'fabric.yaml:6: fabric.macro.fracture_stain: unknown field'),
        ("warp: mine/warp/", "warp: mine/wrap/", "fabric.yaml:4: fabric.macro.tension.warp = 'mine/wrap/tension"),
        ('"mine"\n', '"other"\n', "no such folder"),
        (PART, "[1, 2]\n", "fabric.yaml:1"),
        (PART, "", "fabric.yaml:1"),
        (PART, "area_mass: {value: 10, source: measured, ref: x}\n", "fabric.yaml:1: fabric.area_mass = 10: implaus"),
    ],
)  # fmt: skip
def test_a_part_that_is_none_is_refused_with_its_line(imported, capsys, old, new, phrase):
    (imported / "fabric.yaml").write_text(PART.replace(old, new))
    assert run(["new", "mine", "--from", "data/mine"]) == 2
    said = capsys.readouterr().err
    assert phrase in said and "Traceback" not in said and not Path("configs").exists()


@pytest.mark.parametrize(
    ("folder", "phrase"),
    [
        ("data", "it has no fabric.yaml: write it by knittest data import"),
        ("nowhere", "expected the folder that knittest data import wrote"),
    ],
)
def test_a_folder_without_an_import(imported, capsys, folder, phrase):
    assert run(["new", "mine", "--from", folder]) == 2
    assert phrase in capsys.readouterr().err


def own_curve_beside(imported, warp: str) -> None:
    """A fabric with its own curves and the fracture strain ``warp`` in its file."""
    assert run(["new", "mine", "--from", "data/mine"]) == 0
    path = Path("configs/mine.yaml")
    old = next(line for line in path.read_text().splitlines() if "value: 2.31" in line)
    path.write_text(path.read_text().replace(old, f"    warp: {warp}"))


def test_the_fracture_strain_of_another_fabric_does_not_cut_ones_own_curve(imported, capsys):
    own_curve_beside(imported, "{value: 1.6, source: assumed, ref: as pham2019-v1}")
    with pytest.raises(InputError) as error:
        fabric_laminate(shells())
    assert str(error.value) == (
        "fabric mine: macro.fracture_strain.warp = 1.6 % (assumed) cuts macro.tension.warp before its largest force at "
        "2.31 %; 38 % of this force are not reached. Give the strain at the largest force of your tests, about 2.31 %, "
        "with its source (knittest new NAME --from FOLDER copies it from the import)"
    )
    for command in (["tensile", "--no-frames"], ["check", "tensile"], ["picture-frame"]):
        assert run([*command, "--variant", "mine", "--scale", "macro"]) == 2
        assert "cuts macro.tension.warp" in capsys.readouterr().err
    assert not Path("runs").exists() or not list(Path("runs").rglob("summary.json"))


@pytest.mark.parametrize(("strain", "source", "refused", "warned"), [
    (2.27, "assumed", False, 0), (2.25, "assumed", True, 1), (2.25, "measured", False, 1), (2.25, "user", False, 1),
    (2.27, "measured", False, 0), (2.31, "measured", False, 0),
])  # fmt: skip
def test_what_cuts_a_curve_is_refused_or_said(imported, strain, source, refused, warned):
    own_curve_beside(imported, f"{{value: {strain}, source: {source}}}")
    asked = shells()
    assert len(cut_curve_warnings(asked)) == warned
    if refused:
        with pytest.raises(InputError, match=r"cuts macro\.tension\.warp"):
            fabric_laminate(asked)
    else:
        fabric_laminate(asked)
    assert cut_curve_warnings(shells(scale="meso")) == ()


def test_a_run_carries_the_warning(imported):
    own_curve_beside(imported, "{value: 2.0, source: user}")
    warnings = specimen.run_specimen(shells()).quality.warnings
    assert len([text for text in warnings if "2 % (user) cuts macro.tension.warp" in text]) == 1


def test_a_curve_of_another_fabric_may_be_cut_by_its_assumed_strain(imported):
    text = (configs_dir() / "fabrics" / "pham2019-v1.yaml").read_text().replace("name: pham2019-v1", "name: mine")
    Path("configs").mkdir()
    Path("configs/mine.yaml").write_text(
        text.replace("warp: {value: 1.6, sd: 0.3, source: measured", "warp: {value: 1.4, sd: 0.3, source: assumed")
    )
    fabric_laminate(shells())
    assert len(cut_curve_warnings(shells())) == 1


def test_the_share_that_is_lost_is_that_of_the_curve(imported):
    own_curve_beside(imported, "{value: 1.155, source: user}")
    fabric = shells().fabric
    warp, weft = curve_coverages(fabric, tension_curves(fabric))
    assert (warp.direction, warp.end, warp.is_cut, weft.is_cut, weft.lost) == ("warp", 2.31, True, False, 0.0)
    assert warp.lost == pytest.approx(1 - 30 / 80)


@pytest.mark.parametrize("variant", ["1", "2", "cao2008-weave"])
def test_no_shipped_fabric_is_cut(variant):
    assert cut_curve_warnings(resolve(variant=variant, scale="macro")) == ()
