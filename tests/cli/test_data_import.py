"""``knittest data import``: what the files of a laboratory say is kept, what they leave open is asked."""

import csv
import math
import shutil
from pathlib import Path

import pytest
import yaml

from knittest.base.files import data_dir
from knittest.cli.main import run

ROWS = "Weg;Kraft\nmm;N\n0,0;0,0\n1,5;2000,5\n3,0;6400,0\n"
HEAD = "Strip width;100;mm\nEinspannlänge;200;mm\n"


@pytest.fixture
def place(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def imported(text: str, *options: str, name: str = "strip.csv", direction: str = "warp") -> int:
    Path(name).write_text(text, encoding="utf-8")
    return run(["data", "import", name, "--direction", direction, "--out", "data/mine", *options])


def table(name: str = "tensile-warp.csv") -> dict[str, dict[str, str]]:
    with (Path("data/mine") / name).open(encoding="utf-8") as stream:
        return {row["quantity"]: row for row in csv.DictReader(stream)}


def test_the_width_of_a_strip_of_100_mm_is_kept_and_its_curve_is_per_width(place):
    assert imported(HEAD + ROWS) == 0
    found = table()
    assert (found["peak_force_n"]["mean"], found["strip_width_mm"]["mean"]) == ("6400", "100")
    lines = Path("data/mine/warp/tension.csv").read_text(encoding="utf-8").splitlines()
    assert "# strip_width_mm: 100" in lines and "strain_pct,force_n_per_mm" in lines
    assert float(lines[-1].split(",")[1]) == pytest.approx(64.0)


def test_one_specimen_has_no_standard_deviation_and_a_fabric_names_it(place, capsys):
    assert imported(HEAD + ROWS) == 0
    said = capsys.readouterr().out
    assert all(one in said for one in ('experiment: "mine"', 'experiment_variant: "mine"', '"mine/warp/tension.csv"'))
    assert {row["sd"] for row in table().values()} == {""} and table()["peak_force_n"]["n"] == "1"


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        ("Einspannlänge;200\n" + ROWS, [], "strip.csv: the file states no strip width: give --width [mm]"),
        (HEAD + ROWS, ["--width", "50"], "strip.csv:1: strip width 100 mm, but --width is 50 mm"),
        (
            HEAD + ROWS.replace("mm;N", "mm;kN"),
            [],
            "maximum force 6.4e+06 N, 6.4e+04 N/mm at 100 mm width: implausible",
        ),
        (HEAD + ROWS.replace("2000,5", "2,1").replace("6400,0", "6,4"), [], "it looks like kN: 6400 N"),
        (HEAD + ROWS.replace("2000", "-2000").replace("6400", "-6400"), [], "give --sign negative"),
        ("Richtung;Schuss\n" + HEAD + ROWS, [], "strip.csv:1 states weft, but --direction is warp"),
        (HEAD + ROWS, ["--frame-side", "200"], "--frame-side: not an option of --test tensile"),
    ],
)
def test_plausible_slips_are_bad_input(place, capsys, text, options, words):
    assert imported(text, *options) == 2
    assert words in capsys.readouterr().err
    assert not Path("data").exists()


def test_a_folder_with_other_files_is_left_alone(place):
    Path("data/mine").mkdir(parents=True)
    Path("data/mine/thesis.txt").write_text("mine")
    assert imported(HEAD + ROWS) == 2
    assert [path.name for path in Path("data/mine").iterdir()] == ["thesis.txt"]


def test_a_weft_file_is_not_a_warp_of_the_same_folder(place, capsys):
    assert imported(HEAD + ROWS, name="weft-1.csv") == 2
    assert "weft-1.csv: the file name states weft" in capsys.readouterr().err
    assert imported(HEAD + ROWS, direction="weft") == 0
    assert imported(HEAD + ROWS) == 2
    assert "imported as weft" in capsys.readouterr().err
    assert imported(HEAD + ROWS, "--trust-direction", name="weft-1.csv") == 2  # the option says nothing of copies


def test_all_four_tests_make_one_experiment_and_one_block_of_the_fabric(place, capsys):
    shutil.copytree(data_dir() / "tutorial", "lab")
    imports = [
        ("tensile", "warp-*.csv", ["--direction", "warp"]),
        ("tensile", "weft-*.csv", ["--direction", "weft"]),
        ("picture-frame", "frame-*.csv", []),
        ("cantilever", "cantilever-warp.csv", ["--direction", "warp"]),
        ("cantilever", "cantilever-weft.csv", ["--direction", "weft"]),
        ("friction", "friction-*.csv", ["--direction", "warp"]),
    ]
    for test, files, options in imports:
        names = [str(path) for path in sorted(Path("lab").glob(files))]
        assert run(["data", "import", *names, "--test", test, *options, "--out", "data/mine"]) == 0
        assert run(["data", "stats", *names, "--test", test]) == 0
    macro = yaml.safe_load(Path("data/mine/fabric.yaml").read_text(encoding="utf-8"))["macro"]
    assert set(macro) == {"tension", "fracture_strain", "bending_stiffness", "shear"}
    assert all(set(macro[name]) == {"warp", "weft"} for name in ("tension", "fracture_strain", "bending_stiffness"))
    for path in [*macro["tension"].values(), macro["shear"]["curve"]]:
        assert (Path("data") / path).is_file()
    assert float(table("friction-warp.csv")["mu_paper"]["mean"]) == pytest.approx(290.0 / 2000.0, rel=1e-3)
    assert float(table("cantilever-warp.csv")["overhang_mm"]["mean"]) == pytest.approx(165.0, abs=0.01)
    shear = table("picture-frame.csv")["normalised_shear_force_n_per_mm_at_deg.40"]
    assert float(shear["mean"]) == pytest.approx(0.08, rel=5e-3) and shear["n"] == "3"
    said = capsys.readouterr().out
    assert "first loading only" in said and "2 faces rubbing" in said and "plane at 41.5 deg" in said


def test_a_direction_is_asked_of_strips_and_refused_of_frames(place, capsys):
    shutil.copytree(data_dir() / "tutorial", "lab")
    assert run(["data", "import", "lab/warp-1.csv", "--out", "data/mine"]) == 2
    assert "--direction: missing" in capsys.readouterr().err
    frame = ["data", "import", "lab/frame-1.csv", "--test", "picture-frame", "--out", "data/mine"]
    assert run([*frame, "--direction", "warp"]) == 2
    assert "--direction: not an option of --test picture-frame" in capsys.readouterr().err


def test_a_pull_out_and_a_cycled_frame_are_imported_by_the_command(place, capsys):
    """An inlay held by 0.02 N a crossing; a frame of S = 0.1 gamma with nothing that rubs."""
    rows = [(0.02 * t, max(0.02 * t - 0.2, 0.0)) for t in range(1001)]
    text = "".join(f"{d:.2f},{e:.2f},{min(d / 0.2, 1.0) * 0.02 * (50.0 - e) * 0.28:.6f}\n" for d, e in rows)
    Path("weft.csv").write_text("displacement [mm],free end [mm],force [N]\n" + text)
    pull = ["data", "import", "weft.csv", "--direction", "weft", "--out", "data/mine"]
    assert run(pull) == 2
    assert "looks like a pull-out test; give --test pull-out" in capsys.readouterr().err
    sizes = ["--embedded-length", "50", "--crossing-density", "28"]
    assert run([*pull, "--test", "pull-out", *sizes]) == 2
    assert "clamped edges are unknown" in capsys.readouterr().err
    assert run([*pull, "--test", "pull-out", *sizes, "--clamped", "far"]) == 0
    found = table("pull-out-weft.csv")
    assert float(found["crossing_friction_n"]["mean"]) == pytest.approx(0.02, rel=2e-3)
    assert (found["clamped_edges"]["mean"], found["slid_pitches"]["mean"]) == ("1", "5")
    shear = [(a, 0.1 * math.radians(a) * 200.0 / math.sin(math.radians(45.0 - 0.5 * a))) for a in range(21)]
    both = "".join(f"{a};{f:.5f}\n" for a, f in [*shear, *shear[-2::-1]])
    Path("frame.csv").write_text("Rahmenlänge;200;mm\nGewebeseite;200;mm\nScherwinkel [deg];Kraft [N]\n" + both)
    frame = ["data", "import", "frame.csv", "--test", "picture-frame", "--out", "data/mine"]
    assert run([*frame, "--loading", "cycles", "--clamped", "far"]) == 2
    assert "--clamped: not an option of --test picture-frame" in capsys.readouterr().err
    assert run([*frame, "--loading", "cycles"]) == 0
    cycles = table("picture-frame.csv")
    assert float(cycles["cycle_work_mj"]["mean"]) == pytest.approx(2e3 * math.radians(20.0) ** 2, rel=3e-3)
    assert float(cycles["cycle_loss_mj"]["mean"]) == pytest.approx(0.0, abs=0.1) and cycles["cycles"]["mean"] == "1"
    assert "work [mJ]" in capsys.readouterr().out
