"""Input faults as a user meets them: the exit code and message of the command, and no traceback.

The readers' own tests are in test_yaml_loader, test_yaml_fields and test_lab_csv.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from knittest.base.files import configs_dir
from knittest.cli.main import run
from knittest.config.loading import resolve
from knittest.config.yaml_loader import MAX_BYTES, MAX_DEPTH
from knittest.config.yaml_writer import dump
from knittest.experiment import curves, lab_rows

V1 = (configs_dir() / "fabrics" / "pham2019-v1.yaml").read_text(encoding="utf-8")
WIDTH = "rig:\n  width: "

#: a case of each kind that the reader's own tests hold in full
RIGS = {
    "02 duplicate key": (WIDTH + "50\n  width: 60\n", "rig.yaml:3: rig.width: duplicate key, first given in line 2"),
    "04 infinite": (WIDTH + "-.inf\n", "rig.yaml:2: '-.inf': expected a finite number"),
    "05 true": (WIDTH + "true\n", "rig.yaml:2: rig.width = true: expected a number in mm, found true"),
    "07 alias": ("a: &a [x, x]\nb: &b [*a, *a]\n", "rig.yaml:1: anchors and aliases are not allowed"),
    "09 deep nesting": ("rig: " + "[" * 5000, f"rig.yaml:1: nested deeper than {MAX_DEPTH} levels"),
    "09 oversized file": ("#" * MAX_BYTES + "\n", "rig.yaml: larger than 1000 kB"),
    "10 tag": (WIDTH + "!!python/object/apply:os.system [ls]", "rig.yaml:2: tags are not allowed"),
    "10 not UTF-8": ("rig:\n  # größe\n".encode("latin-1"), "rig.yaml:2: not UTF-8 text"),
}

FABRICS = {
    "11 path up": ("pham2019/curves/tensile-v1-warp.csv", "../../../../etc/passwd", "expected a path in"),
    "12 HTML as name": ("name: pham2019-v1", "name: <script>", "fabric.name = '<script>': expected letters, digits"),
    "13 MPa for GPa": ("value: 59.3", "value: 59300", "(it looks like MPa: 59.3 GPa)"),
    "14 friction below zero": ("value: 0.3,", "value: -0.1,", "must be at least 0"),
}

TABLES = {
    "16 thousands or decimals": ("Weg;Kraft\n0;0\n1.234;5\n", "'1.234' may contain a thousands separator"),
    "17 NaN": ("Weg;Kraft\n0;0\n1;nan\n", "has 1 points; at least two are needed (1 row with empty cells skipped"),
    "17 text": ("Weg;Kraft\n0;0\n1;abc\n", "export.csv:3: 'abc' is not a number"),
    "17 travel goes back": ("Weg;Kraft\n0;0\n2;5\n1;6\n", "export.csv:4: specimen export: the travel falls"),
    "17 travel stays": ("Weg;Kraft\n2;0\n2;5\n2;6\n", "export.csv:4: specimen export: the travel does not rise"),
    "18 one point": ("Weg;Kraft\n0;0\n", "has 1 points; at least two are needed"),
    "19 ragged, short": ("Weg;Kraft\n0;0\n1\n", "export.csv:3: the row has one cell for 2 columns"),
    "19 ragged, long": ("Weg,Kraft\n0,0\n1,5,2,5\n", "export.csv:3: 4 cells below 2 columns"),
    "19 truncated": ("Weg;Kraft\nmm;", "has 0 points"),
    "19 no table": ("Datum;Zeit\n1;2\n", "no header row names a force"),
}


@pytest.fixture
def refused(tmp_path, monkeypatch, capsys):
    """Runs a command in an empty folder; returns what it said after it ended with 2, and wrote nothing."""
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    monkeypatch.delenv("KNITTEST_DEBUG", raising=False)

    def command(*arguments) -> str:
        code = run([str(argument) for argument in arguments])
        said = capsys.readouterr()
        assert code == 2, said.err
        assert "Traceback" not in said.err
        assert said.out == ""
        assert list(work.iterdir()) == []
        assert len(said.err) < 1000
        return said.err

    return command


def written(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("case", RIGS)
def test_rig_file(refused, tmp_path, case):
    content, phrase = RIGS[case]
    assert phrase in refused("tensile", "--variant", "1", "--config", written(tmp_path / "rig.yaml", content))


@pytest.mark.parametrize("case", FABRICS)
def test_fabric_file(refused, tmp_path, case):
    old, new, phrase = FABRICS[case]
    fabric = written(tmp_path / "fabric.yaml", V1.replace(old, new, 1))
    said = refused("tensile", "--fabric", fabric, "--parameters", "as-measured")
    assert phrase in said
    assert f"fabric.yaml:{V1[: V1.index(old)].count(chr(10)) + 1}: " in said


@pytest.mark.parametrize("option", ["--config", "--fabric"])
@pytest.mark.parametrize("device", ["/dev/zero", "/dev/tty"])
def test_11_device(refused, option, device):
    fabric = ["--variant", "1"] if option == "--config" else []
    said = refused("tensile", *fabric, option, device)
    assert "not a regular file" in said or "cannot be read" in said


def test_03_yaml_1_2_numbers_are_read_right(tmp_path, monkeypatch):
    """3e1 is a number and 012 is twelve: text and ten by YAML 1.1."""
    handed = []
    monkeypatch.setattr("knittest.studies.command.run_command", lambda runs, options: handed.extend(runs) or 0)
    text = "rig:\n  width: 3e1\n  gauge_length: 0120\nvariability: {seed: 012}\n"
    config = written(tmp_path / "rig.yaml", text)
    assert run(["tensile", "--variant", "1", "--config", str(config), "--out", str(tmp_path / "o")]) == 0
    assert {(r.rig.width, r.rig.gauge_length, r.variability.seed) for r in handed} == {(30.0, 120.0, 12)}


def test_12_a_name_is_never_a_path_out_of_the_runs_folder(refused):
    for name in ("../x", "a/b", "<b>", "..", ""):
        assert "--variant" in refused("tensile", "--variant", name)
        assert "expected letters" in refused("new", name)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_15_german_export_is_read_right(tmp_path, capsys, encoding):
    text = "Prüfprotokoll;Zwick\nEinspannlänge;200,0;mm\n\nWeg;Kraft\nmm;N\n0,0;0,0\n1,0;1,25\n2,0;1.234,5\n"
    path = tmp_path / "export.csv"
    path.write_bytes(text.encode(encoding))
    assert run(["data", "stats", str(path)]) == 0
    assert capsys.readouterr().out.splitlines()[1].split() == ["export", "1234.5", "1.000"]


@pytest.mark.parametrize("case", TABLES)
def test_laboratory_file(refused, tmp_path, case):
    text, phrase = TABLES[case]
    assert phrase in refused("data", "stats", written(tmp_path / "export.csv", text), "--gauge-length", "200")


def test_16_the_setting_asked_for_settles_it(tmp_path, capsys):
    path = written(tmp_path / "export.csv", "Weg;Kraft\n0;0\n1.234;5\n")
    for mark, strain in ((".", "0.617"), (",", None)):
        code = run(["data", "stats", str(path), "--gauge-length", "200", "--decimal", mark])
        said = capsys.readouterr()
        assert (code == 0 and strain in said.out) if strain else (code == 2 and "strain of 617 %" in said.err)


def finished_run(folder: Path, strain, force) -> Path:
    folder.mkdir()
    (folder / "manifest.json").write_text(json.dumps({"status": "completed", "exit_code": 0}))
    (folder / "config.yaml").write_text(dump(resolve(test="tensile", variant="1", scale="macro", direction="warp")))
    rows = "".join(f"{x},{y}\n" for x, y in zip(strain, force, strict=True))
    (folder / "curve.csv").write_text("strain_pct,force_n\n" + rows)
    return folder


@pytest.mark.parametrize(
    ("text", "phrase"),
    [
        ("5,1\n6,2\n7,3\n", "the curves have no common range"),
        ("0,3\n1,3\n2,3\n", "the reference curve is constant"),
        ("0,1\n1,2\n", "the reference curve has 2 points"),
    ],
)
def test_18_not_comparable_is_no_score(tmp_path, capsys, text, phrase):
    folder = finished_run(tmp_path / "run", np.linspace(0.0, 2.0, 50), np.linspace(0.0, 900.0, 50))
    curve = written(tmp_path / "curve.csv", "# kind: measured\n# strip_width_mm: 50\nstrain_pct,force_n\n" + text)
    assert run(["compare", str(folder), "--against", str(curve), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["comparable"], found["reason"]) == (False, phrase)
    assert "rating" not in found


def test_18_one_point_to_compare_with(refused, tmp_path):
    folder = finished_run(tmp_path / "run", [0.0, 1.0, 2.0], [0.0, 1.0, 3.0])
    curve = written(tmp_path / "curve.csv", "# kind: measured\nstrain_pct,force_n\n1,2\n")
    assert "at least two points" in refused("compare", folder, "--against", curve)


def test_19_files_of_gigabytes_are_not_read(refused, tmp_path):
    path = tmp_path / "export.csv"
    with path.open("wb") as stream:
        stream.truncate(4_000_000_000)  # a hole: takes no room
    assert f"larger than {lab_rows.MAX_BYTES // 1_000_000} MB" in refused("data", "stats", path)
    folder = finished_run(tmp_path / "run", [0.0, 1.0, 2.0], [0.0, 1.0, 3.0])
    assert f"larger than {curves.MAX_BYTES // 1_000_000} MB" in refused("compare", folder, "--against", path)
    assert "larger than 1000 kB" in refused("tensile", "--fabric", path)


def test_21_hostile_vtu_is_never_parsed(refused, tmp_path):
    """No command reads VTU: a bomb of entities, or one that names a file, is text like any other."""
    bomb = "".join(f'<!ENTITY e{k + 1} "{f"&e{k};" * 10}">' for k in range(9))
    path = written(
        tmp_path / "frame.vtu",
        f'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY e0 SYSTEM "file:///etc/passwd">{bomb}]>\n'
        '<VTKFile type="UnstructuredGrid">&e9;</VTKFile>\n',
    )
    folder = finished_run(tmp_path / "run", [0.0, 1.0, 2.0], [0.0, 1.0, 3.0])
    assert "frame.vtu" in refused("data", "stats", path)
    assert "frame.vtu" in refused("compare", folder, "--against", path)
    assert "frame.vtu:1: " in refused("tensile", "--fabric", path)
