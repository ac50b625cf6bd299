"""``knittest report`` of a real run, and its page in a real browser where one is installed."""

import json
from pathlib import Path

import pytest
from browser import browse, needs_browser, seen_on_a_phone
from html_page import HtmlPage, near

from knittest.cli.main import run as command


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "plates"
    arguments = ["--variant", "1", "--scale", "macro", "--preset", "quick", "--direction", "warp", "--no-frames"]
    assert command(["friction", *arguments, "--quiet", "--threads", "1", "--out", str(folder)]) == 0
    return folder


def test_a_run_writes_its_own_page(finished: Path) -> None:
    page = HtmlPage(finished / "report.html")
    page.check()
    summary = json.loads((finished / "summary.json").read_text())
    shown = page.numbers(page.section("run-1-results"))
    assert all(near(value, shown) for value in summary["results"].values())
    provenance = dict(page.tables()["Provenance"])
    assert provenance["status"] == "completed, exit code 0" and provenance["ended"]
    assert "Missing or not readable" not in page.text()
    captions = [" ".join("".join(c.itertext()).split()) for c in page.all("figcaption")]
    assert [c for c in captions if c.endswith("(energies.png)")]


def test_a_second_page_on_demand_is_the_same(finished: Path) -> None:
    before = (finished / "report.html").read_bytes()
    assert command(["report", str(finished)]) == 0
    assert (finished / "report.html").read_bytes() == before


@needs_browser
def test_a_browser_shows_it_on_a_phone_and_prints_it(finished: Path, tmp_path: Path) -> None:
    page = finished / "report.html"
    seen = seen_on_a_phone(page, tmp_path)
    assert seen["heading"] == "friction, pham2019-v1, macro, warp"
    assert seen["wide"] <= seen["window"] <= 390
    assert seen["images"] == seen["shown"] == len(HtmlPage(page).pictures()) > 1
    browse(tmp_path, f"--print-to-pdf={tmp_path / 'page.pdf'}", page.as_uri())
    assert (tmp_path / "page.pdf").read_bytes().startswith(b"%PDF")
