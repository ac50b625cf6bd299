"""An import of tensile tests: its folder, what a fabric file takes from it, and files of other tests than asked for."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from strip_reading import read_lab, refused

from knittest.base.files import data_dir
from knittest.cli.main import run
from knittest.config.fabric import MacroMaterial
from knittest.experiment import lab_tests
from knittest.experiment.curves import load_curve
from knittest.experiment.lab_conditions import StatedDirection
from knittest.experiment.lab_tests import recognise_test
from knittest.experiment.statistics import Specimen
from knittest.experiment.tables import published_rows
from knittest.laboratory.tensile.lab_files import LAB, summary_lines

SHARE = np.linspace(0.0, 1.0, 50)


def strip(name="s", end=1.5, peak=5e3, width=50.0, **more):
    return Specimen(name, end * SHARE, peak * SHARE**2, width, 200.0, **more)


def specimens(width=50.0):
    return [strip("s0", 1.5, 5e3, width), strip("s1", 1.7, 6e3, width)]


def rows(out, direction="warp"):
    names = ("peak_force_n", "fracture_strain_pct", "strip_width_mm", "gauge_length_mm")
    return published_rows(out, out.name, direction, names)


def test_an_import_is_an_experiment_with_table_source_and_curves(tmp_path):
    out = tmp_path / "mine"
    for direction, more in (("warp", 0.0), ("weft", 1.0)):
        series = [strip(s.name, s.strain[-1], s.force[-1] + more) for s in specimens()]
        assert LAB.write(series, out, direction, ["a.csv"]) == "mine"
    peak, strain, width, gauge = rows(out)
    assert (peak.mean, peak.n, peak.table) == (5500.0, 2, "mine, 2 strips of 50 mm, warp")
    assert (strain.mean, strain.sd) == pytest.approx((1.6, np.std([1.5, 1.7], ddof=1)), rel=1e-5)
    assert (width.mean, width.unit, gauge.mean) == (50.0, "mm", 200.0) and np.isnan(width.sd) and width.n == 0
    assert load_curve(out / "warp/corridor.csv").x[-1] == pytest.approx(1.5)
    assert "data import" in (out / "SOURCE.md").read_text(encoding="utf-8")


def test_curves_are_forces_per_width_with_the_width_in_their_head(tmp_path):
    """The same fabric, cut twice as wide, carries twice the force and the same force per width."""
    curves, fractions = [], []
    for name, width in (("narrow", 50.0), ("wide", 100.0)):
        out = tmp_path / name
        series = [strip(f"{name}{k}", e, f * width / 50.0, width) for k, (e, f) in enumerate(((1.5, 5e3), (1.7, 6e3)))]
        LAB.write(series, out, "warp", ["a.csv"])
        for curve in ("corridor", "tension"):
            text = (out / "warp" / f"{curve}.csv").read_text(encoding="utf-8")
            assert f"# test: tensile\n# direction: warp\n# strip_width_mm: {width:g}\n" in text
        curves.append(load_curve(out / "warp/tension.csv"))
        corridor = load_curve(out / "warp/corridor.csv")
        fractions.append(corridor.sd)
        assert rows(out)[0].mean == pytest.approx(110.0 * width)
    narrow, wide = curves
    assert narrow.y_name == wide.y_name == "force_n_per_mm"
    assert narrow.mean[-1] == pytest.approx(110.0) and wide.mean == pytest.approx(narrow.mean)
    assert fractions[0] == pytest.approx(fractions[1]) and fractions[0].max() > 1.0


def test_strips_that_were_measured_one_by_one_count_as_of_their_mean_width(tmp_path):
    series = [strip("s0", 1.5, 99.0 * 100.0, 99.0), strip("s1", 1.7, 101.0 * 100.0, 101.0)]
    LAB.write(series, tmp_path / "mine", "warp", ["a.csv"])
    peak, _, width, _ = rows(tmp_path / "mine")
    assert (peak.mean, width.mean) == pytest.approx((1e4, 100.0)) and peak.sd == pytest.approx(0.0, abs=1e-6)
    two = [strip(width=100.0, path="a.csv"), strip("s1", 1.6, 3e3, 50.0, path="b.csv")]
    for series, words in (
        (two, r"b\.csv: strip width 50 mm, but a\.csv has 100 mm; import series"),
        ([strip(width=None, path="a.csv")], r"a\.csv: the file states no strip width: give --width \[mm\]"),
    ):
        refused(words, LAB.write, series, tmp_path / "x", "warp", [])
    assert not (tmp_path / "x").exists()


def test_one_specimen_states_no_scatter(tmp_path):
    out = tmp_path / "mine"
    LAB.write([strip()], out, "warp", ["a.csv"])
    assert all(np.isnan(row.sd) for row in rows(out)) and rows(out)[0].n == 1
    assert load_curve(out / "warp/corridor.csv").sd is None
    statistics = json.loads((out / "warp/statistics.json").read_text())
    assert statistics["peak_force_n"]["sd"] is None and statistics["conditions"]["strip_width_mm"] == 50.0
    assert "sd" not in yaml.safe_load((out / "fabric.yaml").read_text())["macro"]["fracture_strain"]["warp"]
    assert summary_lines([strip()])[3].split() == ["sd", "-", "-"]


def test_fabric_yaml_is_the_block_of_the_fabric_over_both_directions(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    out = Path("data/mine")
    LAB.write(specimens(100.0), out, "warp", ["a.csv"])
    assert set(yaml.safe_load((out / "fabric.yaml").read_text())["macro"]["tension"]) == {"warp"}
    LAB.write([strip("w", 2.0, 4e3, 100.0), strip("v", 2.2, 4e3, 100.0)], out, "weft", ["b.csv"])
    part = yaml.safe_load((out / "fabric.yaml").read_text())
    assert (part["experiment"], part["experiment_variant"]) == ("mine", "mine")
    macro = part["macro"]
    assert macro["tension"] == {"warp": "mine/warp/tension.csv", "weft": "mine/weft/tension.csv"}
    warp, weft = macro["fracture_strain"]["warp"], macro["fracture_strain"]["weft"]
    assert (warp["value"], warp["source"], weft["value"]) == (pytest.approx(1.6), "measured", pytest.approx(2.1))
    assert warp["sd"] == pytest.approx(np.std([1.5, 1.7], ddof=1), rel=1e-5) and "2 strips, 100 mm wide" in warp["ref"]
    assert load_curve(Path("data/mine/warp/tension.csv")).x[-1] == pytest.approx(warp["value"], rel=1e-5)
    assert set(macro) <= set(MacroMaterial.model_fields)


def test_an_import_replaces_only_what_an_import_wrote(tmp_path):
    out = tmp_path / "mine"
    LAB.write(specimens(), out, "warp", ["a.csv"])
    (out / "SOURCE.md").write_text("tested by me", encoding="utf-8")
    one = specimens()[:1]
    LAB.write(one, out, "warp", ["b.csv"])
    assert [p.name for p in sorted((out / "warp").glob("specimen-*"))] == ["specimen-01.csv"]
    assert (out / "SOURCE.md").read_text(encoding="utf-8") == "tested by me"
    for foreign in ("warp/notes.txt", "thesis.csv"):
        (out / foreign).write_text("mine", encoding="utf-8")
        refused(f"{foreign} is not written by", LAB.write, one, out, "warp", ["c.csv"])
        (out / foreign).unlink()
    (out / "warp/statistics.json").write_text('{"kind": "measured"}')
    refused("import the files again", LAB.write, one, out, "weft", ["c.csv"])
    (out / "warp/statistics.json").unlink()
    refused(r"warp/corridor\.csv is not written", LAB.write, one, out, "warp", ["c.csv"])
    refused("is a file", LAB.write, one, out / "SOURCE.md", "warp", ["c.csv"])


def test_a_file_of_the_other_direction_is_refused_unless_the_option_is_trusted(tmp_path):
    stated = [strip("s0", said=StatedDirection("weft", "a.csv:1")), strip("s1", 1.6, 6e3)]
    refused(r"a\.csv:1 states weft, but --direction is warp", LAB.write, stated, tmp_path / "mine", "warp", ["a.csv"])
    LAB.write(stated, tmp_path / "mine", "warp", ["a.csv"], trusted=True)
    words = "has the same curves, imported as warp"
    refused(words, LAB.write, stated[1:], tmp_path / "mine", "weft", ["a.csv"], trusted=True)
    LAB.write(stated, tmp_path / "mine", "warp", ["a.csv"], trusted=True)  # again, the same way


def test_the_copy_of_a_specimen_is_refused_whatever_its_delimiter(tmp_path):
    (tmp_path / "a.csv").write_text("b0;100;mm\nDehnung [%];Kraft\n0;0\n1,5;6000\n")
    (tmp_path / "b.csv").write_text("width [cm],10\nstrain [%],force [kN]\n0,0\n1.5,6.0\n")
    both = [s for name in ("a.csv", "b.csv") for s in read_lab(tmp_path / name)]
    refused("specimens a and b have the same curve", LAB.write, both, tmp_path / "mine", "warp", ["a.csv", "b.csv"])


def test_fields_of_all_tests_stand_in_the_order_of_a_fabric(tmp_path, monkeypatch):
    parts = {"macro": {"shear": 1}}, {"macro": {"tension": 2, "bending_stiffness": 3}, "area_mass": 4}
    labs = [SimpleNamespace(fabric=lambda _, place, part=part: part, rigs=lambda _: {}) for part in parts]
    monkeypatch.setattr(lab_tests, "LAB_TESTS", dict(enumerate(labs)))
    found = lab_tests.fabric_part(tmp_path)
    assert list(found) == ["area_mass", "macro", "experiment", "experiment_variant"]
    assert list(found["macro"]) == ["tension", "bending_stiffness", "shear"]


TUTORIAL = data_dir() / "tutorial"
FILES = [("frame-1.csv", "picture-frame"), ("cantilever-warp.csv", "cantilever"), ("friction-1.csv", "friction")]
STRIPS = [path for path in sorted(TUTORIAL.glob("*.csv")) if path.stem.split("-")[0] in ("warp", "weft", "yarn")]


@pytest.mark.parametrize(("name", "test"), FILES)
@pytest.mark.parametrize("command", [["stats"], ["import", "--direction", "warp", "--out", "data/mine"]])
@pytest.mark.parametrize("sizes", [[], ["--width", "50", "--gauge-length", "200"]])
def test_a_file_of_another_test_is_no_strip(tmp_path, monkeypatch, capsys, command, name, test, sizes):
    """With sizes of a strip a pull between plates was a tensile test of 1.5 %: silently wrong."""
    monkeypatch.chdir(tmp_path)
    assert run(["data", *command, str(TUTORIAL / name), *sizes]) == 2
    assert f"{name}: looks like a {test} test; give --test {test}" in capsys.readouterr().err
    assert not Path("data").exists()


def test_a_file_without_a_head_is_known_by_its_name(tmp_path, capsys):
    path = tmp_path / "rahmen-1.csv"
    path.write_text("Weg [mm];Kraft [N]\n0;0\n5;1\n10;2\n")
    assert run(["data", "stats", str(path)]) == 2
    assert "for a picture-frame test, give --test picture-frame" in capsys.readouterr().err
    assert run(["data", "stats", str(TUTORIAL / "friction-1.csv"), "--test", "cantilever"]) == 2
    assert "for a friction test, give --test friction" in capsys.readouterr().err


@pytest.mark.parametrize("path", STRIPS, ids=lambda path: path.name)
def test_strips_and_yarns_look_like_no_other_test(path):
    assert len(STRIPS) == 16 and recognise_test(path) == ""


def test_who_says_tensile_is_believed(tmp_path, capsys):
    path = tmp_path / "a.csv"
    path.write_text("Reibung der Backen;keine\nWeg [mm];Kraft [N]\n0;0\n1;2000\n3;6000\n")
    given = ["data", "stats", str(path), "--gauge-length", "200"]
    assert run(given) == 2 and "looks like a friction test" in capsys.readouterr().err
    assert run([*given, "--test", "tensile"]) == 0


@pytest.mark.parametrize(
    ("name", "row", "note"),
    [
        ("force [N]", "abc;x", "line 8 skipped: 'abc;x'"),
        ("load", "1.25,60", "column 'load' has no unit: taken as N"),
        ("force [N]", "1.25,60", None),
    ],
)
def test_what_is_left_out_or_assumed_is_said(tmp_path, name, row, note):
    """A row without numbers between rows of numbers, and a force without a unit, do not pass without a word."""
    path = tmp_path / "s1.csv"
    points = ["0,0", "0.5,10", "1,40", row, "1.5,90", "2,160"]
    path.write_text("\n".join(["strip width [mm],50", "gauge length [mm],200", "", f"strain [%],{name}", *points]))
    (one,) = read_lab(path)
    assert one.force[-1] == 160.0
    assert [text for text in one.notes if "skipped" in text or "unit" in text] == ([note] if note else [])


def test_titles_of_recordings_and_columns_not_used_need_no_note(tmp_path):
    """A title between two recordings is no lost row; a second travel without a unit is not used."""
    path = tmp_path / "s2.csv"
    rows = [f"{k},{0.1 * k:g},{10 * k}" for k in range(30)]
    head = ["strip width [mm],50", "gauge length [mm],200", "", "extension [mm],crosshead,force [N]"]
    path.write_text("\n".join([*head, *rows, "Specimen 2", *rows]))
    found = read_lab(path)
    assert len(found) == 2
    assert [text for one in found for text in one.notes if "skipped" in text or "no unit" in text] == []
