"""The command line as a process sees it: exit codes, streams, what it imports, what a closed or full stdout does."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from knittest.base.errors import InputError, NumericalError, OutOfTolerance, ResourceError
from knittest.cli import main as cli_main
from knittest.cli.main import cli, run, summaries
from knittest.config.loading import resolve
from knittest.config.yaml_writer import dump

HEAVY = ("numba", "pandas", "matplotlib", "pydantic", "rich", "scipy", "numpy", "yaml")
ROOT = Path(cli_main.__file__).resolve().parents[2]


def knittest(*arguments, cwd=None, **options):
    command = [sys.executable, "-m", "knittest.cli.main", *arguments]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=120, **options)


def test_the_package_runs_as_a_module():
    command = [sys.executable, "-m", "knittest", "--version"]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert (found.returncode, found.stdout, found.stderr) == (0, knittest("--version").stdout, "")


def imported_by(*arguments) -> set[str]:
    """Heavy packages that a command imports."""
    code = f"import sys; from knittest.cli.main import run; run({list(arguments)!r}); print('\\n', *sys.modules)"
    output = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, timeout=60).stdout
    assert "knittest.cli.main" in output
    return set(HEAVY) & set(output.splitlines()[-1].split())


@pytest.mark.parametrize(
    "arguments",
    [["--help"], ["--version"], ["tensile", "--help"], ["check", "--help"], ["new", "--help"], ["report", "--help"]],
)
def test_help_imports_nothing_heavy(arguments):
    assert imported_by(*arguments) == set()


def test_config_errors_and_schema_import_no_numba_pandas_or_matplotlib():
    slow = {"numba", "pandas", "matplotlib", "scipy"}
    assert slow.isdisjoint(imported_by("tensile", "--variant", "1", "--set", "rig.widht=3"))
    assert slow.isdisjoint(imported_by("schema"))


def test_help_is_quick():
    """In CPU time, which other processes of a busy machine do not count towards."""
    seconds = []
    for _ in range(3):
        before = os.times()
        assert knittest("--help").returncode == 0
        after = os.times()
        seconds.append(after.children_user + after.children_system - before.children_user - before.children_system)
    assert 0.0 < min(seconds) < 0.6  # 0.1 s measured


@pytest.mark.parametrize("name", list(summaries()))
def test_every_command_of_the_table_has_help_with_an_example(name, capsys):
    assert run([name, "--help"]) == 0
    text = capsys.readouterr().out
    assert "Usage:" in text
    if "COMMAND" not in text.splitlines()[0]:
        assert "Example: knittest" in text


@pytest.mark.parametrize(
    ("arguments", "phrase"),
    [
        (["tensil"], "No such command 'tensil'"),
        (["tensile"], "which fabric?"),
        (["tensile", "--variant", "1", "--scale", "x"], "'x' is not one of"),
        (["tensile", "--variant", "7"], "unknown fabric"),
        (["tensile", "--variant", "1", "--set", "rig.widht=3"], 'did you mean "width"'),
        (["tensile", "--variant", "1", "--set", "rig.gauge_length=3,5"], "write 3.5"),
        (["tensile", "--variant", "1", "--config", "none.yaml"], "none.yaml: no such file"),
        (["tensile", "--fabric", "/dev/zero"], "not a regular file"),
        (["new", "../x"], "expected letters"),
        (["new", "1"], "shipped fabric"),
    ],
)
def test_bad_input_exits_2_with_a_message_and_nothing_else(tmp_path, arguments, phrase):
    result = knittest(*arguments, cwd=tmp_path)
    assert result.returncode == 2
    assert phrase in result.stderr
    assert "Traceback" not in result.stderr
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("raised", "code"),
    [
        (InputError("bad"), 2),
        (NumericalError("bad"), 3),
        (ResourceError("bad"), 4),
        (OutOfTolerance("bad"), 5),
        (KeyboardInterrupt(), 75),
        (MemoryError(), 4),
        (OSError(28, "No space left on device", "runs/x"), 4),
    ],
)
def test_exit_codes(monkeypatch, capsys, raised, code):
    def fail(*_, **__):
        raise raised

    monkeypatch.setattr("knittest.config.schema.run_schema", fail)
    assert run(["schema"]) == code
    error = capsys.readouterr().err
    assert "knittest: " in error or code == 75
    assert "Traceback" not in error


def test_unexpected_error_leaves_its_traceback_in_a_file(monkeypatch, capsys):
    monkeypatch.delenv("KNITTEST_DEBUG", raising=False)
    monkeypatch.setattr("knittest.config.schema.run_schema", lambda: 1 / 0)
    assert run(["schema"]) == 1
    error = capsys.readouterr().err
    assert len(error.splitlines()) == 1
    log = Path(error.split()[-1])
    assert "ZeroDivisionError" in log.read_text()
    log.unlink()
    monkeypatch.setenv("KNITTEST_DEBUG", "1")
    with pytest.raises(ZeroDivisionError):
        run(["schema"])


def test_schema_is_json_on_stdout():
    result = knittest("schema")
    assert json.loads(result.stdout)["title"] == "TensileRun"
    assert result.stderr == ""


def test_closed_pipe_ends_quietly():
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as stdout:
        command = [sys.executable, "-m", "knittest.cli.main", "schema"]
        result = subprocess.run(command, stdout=stdout, stderr=subprocess.PIPE, text=True, cwd=ROOT, timeout=60)
    assert (result.returncode, result.stderr) == (0, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_full_disk_exits_4():
    with Path("/dev/full").open("w") as stdout:
        command = [sys.executable, "-m", "knittest.cli.main", "schema"]
        result = subprocess.run(command, stdout=stdout, stderr=subprocess.PIPE, text=True, cwd=ROOT, timeout=60)
    assert result.returncode == 4
    assert "No space left on device" in result.stderr
    assert "Traceback" not in result.stderr


def test_new_writes_a_start_that_resolves_and_overwrites_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["new", "mine"]) == 0
    written = {path.name: path.read_text() for path in (tmp_path / "configs").iterdir()}
    assert set(written) == {"mine.yaml", "mine-tensile.yaml"}
    assert "knittest tensile --variant mine --config configs/mine-tensile.yaml" in written["mine-tensile.yaml"]
    with pytest.raises(InputError, match="mine") as unknown:
        resolve(variant="7")
    assert "mine-tensile" not in str(unknown.value)
    for scale in ("macro", "meso"):
        assert resolve(variant="mine", config="configs/mine-tensile.yaml", scale=scale).fabric.name == "mine"
    (tmp_path / "configs" / "mine.yaml").write_text("own work")
    assert run(["new", "mine"]) == 2
    assert (tmp_path / "configs" / "mine.yaml").read_text() == "own work"


def test_compare_takes_a_plain_curve_and_names_the_runs_to_choose_from(tmp_path, capsys):
    for direction in ("warp", "weft"):
        folder = tmp_path / "both" / direction
        folder.mkdir(parents=True)
        (folder / "manifest.json").write_text('{"status": "completed", "exit_code": 0}')
        given = resolve(test="tensile", variant="1", scale="macro", direction=direction)
        (folder / "config.yaml").write_text(dump(given))
        (folder / "curve.csv").write_text("strain_pct,force_n\n0,0\n0.8,2000\n1.6,5800\n1.7,100\n")
    plain = tmp_path / "mine.csv"
    plain.write_text("Dehnung [%];Kraft [kN]\n0,0;0,0\n0,8;2,0\n1,6;5,8\n")
    assert run(["compare", str(tmp_path / "both"), "--against", str(plain)]) == 2
    said = capsys.readouterr().err
    assert f"choose one of {tmp_path / 'both' / 'warp'}, {tmp_path / 'both' / 'weft'}" in said
    warp = str(tmp_path / "both" / "warp")
    assert run(["compare", warp, "--against", str(plain)]) == 2 and "--width" in capsys.readouterr().err
    assert run(["compare", warp, "--against", str(plain), "--width", "50", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["peak_error_pct"], said["rmse_force_n"], said["rating"]) == (0.0, 0.0, None)
    assert "counts as measured" in said["note"] and "# direction: warp" in said["no_rating"]
    plain.write_text(f"# direction: warp\n{plain.read_text()}")
    assert run(["compare", warp, "--against", str(plain), "--width", "50", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rating"]["grade"] == "excellent"
    assert run(["compare", warp, "--against", str(plain), "--width", "50"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("against mine.csv (measured; ")
    assert [line.split() for line in said[2:5]] == [
        ["quantity", "run", "reference", "error"],
        ["peak", "force", "[N]", "5800", "5800", "+0.0", "%"],
        ["strain", "at", "the", "peak", "[%]", "1.6", "1.6", "+0.0", "%"],
    ]
    assert said[5].split()[-4:] == ["0.0", "%", "of", "peak"] and said[7] == "rating 1.00 (excellent)"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_tab_completion(monkeypatch, capsys, shell):
    def completed(instruction: str) -> str:
        monkeypatch.setenv("_KNITTEST_COMPLETE", instruction)
        with pytest.raises(SystemExit) as ended:
            cli.main([], prog_name="knittest", standalone_mode=False)
        assert ended.value.code == 0
        return capsys.readouterr().out

    assert f"_KNITTEST_COMPLETE={shell}_complete" in completed(f"{shell}_source")
    for words, wanted in (("knittest ten", "tensile"), ("knittest schema solver.sp", "solver.speed")):
        monkeypatch.setenv("COMP_WORDS", words)
        monkeypatch.setenv("COMP_CWORD", words.split()[-1] if shell == "fish" else str(len(words.split()) - 1))
        assert wanted in completed(f"{shell}_complete")


def test_a_run_prints_its_page_and_opens_it(tmp_path, monkeypatch, capsys):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
    shells = ["tensile", "--variant", "1", "--scale", "macro", "--preset", "quick", "--no-frames"]
    assert run([*shells, "--out", str(tmp_path / "both"), "--open"]) == 0
    page = tmp_path / "both/report.html"
    assert capsys.readouterr().out.count("report: ") == 1 and opened == [page.as_uri()]
    text = page.read_text()
    assert "tensile, pham2019-v1, macro, warp" in text and "tensile, pham2019-v1, macro, weft" in text
    page.unlink()
    assert run(["resume", str(tmp_path / "both")]) == 0 and page.is_file()
    assert run([*shells, "--open", "--no-pictures"]) == 2


def test_doctor_empties_the_cache_and_nothing_else(tmp_path, monkeypatch, capsys):
    from knittest.base import cache

    root = tmp_path / "cache"
    monkeypatch.setenv("KNITTEST_CACHE_DIR", str(root))
    for name in (*cache.FOLDERS, "mine"):
        (root / name).mkdir(parents=True)
        (root / name / "a.npz").write_bytes(b"0" * 500_000)
    (tmp_path / "else").mkdir()
    (root / "settled/a.npz").unlink()
    (root / "settled").rmdir()
    (root / "settled").symlink_to(tmp_path / "else")
    root.chmod(0o700)
    assert run(["doctor", "--clear-cache"]) == 0
    assert "cache: 1.5 MB removed" in capsys.readouterr().out
    assert sorted(path.name for path in root.iterdir()) == ["mine", "settled"] and (tmp_path / "else").is_dir()


def test_all_folders_of_the_cache_can_be_emptied():
    from knittest.base.cache import FOLDERS
    from knittest.base.files import PACKAGE

    sources = [path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")]
    assert {name for text in sources for name in re.findall(r'cache_folder\("(\w+)"', text)} <= {*FOLDERS}


def test_tensile_hands_runs_and_options_on(monkeypatch, tmp_path):
    handed = []
    monkeypatch.setattr(
        "knittest.studies.command.run_command", lambda runs, options: handed.extend((runs, options)) or 3
    )
    arguments = ["--variant", "2", "--scale", "macro", "--preset", "quick", "--set", "rig.width=25", "--seed", "5"]
    words = ["--out", str(tmp_path / "o"), "--threads", "1", "--json", "--quiet", "--no-frames"]
    assert run(["tensile", *arguments, *words]) == run(["tensile", *arguments, "--direction", "weft"]) == 3
    runs, options, (weft,), _ = handed
    assert [r.rig.direction for r in runs] == ["warp", "weft"] and weft.rig.direction == "weft"
    assert all((r.rig.width, r.variability.seed, r.model.scale) == (25.0, 5, "macro") for r in runs)
    assert (options.out, options.threads, options.json) == (tmp_path / "o", 1, True)
    assert (options.quiet, options.frames, options.pictures) == (True, False, True)


def test_schema_explains_a_field(capsys):
    def told(name: str, code: int = 0) -> str:
        assert run(["schema", name]) == code
        return "".join(capsys.readouterr())

    crimp = told("fabric.reinforcing.crimp.warp").splitlines()
    assert crimp[0] == "fabric.reinforcing.crimp.warp [%]"
    assert {"  bounds: ≥ 0, ≤ 5, plausible 0, or from 0.02", "  scale: meso", "  tests: all"} <= set(crimp)
    assert "results of tensile, meso" in crimp[-1] and "macro" not in crimp[-1]
    assert "  preset, friction meso: quick 15, standard 25, paper 50" in told("rig.width")
    assert "fabric.contact.normal_stiffness [N/mm]: penalty" in told("fabric.contact")
    assert "did you mean rig.width" in told("rig.widht", 2)
    assert "did you mean fabric.contact.tangential_ratio" in told("tangential_ratio", 2)
