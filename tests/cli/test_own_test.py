"""A test as a package of its own: installed beside knittest, run from its command, without a file of knittest changed.

The wire of ``tests/own_test`` has a closed form: its force is EA times the strain. What its grips accelerate adds
m v / (2 t), 1e-5 of it, and damping 0.05 /ms of the wire's 0.01 g at 0.05 mm/ms about 1e-6.
"""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
METADATA = "Metadata-Version: 2.1\nName: {name}\nVersion: 0.1\n"


def install(target: Path, name: str, entry: str, *packages: Path) -> None:
    """Put ``packages`` into ``target`` with the metadata that pip would write."""
    for package in packages:
        shutil.copytree(package, target / package.name, ignore=shutil.ignore_patterns("__pycache__"))
    info = target / f"{name.replace('-', '_')}-0.1.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(METADATA.format(name=name), encoding="utf-8")
    (info / "entry_points.txt").write_text(f"[knittest.tests]\n{entry}\n", encoding="utf-8")


@pytest.fixture(scope="module")
def wired(tmp_path_factory):
    target = tmp_path_factory.mktemp("site")
    install(target, "knittest-wire", "wire = knittest_wire.kind:KIND", ROOT / "tests/own_test/knittest_wire")
    return target


def environment(*site: Path) -> dict[str, str]:
    return os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (ROOT, *site))), "COLUMNS": "200"}


def knittest(site: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "knittest.cli.main", *arguments]
    return subprocess.run(command, cwd=folder, env=environment(site), capture_output=True, text=True, timeout=600)


@pytest.fixture(scope="module")
def done(wired, tmp_path_factory):
    folder = tmp_path_factory.mktemp("wire")
    found = knittest(
        wired, folder, "wire", "--variant", "1", "--preset", "quick", "--max-strain", "0.5", "--out", "run"
    )
    assert found.returncode == 0, found.stderr
    return folder, found.stdout


def test_the_command_stands_in_the_help_with_its_own_option(wired, tmp_path):
    assert " wire A wire between two grips. " in " ".join(knittest(wired, tmp_path, "--help").stdout.split())
    own = knittest(wired, tmp_path, "wire", "--help").stdout
    assert "--max-strain" in own and "--direction" not in own and "Pull a wire" in own


def test_a_run_leaves_folder_results_and_tables(done):
    folder, told = done
    summary = json.loads((folder / "run/summary.json").read_text())
    assert summary["rig"] == "wire" and summary["status"] == "completed" and not summary["refused"]
    assert summary["results"]["stiffness_n"] == pytest.approx(1000.0, rel=1e-3)
    assert "EA of the wire [N]" in told and "force at the end [N]" in told
    with (folder / "run/elements.csv").open() as stream:
        strains = [float(row["strain_pct"]) for row in csv.DictReader(stream)]
    with (folder / "run/curve.csv").open() as stream:
        last = list(csv.DictReader(stream))[-1]
    assert len(strains) == 30 and all(s == pytest.approx(float(last["strain_pct"]), rel=1e-3) for s in strains)
    assert float(last["force_n"]) == pytest.approx(10.0 * float(last["strain_pct"]), rel=1e-3)
    assert {"curve.png", "energies.png", "report.html", "config.yaml"} <= {p.name for p in (folder / "run").iterdir()}
    assert "max_strain: 0.5  # %" in (folder / "run/config.yaml").read_text()


def test_its_preset_sets_the_length_and_json_is_json(wired, done, tmp_path):
    found = knittest(
        wired, tmp_path, "wire", "--config", str(done[0] / "run/config.yaml"), "--json", "--no-frames", "--no-pictures"
    )
    assert found.returncode == 0, found.stderr
    again, first = json.loads(found.stdout), json.loads((done[0] / "run/summary.json").read_text())
    assert again["results"] == first["results"]
    assert "length: 10.0  # mm" in Path(tmp_path / again["folder"] / "config.yaml").read_text()


def test_check_and_report_know_it(wired, done):
    folder, _ = done
    checked = knittest(wired, folder, "check", "wire", "--variant", "1", "--json", "--no-time")
    assert json.loads(checked.stdout)["models"][0]["specimen"] == {"area_mm2": 20.0, "length_mm": 20.0}
    assert knittest(wired, folder, "report", "run", "--out", "page.html").returncode == 0
    assert "EA of the wire [N]" in (folder / "page.html").read_text()


def test_a_wrong_field_is_named(wired, tmp_path):
    found = knittest(wired, tmp_path, "wire", "--variant", "1", "--set", "rig.max_strain=200")
    assert found.returncode == 2 and "rig.max_strain = 200" in found.stderr and "10" in found.stderr
    found = knittest(wired, tmp_path, "wire", "--variant", "1", "--scale", "macro")
    assert found.returncode == 2 and "a wire is made of beams" in found.stderr


def test_a_stopped_run_goes_on_to_the_same_bits(wired, tmp_path):
    chosen = ["wire", "--variant", "1", "--preset", "quick", "--set", "solver.speed=0.001", "--quiet", "--no-pictures"]
    chosen += ["--set", "output.checkpoint_interval=0.1"]
    command = [sys.executable, "-m", "knittest.cli.main", *chosen, "--out", "stopped"]
    with subprocess.Popen(command, cwd=tmp_path, env=environment(wired), stderr=subprocess.PIPE) as process:
        ends = time.monotonic() + 300.0
        while process.poll() is None and time.monotonic() < ends:
            if list(tmp_path.glob("stopped/checkpoint-0*.npz")):
                break
            time.sleep(0.02)
        process.send_signal(signal.SIGTERM)
        process.wait(60)
    assert process.returncode == 75
    assert knittest(wired, tmp_path, "resume", "stopped", "--quiet").returncode == 0
    assert knittest(wired, tmp_path, *chosen, "--out", "whole").returncode == 0
    stopped, whole = (json.loads((tmp_path / name / "summary.json").read_text()) for name in ("stopped", "whole"))
    assert stopped["results"] == whole["results"]
    assert (tmp_path / "stopped/curve.csv").read_bytes() == (tmp_path / "whole/curve.csv").read_bytes()


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ("wire = knittest_wire.nowhere:KIND", "test wire of other 0.1: entry point knittest_wire.nowhere:KIND"),
        ("string = knittest_wire.kind:KIND", "its record is named wire"),
        ("tensile = knittest_wire.kind:KIND", "test tensile is in two packages"),
        ("wire = knittest_wire.config:WireRig", "expected a knittest.base.kinds.TestKind"),
    ],
)
def test_a_broken_package_is_named(tmp_path, entry, said):
    install(tmp_path / "site", "other", entry, ROOT / "tests/own_test/knittest_wire")
    found = knittest(tmp_path / "site", tmp_path, "--help")
    assert found.returncode == 2 and said in found.stderr and "Traceback" not in found.stderr


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("kind.py", "TestKind(", "TestKind(unheard_of=1, ", "unheard_of"),  # written for another version of knittest
        ("kind.py", "KIND = ", "KIND = ) ", "cannot be loaded"),
        ("test.py", "def assess(", "def judge(", "knittest_wire.test:WireTest lacks assess"),
    ],
)
def test_a_package_for_another_version_is_named_before_it_runs(tmp_path, file, old, new, said):
    site = tmp_path / "site"
    install(site, "other", "wire = knittest_wire.kind:KIND", ROOT / "tests/own_test/knittest_wire")
    path = site / "knittest_wire" / file
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    found = knittest(site, tmp_path, "check", "wire", "--variant", "1", "--no-time")
    assert found.returncode == 2 and said in found.stderr and "internal error" not in found.stderr


def helped(*path: Path) -> subprocess.CompletedProcess[str]:
    """``knittest --help`` of what is found along ``path`` before this environment's own."""
    env = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, path))}
    command = [sys.executable, "-m", "knittest.cli.main", "--help"]
    return subprocess.run(command, env=env, capture_output=True, text=True, cwd=path[-1])


def test_an_installation_older_than_the_code_says_what_to_do(tmp_path):
    """As if its entry points had been written by an earlier version; a checkout goes by its own pyproject.toml."""
    install(tmp_path, "knittest", "tensile = knittest.laboratory.tensile.kind:KIND")
    assert "bias-extension" in helped(ROOT, tmp_path).stdout
    shutil.copytree(ROOT / "knittest", tmp_path / "knittest", ignore=shutil.ignore_patterns("__pycache__"))
    found = helped(tmp_path)
    assert (
        found.returncode == 2 and "pip install" in found.stderr and "knittest.laboratory.forming.kind" in found.stderr
    )


def test_a_run_and_a_trial_of_it_are_new_when_its_code_changes(tmp_path):
    site = tmp_path / "site"
    install(site, "knittest-wire", "wire = knittest_wire.kind:KIND", ROOT / "tests/own_test/knittest_wire")
    code = """
from knittest.config.loading import resolve
from knittest.export.identity import identity_of
from knittest.studies.trials.trial import trial_of
for test in ("wire", "friction"):
    run = resolve(test=test, variant="1", scale="meso")
    print(identity_of(run, []).get("test"), trial_of(run).key)
"""

    def digests() -> list[str]:
        told = subprocess.run([sys.executable, "-c", code], env=environment(site), capture_output=True, text=True)
        return told.stdout.split()

    before = digests()
    with (site / "knittest_wire/test.py").open("a") as stream:
        stream.write("# changed\n")
    after = digests()
    assert len(before) == 4 and before[2] == "None" and before[2:] == after[2:]
    assert all(old != new for old, new in zip(before[:2], after[:2], strict=True))
