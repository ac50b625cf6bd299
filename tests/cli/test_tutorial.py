"""Every command and every file of docs/own-fabric.md, in the order of the page, in an empty folder."""

import importlib.util
import json
import re
import shlex
import shutil
from pathlib import Path

import pytest
import yaml
from html_page import HtmlPage

from knittest.base.files import data_dir
from knittest.cli.main import run

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/own-fabric.md").read_text(encoding="utf-8")
CHANGE, NEW = "lines to replace", "a new file"


def blocks() -> list[tuple[str, str]]:
    """Language and text of each block of the page."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", PAGE, re.M | re.S)


def command(line: str) -> None:
    words = shlex.split(line)
    if words[:3] == ["cp", "-r", "data/tutorial"]:
        shutil.copytree(data_dir() / "tutorial", words[3])
        return
    assert words[0] == "knittest", line
    arguments = [found for word in words[1:] for found in _files(word)]
    assert run(arguments) == 0, line


def _files(word: str) -> list[str]:
    """Expansion of ``word`` by a shell."""
    return sorted(map(str, Path().glob(word))) if "*" in word else [word]


def write(text: str) -> None:
    """A file of the page, or what the page changes in one."""
    name, what = re.fullmatch(r"# (\S+): (.*)", text.splitlines()[0]).groups()
    path = Path(name)
    if what == NEW:
        assert not path.exists()
        path.write_text(text)
        return
    assert what == CHANGE
    fields = yaml.safe_load(path.read_text())
    lay(fields, yaml.safe_load(text))
    path.write_text(yaml.safe_dump(fields))


def lay(fields: dict, over: dict) -> None:
    for name, value in over.items():
        assert name in fields, name
        if isinstance(value, dict) and "value" not in value:
            lay(fields[name], value)
        else:
            fields[name] = value


@pytest.fixture(scope="module")
def followed(tmp_path_factory) -> Path:
    """A folder in which somebody did all that the page says."""
    folder = tmp_path_factory.mktemp("tutorial")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for language, text in blocks():
            assert language in ("sh", "yaml")
            if language == "yaml":
                write(text)
                continue
            for line in text.splitlines():
                command(line)

    return folder


def rows(folder: Path) -> dict[str, dict]:
    return {row["quantity"]: row for row in json.loads((folder / "summary.json").read_text())["comparison"]}


def test_the_page_leads_to_a_calibrated_fabric(followed):
    result = followed / "runs/calibrate-modulus"
    assert json.loads((result / "calibration.json").read_text())["status"] == "converged"
    modulus = yaml.safe_load((result / "fabric.yaml").read_text())["reinforcing"]["youngs_modulus"]
    assert modulus["source"] == "tuned" and modulus["tuned_on"] == ["Vmade-up warp max. tensile force"]
    HtmlPage(result / "report.html").check()
    page = HtmlPage(followed / "weft.html")
    page.check()
    differing = next(t for c, t in page.tables(page.section("differences")).items() if c.startswith("tensile"))
    before, after = next(row[1:] for row in differing if row[0] == "fabric.reinforcing.youngs_modulus")
    assert before == "57.9 GPa (derived)" and after.endswith(" GPa (tuned)")


def test_the_weft_is_predicted_as_the_page_says(followed):
    """The numbers of the page's table, within 3 %: meso results differ that much between processors at this size."""
    table = {line.split("|")[1].strip(): line.split("|")[2:-1] for line in PAGE.splitlines() if line.startswith("| ")}
    for column, name in enumerate(("before", "after")):
        found = rows(followed / "runs" / name)
        for label, quantity in (("peak force [N]", "peak_force_n"), ("fracture strain [%]", "fracture_strain_pct")):
            stated = float(table[label][column].split()[0])
            assert found[quantity]["simulated"] == pytest.approx(stated, rel=0.03), (name, quantity)
            assert found[quantity]["kind"] == "predicted"
    assert abs(rows(followed / "runs/after")["peak_force_n"]["deviation_sd"]) <= 1.5
    assert {row["kind"] for row in rows(followed / "runs/shells/weft").values()} == {"input"}


def test_the_shipped_files_are_what_their_generator_writes():
    spec = importlib.util.spec_from_file_location("made_up_fabric", ROOT / "benchmarks/made_up_fabric.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    folder = data_dir() / "tutorial"
    shipped = {path.name: path.read_text(encoding="utf-8") for path in folder.glob("*.csv")}
    assert shipped == module.files() and len(shipped) == 24
    assert all("made up" in text for text in shipped.values())
