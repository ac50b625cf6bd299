"""Folders of runs that failed, are partial, older, damaged or something else: a page that says so, or one message."""

import json
import shutil
from pathlib import Path

import pytest
from html_page import HtmlPage
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from report_sample import edit_json, write_run

from knittest.base.errors import InputError, NumericalError
from knittest.cli.main import run as command
from knittest.export.folder import RunFolder
from knittest.report_page.page import write_if_possible, write_report, write_reports

FILES = ("manifest.json", "summary.json", "comparison.json", "config.yaml", "curve.csv", "energies.csv")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_run(tmp_path_factory.mktemp("whole") / "run")


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "run"))


def page_of(folder: Path) -> HtmlPage:
    page = HtmlPage(write_report(folder))
    page.check()
    return page


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize(
    "content", [None, b"", b"\x00\xff\xfe{", b"[1, 2]", b"{", b"[" * 100_000, b"a,b\nx,y\n", b'{"status": [1e999]}'],
    ids=["missing", "empty", "binary", "list", "cut", "deep", "words", "types"],
)  # fmt: skip
def test_a_damaged_file_costs_its_part_only_and_is_named(folder: Path, name: str, content: bytes | None) -> None:
    (folder / name).unlink()
    if content is not None:
        (folder / name).write_bytes(content)
    page = page_of(folder)
    harmless = content == b'{"status": [1e999]}' and name in ("summary.json", "comparison.json")
    assert harmless or f"Missing or not readable: {name}" in page.text(page.section("summary"))
    assert ("5666" in page.text(page.section("run-1-results"))) == (name != "summary.json")


def test_pictures_that_are_none_are_named(folder: Path) -> None:
    (folder / "deformed.png").write_bytes(b"<svg onload=alert(1)>")
    (folder / "wrinkles.png").mkdir()
    text = page_of(folder).text()
    assert "deformed.png: not a PNG picture" in text and "wrinkles.png" in text


def test_failed_run_shows_why_and_what_there_is_of_its_curve(tmp_path: Path) -> None:
    from export_sample import curve, energies

    from knittest.config.loading import resolve
    from knittest.config.yaml_writer import dump

    run = resolve(variant="1", scale="macro", direction="warp")
    folder = RunFolder.create(tmp_path / "r", run, config_text=dump(run), threads=1)
    with pytest.raises(NumericalError), folder:
        folder.write_table("curve.csv", curve(5800.0))
        folder.write_table("energies.csv", energies(("fabric",)))
        raise NumericalError("a number is not finite in shell 12")
    page = page_of(tmp_path / "r")
    assert "This run failed: a number is not finite in shell 12. There are no results." in page.text()
    assert "<!-- simulated, incomplete -->" in page.pictures()[0].decode()
    assert "at the stop" in page.text(page.section("run-1-gates"))
    assert "Missing or not readable" not in page.text()


def test_running_or_killed_run_is_told_from_a_finished_one(folder: Path) -> None:
    edit_json(folder / "manifest.json", status="running")
    for name in ("summary.json", "comparison.json", "curve.csv", "energies.csv"):
        (folder / name).unlink()
    text = page_of(folder).text()
    assert "Not finished" in text and "This run has no results." in text and "There is no curve to draw." in text


def test_forbidden_characters_are_replaced_and_a_forced_resume_is_told(folder: Path) -> None:
    rows = json.loads((folder / "summary.json").read_text())["comparison"]
    rows = [{**row, "source": "\ud800 \x07 \x9f \ufffe $ " + 200 * "x"} for row in rows]
    edit_json(folder / "summary.json", comparison=rows)
    note = {"time": "2026-01-01", "at_ms": 1.5, "forced": ["solver.damping was 0.5, is 0.6"]}
    edit_json(folder / "manifest.json", resumed=[note])
    page = page_of(folder)
    assert "\ufffd \ufffd \ufffd \ufffd $ xxx" in page.text(page.section("run-1-results"))
    assert "at 1.5 ms, with --force although solver.damping was 0.5, is 0.6" in page.text()


def test_older_and_newer_schemas_are_shown_as_written(folder: Path) -> None:
    config = (folder / "config.yaml").read_text()
    (folder / "config.yaml").write_text(config.replace("  damping:", "  old_damping:"))
    summary = json.loads((folder / "summary.json").read_text())
    del summary["refused"], summary["cost"]
    summary["results"]["mean_stress"] = [1.0, 2.0]
    (folder / "summary.json").write_text(json.dumps(summary))
    page = page_of(folder)
    text = page.text(page.section("summary"))
    assert "not a config of this version, shown as written" in text and "summary.json: results.mean_stress" in text
    assert "solver.old_damping" in {row[0] for rows in page.tables().values() for row in rows}
    assert "Quality measures (limits unknown)" in page.tables()


def test_a_test_that_this_version_does_not_know(folder: Path) -> None:
    edit_json(folder / "summary.json", rig="peel")
    (folder / "config.yaml").unlink()
    text = page_of(folder).text()
    assert "No curve is known for the test peel" in text and "5666" in text


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)
KEYS = {
    "manifest.json": ("status", "version", "data_sha256", "resumed", "libraries", "seed", "exit_code", "message"),
    "summary.json": ("rig", "results", "quality", "cost", "comparison", "refused", "scale", "direction"),
    "comparison.json": ("curves",),
}
METRIC = st.dictionaries(
    st.sampled_from(("comparable", "compared_with", "peak_error_pct", "rating", "note")), JSON, max_size=4
)
ROW = st.dictionaries(st.sampled_from(("quantity", "experiment_mean", "deviation_sd", "kind")), JSON, max_size=4)


def fuzzed(whole: Path, tmp_path: Path) -> Path:
    folder = tmp_path / "fuzzed"
    shutil.rmtree(folder, ignore_errors=True)
    return Path(shutil.copytree(whole, folder))


FUZZ = {"deadline": None, "suppress_health_check": [HealthCheck.function_scoped_fixture], "derandomize": True}
VALUES = JSON | st.lists(METRIC | ROW, max_size=2) | st.dictionaries(st.text(max_size=8), st.floats(), max_size=3)
CELL = st.sampled_from(["1", "-2.5", "nan", "inf", "1e308", "-1e308", "", "x"])


@settings(max_examples=40, **FUZZ)
@given(data=st.data())
def test_any_json_makes_a_page_or_one_message(whole: Path, tmp_path: Path, data: st.DataObject) -> None:
    folder = fuzzed(whole, tmp_path)
    for name, keys in KEYS.items():
        content = json.loads((folder / name).read_text())
        content |= data.draw(st.dictionaries(st.sampled_from(keys), VALUES, max_size=3))
        (folder / name).write_text(json.dumps(content))
    page_of(folder)


@settings(max_examples=25, **FUZZ)
@given(cells=st.lists(st.lists(CELL, min_size=2, max_size=2), max_size=6))
@example(cells=[["0", "1e308"], ["1", "1.7e308"]])
def test_any_table_makes_a_page(whole: Path, tmp_path: Path, cells: list[list[str]]) -> None:
    folder = fuzzed(whole, tmp_path)
    rows = "\n".join(",".join(row) for row in cells)
    (folder / "curve.csv").write_text(f"strain_pct,force_n\n{rows}\n")
    (folder / "energies.csv").write_text(f"time_ms,kinetic_mj\n{rows}\n")
    page_of(folder)


def test_what_is_no_run_folder_exits_2_with_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "file.txt").write_text("x")
    (tmp_path / "web").mkdir()
    (tmp_path / "web" / "manifest.json").write_text('{"name": "an app", "icons": []}')
    for name, phrase in (
        ("none", "no such folder"),
        ("empty", "not a run folder (it has no manifest.json), and holds none"),
        ("file.txt", "is a file, expected a run folder"),
        ("web", "not a run folder of knittest"),
    ):
        assert command(["report", str(tmp_path / name)]) == 2
        error = capsys.readouterr().err
        assert phrase in error and len(error.splitlines()) == 1
    assert sorted(p.name for p in tmp_path.rglob("*.html")) == []


def test_only_pages_are_written_over(folder: Path, tmp_path: Path) -> None:
    thesis = tmp_path / "thesis.html"
    thesis.write_text("years of work")
    with pytest.raises(InputError, match="not a page of knittest report"):
        write_reports([folder], thesis)
    assert thesis.read_text() == "years of work"
    with pytest.raises(InputError, match="is a folder"):
        write_reports([folder], tmp_path)
    with pytest.raises(InputError, match="does not exist"):
        write_reports([folder], tmp_path / "no" / "page.html")
    first, _ = write_reports([folder], tmp_path / "page.html")
    assert write_reports([folder], first) == (first, 1)


def test_a_run_whose_page_fails_is_complete_all_the_same(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def fail(path: Path) -> Path:
        raise ZeroDivisionError("a defect")

    write_if_possible(folder, fail)
    assert "complete, but report.html could not be written: a defect" in capsys.readouterr().err
